from dataclasses import replace

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.estimators import make
from fogsim.values import Camera, FogCategory, Frame, Observation, Response

SMALL = Camera(160, 120, 144.0, (79.5, 59.5), 1.38, np.radians(2.0))
WIDE = Camera(688, 515, 700.0, (344.0, 280.0), 1.3, np.radians(1.0), response=Response.GAMMA)


def estimate(image, camera, **options):
    return make("negru2013", camera, **options).update(Observation(image))


def visibilities(render, road, seeds, **options):
    found = [estimate(render(road, seed), road.camera, **options) for seed in seeds]
    return np.array([e.visibility if e.valid else np.nan for e in found])


@pytest.mark.parametrize(("visibility", "bound"), [(20, 10), (50, 10), (100, 10), (200, 10), (400, 25)])
@pytest.mark.parametrize(("response", "airlight"), list(zip(Response, (120.0, 200.0, 120.0), strict=True)))
def test_recovers_visibility_on_a_foreign_renderers_frames(render, road, visibility, bound, response, airlight):
    scene = road.but(visibility=visibility, airlight=airlight, camera=replace(road.camera, response=response))
    error = visibilities(render, scene, range(3)) / visibility - 1
    assert np.median(np.abs(error)) < bound / 100


@pytest.mark.parametrize(("camera", "visibility"), [(SMALL, 50), (SMALL, 100), (SMALL, 200), (WIDE, 100), (WIDE, 400)])
def test_recovers_visibility_with_other_cameras(render, road, camera, visibility):
    error = visibilities(render, road.but(visibility=visibility, camera=camera), range(3)) / visibility - 1
    # With the small camera the inflection of 200 m is 1.5 rows below the horizon: one of three may not be seen.
    assert np.isfinite(error).sum() >= 2
    assert np.nanmedian(np.abs(error)) < 0.10


def test_a_rolled_camera_sees_the_same_fog(render, road):
    rolled = road.but(camera=replace(road.camera, roll=np.radians(3.0)))
    assert visibilities(render, rolled, range(2)) == pytest.approx([100, 100], rel=0.1)


def test_interval_covers_the_truth(render, road):
    inside = []
    for visibility in (40.0, 80.0, 150.0, 250.0):
        for seed in range(4):
            low, high = estimate(render(road.but(visibility=visibility), seed), road.camera).visibility_interval
            inside.append(low < visibility < high)
    assert np.mean(inside) > 0.8


def test_interval_covers_a_horizon_that_is_off(render, road):
    # The vehicle pitches by one claimed standard deviation either way; the 90 % interval must hold both.
    for pitch in (-0.1, 0.1):
        true = replace(road.camera, pitch=road.camera.pitch + np.radians(pitch))
        image = render(road.but(visibility=200.0, camera=true))
        low, high = estimate(image, road.camera).visibility_interval
        assert low < 200.0 < high


def test_as_published_is_coarser_but_near(render, road):
    found = visibilities(render, road, range(6), as_published=True)
    assert np.nanmedian(np.abs(found / 100.0 - 1)) < 0.2
    refined = visibilities(render, road, range(6))
    assert np.median(np.abs(refined / 100.0 - 1)) < np.nanmedian(np.abs(found / 100.0 - 1))


@pytest.mark.parametrize("sky", [90.0, 150.0, 245.0])
@pytest.mark.parametrize("patch_contrast", [0.0, 0.03, 0.08])
def test_clear_air_is_never_fog(render, road, sky, patch_contrast):
    for seed in range(3):
        scene = road.but(visibility=1e6, sky=sky, airlight=sky, patch_contrast=patch_contrast)
        found = estimate(render(scene, seed), road.camera)
        assert not found.valid or found.category is FogCategory.NONE
        if found.valid and found.extinction == 0:
            assert 0 < found.standard_deviation < 0.02


@pytest.mark.parametrize("paint", [30.0, 60.0, 180.0])
@pytest.mark.parametrize("visibility", [30.0, 50.0, 100.0, 200.0])
def test_a_lead_vehicle_does_not_clear_the_fog(render, road, visibility, paint):
    scene = road.but(visibility=visibility, lead_distance=25.0, lead_paint=paint)
    found = estimate(render(scene), road.camera)
    assert not found.valid or found.visibility == pytest.approx(visibility, rel=0.25)


@pytest.mark.parametrize("wall", [5, 20, 90, 130, 180])
@pytest.mark.parametrize("foot", [260, 300, 400])
def test_a_wall_across_the_road_is_no_fog_and_no_clear_air(render, road, wall, foot):
    image = render(road.but(visibility=1e6))
    image[200:foot] = wall
    assert not estimate(image, road.camera).valid


def test_an_obstacle_is_named_as_the_reason(render, road):
    image = render(road.but(visibility=1e6))
    image[200:300] = 20
    assert "below the horizon" in str(estimate(image, road.camera).diagnostics["reason"])


def test_mirroring_changes_nothing(render, road):
    image = render(road)
    found, mirrored = estimate(image, road.camera), estimate(image[:, ::-1], road.camera)
    assert mirrored.extinction == pytest.approx(found.extinction, rel=1e-6)


def test_grey_and_colour_agree(render, road):
    image = render(road)
    found = estimate(image, road.camera)
    colour = estimate(np.repeat(image[:, :, None], 3, axis=2), road.camera)
    assert colour.extinction == pytest.approx(found.extinction, rel=1e-4)


def test_unsaturated_gain_changes_nothing_beyond_quantisation(render, road):
    full = road.but(airlight=200.0, noise=0.0)
    dim = full.but(airlight=100.0, asphalt=30.0, mark=75.0, terrain=22.5)
    bright, dark = estimate(render(full), road.camera), estimate(render(dim), road.camera)
    assert dark.extinction == pytest.approx(bright.extinction, rel=0.04)
    assert dark.diagnostics["airlight"] == pytest.approx(0.5 * bright.diagnostics["airlight"], rel=0.01)


@pytest.mark.parametrize(("bits", "factor"), [(10, 4), (12, 16)])
def test_more_bits_of_the_same_picture_change_nothing(render, road, bits, factor):
    image = render(road)
    deep = estimate(image.astype(np.uint16) * factor, replace(road.camera, bits=bits))
    assert deep.extinction == pytest.approx(estimate(image, road.camera).extinction, rel=1e-3)


def test_a_bit_depth_that_was_not_told_is_an_error(render, road):
    image = render(road)
    with pytest.raises(InputError, match="8 bits must have dtype uint8"):
        estimate(image.astype(np.uint16), road.camera)
    with pytest.raises(InputError, match="10 bits must have dtype uint16"):
        estimate(image, replace(road.camera, bits=10))
    with pytest.raises(InputError, match="values 0 … 1023, got one of"):
        estimate(image.astype(np.uint16) * 16, replace(road.camera, bits=10))


def test_visibility_scales_with_the_told_height(render, road):
    image = render(road)
    tall = replace(road.camera, mount_height=2 * road.camera.mount_height)
    # How wide the band is at the horizon is known in metres, and is another number of columns.
    assert estimate(image, tall).visibility == pytest.approx(2 * estimate(image, road.camera).visibility, rel=0.01)


def test_diagnostics_say_what_was_found(render, road):
    found = estimate(render(road), road.camera)
    details = found.diagnostics
    assert details["horizon_row"] == pytest.approx(road.camera.horizon_row, abs=0.5)
    depth = road.camera.row_distance / (details["inflection_row"] - details["horizon_row"])
    assert depth == pytest.approx(2 / found.extinction)
    assert details["airlight"] == pytest.approx(200, abs=3)
    assert details["road"] == pytest.approx(60, abs=6)
    left, right, top, bottom = details["band"]
    assert 0 <= left < right < 640
    assert top < details["inflection_row"] < bottom == 479
    assert len(details["profile"]) == bottom - top + 1


def test_saturated_sky_is_taken_as_a_lower_bound(render, road):
    found = estimate(render(road.but(airlight=300.0)), road.camera)
    assert not found.valid or found.visibility == pytest.approx(100, rel=0.15)


def rows_of(values, cols=640):
    noise = np.random.default_rng(6).normal(0, 1, (len(values), cols))
    return np.clip(np.asarray(values)[:, None] + noise, 0, 255).astype(np.uint8)


LIT_ROAD = np.where(np.arange(480) > 225, 120 * np.clip((np.arange(480) - 225) / 255, 0, 1) ** 2, 2)
TELLS_NOTHING = {
    "black": np.zeros((480, 640), np.uint8),
    "white": np.full((480, 640), 255, np.uint8),
    "grey": np.full((480, 640), 128, np.uint8),
    "noise": np.random.default_rng(7).integers(0, 256, (480, 640), dtype=np.uint8),
    "colour noise": np.random.default_rng(8).integers(0, 256, (480, 640, 3), dtype=np.uint8),
    "night": rows_of(LIT_ROAD),
    "lit night": rows_of(LIT_ROAD + 12),
    "checkerboard": (np.indices((480, 640)).sum(axis=0) // 7 % 2 * 255).astype(np.uint8),
}


@pytest.mark.parametrize("name", TELLS_NOTHING)
def test_an_image_without_a_foggy_road_is_refused_with_a_reason(road, name):
    found = estimate(TELLS_NOTHING[name], road.camera)
    assert not found.valid
    assert found.diagnostics["reason"]
    assert found.extinction == 0.0
    assert found.standard_deviation == np.inf


def test_a_road_as_bright_as_the_airlight_is_refused(render, road):
    found = estimate(render(road.but(asphalt=195.0, terrain=190.0, mark=200.0)), road.camera)
    assert not found.valid
    assert "bright" in str(found.diagnostics["reason"])


def test_upside_down_is_refused(render, road):
    assert not estimate(render(road)[::-1], road.camera).valid


@pytest.mark.parametrize("pitch", [-40.0, 40.0, 89.0])
def test_a_horizon_outside_the_image_is_refused(render, road, pitch):
    camera = replace(road.camera, pitch=np.radians(pitch))
    found = estimate(render(road), camera)
    assert not found.valid
    assert "horizon" in str(found.diagnostics["reason"])


@pytest.mark.parametrize("size", [(1, 1), (16, 16), (2, 300), (300, 2), (33, 20)])
def test_tiny_images_are_refused(size):
    width, height = size
    camera = Camera(width, height, 100.0, (width / 2, height / 2), 1.4)
    for value in (0, 90, 255):
        assert not estimate(np.full((height, width), value, np.uint8), camera).valid


@pytest.mark.parametrize("seed", range(1, 13, 2))
def test_nothing_odd_gets_out_of_random_pictures(seed):
    rng = np.random.default_rng(seed)
    camera = Camera(96, 72, rng.uniform(30, 300), (48.0, rng.uniform(0, 72)), 1.4, rng.uniform(-0.3, 0.3))
    rows = np.interp(np.arange(72), np.sort(rng.uniform(0, 72, 5)), rng.uniform(0, 300, 5))
    image = np.clip(rows[:, None] + rng.normal(0, rng.choice([0, 1, 20]), (72, 96)), 0, 255).astype(np.uint8)
    found = estimate(image, camera, as_published=True)
    assert np.isfinite(found.extinction)
    assert found.extinction >= 0
    assert found.standard_deviation > 0
    assert found.valid == np.isfinite(found.standard_deviation)


@pytest.mark.parametrize(
    ("image", "message"),
    [
        (np.zeros((120, 160), np.uint8), "160×120.*640×480"),
        (np.zeros((480, 640), np.float32), "float32"),
        (np.zeros((480, 640, 4), np.uint8), r"\(480, 640, 4\)"),
        (np.zeros(480, np.uint8), r"\(480,\)"),
        ([[0]], r"frame must be .*, got \[\[0\]\]"),
    ],
)
def test_what_is_no_image_of_the_camera_is_an_error(road, image, message):
    with pytest.raises(InputError, match=message):
        estimate(image, road.camera)


def test_frames_and_bare_arrays_agree_and_nothing_is_remembered(render, road):
    estimator = make("negru2013", road.camera)
    image = render(road)
    first = estimator.update(Observation(Frame(3.0, image, road.camera)))
    estimator.update(Observation(render(road.but(visibility=30.0))))
    again = estimator.update(Observation(image))
    assert (again.extinction, again.standard_deviation) == (first.extinction, first.standard_deviation)


def test_the_image_is_left_alone(render, road):
    image = render(road)
    image.flags.writeable = False
    kept = image.copy()
    assert estimate(image, road.camera).valid
    assert np.array_equal(image, kept)


def test_the_vanishing_point_mends_a_horizon_that_is_off(render, road):
    errors = {True: [], False: []}
    for seed, pitch in enumerate((-0.15, 0.15, -0.1, 0.1)):
        true = replace(road.camera, pitch=road.camera.pitch + np.radians(pitch))
        # In denser fog the road's curve itself shows the horizon.
        image = render(road.but(visibility=1000.0, camera=true), seed)
        for looks, found in errors.items():
            found.append(abs(estimate(image, road.camera, vanishing_point=looks).visibility / 1000.0 - 1.0))
    assert np.mean(errors[True]) < 0.5 * np.mean(errors[False])
    assert np.mean(errors[True]) < 0.05


@pytest.mark.parametrize(("visibility", "bound"), [(400.0, 0.12), (700.0, 0.2), (1000.0, 0.35)])
def test_thin_fog_is_measured_and_the_interval_holds(render, road, visibility, bound):
    camera = replace(road.camera, width=688, height=515, focal_length=700.0, principal_point=(343.5, 257.0))
    inside = []
    for seed in range(6):
        pitch = np.random.default_rng(seed).normal(0.0, np.radians(0.1))
        image = render(road.but(visibility=visibility, camera=replace(camera, pitch=camera.pitch + pitch)), seed)
        found = estimate(image, camera)
        # The judge takes k = 3 / V.
        assert found.extinction * visibility / 3.0 == pytest.approx(1.0, abs=bound)
        inside.append(abs(found.extinction - 3.0 / visibility) < 1.645 * found.standard_deviation)
    assert np.mean(inside) > 0.8


def test_printed_signs_are_far_off(render, road):
    # negru2013 eqs. 17 and 18 as printed; physics.md section 5.4 has the right ones.
    right = visibilities(render, road, range(3), as_published=True)
    printed = visibilities(render, road, range(3), as_published=True, printed_signs=True)
    assert np.nanmin(np.abs(right / 100.0 - 1.0)) < 0.2
    # What the printed equations make of the row is no model of the curve: refused, or far off.
    assert all(np.isnan(found) or abs(found / 100.0 - 1.0) > 0.3 for found in printed)


def test_as_published_keeps_the_best_vanishing_point_and_inflection(render, road):
    estimator = make("negru2013", road.camera, as_published=True)
    lined = estimator.update(Observation(render(road)))
    bare = estimator.update(Observation(render(road.but(marks=False, terrain=60.0), 1)))
    assert bare.diagnostics["horizon_row"] == lined.diagnostics["horizon_row"]
    estimator.reset()
    alone = estimator.update(Observation(render(road.but(marks=False, terrain=60.0), 1)))
    assert alone.diagnostics["horizon_row"] == road.camera.horizon_row


@pytest.mark.parametrize("name", ["horizon_frames", "inflection_frames", "pitch_deviation"])
def test_parameters_out_of_range_are_errors(road, name):
    with pytest.raises(InputError, match=name):
        make("negru2013", road.camera, **{name: 0})
