"""What came of tests, as CI servers and people read it."""

import re
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from made_up_cases import BROKEN, MadeUpEngine, complete, made_up_test

from fogsim.testing import FileOutcome, FogTest, run_tests
from fogsim.testing.artefacts import Artefacts
from fogsim.testing.junit import annotations, write_junit
from fogsim.testing.page import PageContent, write_page
from tests.recorders.test_report import Page

ALLOWED = {
    "testsuites": ({"testsuite"}, {"name", "time", "tests", "failures", "errors"}, set()),
    "testsuite": (
        {"testcase"},
        {"name", "tests", "failures", "errors", "skipped", "time", "timestamp", "hostname", "file"},
        {"name", "tests", "failures", "errors"},
    ),
    "testcase": ({"failure", "error", "system-out"}, {"name", "time", "classname"}, {"name"}),
    "failure": (set(), {"type", "message"}, set()),
    "error": (set(), {"type", "message"}, set()),
    "system-out": (set(), set(), set()),
}
"""Elements that junit-10.xsd of Jenkins' xUnit plugin allows within each, their attributes, and those they must have.

Only what is written here; ``error`` is as of its original, whose copies name it ``errors``.
"""


@pytest.fixture
def outcomes(tmp_path: Path) -> list[FileOutcome]:
    told = {
        "a0": complete("passed", "passed"),
        "a1": complete("failed", "inconclusive", reason="<never> fired \x07 & ended, 5 %"),
        "b0": complete("inconclusive"),
        "c0": complete("passed"),
        "c1": BROKEN,
    }
    tests: Sequence[FogTest] = [
        made_up_test(keys, Path(f"with, comma/{keys[0]}.fog.yaml")) for keys in (["a0", "a1"], ["b0"], ["c0", "c1"])
    ]
    return run_tests(tests, tmp_path / "out", MadeUpEngine(told))


def check_element(element: ET.Element) -> None:
    children, attributes, required = ALLOWED[element.tag]
    assert {child.tag for child in element} <= children
    assert required <= set(element.attrib) <= attributes
    if element.tag != "testcase" and "time" in element.attrib:
        assert re.fullmatch(r"[0-9]{0,3}(\.[0-9]{0,3})?", element.attrib["time"])
    for child in element:
        check_element(child)


def test_junit_is_by_the_schema(outcomes: list[FileOutcome], tmp_path: Path) -> None:
    write_junit(tmp_path / "new" / "junit.xml", outcomes)
    root = ET.parse(tmp_path / "new" / "junit.xml").getroot()  # noqa: S314 - written here
    check_element(root)
    assert root.attrib | {"time": ""} == {"name": "fogsim", "time": "", "tests": "5", "failures": "2", "errors": "1"}
    for suite in root:
        cases = list(suite)
        assert suite.attrib["tests"] == str(len(cases))
        assert suite.attrib["failures"] == str(len(suite.findall("testcase/failure")))
        assert suite.attrib["errors"] == str(len(suite.findall("testcase/error")))
        names = [(case.attrib["classname"], case.attrib["name"]) for case in cases]
        assert len(set(names)) == len(names)
        assert sum(float(case.attrib["time"]) for case in cases) == pytest.approx(float(suite.attrib["time"]), abs=0.01)
    first = root.find("testsuite/testcase/failure")
    assert first.attrib["type"] == "failed"
    assert (
        "1 of 2 cases passed; run=1: expected ego.ttc >= 1.5 s, came 1.2 s at 34.5 s, 812 m" in first.attrib["message"]
    )
    assert "with, comma/a0.fog.yaml:7\n" in first.text
    assert "fogsim test 'with, comma/a0.fog.yaml' --case run=1" in first.text
    out = root.find("testsuite/testcase/system-out")
    assert r"run=1: failed: expected" in str(out.text)
    assert r"(<never> fired \x07 & ended, 5 %)" in str(out.text)


def test_annotations_name_file_and_line_and_are_escaped(outcomes: list[FileOutcome]) -> None:
    lines = list(annotations(outcomes, ["duration_s=3"]))
    assert len(lines) == 3
    assert all(re.fullmatch(r"::error file=[^,:]+(,line=\d+)?,title=[^,:]+(%3A[^,:]+)?::.+", line) for line in lines)
    assert lines[0].startswith("::error file=with%2C comma/a0.fog.yaml,line=7,title=e0.always%3A failed::")
    assert "5 %25)%0Afogsim test" in lines[0]
    assert "--set duration_s=3" in lines[0]
    assert "SUMO has ended" in lines[2]


def test_the_page_has_what_failed_with_plot_and_video(outcomes: list[FileOutcome], tmp_path: Path) -> None:
    plot, video = tmp_path / "plot.svg", tmp_path / "video.mp4"
    plot.write_text("<svg/>")
    video.write_bytes(b"film")
    artefacts = {("a1", "e0", "always"): Artefacts(plot, video), ("b0", "e0", "always"): Artefacts(tmp_path / "none")}
    write_page(tmp_path / "page.html", PageContent(outcomes, artefacts, 4.0))
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert len(Page(text).images) == 2
    assert text.count("data:image/svg+xml") == text.count("data:video/mp4") == 1
    assert "&lt;never&gt; fired" in text
    assert "SUMO has ended &lt;here&gt;" in text
    assert "3 passed, " not in text
    assert "1 failed, 1 inconclusive, 1 error; 5 runs of 3 files in 4.0 s" in text
    assert "fogsim test &#39;with, comma/a0.fog.yaml&#39; --case run=1" in text


def test_a_large_video_is_linked_whatever_its_folder_is_called(
    outcomes: list[FileOutcome], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fogsim.testing.page._LARGEST_EMBEDDED", 3)
    (folder := tmp_path / "run #1 100%").mkdir()
    (folder / "video.mp4").write_bytes(b"film")
    artefacts = {("a1", "e0", "always"): Artefacts(None, folder / "video.mp4")}
    write_page(tmp_path / "page.html", PageContent(outcomes, artefacts, 4.0))
    assert 'src="run%20%231%20100%25/video.mp4"' in (tmp_path / "page.html").read_text(encoding="utf-8")
