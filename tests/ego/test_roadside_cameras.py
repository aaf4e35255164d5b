"""Roadside cameras: what they report comes from their images, and costs nothing where there are none."""

import dataclasses
import math

import numpy as np
import pytest

import fogsim
from fogsim.errors import InputError
from fogsim.scenario import build, override
from fogsim.simulation.ego.road_meters import RoadMeters
from fogsim.simulation.ego.roadside_cameras import RoadsideCameras, as_log_normal, over_road
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, Estimate, FogField, FogReport, Step
from tests.data.early_motorway import EARLY

SMALL = (EARLY, "camera.width=80", "camera.height=60", "expect={}")
SEEN = "fog.visibility_m=200", "advice=none"
CAMERAS = "sensors.reports.roadside={camera: {}, first_m: 300, every_m: 400, period_s: 1, delay_s: 0.5}"


def drive(*settings: str, seed: int = 1) -> list[Step]:
    return list(fogsim.run(fogsim.load_scenario("motorway_fog_bank", [*SMALL, "duration_s=0.4", *settings]), seed))


def reported(steps: list[Step]) -> list[FogReport]:
    return [report for step in steps for report in step.observation.reports]


@pytest.fixture(scope="module")
def steps() -> list[Step]:
    return drive(*SEEN, CAMERAS, "duration_s=2.3")


def test_they_report_the_fog_that_their_images_show(steps: list[Step]) -> None:
    found = reported(steps)
    true = extinction_from_visibility(200.0)
    assert len({one.source for one in found}) >= 10
    for one in found:
        assert abs(math.log(one.extinction / true)) < 3.0 * one.relative_deviation < 0.5
    errors = [math.log(one.extinction / true) for one in found]
    assert np.abs(np.median(errors)) < 0.1
    # No two images have the same noise.
    assert len({one.extinction for one in found}) > 0.8 * len(found)


def test_they_report_in_their_beats_and_the_first_image_was_reported_before_the_run(steps: list[Step]) -> None:
    assert {one.time for one in steps[0].observation.reports} == {-0.5}
    first = [one for one in reported(steps) if one.source == "sensor 1"]
    assert [one.number for one in first] == list(range(first[0].number, first[0].number + len(first)))
    assert np.diff([one.time for one in first[1:]]) == pytest.approx(1.0, abs=0.11)
    assert all(700.0 < one.place <= 850.0 for one in first)
    arrived = [(step.time, one.time) for step in steps[1:] for one in step.observation.reports]
    assert arrived
    assert all(at - sent == pytest.approx(0.5, abs=0.11) for at, sent in arrived)


def test_in_clear_air_they_report_that_there_is_little_fog() -> None:
    found = reported(drive("fog.visibility_m=inf", CAMERAS))
    assert len({one.source for one in found}) >= 10
    assert all(one.extinction < extinction_from_visibility(1000.0) for one in found)


def test_by_night_they_are_silent() -> None:
    assert reported(drive("fog.visibility_m=100", CAMERAS, "light.illuminance_lx=0.1")) == []


def test_the_same_seed_has_the_same_reports_and_another_does_not(steps: list[Step]) -> None:
    same, other = (reported(drive(*SEEN, CAMERAS, seed=seed)) for seed in (1, 2))
    assert reported(steps[:5]) == same != other


def test_a_wrong_calibration_makes_wrong_reports() -> None:
    wrong = CAMERAS.replace("{}", "{told: {pitch_error_deg: 1}, estimator: {method: negru2013}}")
    right = CAMERAS.replace("{}", "{estimator: negru2013}")
    errors = [
        np.median([math.log(one.extinction / extinction_from_visibility(100.0)) for one in reported(steps)])
        for steps in (drive("fog.visibility_m=100", settings) for settings in (right, wrong))
    ]
    assert abs(errors[1]) > 2.0 * abs(errors[0])


def test_they_change_nothing_that_the_ego_sees_and_none_are_made_unless_asked_for(
    steps: list[Step], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(RoadsideCameras, "__init__", lambda *_: pytest.fail("cameras have been made"))
    for one, other in zip(drive(*SEEN), steps[:5], strict=True):
        assert np.array_equal(one.observation.image, other.observation.image)
        assert np.array_equal(one.traffic.position, other.traffic.position)
        assert [e.extinction for e in one.estimates] == [e.extinction for e in other.estimates]


def test_a_row_below_the_horizon_is_shifted_by_what_the_mast_stands_aside() -> None:
    camera = Camera(320, 240, 290.0, (160.0, 120.0), 6.0, pitch=math.radians(2.0))
    image = np.zeros((240, 320, 3), np.uint8)
    # The middle of a lane 5 m to the left, ζ ahead along the axis, is at column u0 − α 5 / ζ.
    for row in range(130, 200):
        depth = camera.row_distance / (row - camera.horizon_row)
        image[row, round(160.0 - camera.focal_length * 5.0 / depth)] = 200
    shifted = over_road(image, camera, 5.0)
    columns = np.argmax(shifted[130:200, :, 0], axis=1)
    assert (shifted[130:200].max(axis=(1, 2)) == 200).all()
    assert columns == pytest.approx(np.full(70, 160), abs=1.0)
    assert np.array_equal(over_road(image, camera, 0.0), image)
    assert np.array_equal(shifted[:110], image[:110])


def test_a_log_normal_distribution_stands_for_the_positive_part_of_a_normal_one() -> None:
    for extinction, deviation in [(0.0, 0.001), (0.001, 0.001), (0.03, 0.004), (0.03, 0.0)]:
        median, relative = as_log_normal(Estimate("a", extinction, deviation))
        k = np.linspace(0.0, extinction + 10.0 * deviation, 200_001) if deviation else np.array([extinction])
        density = np.exp(-0.5 * ((k - extinction) / max(deviation, 1e-9)) ** 2)
        mean = np.average(k, weights=density)
        variance = np.average((k - mean) ** 2, weights=density)
        assert median * math.exp(0.5 * relative**2) == pytest.approx(mean, rel=1e-3)
        assert mean**2 * math.expm1(relative**2) == pytest.approx(variance, rel=1e-3, abs=1e-9)


def test_a_section_goes_by_the_last_report_of_a_sensor_wherever_that_was_seen() -> None:
    scenario = fogsim.load_scenario("motorway_fog_bank", [*SMALL, "drivers.advised=signs"])
    meters = RoadMeters(build.sections_config(scenario), np.array([[0.0, 0.0, 0.0], [2000.0, 0.0, 0.0]]), np.zeros(0))
    report = FogReport("sensor 0", 0, 150.0, 0.0, 0.03, 0.1)
    for one in (report, dataclasses.replace(report, number=1, place=120.0, extinction=0.001)):
        meters.hear([one])
    assert {section.reported for section in meters.measure(FogField(0.03, (1.0,) * 3))} == {0.001}


def test_a_scenario_with_a_roadside_camera_takes_overrides() -> None:
    scenario = fogsim.load_scenario("motorway_fog_bank", [CAMERAS])
    assert override(scenario, ["duration_s=10"]).duration_s == 10.0


def test_what_cannot_be_is_refused() -> None:
    for settings, told in [
        (("sensors.reports.roadside={camera: {}, wrong: 5 %}",), r"wrong is of sensors .*leave out wrong or camera"),
        (("sensors.reports.roadside={camera: {}, deviation: 0.2}",), r"roadside: deviation is of sensors"),
        ((CAMERAS, "renderer=none", "estimators=[]"), r"reports\.roadside\.camera takes images, and renderer: none"),
        (("sensors.reports.roadside={camera: {estimator: joint}}",), r"camera\.estimator: unknown estimator 'joint'"),
        (("sensors.reports.roadside={camera: {mount_height_m: 0}}",), r"camera\.mount_height_m"),
    ]:
        with pytest.raises(InputError, match=told):
            fogsim.load_scenario("motorway_fog_bank", list(settings))
