"""Runs without a camera: the same traffic, and frames of darkness that nobody reads."""

from pathlib import Path

import numpy as np
import pytest
from early_motorway import EARLY

import fogsim
from fogsim.dataset import write_dataset
from fogsim.errors import InputError
from fogsim.values import Lamp
from fogsim_envs.advisory import FogAdvisoryEnv

SETTINGS = (
    EARLY,
    "advice={method: netherlands_a16, informed_by: truth}",
    "lighting={method: fog_lamp_rules, informed_by: truth}",
    *("duration_s=3", "camera.width=32", "camera.height=24", "clocks.camera_period_s=0.5", "fog.visibility_m=60"),
)
BLIND = ("renderer=none", "estimators=[]")


def test_what_needs_no_camera_happens_without_one_just_so() -> None:
    seen = list(fogsim.run(fogsim.load_scenario("motorway_fog_bank", SETTINGS), seed=2))
    unseen = list(fogsim.run(fogsim.load_scenario("motorway_fog_bank", (*SETTINGS, *BLIND)), seed=2))
    assert len(seen) == len(unseen) == 7
    for one, other in zip(seen, unseen, strict=True):
        np.testing.assert_array_equal(one.traffic.position, other.traffic.position)
        # Without a camera the driver is warned of nothing; all else is alike.
        assert other.command.warning is None
        assert (one.command.advice, one.command.lamps) == (other.command.advice, other.command.lamps)
        assert other.estimates == ()
    assert unseen[-1].command.advice.speed == pytest.approx(60 / 3.6)
    assert Lamp.REAR_FOG not in unseen[-1].command.lamps


def test_frames_are_for_estimators_and_estimators_for_frames() -> None:
    with pytest.raises(InputError, match=r"write estimators: \[\] with it"):
        fogsim.load_scenario("motorway_fog_bank", ["renderer=none"])
    with pytest.raises(InputError, match="estimators: must have at least one entry"):
        fogsim.load_scenario("motorway_fog_bank", ["estimators=[]"])
    with pytest.raises(InputError, match="informed_by"):
        fogsim.load_scenario("motorway_fog_bank", ["advice={method: none, informed_by: nobody}"])


def test_who_needs_frames_says_so(tmp_path: Path) -> None:
    scenario = fogsim.load_scenario("motorway_fog_bank", (*SETTINGS, *BLIND))
    with pytest.raises(InputError, match="a dataset needs frames, and renderer: none draws none"):
        write_dataset(scenario, tmp_path / "out", 1)
    with pytest.raises(InputError, match="the agent needs frames"):
        FogAdvisoryEnv("motorway_fog_bank", overrides=BLIND)
