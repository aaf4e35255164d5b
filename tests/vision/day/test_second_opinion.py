"""Which of two answers counts."""

import math
from dataclasses import replace

import numpy as np
import pytest

from fogsim.values import Camera, Estimate
from fogsim.values.estimate import OpticalDepths
from fogsim.vision.day import second_opinion
from fogsim.vision.day.road_end import RoadEnd
from fogsim.vision.day.row_kernels import LIGHTS
from fogsim.vision.day.second_opinion import MODEL_DEVIATION, MOST_DOUBT, PERIOD, DayVerdict, SecondOpinion, verdict_of
from fogsim.vision.lines.horizon import Horizon

CAMERA = Camera(64, 48, 60.0, (31.5, 23.5), 1.3)
SCALE = 0.05
OWN = Estimate("joint_road", 0.03, 0.0015, diagnostics={"road": 50.0})
AGREES = DayVerdict(0.031, 0.002, 0.031, (88.0, 108.0), "", True, True, True, 0.0, 0.0, 0.0)
DENSER = replace(AGREES, extinction=0.06, deviation=0.003, interval=(46.0, 54.0))
FAR = replace(AGREES, extinction=0.003, deviation=0.0002, interval=(900.0, 1100.0))
SILENT = replace(AGREES, reason="dark")
THIN = replace(OWN, extinction=0.001, standard_deviation=1e-4)
CLEAR = replace(AGREES, interval=(1500.0, math.inf), shows_fog=False)


@pytest.fixture
def said(monkeypatch):
    """Function from an estimate and what the day model finds to what comes of both, and how often it looked."""
    looks = []

    def answer(own, verdict, times=(0.0,), lines=0):
        looks.clear()
        monkeypatch.setattr(second_opinion, "fit_day", lambda *arguments: looks.append(arguments))
        monkeypatch.setattr(second_opinion, "verdict_of", lambda *_: verdict)
        second, image = SecondOpinion(CAMERA, SCALE), np.zeros((48, 64), np.uint8)
        found = [second.on(own, image, Horizon(23.5, 1.0), math.inf, time, lines) for time in times]
        return found[-1], len(looks)

    return answer


def test_an_estimate_that_is_agreed_with_stays_with_the_calibration_in_its_interval(said):
    found, _ = said(OWN, replace(AGREES, response_deviation=0.1))
    assert found.extinction == OWN.extinction
    common = math.hypot(SCALE, 0.1)
    assert found.common_deviation == pytest.approx(common)
    assert found.standard_deviation == pytest.approx(math.hypot(0.0015, 0.03 * common))
    assert said(OWN, replace(AGREES, response_deviation=0.1, is_even=False))[0] == found
    unsure, _ = said(OWN, replace(AGREES, response_deviation=0.1, is_sure=False))
    assert unsure.common_deviation == pytest.approx(SCALE)
    assert said(OWN, AGREES, (0.0, 0.1, 0.2, PERIOD + 0.1))[1] == 2
    assert said(OWN, replace(SILENT, outside=0.9), (0.0, 0.1, 0.2))[1] == 3


def test_the_day_model_answers_where_the_other_has_none_and_else_says_why_not(said):
    none = Estimate.invalid("joint_road", "no sky is seen above the road")
    found, _ = said(none, DENSER)
    assert found.valid
    alone = math.hypot(DENSER.deviation, MODEL_DEVIATION * DENSER.extinction)
    assert (found.extinction, found.standard_deviation) == (DENSER.extinction, pytest.approx(alone))
    assert found.common_deviation == MODEL_DEVIATION
    assert said(none, SILENT)[0].diagnostics["reason"] == "dark"
    unsure = said(none, replace(DENSER, is_sure=False))[0]
    assert not unsure.valid
    assert unsure.diagnostics["reason"] == "no sky is seen above the road"


def test_two_answers_that_exclude_one_another_are_spanned_or_given_up(said):
    found, _ = said(OWN, DENSER)
    low, high = found.visibility_interval
    assert low <= 46.5
    assert high >= 105.0
    far, _ = said(OWN, FAR)
    assert "disagree" in str(far.diagnostics["reason"])
    assert said(OWN, replace(FAR, is_even=False))[0].valid
    # As before a wall or a tunnel's portal, which hides the road.
    assert "disagree" in str(said(OWN, replace(DENSER, is_sure=False))[0].diagnostics["reason"])


def test_no_fog_is_believed_before_a_wall_that_hides_the_sky(said):
    walled = replace(AGREES, is_walled=True)
    assert "as a wall does" in str(said(OWN, walled)[0].diagnostics["reason"])
    assert said(OWN, walled, lines=None)[0].valid
    assert said(THIN, replace(CLEAR, is_walled=True))[0].valid


def test_what_the_joint_fit_does_not_know_ends_its_estimate_and_proves_no_other(said):
    assert not said(OWN, replace(FAR, outside=0.9))[0].valid
    assert not said(OWN, replace(SILENT, outside=0.9))[0].valid
    assert said(OWN, replace(SILENT, outside=0.4))[0].valid
    assert said(OWN, replace(AGREES, doubt=MOST_DOUBT - 1.0))[0].valid
    assert "contrast" in str(said(OWN, replace(AGREES, doubt=MOST_DOUBT + 1.0))[0].diagnostics["reason"])


def test_an_unlikely_response_is_given_up_for_the_mean_over_others_and_an_impossible_one_for_their_answer(said):
    own = replace(OWN, optical_depths=OpticalDepths((50.0,), (1.5,), (0.1,)))
    thinner = replace(AGREES, extinction=0.025, interval=(100.0, 140.0), response_shift=-0.2, response_deviation=0.1)
    times = (0.0, 0.1)
    found, _ = said(own, thinner, times)
    assert found.extinction == pytest.approx(0.03 * math.exp(-0.2))
    assert found.optical_depths.depth[0] == pytest.approx(1.5 * math.exp(-0.2))
    assert said(own, replace(thinner, free=20.0), times)[0] == found
    other, _ = said(own, replace(DENSER, is_stated=False, is_even=False))
    assert other.extinction == DENSER.extinction


def test_where_the_sky_is_clipped_an_estimate_is_as_unsure_as_the_day_model(said):
    found, _ = said(OWN, replace(AGREES, airlight_deviation=0.3))
    assert found.standard_deviation == pytest.approx(0.03 * math.hypot(0.05, SCALE, 0.3))


def test_an_answer_that_the_day_model_excludes_is_given_up_though_it_has_none(said):
    assert not said(OWN, replace(FAR, reason="too little road"))[0].valid
    assert said(OWN, SILENT)[0].valid


def test_before_what_stands_in_the_lane_the_joint_fit_answers_unless_the_road_may_be_wet(said):
    hidden = replace(SILENT, free=20.0, outside=0.1)
    assert said(OWN, hidden)[0].extinction == OWN.extinction
    assert said(OWN, replace(hidden, outside=0.3))[0].diagnostics["reason"] == "dark"


def test_on_a_bent_road_the_joint_fit_answers_and_the_day_model_says_what_responses_change(said):
    found, looks = said(OWN, replace(DENSER, response_deviation=0.1), lines=None)
    assert looks == 1
    assert found.extinction == OWN.extinction
    assert found.common_deviation == pytest.approx(math.hypot(SCALE, 0.1))
    assert found.standard_deviation == pytest.approx(math.hypot(0.0015, 0.03 * math.hypot(SCALE, 0.1)))


def test_a_road_in_shade_is_one_where_its_lines_meet_under_the_stated_response():
    fit = second_opinion.DayFit(
        log_visibility=np.log([95.0, 100.0, 105.0]),
        chance=np.full(3, 1.0 / 3.0),
        fog_over_none=-5.0,
        responses=np.array([0.9, 0.1]),
        surfaces=np.eye(6)[3],
        lights=LIGHTS.chance,
        clipped=0.0,
        brightest=0.8,
        contrast=0.5,
        log_means=np.zeros(2),
        obstacle=math.inf,
    )
    assert verdict_of(fit, SCALE, 3).reason
    assert not verdict_of(replace(fit, responses=np.array([0.01, 0.99])), SCALE, 4).is_sure
    assert not verdict_of(replace(fit, surfaces=np.eye(6)[4]), SCALE, 4).is_sure
    seen = verdict_of(fit, SCALE, 4)
    assert not seen.reason
    assert seen.is_sure
    assert not seen.is_even


def test_an_unknown_response_and_a_road_that_may_be_wet_are_too_much_for_one_image():
    responses, wet = np.array([0.0, 1.0, 0.0, 0.0, 0.0]), np.eye(LIGHTS.chance.size)[1]
    fit = second_opinion.DayFit(
        log_visibility=np.log([95.0, 100.0, 105.0]),
        chance=np.full(3, 1.0 / 3.0),
        fog_over_none=30.0,
        responses=responses,
        surfaces=np.eye(6)[0],
        lights=wet,
        clipped=0.0,
        brightest=0.8,
        contrast=0.5,
        log_means=np.zeros(5),
        obstacle=math.inf,
    )
    assert "wet" in verdict_of(fit, SCALE).reason
    assert not verdict_of(replace(fit, lights=np.eye(LIGHTS.chance.size)[0]), SCALE).reason
    assert not verdict_of(replace(fit, responses=np.eye(5)[4]), SCALE).reason
    assert not verdict_of(replace(fit, responses=np.array([0.5, 0.5, 0.0, 0.0, 0.0])), SCALE).reason
    bright = replace(fit, lights=np.eye(LIGHTS.chance.size)[0], contrast=0.15)
    assert verdict_of(bright, SCALE).reason == second_opinion.FAR_ROAD
    walled = replace(fit, end=RoadEnd(density=1.0))
    assert verdict_of(walled, SCALE).is_walled
    assert not verdict_of(replace(walled, free=25.0), SCALE).is_walled  # the road ends at a vehicle


def test_an_answer_that_agrees_with_clear_air_has_no_upper_end(said):
    found, _ = said(THIN, CLEAR)
    assert found.valid
    assert found.extinction == 0.001
    assert found.visibility_interval[1] == math.inf


def test_clear_air_is_reported_only_as_far_as_road_was_read(said):
    found, _ = said(Estimate.invalid("joint_road", "too dark"), replace(CLEAR, farthest=110.0))
    assert found.valid
    assert found.reach == 110.0


def test_fog_that_begins_in_a_clear_drive_is_compared_at_once(said, monkeypatch):
    looks = []
    monkeypatch.setattr(second_opinion, "fit_day", lambda *arguments: looks.append(arguments))
    monkeypatch.setattr(second_opinion, "verdict_of", lambda *_: CLEAR if len(looks) < 2 else AGREES)
    second, image = SecondOpinion(CAMERA, SCALE), np.zeros((48, 64), np.uint8)
    times = ((0.0, THIN), (0.1, THIN), (0.2, OWN))
    found = [second.on(own, image, Horizon(23.5, 1.0), math.inf, time, 0) for time, own in times]
    assert len(looks) == 2
    assert found[1].visibility_interval[1] == math.inf
    assert found[2].visibility_interval[1] < 150.0
