"""Coverage by measured values: of steps made by hand, and of a campaign, the same however it was run."""

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from drawn_scenario import SCENARIO as DRAWN

from fogsim.cli.campaign import _report
from fogsim.conditions import SIGNALS, Finding, FindingVerdict
from fogsim.errors import FogSimError, MissingDependencyError
from fogsim.scenario import Scenario
from fogsim.testing.campaign.running import Campaign, load_campaign, run_campaign
from fogsim.testing.execution import CoverageCheck, ThisProcess
from fogsim.testing.odd.coverage_watch import CoverageWatch, write_coverage
from fogsim.testing.odd.odd_file import read_odd
from fogsim.testing.results import finding_to_json
from fogsim.units import extinction_from_visibility
from fogsim.values import Step
from tests.helpers.command import run_python
from tests.recorders.synthetic import make_step

SCENARIO = DRAWN.replace("{lognormal: [100 m, 1], at_least: 20 m, at_most: 1000 m}", "{uniform: [50 m, 1500 m]}")


def at(second: int, visibility: float, speed: float, x: float) -> Step:
    step = make_step(speed=speed)
    position = step.traffic.position.copy()
    position[step.ego] = (x, 0.0, 0.0)
    truth = replace(step.truth, extinction=extinction_from_visibility(visibility))
    return replace(step, time=float(second), traffic=replace(step.traffic, position=position), truth=truth)


def test_seconds_and_metres_of_steps_made_by_hand() -> None:
    watch = CoverageWatch(read_odd("fog"))
    # The first step begins the first period; each further one ends one. 120 km/h in the last is 33.33 m/s.
    for step in (
        at(0, 40.0, 20.0, 0.0),
        at(1, 40.0, 20.0, 20.0),
        at(2, 50.0, 25.0, 45.0),
        at(3, 2000.0, 25.0, 70.0),
        at(4, 80.0, 120.0 / 3.6, 100.0),
    ):
        watch.update(step)
    failed = Finding("safe", "always", FindingVerdict.FAILED, "", "", 2.0, 45.0, "", None)
    document = watch.document("by hand", [failed])
    items = {one["attribute"]: one for one in document["items"] if "attribute" in one}
    assert items["environment.visibility"]["seconds"] == {
        "[0, 50)": 1.0,
        "[50, 100)": 2.0,
        "[100, 200)": 0.0,
        "[200, 500)": 0.0,
        "[500, 1000]": 0.0,
    }
    assert items["environment.visibility"]["out_of_range"] == {"<above>": 1}
    assert items["dynamic.speed"]["meters"] == {
        "[0, 30)": 0.0,
        "[30, 60)": 0.0,
        "[60, 80)": 20.0,
        "[80, 100)": 50.0,
        "[100, 130]": 30.0,
    }
    assert document["odd"]["seconds"] == {"inside": 3.0, "assumed": 0.0, "outside": 1.0}
    assert document["outcome"]["failed_cell"][0] == "[50, 100)"
    assert document["odd"]["samples"]["rows"][0][:3] == [1.0, 0.0, pytest.approx(20.0 / 111_319.5, rel=1e-3)]


def test_a_signal_that_raises_is_an_error_with_file_and_key(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(_: object) -> float:
        raise ZeroDivisionError("by hand")

    monkeypatch.setitem(SIGNALS._entries, "light", replace(SIGNALS["light"], value=broken))
    watch = CoverageWatch(read_odd("fog"))
    with pytest.raises(FogSimError, match=r"fog\.odd\.yaml: probes\.environment\.illumination\.signal: ZeroDivision"):
        watch.update(at(0, 40.0, 20.0, 0.0))


class Interrupted(ThisProcess):
    """An engine that runs the last cases first, and stops after some of them."""

    __slots__ = ("left",)

    def run(self, runs, folder, watch) -> None:
        object.__setattr__(self, "left", 5)
        for run in reversed(runs):
            if not self.left:
                raise KeyboardInterrupt
            object.__setattr__(self, "left", self.left - 1)
            super().run([run], folder, watch)


def covered(campaign: Campaign, out: Path, engine: ThisProcess) -> tuple[list[str], dict[str, bytes]]:
    found = run_campaign(campaign, out, engine)
    summary, _ = write_coverage(out, campaign.odd, [one.run for one in found.results])
    files = [out / "coverage.json", out / "coverage.html", *sorted((out / "coverage").iterdir())]
    return summary, {str(file.relative_to(out)): file.read_bytes() for file in files}


def test_a_campaign_and_the_same_one_resumed(tmp_path: Path) -> None:
    (tmp_path / "drawn.fog.yaml").write_text(SCENARIO)
    campaign = load_campaign(tmp_path / "drawn.fog.yaml", budget=16, odd="fog")
    check = CoverageCheck(campaign.odd)
    summary, whole = covered(campaign, tmp_path / "a", ThisProcess(check))
    for _ in range(3):
        with pytest.raises(KeyboardInterrupt):
            covered(campaign, tmp_path / "b", Interrupted(check))
    assert covered(campaign, tmp_path / "b", Interrupted(check)) == (summary, whole)

    # Each case lasts 1 s in even fog.
    merged = json.loads(whole["coverage.json"])
    visibility = next(one for one in merged["groups"]["odd"]["entries"] if one["name"] == "odd.environment.visibility")
    results = [json.loads(one.read_text()) for one in (tmp_path / "a" / "results").glob("*.json")]
    drawn = [one["coverage"]["odd"]["samples"]["rows"][0][3] for one in results]
    counts, _ = np.histogram(drawn, [0, 50, 100, 200, 500, 1000])
    assert [bucket["seconds"] for bucket in visibility["buckets"]] == counts.tolist()
    outside = sum(one > 1000.0 for one in drawn)
    assert 0 < outside < 16
    assert f"{16 - outside} s inside, {outside} s outside" in summary[0]
    assert any(line.startswith("  hole: environment.illumination: [0, 1), [1, 1000) lx") for line in summary)
    table = whole["coverage/case_00003_cod.csv"].decode().splitlines()
    assert len(table) == 11
    assert table[1].startswith("1970-01-01 00:00:00.100,")
    assert "environment.visibility;m" in table[0]


def passes(_: Scenario, __: int, ___: Path) -> dict[str, Any]:
    """Work that decides each case without running it."""
    finding = Finding("safe", "always", FindingVerdict.PASSED, "", "", None, None, "", 1.0)
    outcome = {"findings": [finding_to_json(finding)], "metrics": {"minimum_gap_m": 2.0}, "ending": None}
    return {"status": "complete", **outcome, "duration_s": 0.1}


def test_results_without_this_coverage_do_not_count(tmp_path: Path) -> None:
    (tmp_path / "drawn.fog.yaml").write_text(SCENARIO)
    plain, with_odd = (load_campaign(tmp_path / "drawn.fog.yaml", budget=16, odd=odd) for odd in (None, "fog"))
    first, second = (run_campaign(one, tmp_path / "out", ThisProcess(passes)) for one in (plain, with_odd))
    assert {one.run.key for one in first.results}.isdisjoint(one.run.key for one in second.results)
    (tmp_path / "out" / "coverage.json").write_text("an earlier call's")
    summary, _ = write_coverage(tmp_path / "out", with_odd.odd, [one.run for one in second.results])
    assert summary == ["ODD fog: no coverage, all runs ended with errors"]
    assert not (tmp_path / "out" / "coverage.json").exists()
    for name in ("coverage.json", "coverage.html", "coverage/case_00000_cod.csv"):
        (tmp_path / "out" / name).write_text("an earlier campaign's")
    _report(plain, first, None, (), tmp_path / "out", None)
    assert not list((tmp_path / "out").glob("coverage*"))


def test_without_the_extra_a_campaign_with_an_odd_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "openodd", None)
    (tmp_path / "drawn.fog.yaml").write_text(SCENARIO)
    load_campaign(tmp_path / "drawn.fog.yaml", budget=16)
    with pytest.raises(MissingDependencyError, match=r"fogsim\[odd\]"):
        load_campaign(tmp_path / "drawn.fog.yaml", budget=16, odd="fog")


@pytest.mark.nightly
def test_the_command_writes_the_same_with_any_number_of_processes(tmp_path: Path) -> None:
    (tmp_path / "drawn.fog.yaml").write_text(SCENARIO)
    written = []
    for processes in ("1", "2"):
        line = ["campaign", "drawn.fog.yaml", "--budget", "16", "--odd", "fog", "-j", processes, "--out", processes]
        done = run_python("-m", "fogsim", *line, cwd=tmp_path)
        assert "hole: environment.illumination" in done.stdout
        out = tmp_path / processes
        files = [out / "coverage.json", out / "coverage.html", *sorted((out / "coverage").iterdir())]
        written.append({str(file.relative_to(out)): file.read_bytes() for file in files})
    assert written[0] == written[1]
    assert len(written[0]) == 2 + 4 * 16
