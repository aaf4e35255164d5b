"""On networks that FogSim did not write drivers in clear air are SUMO's own, bit for bit, and runs in fog end well."""

import json
import subprocess
import sys
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


@pytest.mark.nightly
def test_a_town_with_everything_in_it_is_built_and_runs_to_its_end() -> None:
    program = PROGRAM.with_name("foreign_networks.py")
    small = ["--blocks", "4", "--per-hour", "900", "--seconds", "120", "--renderer", "none"]
    done = subprocess.run(
        [sys.executable, program, "--json", *small], capture_output=True, text=True, timeout=280, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    files, alone, run = json.loads(done.stdout)
    assert files["lanes"] == 2 * 24 * 3 + 2  # both ways of 24 streets with two lanes and a footway; two tracks
    assert alone["run"] == "SUMO alone"
    # Who departs first drives through the whole town; taxis wait and cars park beside its way.
    assert (run["ego"], run["ending"], run["simulated_s"]) == ("tour", "time", pytest.approx(120.0, abs=1.0))
    assert run["most_off_lanes"] >= 2
