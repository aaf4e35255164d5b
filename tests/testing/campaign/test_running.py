"""A campaign's cases and files: resumed, with any engine, and what is refused."""

import csv
import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from fogsim.conditions import Finding, FindingVerdict
from fogsim.core.files.atomic import write_json
from fogsim.errors import InputError
from fogsim.scenario import load_scenario
from fogsim.study.execution import result_file
from fogsim.testing.campaign.drawing_plan import Findings
from fogsim.testing.campaign.outputs import rate_text, write_campaign_junit, write_cases, write_report
from fogsim.testing.campaign.running import Campaign, load_campaign, run_campaign
from fogsim.testing.results import finding_to_json

SCENARIO = """
name: drawn
duration: 1 s
road: {template: motorway, length: 1 km}
actors: {ego: {position: 50 m, speed: $speed}}
fog: {visibility: $fog}
renderer: none
sut: {estimators: []}
expect: {safe: {always: ego.speed > 1 km/h}}
space:
  fog: {lognormal: [100 m, 1], at_least: 20 m, at_most: 1000 m}
  speed: {uniform: [50 km/h, 120 km/h]}
  run: seeds
"""


class Closed:
    """An engine that decides each case in closed form, and ends after some of them."""

    def __init__(self, most: int = 1000, reverse: bool = False) -> None:
        self.left, self.reverse = most, reverse

    def run(self, runs, folder, watch) -> None:
        for run in reversed(runs) if self.reverse else runs:
            if not self.left:
                raise KeyboardInterrupt
            self.left -= 1
            margin = run.scenario.fog.visibility_m / 200.0 - run.scenario.actors["ego"].speed_kmh / 100.0
            verdict = FindingVerdict.PASSED if margin > 0.0 else FindingVerdict.FAILED
            finding = Finding("safe", "always", verdict, "fast", f"margin {margin:.3f}", None, None, "", margin)
            told = {"findings": [finding_to_json(finding)], "metrics": {"minimum_gap_m": 2.0}, "ending": None}
            write_json(result_file(folder, run), {"status": "complete", **told, "duration_s": 0.1})
            watch(run, None)


@pytest.fixture
def campaign(tmp_path: Path) -> Campaign:
    (tmp_path / "drawn.fog.yaml").write_text(SCENARIO)
    return load_campaign(tmp_path / "drawn.fog.yaml", budget=40)


def files(campaign: Campaign, found: Findings, folder: Path) -> dict[str, bytes]:
    write_cases(folder / "cases.csv", campaign, found)
    write_report(folder / "report.html", campaign, found, [])
    write_campaign_junit(folder / "junit.xml", campaign, found, [])
    return {name: (folder / name).read_bytes() for name in ("cases.csv", "report.html", "junit.xml")}


def test_resumed_and_in_any_order_the_files_are_the_same(campaign: Campaign, tmp_path: Path) -> None:
    whole = files(campaign, run_campaign(campaign, tmp_path / "a", Closed()), tmp_path / "a")
    for most in (5, 12, 21):
        with pytest.raises(KeyboardInterrupt):
            run_campaign(campaign, tmp_path / "b", Closed(most))
    told: list[tuple[int, int]] = []
    resumed = run_campaign(campaign, tmp_path / "b", Closed(2, reverse=True), lambda *one: told.append(one))
    assert told[-1][0] == 40
    assert files(campaign, resumed, tmp_path / "b") == whole
    rows = list(csv.DictReader(whole["cases.csv"].decode().splitlines()))
    assert [row["purpose"] for row in rows] == ["space"] * 16 + ["boundary"] * 24
    assert len({row["seed"] for row in rows}) == 40
    for row in rows:
        assert 20.0 <= float(row["fog [m]"]) <= 1000.0
        assert (row["verdict"] == "passed") == (float(row["margin"]) > 0.0)
    cases = ET.fromstring(whole["junit.xml"]).findall(".//testcase")  # noqa: S314 - written just now
    assert len(cases) == 40
    assert {"failed", "passed"} == {row["verdict"] for row in rows}
    page = whole["report.html"].decode()
    assert page.index("<img") < page.index("declared distribution")
    assert "no failure rate" in rate_text(resumed)


def test_the_command_of_a_failure_runs_the_same_case(campaign: Campaign, tmp_path: Path) -> None:
    found = run_campaign(campaign, tmp_path / "a", Closed())
    junit = files(campaign, found, tmp_path / "a")["junit.xml"].decode()
    failed = next(one for one in found.results if one.has_failed)
    label = re.search(r"--case '([^']+)'", junit)
    assert label is not None
    from fogsim.scenario.loading import load_cases

    ((case, scenario),) = load_cases(campaign.file, wanted=label[1], is_test=True).cases
    assert (case.seed, scenario) == (failed.run.seed, failed.run.scenario)


def test_latin_hypercube_and_seed_draw_others(campaign: Campaign, tmp_path: Path) -> None:
    drawn = []
    for options in ({}, {"seed": 1}, {"sequencing": "latin_hypercube"}):
        other = load_campaign(campaign.file, budget=16, **options)
        found = run_campaign(other, tmp_path / str(len(drawn)), Closed())
        drawn.append([one.values for one in found.drawn])
    assert drawn[0] != drawn[1] != drawn[2] != drawn[0]


def test_mistakes(tmp_path: Path) -> None:
    file = tmp_path / "drawn.fog.yaml"
    wrong = {
        "space is missing": (SCENARIO.partition("space:")[0].replace("$fog", "20 m").replace("$speed", "50 km/h")),
        "space.fog.loguniform: expected": SCENARIO.replace("lognormal: [100 m, 1]", "loguniform: [0 m, 1 m]"),
        "lies between its limits": SCENARIO.replace("at_least: 20 m, at_most: 1000 m", "at_least: 90 m, at_most: 80 m"),
        "space.fog: expected seeds or a distribution": SCENARIO.replace(
            "{lognormal: [100 m, 1], at_least: 20 m, at_most: 1000 m}", "[20 m]"
        ),
        "vary has fog already": SCENARIO + "vary: {fog: [20 m]}\n",
        "\\$other stands nowhere": SCENARIO + "  other: {uniform: [1, 2]}\n",
        "choose one with --case": SCENARIO.replace("renderer: none", "renderer: $drawn")
        + "vary: {drawn: [none, cpu]}\n",
        "expect is missing": SCENARIO.replace("expect: {safe: {always: ego.speed > 1 km/h}}", ""),
    }
    for message, text in wrong.items():
        file.write_text(text)
        with pytest.raises(InputError, match=message):
            load_campaign(file)
    file.write_text(SCENARIO)
    assert load_scenario(file).fog.visibility_m == pytest.approx(100.0, rel=0.1), "the median"


@pytest.mark.nightly
def test_the_command(tmp_path: Path) -> None:
    (tmp_path / "drawn.fog.yaml").write_text(SCENARIO)
    line = [sys.executable, "-m", "fogsim", "campaign", "drawn.fog.yaml", "--budget", "20", "-j", "2", "--out", "out"]
    done = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "20 cases: 20 passed" in done.stdout
    assert len((tmp_path / "out" / "cases.csv").read_text().splitlines()) == 21
