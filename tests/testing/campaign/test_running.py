"""A campaign's cases and files: resumed, with any engine, and what is refused."""

import csv
import re
import shutil
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from drawn_scenario import SCENARIO

from fogsim.conditions import Finding, FindingVerdict
from fogsim.core.files.atomic import write_json
from fogsim.errors import InputError
from fogsim.scenario import load_scenario
from fogsim.scenario.loading import load_cases
from fogsim.study.execution import result_file
from fogsim.testing.campaign.comparison import changes, changes_text
from fogsim.testing.campaign.drawing_plan import Findings
from fogsim.testing.campaign.outputs import rate_text, write_campaign_junit, write_cases, write_report
from fogsim.testing.campaign.running import Campaign, load_campaign, run_campaign, smallest_failing
from fogsim.testing.results import finding_to_json
from tests.helpers.command import run_python


class Closed:
    """An engine that decides each case in closed form, and ends after some of them."""

    def __init__(self, most: int = 1000, reverse: bool = False, passes_below: float = 0.0) -> None:
        self.left, self.reverse, self.passes_below = most, reverse, passes_below

    def run(self, runs, folder, watch) -> None:
        for run in reversed(runs) if self.reverse else runs:
            if not self.left:
                raise KeyboardInterrupt
            self.left -= 1
            margin = run.scenario.fog.visibility_m / 200.0 - run.scenario.actors["ego"].speed_kmh / 100.0
            margin = 1.0 if run.scenario.fog.visibility_m < self.passes_below else margin
            verdict = FindingVerdict.PASSED if margin > 0.0 else FindingVerdict.FAILED
            finding = Finding("safe", "always", verdict, "fast", f"margin {margin:.3f}", None, None, "", margin)
            told = {"findings": [finding_to_json(finding)], "metrics": {"minimum_gap_m": 2.0}, "ending": None}
            write_json(result_file(folder, run), {"status": "complete", **told, "duration_s": 0.1})
            watch(run, None)


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    (file := tmp_path_factory.mktemp("campaign") / "drawn.fog.yaml").write_text(SCENARIO)
    return load_campaign(file, budget=40)


@pytest.fixture(scope="module")
def found(campaign: Campaign) -> Findings:
    """What it found without interruption, in the folder of its file."""
    return run_campaign(campaign, campaign.file.parent / "out", Closed())


def files(campaign: Campaign, found: Findings, folder: Path) -> dict[str, bytes]:
    write_cases(folder / "cases.csv", campaign, found)
    write_report(folder / "report.html", campaign, found, [])
    write_campaign_junit(folder / "junit.xml", campaign, found, [])
    return {name: (folder / name).read_bytes() for name in ("cases.csv", "report.html", "junit.xml")}


def test_resumed_and_in_any_order_the_files_are_the_same(campaign: Campaign, found: Findings, tmp_path: Path) -> None:
    whole = files(campaign, found, tmp_path)
    assert b"<p>Cases: 16 to fill the space" in whole["report.html"]
    for most in (5, 33):
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
    assert {one.attrib["value"] for one in cases[0].findall("properties/property")} == {"SYS-1", "SYS 2"}
    assert {"failed", "passed"} == {row["verdict"] for row in rows}
    page = whole["report.html"].decode()
    assert page.index("<img") < page.index("declared distribution")
    assert "no failure rate" in rate_text(resumed)


def test_a_failed_run_is_repeated_when_resumed(campaign: Campaign, found: Findings, tmp_path: Path) -> None:
    shutil.copytree(campaign.file.parent / "out", tmp_path / "out")
    first = result_file(tmp_path / "out" / "results", found.results[0].run)
    write_json(first, {"status": "failed", "message": "killed"})
    resumed = run_campaign(campaign, tmp_path / "out", Closed(1))
    assert [one.message for one in resumed.results] == [None] * 40


def test_the_command_of_a_failure_runs_the_same_case(campaign: Campaign, found: Findings, tmp_path: Path) -> None:
    write_campaign_junit(tmp_path / "junit.xml", campaign, found, [])
    failed = next(one for one in found.results if one.has_failed)
    label = re.search(r"--case '([^']+)'", (tmp_path / "junit.xml").read_text())
    ((case, scenario),) = load_cases(campaign.file, wanted=label[1], is_test=True).cases
    assert (case.seed, scenario) == (failed.run.seed, failed.run.scenario)


def test_the_same_cases_before_and_after(campaign: Campaign, found: Findings, tmp_path: Path) -> None:
    """What changed is found: here each case below 100 m, which the engine no longer lets fail."""
    before = found
    write_cases(tmp_path / "cases.csv", campaign, before)
    again = load_campaign(campaign.file, ["light.illuminance_lx=20000"], against=tmp_path)
    after = run_campaign(again, tmp_path / "b", Closed(passes_below=100.0))
    assert [one.values for one in after.drawn] == [one.values for one in before.drawn]
    assert [one.run.seed for one in after.results] == [one.run.seed for one in before.results]
    failed = [one.run.levels for one in before.results if one.has_failed]
    mended = [levels for levels in failed if float(levels["fog"].removesuffix(" m")) < 100.0]
    assert [one.result.run.levels for one in changes(again.earlier, after)] == mended
    assert changes_text(again.earlier, after) == f"{len(mended)} of 40 cases changed: {len(mended)} failed → passed"
    content = files(again, after, tmp_path / "b")
    rows = list(csv.DictReader(content["cases.csv"].decode().splitlines()))
    assert sum(row["verdict"] != row["verdict_before"] for row in rows) == len(mended)
    assert f"<h2>Before and after</h2>\n<p>{len(mended)} of 40 cases changed" in content["report.html"].decode()
    assert load_campaign(campaign.file, against=tmp_path / "b").earlier[0].verdict == rows[0]["verdict"]


def test_what_is_no_earlier_campaign(campaign: Campaign, tmp_path: Path) -> None:
    for table, message in [
        (None, "no cases.csv of a campaign is there"),
        ("case,purpose,fog [m],seed,verdict\n", "expected the columns case, purpose, fog \\[m\\], speed"),
        ("case,purpose,fog [m],speed [km/h],seed,verdict\n", "has no case"),
        ("case,purpose,fog [m],speed [km/h],seed,verdict\n0,space,x,1,2,passed\n", "cases.csv:2: expected a case"),
        ("case,purpose,fog [m],speed [km/h],seed,verdict\n0,space,nan,1,2,passed\n", "cases.csv:2: expected a case"),
        ("case,purpose,fog [m],speed [km/h],seed,verdict\n0,space,90,1,2,pass\n", "cases.csv:2: expected a case"),
        ('case,"' + "x" * 200_000, "cases.csv:1: not a table"),
        ("", "expected the columns"),
    ]:
        if table is not None:
            (tmp_path / "cases.csv").write_text(table)
        with pytest.raises(InputError, match=message):
            load_campaign(campaign.file, against=tmp_path)


def test_messages_of_errors_do_not_break_an_earlier_table(campaign: Campaign, tmp_path: Path) -> None:
    header = "case,purpose,fog [m],speed [km/h],seed,verdict,message\n"
    (tmp_path / "cases.csv").write_text(f'{header}0,space,90,60,2,error,"a\nb"\n1,space,95,60,3,error,a\x0cb\u2028c\n')
    earlier = load_campaign(campaign.file, against=tmp_path).earlier
    assert [(one.seed, one.verdict) for one in earlier] == [(2, "error"), (3, "error")]


def test_seeds_of_earlier_cases_are_not_dropped(campaign: Campaign, found: Findings, tmp_path: Path) -> None:
    write_cases(tmp_path / "cases.csv", campaign, found)
    (tmp_path / "drawn.fog.yaml").write_text(SCENARIO.replace("  run: seeds\n", ""))
    with pytest.raises(InputError, match="its cases have seeds, and space has none"):
        load_campaign(tmp_path / "drawn.fog.yaml", against=tmp_path)


def test_the_smallest_failing_case_is_near_the_medians(campaign: Campaign, found: Findings, tmp_path: Path) -> None:
    """At the median speed, 85 km/h, the closed form fails below 170 m; the median fog is thicker than that."""
    smallest = smallest_failing(campaign, found, campaign.file.parent / "out", Closed())
    assert smallest.values == campaign.reader.case.levels, "the median case fails"
    clearer = load_campaign(campaign.file, ["space.fog={loguniform: [100 m, 1000 m]}"], budget=40)
    found = run_campaign(clearer, tmp_path / "b", Closed())
    smallest = smallest_failing(clearer, found, tmp_path / "b", Closed())
    fog, passing = (float(one["fog"].removesuffix(" m")) for one in (smallest.values, smallest.passes_at))
    assert (smallest.values["speed"], smallest.values["run"]) == ("85 km/h", "0")
    assert 160.0 < fog < 170.0 <= passing < 180.0
    resumed = smallest_failing(clearer, found, tmp_path / "b", Closed(0))
    assert resumed == smallest, "known results are not run again"


def test_latin_hypercube_and_seed_draw_others(campaign: Campaign, found: Findings, tmp_path: Path) -> None:
    drawn = [[one.values for one in found.drawn[:16]]]
    for options in ({"seed": 1}, {"sequencing": "latin_hypercube"}):
        other = load_campaign(campaign.file, budget=16, **options)
        others = run_campaign(other, tmp_path / str(len(drawn)), Closed())
        drawn.append([one.values for one in others.drawn])
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
        "speed=-.* km/h(.|\n)*space.speed reaches it; bound it": SCENARIO.replace(
            "uniform: [50 km/h, 120 km/h]", "normal: [50 km/h, 30 km/h]"
        ),
        "expect is missing": re.sub("expect: .*", "", SCENARIO),
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
    line = ("-m", "fogsim", "campaign", "drawn.fog.yaml", "--budget", "20", "-j", "2", "--out", "out")
    done = run_python(*line, cwd=tmp_path)
    assert "20 cases: 20 passed" in done.stdout
    assert len((tmp_path / "out" / "cases.csv").read_text().splitlines()) == 21
