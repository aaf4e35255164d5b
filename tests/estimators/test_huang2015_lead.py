import functools
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.estimators import make
from fogsim.estimators.huang2015_comparison import crop_vehicle
from fogsim.values import Camera, Frame, LeadMeasurement, Observation, Response
from fogsim.values.camera_response import respond
from fogsim.vision.vehicle.rear_localisation import localise_rear

LN20 = np.log(20.0)


@dataclass(frozen=True)
class Chase:
    """A road with one vehicle ahead, drawn by point samples in the world: nothing of FogSim's renderer is in it.

    Luminances in linear grey levels 0 … 255, lengths in metres.
    """

    visibility: float = 100.0
    airlight: float = 200.0
    asphalt: float = 60.0
    paint: float = 90.0
    width: float = 1.8
    height: float = 1.5
    across: float = 0.2
    taper: float = 0.0
    noise: float = 1.0
    pitch_scatter: float = np.radians(0.1)
    range_noise: float = 0.25
    brakes_beyond: float = np.inf
    gain_beyond: tuple[float, float] = (np.inf, 1.0)
    sky_excess: float = 0.0
    blur: bool = False
    beam: float = 0.0
    camera: Camera = field(
        default_factory=lambda: Camera(688, 515, 700.0, (343.5, 257.0), 1.3, np.radians(1.0), response=Response.LINEAR)
    )

    def but(self, **changes):
        return replace(self, **changes)


def rear(chase: Chase, side: np.ndarray, up: np.ndarray, *, braking: bool) -> np.ndarray:
    """Luminance of the rear of a vehicle without fog; `side` and `up` from the middle of its foot."""
    w, h = 0.5 * chase.width, chase.height
    out = np.full(side.shape, chase.paint)
    out = np.where((up > 0.62 * h) & (up < 0.94 * h) & (np.abs(side) < 0.78 * w), 18.0 + 30.0 * (up / h - 0.6), out)
    out = np.where(up < 0.16 * h, 12.0, out)
    out = np.where((up > 0.3 * h) & (up < 0.36 * h), 0.6 * chase.paint, out)
    out = np.where((np.abs(up - 0.42 * h) < 0.06) & (np.abs(side) < 0.26), 190.0, out)
    lamps = (np.abs(up - 0.52 * h) < 0.09) & (np.abs(np.abs(side) - 0.8 * w) < 0.13)
    return np.where(lamps, 700.0 if braking else 35.0, out)


def light(chase: Chase, v: np.ndarray, u: np.ndarray, distance: float, pitch: float, table: np.ndarray) -> np.ndarray:
    """Linear luminance at image points."""
    camera = chase.camera
    x, y = (u - camera.principal_point[0]) / camera.focal_length, (v - camera.principal_point[1]) / camera.focal_length
    forward, down = np.cos(pitch) - y * np.sin(pitch), np.sin(pitch) + y * np.cos(pitch)
    on_ground = down > 1e-6
    depth = np.where(on_ground, camera.mount_height / np.maximum(down, 1e-6), np.inf)
    per_depth = np.sqrt(1.0 + x**2 + y**2)
    ahead = np.minimum(depth * forward, 1e5)
    left = -np.minimum(depth, 1e5) * x
    grain = table[(ahead / 0.9).astype(int) % 64, np.floor(left / 0.9).astype(np.int32) & 63]
    ground = chase.asphalt * (1.0 + 0.03 * grain)
    ground[(np.abs(np.abs(left) - 1.8) < 0.08) & (ahead % 12.0 < 4.0)] = 2.4 * chase.asphalt
    ground *= 1.0 + chase.beam * (6.0 / np.maximum(ahead, 2.0)) ** 2
    shadow = (ahead > distance) & (ahead < distance + 4.0) & (np.abs(left + chase.across) < 0.5 * chase.width)
    ground[shadow] = 0.25 * chase.asphalt
    transmission = np.exp(-LN20 / chase.visibility * np.minimum(depth * per_depth, 1e6))
    seen = ground * transmission + chase.airlight * (1.0 - transmission)
    seen[~on_ground[:, 0]] = chase.airlight * (1.0 + chase.sky_excess)
    plane = distance / forward
    side, up = plane * x - chase.across, camera.mount_height - plane * down
    half = 0.5 * chase.width * (1.0 - chase.taper * np.clip(2.0 * up / chase.height - 1.0, 0.0, 1.0))
    box = (np.abs(side) < half) & (up > 0.18) & (up < chase.height)
    side, up, path = (np.broadcast_to(one, box.shape)[box] for one in (side, up, plane * per_depth))
    transmission = np.exp(-LN20 / chase.visibility * path)
    own = rear(chase, side, up, braking=distance > chase.brakes_beyond)
    seen[box] = own * transmission + chase.airlight * (1.0 - transmission)
    return seen


def points(first: int, last: int, samples: int) -> np.ndarray:
    return (np.arange(first, last)[:, None] + (np.arange(samples) + 0.5) / samples - 0.5).ravel()


def pixel_means(chase: Chase, rows: tuple[int, int], cols: tuple[int, int], samples: int, *where) -> np.ndarray:
    fine = light(chase, points(*rows, samples)[:, None], points(*cols, samples)[None, :], *where)
    return fine.reshape(rows[1] - rows[0], samples, cols[1] - cols[0], samples).mean(axis=(1, 3))


def picture(chase: Chase, distance: float, rng: np.random.Generator) -> np.ndarray:
    """Linear luminance of one frame: one sample a pixel, of the vehicle 8 × 8."""
    camera = chase.camera
    where = (distance, camera.pitch + rng.normal(0.0, chase.pitch_scatter), rng.standard_normal((64, 64)))
    out = pixel_means(chase, (0, camera.height), (0, camera.width), 1, *where)
    scale = camera.focal_length / distance
    foot, middle = camera.horizon_row + camera.row_distance / distance, camera.principal_point[0] + chase.across * scale
    rows = max(int(foot - 1.2 * chase.height * scale - 8), 0), min(int(foot + 0.3 * scale + 8), camera.height)
    cols = max(int(middle - 1.3 * scale), 0), min(int(middle + 1.3 * scale), camera.width)
    out[slice(*rows), slice(*cols)] = pixel_means(chase, rows, cols, 8, *where)
    if chase.blur:
        padded = np.pad(out, 1, mode="edge")
        across = 0.25 * padded[:, :-2] + 0.5 * padded[:, 1:-1] + 0.25 * padded[:, 2:]
        out = 0.25 * across[:-2] + 0.5 * across[1:-1] + 0.25 * across[2:]
    return out * (chase.gain_beyond[1] if distance > chase.gain_beyond[0] else 1.0)


def exposed(chase: Chase, light: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    camera = chase.camera
    most = 2**camera.bits - 1
    signal = respond(np.clip(light / 255.0, 0.0, 1.0), camera.response) * most
    noisy = np.rint(signal + rng.normal(0.0, chase.noise * most / 255.0, light.shape))
    return np.clip(noisy, 0, most).astype(np.uint8 if camera.bits == 8 else np.uint16)


@functools.lru_cache(maxsize=24)
def chased(chase: Chase, seed: int, ranges: tuple[float, ...]) -> list[Observation]:
    rng = np.random.default_rng(seed)
    seen = []
    for i, distance in enumerate(ranges):
        image = exposed(chase, picture(chase, distance, rng), rng)
        told = LeadMeasurement(distance + rng.normal(0.0, chase.range_noise), 5.0)
        seen.append(Observation(Frame(float(i), image, chase.camera), lead=told))
    return seen


AWAY = tuple(float(distance) for distance in range(25, 91, 5))


def followed(chase: Chase, seed: int = 0, ranges: tuple[float, ...] = AWAY, **options):
    estimator = make("huang2015_lead", chase.camera, **options)
    for observation in chased(chase, seed, ranges):
        estimate = estimator.update(observation)
    return estimate


def test_corrected_recovers_visibility_and_intervals_cover_the_truth():
    inside = []
    for visibility, bound in ((30.0, 12), (100.0, 4), (500.0, 10)):
        found = [followed(Chase(visibility=visibility, across=a), seed) for seed, a in enumerate((-0.5, 0.4))]
        assert np.median([abs(one.visibility / visibility - 1) for one in found]) < bound / 100
        inside += [low < visibility < high for low, high in (one.visibility_interval for one in found)]
    assert np.mean(inside) >= 0.75


def test_as_published_errs_either_way_of_100_m():
    # Noise adds to the variance in dense fog; distance takes detail away in thin fog.
    assert followed(Chase(visibility=40.0), as_published=True).visibility > 50.0
    assert followed(Chase(visibility=500.0), as_published=True).visibility < 420.0


@pytest.mark.parametrize("visibility", [50.0, 500.0])
def test_variances_follow_the_law_where_nothing_else_changes_them(visibility):
    # eq. 4.17: σ₂²/σ₁² = e^(−2k (d₂ − d₁)). Pixels on edges of a lamp or plate take up to 4 % of it, 12 bits nothing.
    # Beside the narrow roof there is sky; noise of the ranges would change its share of a window about the vehicle.
    lens = Camera(800, 600, 2800.0, (399.5, 299.5), 1.0, response=Response.LINEAR, bits=12)
    chase = Chase(visibility=visibility, camera=lens, noise=0.0, taper=0.4)
    variances = followed(chase, ranges=(30.0, 35.0, 40.0, 45.0), as_published=True).diagnostics["variances"]
    assert variances[1:] / variances[:-1] == pytest.approx([np.exp(-10.0 * LN20 / visibility)] * 3, rel=0.04)


OTHER = functools.partial(Camera, 1024, 640, 1000.0, (500.0, 330.0), 1.6, np.radians(2.0))


@pytest.mark.parametrize(
    ("visibility", "changes", "most"),
    [
        (120.0, {"brakes_beyond": 50.0}, 0.08),
        (120.0, {"gain_beyond": (55.0, 0.8)}, 0.08),
        (120.0, {"paint": 140.0, "width": 2.5, "height": 2.6}, 0.08),
        (120.0, {"sky_excess": 0.03}, 0.08),
        (120.0, {"airlight": 120.0, "asphalt": 36.0, "paint": 50.0}, 0.08),
        (150.0, {"camera": OTHER(response=Response.SRGB)}, 0.06),
        (150.0, {"camera": OTHER(response=Response.GAMMA, bits=12)}, 0.06),
    ],
)
def test_what_else_changes_the_picture_is_no_fog(visibility, changes, most):
    assert followed(Chase(visibility=visibility, **changes)).visibility == pytest.approx(visibility, rel=most)


def test_a_lens_that_blurs_is_no_fog_once_it_is_told():
    # Three taps of a quarter, a half and a quarter have the variance 1/2.
    chase = Chase(visibility=120.0, blur=True)
    told, untold = followed(chase, blur=0.5**0.5), followed(chase)
    assert told.visibility == pytest.approx(120.0, rel=0.06)
    assert untold.visibility < told.visibility


def test_the_window_and_the_fog_on_the_way_back_are_those_of_the_way_away():
    # The window found at 90 m is placed again as the vehicle comes nearer, or it would hold a strip of sky.
    chase = Chase(visibility=300.0, across=0.0, range_noise=0.0)
    away, back = (
        followed(chase, 1, ranges, as_published=True).diagnostics["variances"] for ranges in (AWAY, AWAY[::-1])
    )
    # Single variances scatter with the noise; a strip of sky would make all of them larger.
    assert np.mean(np.divide(back[:5], away[:5])) == pytest.approx(1.0, abs=0.05)
    assert followed(chase, 1, AWAY[::-1]).visibility == pytest.approx(300.0, rel=0.08)


@pytest.mark.parametrize(("visibility", "width", "bound"), [(80.0, None, 0.1), (300.0, 1.8, 0.06)])
def test_without_a_radar_the_camera_gives_the_range(visibility, width, bound):
    estimator = make("huang2015_lead", Chase().camera, range_from="camera", vehicle_width=width)
    for seen in chased(Chase(visibility=visibility), 1, AWAY[:10]):
        found = estimator.update(replace(seen, lead=None))
    assert found.diagnostics["distances"] == pytest.approx(AWAY[:10], rel=0.05)
    low, high = found.visibility_interval
    assert low < visibility < high
    assert found.visibility == pytest.approx(visibility, rel=bound)


def test_what_the_camera_does_not_know_of_ranges_widens_the_interval():
    seen = [replace(one, lead=None) for one in chased(Chase(visibility=150.0), 1, AWAY[:10])]
    spread = []
    for options in ({"vehicle_width": 1.8}, {}, {"pitch_deviation": np.radians(2.0)}):
        estimator = make("huang2015_lead", Chase().camera, range_from="camera", **options)
        found = [estimator.update(one) for one in seen][-1]
        spread.append(found.standard_deviation / found.extinction)
    # The last pitch says nothing of ranges: the spread of vehicles' widths, 15 %, is left.
    assert spread[0] < 0.5 * spread[1] < 0.5 * spread[2]
    assert spread[2] == pytest.approx(0.15, rel=0.1)


@pytest.mark.parametrize(
    ("distance", "bound", "visibility"),
    [(90.0, 0.2, 500.0), (60.0, 0.15, 120.0), (30.0, 0.07, 120.0)],
)
def test_the_foot_is_found_as_well_as_the_pitch_is_known_or_better(distance, visibility, bound):
    errors = []
    for seed in range(3):
        chase, rng = Chase(visibility=visibility), np.random.default_rng(seed)
        pitch = np.random.default_rng(seed).normal(0.0, chase.pitch_scatter)
        image = exposed(chase, picture(chase, distance, rng), rng)
        crop = crop_vehicle(image, chase.camera, distance)
        found = localise_rear(crop.luminance, crop.origin, chase.camera, distance, crop.noise)
        camera = replace(chase.camera, pitch=chase.camera.pitch + pitch)
        errors.append((found.foot - camera.horizon_row - camera.row_distance / distance) * distance)
    # The told pitch alone is 0.15 m off at 90 m.
    assert np.sqrt(np.mean(np.square(errors))) / chase.camera.focal_length < bound


def test_confidence_curve_is_given_with_the_estimate():
    found = followed(Chase(visibility=100.0))
    at, left = found.diagnostics["confidence_distances"], found.diagnostics["confidence"]
    assert left == pytest.approx(np.exp(-2 * found.extinction * at))
    assert left[0] == 1.0


def test_the_window_is_where_the_vehicle_is():
    chase = Chase(visibility=120.0, across=0.5, pitch_scatter=0.0)
    found = followed(chase, ranges=(30.0,))
    column, foot, width = found.diagnostics["window"]
    scale = chase.camera.focal_length / 30.0
    assert column == pytest.approx(chase.camera.principal_point[0] + 0.5 * scale, abs=3.0)
    assert foot == pytest.approx(chase.camera.horizon_row + chase.camera.row_distance / 30.0, abs=6.0)
    assert width == pytest.approx(1.8 * scale, rel=0.1)
    assert not found.valid
    assert "not changed enough" in found.diagnostics["reason"]


def test_another_vehicle_begins_another_track():
    chase = Chase(visibility=100.0)
    estimator = make("huang2015_lead", chase.camera)
    for seen in chased(chase, 0, AWAY):
        estimator.update(seen)
    (seen,) = chased(chase, 1, (25.0,))
    assert not estimator.update(replace(seen, frame=replace(seen.frame, time=float(len(AWAY))))).valid
    assert estimator.tracks == 2
    assert estimator.update(Observation(seen.image)).diagnostics["reason"] == "no vehicle is tracked ahead"


@pytest.mark.parametrize(("paint", "as_published"), [(90.0, False), (40.0, True)])
def test_a_road_that_lamps_light_is_no_answer(paint, as_published):
    # At dusk the own head lamps make road and vehicle brighter than they are to the sky.
    dusk = Chase(visibility=100.0, airlight=60.0, asphalt=110.0, paint=paint)
    for ranges in (AWAY, AWAY[::-1]):
        found = followed(dusk, ranges=ranges, as_published=as_published)
        assert not found.valid
        assert "brighter than the sky" in found.diagnostics["reason"]


def test_a_road_that_is_brightest_nearby_is_lit_by_lamps_though_darker_than_the_sky():
    day = Chase(visibility=100.0, asphalt=40.0)
    assert followed(day).valid
    assert "lamps light the road" in followed(day.but(beam=2.5)).diagnostics["reason"]


def test_an_empty_road_shows_the_camera_no_range():
    chase = Chase(visibility=150.0)
    image = exposed(chase, picture(chase, 5000.0, np.random.default_rng(0)), np.random.default_rng(0))
    found = make("huang2015_lead", chase.camera, range_from="camera").update(Observation(image))
    assert not found.valid
    assert found.diagnostics["reason"]


def test_the_width_of_vehicles_is_for_ranges_by_the_camera():
    with pytest.raises(InputError, match="range_from"):
        make("huang2015_lead", Chase().camera, vehicle_width=1.8)
