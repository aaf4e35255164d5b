"""What confirms an estimate by the road's brightness, and what speaks against it."""

import math
from dataclasses import replace

import numpy as np
import pytest

from fogsim.values import Camera, Estimate, LeadMeasurement
from fogsim.vision.day import confirmation
from fogsim.vision.day.day_fit import free_road
from fogsim.vision.day.far_objects import STANDS_OUT
from fogsim.vision.day.row_data import near_horizon
from fogsim.vision.day.second_opinion import DISAGREE, DayVerdict
from fogsim.vision.lines.horizon import Horizon

CAMERA = Camera(64, 48, 60.0, (31.5, 23.5), 1.3)
SCALE = 0.05
IMAGE = np.zeros((48, 64), np.uint8)
OWN = Estimate("zhu2015", 0.03, 0.0015, diagnostics={"frames": 1})
NO_FOG = Estimate("zhu2015", 0.0, 1e-4)
FOG = DayVerdict(0.031, 0.002, 0.031, (88.0, 108.0), "", True, True, True, 0.0, 0.0, 0.0)
CLEAR = replace(FOG, extinction=0.001, deviation=0.0006, median=0.0005, interval=(1500.0, math.inf), shows_fog=False)
SILENT = replace(FOG, reason="the sky above the road is hidden", shows_fog=False)


@pytest.fixture
def looked(monkeypatch):
    """Function from what the day model finds, and whether something stands out, to a confirmation and its looks."""

    def confirming(day, far=False):
        looks = []
        monkeypatch.setattr(confirmation, "fit_free_road", lambda *arguments: looks.append(arguments))
        monkeypatch.setattr(confirmation, "verdict_of", lambda *_: day)
        monkeypatch.setattr(confirmation, "stands_out", lambda *_: far)
        return confirmation.Confirmation(CAMERA, Horizon(23.5, 1.0), SCALE), looks

    return confirming


def once(looked, own, day, far=False):
    return looked(day, far)[0].of(own, IMAGE, math.inf, 0.0)


def test_fog_that_shows_in_both_counts_with_what_camera_and_models_leave_open(looked):
    found = once(looked, OWN, FOG)
    assert found.extinction == OWN.extinction
    least = math.hypot(OWN.standard_deviation, SCALE * OWN.extinction)
    assert least < found.standard_deviation < math.hypot(least, 1.1 * confirmation.MODEL_DEVIATION * OWN.extinction)
    assert SCALE <= found.common_deviation < 0.2
    denser = replace(FOG, extinction=0.04, deviation=0.003, median=0.04, interval=(67.0, 86.0))
    low, high = once(looked, OWN, denser).visibility_interval
    assert low < 75.0
    assert high > 110.0


def test_clear_air_is_claimed_only_as_far_as_rows_are_surely_below_the_horizon(looked):
    assert once(looked, NO_FOG, CLEAR, far=True).reach == pytest.approx(60.0 * 1.3 / near_horizon(1.0))
    assert once(looked, OWN, FOG).reach == math.inf


@pytest.mark.parametrize("own", [OWN, NO_FOG])
def test_a_day_model_with_other_fog_or_without_any_refuses(looked, own):
    other = replace(FOG, extinction=0.2, deviation=0.01, median=0.2, interval=(14.0, 16.0))
    assert once(looked, own, other).diagnostics["reason"] == DISAGREE
    reasons = {once(looked, own, SILENT).diagnostics["reason"], once(looked, OWN, CLEAR).diagnostics["reason"]}
    assert reasons == {confirmation.UNCONFIRMED if own is OWN else confirmation.NOT_CLEAR, confirmation.UNCONFIRMED}


def test_clear_air_needs_contrast_far_away(looked):
    # The day model's road shows it from 1500 m on, and things at the horizon that fog of 1000 m would hide.
    assert once(looked, NO_FOG, CLEAR).visibility_interval == (pytest.approx(1500.0, rel=0.02), math.inf)
    assert once(looked, NO_FOG, SILENT, far=True).visibility_interval == (pytest.approx(1000.0), math.inf)
    assert once(looked, replace(NO_FOG, standard_deviation=0.5), FOG).diagnostics["reason"] == DISAGREE


def test_what_stands_out_refuses_fog(looked):
    found = once(looked, OWN, FOG, far=True)
    assert found.diagnostics == {"reason": STANDS_OUT, "frames": 1}
    assert confirmation.without_far_objects(OWN, IMAGE, CAMERA, Horizon(23.5, 1.0)).diagnostics["reason"] == STANDS_OUT
    assert confirmation.without_far_objects(NO_FOG, IMAGE, CAMERA, Horizon(23.5, 1.0)) is NO_FOG


def test_in_a_drive_it_looks_from_time_to_time_and_where_the_estimate_changes(looked):
    confirms, looks = looked(FOG)
    for time in (0.0, 0.1, confirmation.PERIOD - 0.1, confirmation.PERIOD + 0.1):
        confirms.of(OWN, IMAGE, math.inf, time)
    assert len(looks) == 2
    assert not confirms.of(replace(OWN, extinction=0.3), IMAGE, math.inf, confirmation.PERIOD + 0.2).valid
    assert len(looks) == 3
    refuses, looks = looked(SILENT)
    for time in (0.0, 0.5 * confirmation.SOON, 1.5 * confirmation.SOON):
        assert not refuses.of(OWN, IMAGE, math.inf, time).valid
    assert len(looks) == 2


def test_fog_that_changes_along_the_way_widens_the_interval_for_some_seconds(looked):
    confirms, _ = looked(FOG)

    def relative(time, extinction):
        found = confirms.of(replace(OWN, extinction=extinction), IMAGE, math.inf, time)
        return found.standard_deviation / found.extinction

    even, changed = relative(0.0, 0.03), relative(1.0, 0.034)
    assert changed > 1.05 * even
    assert relative(12.0, 0.034) < changed
    confirms.reset()
    assert relative(0.0, 0.03) == even


def test_a_refusal_of_the_method_stays(looked):
    refusal = Estimate.invalid("zhu2015", "no road is seen")
    confirms, looks = looked(FOG)
    assert confirms.of(refusal, IMAGE, math.inf, 0.0) is refusal
    assert looks == []


def test_a_tracked_vehicle_ends_the_free_road():
    assert free_road(None) == free_road(LeadMeasurement(math.inf, 0.0)) == math.inf
    assert free_road(LeadMeasurement(25.0, 0.0)) == pytest.approx(25.0, abs=1.0)
