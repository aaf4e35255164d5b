"""On networks that FogSim did not write drivers in clear air are SUMO's own, bit for bit, and runs in fog end well."""

import json
from pathlib import Path

import pytest

from tests.helpers.command import run_script

PROGRAM = Path(__file__).resolve().parents[2] / "benchmarks" / "networks.py"
RUNS = ["SUMO alone", "inf m", "30 m"]


# The trains' network is large.
@pytest.mark.parametrize(
    "networks",
    [("left_hand", "roundabout"), pytest.param(("grid", "spider", "random", "rail"), marks=pytest.mark.nightly)],
)
def test_clear_air_changes_nothing_and_fog_only_trains_nothing(networks: tuple[str, ...]) -> None:
    arguments = ["--json", "--seconds", "40", "--step", "1", "--visibilities", "inf", "30", "--networks", *networks]
    done = run_script(PROGRAM, *arguments, "--one-process")
    assert done.returncode == 0, done.stdout + done.stderr
    records = json.loads(done.stdout)
    for name in networks:
        rows = {row["run"]: row for row in records if row["network"] == name}
        assert list(rows) == RUNS
        assert rows["SUMO alone"]["vehicles"] >= 3
        assert rows["inf m"]["same"]
        # Trains go by their signals; elsewhere a comparison without a difference in dense fog would compare nothing.
        assert rows["30 m"]["same"] is (name == "rail")
