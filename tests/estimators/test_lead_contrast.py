"""The contrast of the vehicle ahead, judged on pictures of a painter that shares nothing with FogSim's renderer."""

import functools
from dataclasses import dataclass, replace

import numpy as np
import pytest

from fogsim.estimators import make
from fogsim.values import Camera, Frame, LeadMeasurement, Observation, Response
from fogsim.values.camera_response import respond

LN20 = np.log(20.0)
CAMERA = Camera(512, 384, 560.0, (255.5, 191.5), 1.35, np.radians(1.5))
CAMERAS = (
    Camera(800, 450, 1100.0, (395.0, 230.0), 1.6, np.radians(2.0), response=Response.SRGB),
    Camera(480, 360, 480.0, (239.5, 179.5), 2.2, np.radians(4.0), response=Response.GAMMA),
    replace(CAMERA, roll=np.radians(2.0)),
)
SETBACK = 1.7
SIDE = 2
RANGES = tuple(float(d) for d in range(25, 91, 5))
EVEN = ((0.0,), (1.0,))
DARK_LAND = {
    30.0: ((-10, -5, -2, 0, 2, 5, 10, 30), (0.58, 0.71, 0.87, 1.0, 1.11, 1.22, 1.40, 2.00)),
    400.0: ((-10, -5, -2, 0, 2, 5, 10, 30), (0.61, 0.69, 0.81, 1.0, 1.22, 1.39, 1.64, 2.36)),
}
"""Airlight over that at the horizon by elevation [deg], over land of albedo 0.1, by V_met [m].

From docs/explanation/airlight.md."""


@dataclass(frozen=True)
class Rear:
    """A flat rear: size and place to the right [m], luminance over the airlight's of body, glass and grain."""

    depth: float
    width: float = 1.8
    height: float = 1.5
    aside: float = 0.0
    body: float = 0.3
    grain: float = 0.1
    lamps: bool = False
    look: int = 0

    def shade(self, x: np.ndarray, z: np.ndarray) -> np.ndarray:
        cells = np.random.default_rng(self.look).normal(size=(24, 24))
        rows = np.clip(24 * z / self.height, 0, 23).astype(int)
        cols = np.clip(24 * (x / self.width + 0.5), 0, 23).astype(int)
        light = self.body * (1.0 + self.grain * cells[rows, cols])
        light = np.where((np.abs(z - 0.8 * self.height) < 0.25) & (np.abs(x) < 0.36 * self.width), 0.08, light)
        light = np.where((np.abs(z - 0.62) < 0.06) & (np.abs(x) < min(0.26, 0.2 * self.width)), 0.6, light)
        light = np.where(z < 0.28, 0.03, light)
        if self.lamps:
            light = np.where((np.abs(z - 0.85) < 0.1) & (np.abs(np.abs(x) - 0.38 * self.width) < 0.12), 4.0, light)
        return light


@functools.lru_cache(maxsize=256)
def paint(camera, rears, visibility, seed, airlight=200.0, pitch=0.0, beam=0.0, light=EVEN):
    """Image of a grainy road with kerbs, lit by a beam, rears on it, and fog whose airlight goes by elevation."""
    rng = np.random.default_rng(seed)
    at = (np.arange(SIDE) + 0.5) / SIDE - 0.5
    y, x = ((np.arange(n)[:, None] + at).ravel() for n in (camera.height, camera.width))
    x = (x[None, :] - camera.principal_point[0]) / camera.focal_length
    y = (y[:, None] - camera.principal_point[1]) / camera.focal_length
    if camera.roll:  # otherwise all points of a row are equally far, and one column of them says how far
        turn = np.exp(-1j * camera.roll) * (x + 1j * y)
        x, y = turn.real, turn.imag
    slope = np.tan(camera.pitch + pitch + np.arctan(y))
    ground = camera.mount_height / np.maximum(slope, 1e-6)
    far = np.minimum(ground, 1e4)
    left = np.where(slope > 1e-6, np.exp(-LN20 / visibility * far), 0.0)
    sideways = x * far
    cells = 0.04 * np.random.default_rng(99).normal(size=(128, 128)) + 1.0
    road = cells[((far + 1.7 * seed) / 0.7).astype(np.int32) & 127, (sideways / 0.7).astype(np.int32) & 127]
    right = np.abs(sideways)
    road *= np.where(right < 5.5, 0.3, 0.2)
    road[np.abs(right - 1.75) < 0.08] = 0.7
    road *= 1.0 + beam * (6.0 / np.maximum(ground, 2.0)) ** 2
    share = np.interp(-np.degrees(np.arctan(slope)), *light)
    fine = (road - share) * left + share
    for rear in sorted(rears, key=lambda r: -r.depth):
        height = camera.mount_height - rear.depth * slope
        across = x * rear.depth - rear.aside
        hit = (np.abs(across) < 0.5 * rear.width) & (height > 0) & (height < rear.height)
        across, height, before = (np.broadcast_to(one, hit.shape)[hit] for one in (across, height, share))
        fine[hit] = (rear.shade(across, height) - before) * np.exp(-LN20 / visibility * rear.depth) + before
    parts = [fine[i::SIDE, j::SIDE] for i in range(SIDE) for j in range(SIDE)]
    linear = airlight / 255.0 * sum(parts) / len(parts)
    signal = 255.0 * respond(np.clip(linear, 0.0, 1.0), camera.response)
    return np.clip(np.rint(signal + rng.normal(0.0, 1.2, signal.shape)), 0, 255).astype(np.uint8)


def drive(visibility, rears, seed=0, camera=CAMERA, noise=0.25, bias=0.0, gains=None, told=None, beam=0.0, light=EVEN):
    """Observations of the first of each frame's rears, once a second."""
    rng = np.random.default_rng(seed)
    depths = told or [frame[0].depth for frame in rears]
    for i, (frame, depth) in enumerate(zip(rears, depths, strict=True)):
        gain = 200.0 * (gains[i] if gains else 1.0)
        image = paint(camera, frame, visibility, 1000 * seed + i, gain, rng.normal(0.0, np.radians(0.1)), beam, light)
        speed = depths[min(i + 1, len(depths) - 1)] - depths[max(i - 1, 0)]
        speed /= min(i + 1, len(depths) - 1) - max(i - 1, 0)
        lead = LeadMeasurement(depth - SETBACK + bias + rng.normal(0.0, noise), speed)
        yield Observation(Frame(float(i), image, camera), lead=lead)


def away(ranges=RANGES, **look):
    return [(Rear(depth, **look),) for depth in ranges]


def every(observations, camera=CAMERA, **options):
    estimator = make("lead_contrast", camera, **options)
    return [estimator.update(observation) for observation in observations]


def off(estimate, visibility):
    """Relative error of k."""
    assert estimate.valid, estimate.diagnostics["reason"]
    return estimate.extinction * visibility / LN20 - 1.0


def test_a_vehicle_that_draws_away_tells_the_visibility_and_how_sure_that_is():
    looks, inside = ({"body": 0.6}, {"body": 0.05}, {"width": 2.5, "height": 3.5}), []
    for visibility, median, worst in ((50, 3, 7), (300, 2, 5), (500, 4, 10)):
        found = [every(drive(visibility, away(look=i, **look), i))[-1] for i, look in enumerate(looks)]
        errors = np.abs([off(one, visibility) for one in found])
        deviations = np.array([one.standard_deviation * visibility / LN20 for one in found])
        assert 100 * np.median(errors) < median
        assert 100 * max(errors) < worst
        assert max(deviations) < 0.08
        inside += list(errors < 1.645 * deviations)
    assert np.mean(inside) >= 0.75


@pytest.mark.parametrize("farther", [120.0, 400.0])
def test_a_vehicle_too_dark_or_too_bright_for_the_decrease_of_its_contrast_shows_uneven_fog(farther):
    """On average V_met is 200 m before the vehicle at 60 m, another at 90 m."""
    depths, means = np.linspace(60.0, 90.0, 10), np.geomspace(200.0, farther, 10)
    images = [paint(CAMERA, (Rear(depth),), mean, i) for i, (depth, mean) in enumerate(zip(depths, means, strict=True))]
    found = every(
        Observation(Frame(float(i), image, CAMERA), lead=LeadMeasurement(depth - SETBACK, 3.3))
        for i, (depth, image) in enumerate(zip(depths, images, strict=True))
    )
    reasons = [one.diagnostics["reason"] for one in found[3:]]
    assert any("may be uneven" in reason for reason in reasons)
    assert all("may be uneven" in reason or "Duntley" in reason for reason in reasons)


@pytest.mark.parametrize("visibility", sorted(DARK_LAND))
def test_airlight_that_darkens_toward_the_road_is_reckoned_with_the_extinction_that_is_found(visibility):
    ranges = np.linspace(12.0, min(0.9 * visibility, 160.0), 20).tolist()
    # Exposed so that the sky is not clipped.
    look, rears = {"gains": [0.55] * len(ranges), "noise": 0.1}, away(ranges)
    found = every(drive(visibility, rears, light=DARK_LAND[visibility], **look))[-1]
    even = every(drive(visibility, rears, **look))[-1]
    assert abs(off(found, visibility)) * LN20 / visibility < 2.0 * found.standard_deviation
    assert found.standard_deviation > 1.5 * even.standard_deviation
    assert abs(off(found, visibility)) < 0.15


def test_pictures_are_levelled_anew_although_the_reference_is_not_among_them():
    light, ranges = DARK_LAND[30.0], np.linspace(12.0, 26.0, 15).tolist()
    observations = list(drive(30.0, away(ranges), light=light, gains=[0.55] * len(ranges), noise=0.1))
    estimator = make("lead_contrast", CAMERA)
    for observation in observations[:12]:
        estimator.update(observation)
    track = estimator._track
    track.detections = [one for one in track.detections if one.picture is not track.reference.picture]
    before = [one.contrast.ratio for one in track.detections]
    track.relevel(0.5)
    assert track.reference.levelled.extinction == 0.5
    assert {one.levelled.extinction for one in track.detections} == {0.5}
    assert [one.contrast.ratio for one in track.detections] != before
    assert estimator.update(observations[12]).method == "lead_contrast"


LANE_CHANGE = [(Rear(d, aside=float(np.clip(0.3 * (i - 5), 0.0, 2.4))),) for i, d in enumerate(RANGES)]


@pytest.mark.parametrize(
    ("visibility", "rears", "seed", "camera", "most"),
    [
        *((120, away(), 3, camera, 0.06) for camera in CAMERAS),
        pytest.param(150, away(width=0.65, body=0.12), 5, CAMERA, 0.08, id="a motorcycle"),
        pytest.param(150, away(RANGES[::-1]), 1, CAMERA, 0.06, id="comes nearer"),
        pytest.param(150, away(aside=1.0), 2, CAMERA, 0.06, id="aside"),
        pytest.param(150, LANE_CHANGE, 6, CAMERA, 0.08, id="changes lane"),
    ],
)
def test_other_cameras_vehicles_and_courses(visibility, rears, seed, camera, most):
    assert abs(off(every(drive(visibility, rears, seed, camera), camera)[-1], visibility)) < most


def test_valid_within_twenty_metres():
    estimates = every(drive(120, away(), 4))
    assert estimates[4].valid
    assert abs(off(estimates[4], 120)) < 2.5 * estimates[4].standard_deviation * 120 / LN20


def test_exposure_and_lamps_that_are_lit_change_little():
    steady = every(drive(150, away()))[-1]
    gains = [1.0, 0.9, 0.8, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.1, 1.0, 0.9, 0.8, 1.0]
    changing = every(drive(150, away(), gains=gains))[-1]
    braking = every(drive(150, [(Rear(d, lamps=i in {2, 3, 8, 9, 10}),) for i, d in enumerate(RANGES)]))[-1]
    released = every(drive(150, [(Rear(d, lamps=i < 4),) for i, d in enumerate(RANGES)]))[-1]
    for found in (changing, braking, released):
        assert found.extinction == pytest.approx(steady.extinction, rel=0.05)


def test_a_biased_range_and_setback_change_little():
    plain, biased = (every(drive(120, away(), bias=bias))[-1].extinction for bias in (0.0, 1.5))
    assert biased == pytest.approx(plain, rel=0.05)
    near, far = (every(drive(120, away()), setback=setback)[-1].extinction for setback in (0.7, 2.7))
    assert near == pytest.approx(far, rel=0.05)


def test_a_gap_in_the_track_does_no_harm():
    observations = list(drive(150, away(), 7))
    for i in (6, 7):
        observations[i] = replace(observations[i], lead=None)
    estimates = every(observations)
    assert not estimates[6].valid
    assert abs(off(estimates[8], 150)) < 0.1
    assert abs(off(estimates[-1], 150)) < 0.06


@pytest.mark.parametrize("body", [0.05, 0.7])
def test_a_vehicle_that_cuts_in_begins_a_track_of_its_own(body):
    before = [(Rear(d),) for d in RANGES[4:10]]
    after = [(Rear(d - 30.0, look=9, body=body), Rear(d + 5.0)) for d in RANGES[10:]]
    estimates = every(drive(150, before + after, 8))
    assert abs(off(estimates[5], 150)) < 0.1
    assert not estimates[6].valid
    for found in estimates[6:]:
        assert not found.valid or abs(off(found, 150)) < 3.0 * found.standard_deviation * 150 / LN20


def test_no_change_of_range_is_no_answer():
    found = every(drive(150, away((40.0,) * 8)))[-1]
    assert not found.valid
    assert found.diagnostics["reason"]


def test_fog_that_thickens_while_the_range_stays_ends_the_track():
    before = list(drive(300, away(RANGES[:8]), 9))
    estimator = make("lead_contrast", CAMERA)
    assert [estimator.update(observation) for observation in before][-1].valid
    for i, visibility in enumerate((280, 240, 200, 160, 130, 110, 90, 80)):
        image = paint(CAMERA, (Rear(60.0),), visibility, 500 + i)
        lead = LeadMeasurement(60.0 - SETBACK, 0.0)
        found = estimator.update(Observation(Frame(8.0 + i, image, CAMERA), lead=lead))
    assert not found.valid


def boards():
    v, u = np.mgrid[: CAMERA.height, : CAMERA.width]
    rng = np.random.default_rng(0)
    for size in (4, 8, 16, 24, 48, 96):
        yield f"board {size}", np.where((v // size + u // size) % 2, 210, 40)
        yield f"faint board {size}", np.where((v // size + u // size) % 2, 150, 138)
        yield f"stripes {size}", np.where(u // size % 2, 200, 60)
    yield "white", np.full_like(u, 255)
    yield "grey", np.full_like(u, 128)
    yield "noise", rng.integers(0, 256, u.shape)
    yield "faint noise", np.rint(rng.normal(128, 4, u.shape))
    yield "ramp", np.rint(250 - 0.5 * v)
    yield "ramp upward", np.rint(50 + 0.5 * v)


@pytest.mark.parametrize("ranges", [RANGES, RANGES[::-1]], ids=["away", "nearer"])
def test_pictures_of_no_road_are_no_answer(ranges):
    speed = ranges[1] - ranges[0]
    for name, image in boards():
        frames = [Frame(float(i), image.astype(np.uint8), CAMERA) for i in range(len(ranges))]
        for found in every(Observation(f, lead=LeadMeasurement(d, speed)) for f, d in zip(frames, ranges, strict=True)):
            assert not found.valid, (name, found.extinction, found.standard_deviation)


def test_darkness_is_no_answer():
    dark = [replace(o, frame=replace(o.frame, image=o.frame.image // 50)) for o in drive(150, away())]
    assert not any(found.valid for found in every(dark))


def test_a_road_that_is_brightest_nearby_is_lit_by_lamps():
    day, lit = (every(drive(80, away(), beam=beam))[-1] for beam in (0.0, 1.2))
    assert day.valid
    assert lit.diagnostics["reason"] == "lamps light the road: this is a daytime method"


@pytest.mark.parametrize("visibility", [60, 600])
def test_a_range_that_belongs_to_nothing_is_no_answer(visibility):
    empty = [()] * len(RANGES)
    assert not any(found.valid for found in every(drive(visibility, empty, told=RANGES)))
    # A vehicle is there, but it keeps its distance while the range grows.
    fixed = away((35.0,) * len(RANGES))
    assert not any(found.valid for found in every(drive(visibility, fixed, told=RANGES)))


def test_losing_the_vehicle_and_reset_forget_the_track():
    observations = list(drive(150, away()))
    estimator = make("lead_contrast", CAMERA)
    for observation in observations:
        estimator.update(observation)
    for later in range(14, 21):
        lost = replace(observations[0].frame, time=float(later))
        assert not estimator.update(Observation(lost)).valid
    once_more = [replace(seen, frame=replace(seen.frame, time=seen.time + 21.0)) for seen in observations]
    assert not estimator.update(once_more[0]).valid
    for observation in once_more[1:]:
        estimator.update(observation)
    estimator.reset()
    assert not estimator.update(observations[0]).valid
