from dataclasses import replace

import numpy as np
import pytest

from fogsim.estimators import make
from fogsim.estimators.zhu2015 import weighted_row, zhu_category
from fogsim.values import FogCategory, Frame, LeadMeasurement, Observation, Response

LEAD = LeadMeasurement(25.0, 0.0)


def estimate(image, camera, lead=None, **options):
    return make("zhu2015", camera, **options).update(Observation(image, lead=lead))


def tilted(road, degrees, **changes):
    """The road seen by a camera whose pitch is not the told one, and the told camera."""
    told = replace(road.camera, **changes)
    return road.but(camera=replace(told, pitch=told.pitch + np.radians(degrees))), told


@pytest.mark.parametrize(
    ("visibility", "category"),
    [(0.1, "dense"), (99.9, "dense"), (100, "moderate"), (299, "moderate"), (300, "low"), (1000, "none")],
)
def test_classes_are_those_of_table_1(visibility, category):
    assert zhu_category(visibility) is FogCategory(category)


def test_weighted_row_drops_extremes_and_counts_values_by_how_often_they_occur():
    # 1 and 90 go; mean 10.8 and median 10 join 10, 10, 10, 13: 10 has 4 votes of 6 four times over.
    rows = np.array([10.0, 1.0, 10.0, 13.0, 90.0, 10.0])
    expected = (4 * 4 * 10.0 + 13.0 + 10.75) / (4 * 4 + 2)
    assert weighted_row(rows) == pytest.approx(expected)
    assert weighted_row(np.array([7.0])) == 7.0


@pytest.mark.parametrize(
    ("visibility", "category"),
    [(94, "dense"), (107, "moderate"), (280, "moderate"), (340, "low"), (1e6, "none")],
)
def test_four_classes_under_a_pitch_that_is_not_told(render, road, visibility, category):
    found = []
    for seed, (degrees, focal_length) in enumerate(((-0.1, 577.0), (0.1, 577.0), (0.1, 1000.0))):
        scene, told = tilted(road.but(visibility=visibility), degrees, focal_length=focal_length)
        found.append(estimate(render(scene, seed), told).diagnostics["class"])
    assert found.count(category) >= 2


@pytest.mark.parametrize(
    ("visibility", "bound", "airlight", "response"),
    [
        (40.0, 0.05, 120.0, Response.LINEAR),
        (90.0, 0.05, 260.0, Response.SRGB),
        (200.0, 0.08, 260.0, Response.SRGB),
        (500.0, 0.3, 120.0, Response.LINEAR),
    ],
)
def test_recovers_visibility(render, road, visibility, bound, airlight, response):
    camera = replace(road.camera, response=response)
    scene = road.but(visibility=visibility, airlight=airlight, camera=camera)
    errors = [estimate(render(scene, seed), camera).visibility / visibility - 1 for seed in range(3)]
    # What a clipped sky cuts off makes the curve look steeper farther up.
    assert np.median(np.abs(errors)) < bound + (0.05 if airlight > 255 else 0.0)


def test_thin_fog_beyond_its_rows_is_no_dense_fog(render, road):
    # At 900 m the inflection lies 1.3 px below the horizon: it may be told as any thin fog, or not at all.
    for seed in range(4):
        found = estimate(render(road.but(visibility=900.0), seed), road.camera)
        assert not found.valid or found.visibility > 400.0


@pytest.mark.parametrize(("visibility", "category"), [(95, "dense"), (200, "moderate")])
def test_state_after_three_frames_of_a_road_whose_albedo_drifts(render, road, visibility, category):
    states = []
    for drive in range(4):
        scene, told = tilted(road.but(visibility=visibility, drift=0.15), 0.1 * (-1) ** drive)
        estimator = make("zhu2015", told)
        found = [estimator.update(Observation(render(scene, 10 * drive + frame))) for frame in range(3)]
        states.append(found[-1].diagnostics["state"])
    assert states.count(category) >= 3


@pytest.mark.parametrize("visibility", [50.0, 120.0])
def test_a_verge_beside_the_lane_is_no_road(render, road, visibility):
    scene = road.but(visibility=visibility, verge=True)
    found = [estimate(render(scene, seed), road.camera).visibility for seed in range(3)]
    assert np.median(found) == pytest.approx(visibility, rel=0.03)


def test_a_wood_along_the_horizon_is_not_taken_for_the_sky(render, road):
    image = render(road.but(visibility=1e6, terrain=70.0))
    horizon = int(road.camera.horizon_row)
    image[horizon - 45 : horizon] = 20
    found = estimate(image, road.camera)
    assert found.valid
    assert found.diagnostics["class"] is FogCategory.NONE


@pytest.mark.parametrize("visibility", [50.0, 200.0, 400.0])
def test_a_lead_vehicle_does_not_clear_the_fog(render, road, visibility):
    scene = road.but(visibility=visibility, lead_distance=25.0)
    found = estimate(render(scene), road.camera, LEAD)
    assert found.visibility == pytest.approx(visibility, rel=0.2)


def test_as_published_the_region_between_the_lines_makes_all_air_thick_fog(render, road):
    for visibility in (50.0, 500.0, 1e6):
        image = render(road.but(visibility=visibility))
        for growth in (2.0, 6.0, 20.0):
            found = estimate(image, road.camera, as_published=True, growth=growth)
            assert found.diagnostics["class"] is FogCategory.DENSE


def test_a_region_over_the_whole_image_grows_into_the_sky_in_dense_fog(render, road):
    dense, thin = (
        estimate(render(road.but(visibility=visibility)), road.camera, repairs=["own_lane"])
        for visibility in (50.0, 500.0)
    )
    assert dense.diagnostics["class"] is FogCategory.NONE
    assert dense.visibility > thin.visibility


def test_three_frames_are_averaged_and_three_equal_classes_make_a_state(render, road):
    estimator = make("zhu2015", road.camera)
    states, frames = [], []
    for seed, visibility in enumerate((200.0, 200.0, 200.0, 60.0, 60.0, 60.0, 60.0)):
        found = estimator.update(Observation(render(road.but(visibility=visibility), seed)))
        states.append(found.diagnostics["state"])
        frames.append(found.diagnostics["frames"])
    assert states[:3] == [None, None, "moderate"]
    assert states[3] == "moderate"
    assert states[-1] == "dense"
    assert frames == [1, 2, 3, 3, 3, 3, 3]
    estimator.reset()
    again = estimator.update(Observation(render(road, 0)))
    assert again.diagnostics["frames"] == 1
    assert again.diagnostics["state"] is None


def test_frames_from_before_a_gap_are_not_averaged(render, road):
    method = make("zhu2015", road.camera)
    for time, visibility in ((0.0, 60.0), (0.1, 60.0), (5.0, 240.0)):
        frame = Frame(time, render(road.but(visibility=visibility)), road.camera)
        found = method.update(Observation(frame))
    assert found.diagnostics["frames"] == 1
    assert found.visibility == pytest.approx(240.0, rel=0.1)


def test_interval_covers_the_truth(render, road):
    inside = []
    for seed, visibility in enumerate((40.0, 80.0, 150.0, 250.0, 400.0, 60.0)):
        scene, told = tilted(road.but(visibility=visibility), 0.1 * (-1) ** seed)
        low, high = estimate(render(scene, seed), told).visibility_interval
        inside.append(low < visibility < high)
    assert np.mean(inside) >= 0.7
