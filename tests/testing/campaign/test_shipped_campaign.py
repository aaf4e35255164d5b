"""The campaign that comes with FogSim passes the reference brake, and finds ten broken ones."""

import shutil
from pathlib import Path

import broken_brakes
import pytest

from fogsim.scenario import catalogue
from fogsim.testing.campaign.running import load_campaign, run_campaign
from fogsim.testing.execution import ThisProcess

SHIPPED = catalogue()["emergency_brake_in_fog"]
NAMES = [one.__name__ for one in broken_brakes.BROKEN]


def failures(folder: Path, controller: str, budget: int) -> int:
    shutil.copy(SHIPPED, folder / "scenario.yaml")
    shutil.copy(broken_brakes.__file__, folder)
    campaign = load_campaign(folder, [f"sut.controller={controller}"], budget=budget)
    found = run_campaign(campaign, folder / "out", ThisProcess())
    assert len(found.results) == budget
    assert not [one.message for one in found.results if one.message]
    return sum(one.has_failed for one in found.results)


@pytest.mark.nightly
def test_the_reference_passes(tmp_path: Path) -> None:
    assert failures(tmp_path, "emergency_brake", 96) == 0


@pytest.mark.nightly
@pytest.mark.parametrize("name", NAMES)
def test_a_broken_brake_is_found(tmp_path: Path, name: str) -> None:
    assert failures(tmp_path, f"'broken_brakes:{name}'", 32) > 0
