"""Fog from what the own head lamps light: fog and road, by one model."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from fogsim.atmosphere.lamps.phase_function import Droplets
from fogsim.errors import InputError
from fogsim.estimators import make, supply
from fogsim.estimators.night.light_fit import Fit, Measured, log_likelihoods
from fogsim.estimators.night.night_road import DAYLIGHT, NightRoad
from fogsim.estimators.night.own_light import VISIBILITIES, cell_luminance, cells_of, without_cut_noise
from fogsim.values import Camera, Estimate, Frame, Lamp, LeadMeasurement, Observation
from fogsim.values.observation import LightMeasurement
from tests.estimators.night.pictures import CAMERA, SETBACK, night_picture

DARK = LightMeasurement(0.0)


def estimate(
    picture: NDArray[np.uint8], camera: Camera = CAMERA, head_lamps: str = "usual", **known: object
) -> Estimate:
    told = {"lamps": Lamp.LOW_BEAM, "camera_setback": SETBACK, "light": DARK, **known}
    return night_road(camera, head_lamps=head_lamps).update(Observation(picture, **told))


def night_road(camera: Camera = CAMERA, frames: int = 3, head_lamps: str = "usual") -> NightRoad:
    made = NightRoad(camera, frames=frames, head_lamps=head_lamps)
    supply(made)
    return made


def holds(found: Estimate, visibility: float) -> bool:
    low, high = found.visibility_interval
    return low <= visibility <= high


@pytest.mark.parametrize("visibility", [40.0, 80.0, 180.0])
def test_what_is_drawn_is_found_whatever_the_exposure(visibility: float) -> None:
    for saturation in (1.5, 4.0):
        found = estimate(night_picture(visibility, saturation=saturation))
        assert found.visibility == pytest.approx(visibility, rel=0.25)
        assert holds(found, visibility)


@pytest.mark.parametrize(("head_lamps", "light"), [("usual", DARK), ("unknown", None)])
def test_a_clear_night_has_a_lower_bound_alone(head_lamps: str, light: LightMeasurement | None) -> None:
    found = estimate(night_picture(np.inf), head_lamps=head_lamps, light=light)
    low, high = found.visibility_interval
    assert not found.valid
    assert low > {"usual": 800.0, "unknown": 150.0}[head_lamps]
    assert high == np.inf


@pytest.mark.parametrize(
    "change",
    [{"asphalt": 0.0195}, {"droplets": Droplets.HEAVY_RADIATION}, {"droplets": Droplets.HEAVY_ADVECTION}],
    ids=["half as bright again", "larger droplets", "advection fog"],
)
def test_other_asphalt_and_droplets_are_in_the_interval(change: dict[str, float]) -> None:
    for visibility in (80.0, 150.0):
        found = estimate(night_picture(visibility, **change))
        assert holds(found, visibility)
        assert found.visibility_interval[0] > 0.4 * visibility


def test_so_is_a_pitch_that_is_not_the_assumed_one() -> None:
    for pitch in (-0.15, 0.15):
        seen = night_picture(80.0, camera=dataclasses.replace(CAMERA, pitch=CAMERA.pitch + np.radians(pitch)))
        assert holds(estimate(seen), 80.0)


def test_an_unknown_beam_tells_less() -> None:
    known, unknown = (estimate(night_picture(150.0), head_lamps=name) for name in ("usual", "unknown"))
    assert holds(known, 150.0)
    assert holds(unknown, 150.0)


@pytest.mark.parametrize("lux", [1.0, 10.0, 60.0])
def test_at_dusk_daylight_is_part_of_the_model(lux: float) -> None:
    for light in (LightMeasurement(lux), None):
        found = estimate(night_picture(80.0, daylight=0.7 * lux / np.pi, saturation=2.5 + 0.5 * lux), light=light)
        assert holds(found, 80.0)
        assert found.valid or light is None


def test_grey_pictures_and_a_black_level_are_read_alike() -> None:
    grey = np.ascontiguousarray(night_picture(60.0)[:, :, 1])
    assert estimate(grey).visibility == estimate(night_picture(60.0)).visibility
    raised = dataclasses.replace(CAMERA, black_level=0.04)
    assert estimate(night_picture(60.0, camera=raised, noise=0.01), raised).visibility == pytest.approx(60.0, rel=0.25)


def test_what_it_cannot_tell() -> None:
    night = night_picture(60.0)
    lamps = np.random.default_rng(0).integers(0, 250, night.shape).astype(np.uint8)
    for picture, known, why in (
        (night, {"light": LightMeasurement(2.0 * DAYLIGHT)}, "200 lx of daylight"),
        (np.full_like(night, 255), {}, "too bright nor too dark"),
        (np.full_like(night, 1), {}, "too dark"),
        (night[::-1].copy(), {}, "lamps all around"),
        (np.where(lamps[:, :, :1] > 200, 254, night), {}, "lamp"),
        (night, {"lamps": Lamp.POSITION}, "no head lamp is lit"),
        (night, {"lead": LeadMeasurement(5.0, 0.0)}, "close ahead"),
    ):
        found = estimate(picture, **known)
        assert not found.valid
        assert why in str(found.diagnostics["reason"])
        assert found.bounds is None
    alone = NightRoad(CAMERA).update(Observation(night, lamps=Lamp.LOW_BEAM))
    assert "no calibration" in str(alone.diagnostics["reason"])
    densest = estimate(night_picture(6.0))
    assert not densest.valid
    assert densest.bounds is not None
    assert densest.bounds.least > 3.0 / 30.0


def test_vehicles_ahead_and_lamps_of_others_are_left_out() -> None:
    picture = night_picture(100.0)
    picture[58:66, 74:86] = 30  # its rear, 20 m ahead
    picture[50:54, 30:34] = 255
    assert estimate(picture, lead=LeadMeasurement(20.0, 0.0)).visibility == pytest.approx(100.0, rel=0.3)


@pytest.mark.parametrize(
    ("flatness", "power", "visibility"), [(1.0, 1.3, 60.0), (2.0, 1.8, 60.0), (1.0, 1.8, 150.0), (2.0, 1.3, 150.0)]
)
def test_the_glow_of_near_lamps_is_part_of_the_model(visibility: float, power: float, flatness: float) -> None:
    picture = night_picture(visibility)
    rows, cols = np.indices(picture.shape[:2])
    away = np.hypot(flatness * (rows - 52.0), cols - 33.0)
    linear = (picture / 255.0) ** 2.2 + 1.2 * (np.maximum(away, 4.0) / 4.0)[..., None] ** -power
    glowing = np.round(255.0 * np.minimum(linear, 1.0) ** (1 / 2.2)).astype(np.uint8)
    found = estimate(glowing)
    assert found.visibility == pytest.approx(visibility, rel=0.35)
    assert holds(found, visibility)


@pytest.mark.parametrize(("ambient", "answers"), [(0.1, True), (0.3, False)])
def test_the_light_of_a_street_is_no_veil(ambient: float, answers: bool) -> None:
    picture = night_picture(80.0)
    below = np.arange(len(picture)) - CAMERA.horizon_row
    kept = np.where(below > 0.0, np.exp(-3.0 / 80.0 * CAMERA.row_distance / np.maximum(below, 0.5)), 0.0)
    linear = (picture / 255.0) ** 2.2 + ambient * (1.0 - 0.5 * kept)[:, None, None]
    linear[20:24, 60:64] = 1.0  # a street lamp
    light = LightMeasurement(0.05)  # the sky's alone
    found = estimate(np.round(255.0 * np.minimum(linear, 1.0) ** (1 / 2.2)).astype(np.uint8), light=light)
    assert found.valid == answers
    assert holds(found, 80.0)


def test_a_camera_that_sees_no_sky_reads_the_road() -> None:
    camera = dataclasses.replace(CAMERA, pitch=0.45)
    found = estimate(night_picture(60.0, camera=camera), camera, light=None)
    assert not found.valid or holds(found, 60.0)
    assert not cells_of(camera).is_sky.any()


def test_a_change_of_lamps_begins_anew() -> None:
    estimator = night_road(frames=50)
    high = Lamp.LOW_BEAM | Lamp.HIGH_BEAM
    for _ in range(3):
        estimator.update(Observation(night_picture(60.0), lamps=Lamp.LOW_BEAM, camera_setback=SETBACK, light=DARK))
    seen = night_picture(60.0, lamps=high, saturation=12.0)
    lit = Observation(seen, lamps=high, camera_setback=SETBACK, light=DARK)
    assert estimator.update(lit).extinction == night_road().update(lit).extinction


def test_frames_before_a_long_gap_are_forgotten() -> None:
    estimator, told = night_road(), {"lamps": Lamp.LOW_BEAM, "camera_setback": SETBACK, "light": DARK}
    for time in (0.0, 0.1):
        estimator.update(Observation(Frame(time, night_picture(30.0), CAMERA), **told))
    seen = Observation(Frame(60.0, night_picture(120.0), CAMERA), **told)
    assert estimator.update(seen).extinction == night_road().update(seen).extinction


def test_lamps_of_a_file_are_used(tmp_path: Path) -> None:
    file = tmp_path / "lamps.yaml"
    with pytest.raises(InputError, match=r"usual, unknown or a file, got .*lamps.yaml"):
        make("night_road", CAMERA, head_lamps=str(file))
    file.write_text("height_m: 0.65\n", encoding="utf-8")
    by_file, usual = (estimate(night_picture(60.0), head_lamps=name) for name in (str(file), "usual"))
    assert by_file.extinction == usual.extinction
    file.write_text("height_m: 1.1\n", encoding="utf-8")
    assert estimate(night_picture(60.0), head_lamps=str(file)).extinction != usual.extinction


def test_cells_are_measured_where_they_look() -> None:
    cells = cells_of(CAMERA)
    rows = np.arange(CAMERA.height)
    image = np.repeat(rows[:, None], CAMERA.width, axis=1).astype(np.uint8)
    mean, clipped, _ = cell_luminance(image, np.arange(256, dtype=np.float32), cells.box)
    middle = 0.5 * (cells.box[:, 0] + cells.box[:, 1] - 1)
    assert np.allclose(255.0 * mean, middle, rtol=1e-5)
    assert not clipped.any()
    assert (middle[cells.is_sky] < CAMERA.horizon_row).all()
    assert (cells.rays[cells.is_sky, :, 2] > 0.0).all()
    assert (cells.rays[~cells.is_sky, :, 2] < 0.0).all()


def test_the_likelihood_is_largest_where_the_light_was_made() -> None:
    rng = np.random.default_rng(1)
    veil, road = (np.exp(rng.standard_normal((3, 37, 30))).astype(np.float32) for _ in range(2))
    depth = np.tile(np.where(np.arange(30) < 12, 1e9, np.geomspace(5.0, 100.0, 30)), (3, 1)).astype(np.float32)
    seen = 0.2 * (veil[1, 20] + road[1, 20]).astype(np.float64) + 1e-4
    glow = np.geomspace(1.0, 0.01, 30)[None]
    for others, amount in ((glow[:0], 0.0), (glow, 0.0), (glow, 0.3)):
        shown = seen + amount * glow[0]
        known = Measured(shown, np.zeros(30), others, 0.0, 0.0, 6e-4, 16.0)
        best = Fit(np.empty(30), np.empty(2))
        templates = veil, road, depth
        found = log_likelihoods(known, 3.0 / VISIBILITIES, *templates, (0.05 * shown) ** 2, np.ones(30), best, 1)
        assert np.unravel_index(np.argmax(found), found.shape) == (0, 1, 20)
        assert np.allclose(best.luminance, shown, rtol=2e-3)
        assert best.summary[0] < 1e-2
        assert best.summary[1] == pytest.approx(seen.sum() / shown.sum(), abs=0.01)


def test_shapes_of_glow_together_are_as_likely_as_each_alone() -> None:
    rng = np.random.default_rng(3)
    veil, road = (np.exp(rng.standard_normal((4, 5, 30))).astype(np.float32) for _ in range(2))
    depth = np.tile(np.where(np.arange(30) < 12, 1e9, np.geomspace(5.0, 100.0, 30)), (4, 1)).astype(np.float32)
    glows, shown = np.exp(rng.standard_normal((3, 30))), np.exp(rng.standard_normal(30))
    for scales in ((0.0, 0.0), (0.2, 0.0), (0.0, 0.1)):
        known = Measured(shown, np.linspace(1.0, 0.0, 30), glows, *scales, 6e-4, 16.0)
        rest = np.geomspace(0.003, 0.1, 5), veil, road, depth, (0.1 * shown) ** 2, np.ones(30)
        best = Fit(np.empty(30), np.empty(2))
        alone = [log_likelihoods(known._replace(others=one[None]), *rest, best, 1)[0] for one in glows]
        assert np.array_equal(log_likelihoods(known, *rest, best, 3), alone)


def test_amplitudes_are_those_of_least_squares() -> None:
    rng, sky, cells = np.random.default_rng(2), 12, 30
    is_sky = np.arange(cells) < sky
    up, depth = (
        np.where(is_sky, np.linspace(0.1, 1.0, cells), 0.0),
        np.where(is_sky, 1e9, np.linspace(80.0, 8.0, cells)),
    )
    veil = np.exp(0.5 * rng.standard_normal(cells)).astype(np.float32)
    road = np.where(is_sky, 0.0, np.exp(rng.standard_normal(cells))).astype(np.float32)
    glow, kept, scale = np.geomspace(1.0, 0.01, cells), np.exp(-0.03 * depth), 0.2
    # Airlight, the road by day, how the sky brightens and the glow, with what is known of them; the pedestal before.
    light = np.stack([np.ones(cells), 1.0 - kept, kept, 4.0 * up, glow])
    mean = np.array([0.0, 0.7, 0.15, 0.0, 0.0]) * scale
    deviation = np.array([0.01, 0.5 * scale, 0.12 * scale, 0.3 * scale, 1.0])
    for amounts in (
        (0.3, 0.001, 0.1, 0.02, 0.02, 0.3),
        (0.3, 0.001, 0.1, -0.2, 0.02, -0.3),
        (-0.3, 0.0, 0.2, 0.05, 0.0, 0.0),
    ):
        shown = amounts[0] * (veil + road) + np.array(amounts[1:]) @ light
        measured, best = Measured(shown, up, glow[None], scale, 0.0, 0.01, 20.0), Fit(np.empty(cells), np.empty(2))
        spread, templates = np.full(cells, 0.01**2), (one[None, None] for one in (veil, road))
        found = log_likelihoods(
            measured, np.array([0.03]), *templates, depth[None].astype(np.float32), spread, np.ones(cells), best, 1
        )
        total = 0.0
        for ratio in np.linspace(-1.8, 1.8, 7):
            terms = np.vstack([math.exp(ratio) * veil + road, light])
            rows = np.vstack([terms.T / 0.01, np.diag(np.concatenate([[0.0], 1.0 / deviation]))[1:]])
            wanted = np.concatenate([shown / 0.01, mean / deviation])
            lowest = np.array([0.0, -np.inf, 0.0, 0.0, -np.inf, 0.0])
            solved = lsq_linear(rows, wanted, (lowest, np.inf), tol=1e-14)
            square = 2.0 * solved.cost / cells
            total += (0.25 + square) ** -10.0 * math.exp(-0.5 * (ratio / 0.7) ** 2)
        assert found[0, 0, 0] == pytest.approx(math.log(total), abs=1e-4)


def test_noise_that_is_cut_off_at_the_dark_is_allowed_for() -> None:
    rng, cells = np.random.default_rng(3), cells_of(CAMERA)
    table = np.arange(256, dtype=np.float32)
    for true in (0.0, 4.0, 12.0, 40.0):
        noisy = np.maximum(np.round(true + 8.0 * rng.standard_normal((CAMERA.height, CAMERA.width))), 0.0)
        seen = cell_luminance(noisy.astype(np.uint8), table, cells.box)
        found = 255.0 * np.average(without_cut_noise(seen).luminance[cells.is_sky])
        assert found == pytest.approx(true, abs=0.7)
    assert 255.0 * seen.luminance.mean() > 35.0
