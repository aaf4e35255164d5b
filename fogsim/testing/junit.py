"""Test results for CI servers: annotations of GitHub, and JUnit XML with a suite for each file, a case for each clause.

By the schema of Jenkins' xUnit plugin (junit-10.xsd), which GitLab and GitHub's actions read too. Inconclusive clauses
are failures, since those servers treat skipped tests as passed.
"""

import platform
import re
from collections.abc import Container, Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from xml.etree import ElementTree as ET

from fogsim.core.files.atomic import write_text
from fogsim.scenario import Scenario
from fogsim.testing.collection import label_of
from fogsim.testing.judgement import Judgement, Outcome
from fogsim.testing.page import broken_text, case_lines, command_text, judgement_text
from fogsim.testing.results import CaseResult
from fogsim.testing.session import FileOutcome

_NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that XML 1.0 cannot hold."""


def write_junit(path: Path, outcomes: Sequence[FileOutcome], settings: Sequence[str] = ()) -> None:
    """Write the results of tests; `settings` are from ``--set``, for the commands that run a case again."""
    now = datetime.now(UTC).isoformat(timespec="seconds")
    suites = [_suite(one, settings, now) for one in outcomes]
    counted = {key: str(sum(int(one.attrib[key]) for one in suites)) for key in ("tests", "failures", "errors")}
    seconds = _seconds(sum(one.duration for one in outcomes))
    root = ET.Element("testsuites", {"name": "fogsim", "time": seconds, **counted})
    root.extend(suites)
    ET.indent(root)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n')


def _suite(outcome: FileOutcome, settings: Sequence[str], now: str) -> ET.Element:
    outcomes = [one.outcome for one in outcome.judgements]
    suite = ET.Element(
        "testsuite",
        name=xml_text(outcome.test.name),
        tests=str(len(outcomes) + bool(outcome.broken)),
        failures=str(sum(one is not Outcome.PASSED for one in outcomes)),
        errors=str(int(bool(outcome.broken))),
        skipped="0",
        time=_seconds(outcome.duration),
        timestamp=now,
        hostname=platform.node(),
        file=xml_text(str(outcome.test.path)),
    )
    suite.extend([_clause(outcome, one, settings) for one in outcome.judgements])
    if outcome.broken:
        suite.append(_broken(outcome, outcome.broken, settings))
    return suite


def _clause(outcome: FileOutcome, judgement: Judgement, settings: Sequence[str]) -> ET.Element:
    # The runs are those of all clauses: each has its share of their time.
    share = outcome.duration / (len(outcome.judgements) + bool(outcome.broken))
    case = _case(outcome, judgement.title, share)
    add_requirements(case, judgement.run.scenario, [judgement.name])
    text = judgement_text(judgement)
    if judgement.outcome is not Outcome.PASSED:
        failure = ET.SubElement(case, "failure", type=str(judgement.outcome), message=xml_text(text))
        where = outcome.test.lines[judgement.name]
        failure.text = xml_text(f"{where}\n{text}\n{command_text(outcome.test, judgement.run, settings)}\n")
    lines = case_lines(outcome, judgement)
    if lines:
        ET.SubElement(case, "system-out").text = xml_text("\n".join(lines) + "\n")
    return case


def _broken(outcome: FileOutcome, broken: Sequence[CaseResult], settings: Sequence[str]) -> ET.Element:
    case = _case(outcome, "run", outcome.duration / (len(outcome.judgements) + 1))
    text = broken_text(broken)
    error = ET.SubElement(case, "error", type="error", message=xml_text(text))
    error.text = xml_text(f"{outcome.test.path}\n{text}\n{command_text(outcome.test, broken[0].run, settings)}\n")
    if len(outcome.results) > 1:
        listed = "".join(f"{label_of(one.run)}: {one.message}\n" for one in broken)
        ET.SubElement(case, "system-out").text = xml_text(listed)
    return case


def _case(outcome: FileOutcome, name: str, seconds: float) -> ET.Element:
    attributes = {"classname": xml_text(str(outcome.test.path)), "name": xml_text(name), "time": _seconds(seconds)}
    return ET.Element("testcase", attributes)


def add_requirements(case: ET.Element, scenario: Scenario, names: Container[str]) -> None:
    """Add the requirements of expectations as properties, as pytest writes its own and Jenkins and Xray read them."""
    expected = [one for name, one in scenario.expect.items() if name in names]
    ids = dict.fromkeys(one for expectation in expected for one in expectation.requirement)
    if ids:
        properties = ET.SubElement(case, "properties")
        for one in ids:
            ET.SubElement(properties, "property", name="requirement", value=xml_text(one))


def xml_text(text: str) -> str:
    """A text without characters that XML cannot hold."""
    return _NO_XML.sub(lambda found: f"\\x{ord(found[0]):02x}", text)


def _seconds(seconds: float) -> str:
    return f"{seconds:.3f}"


def annotations(outcomes: Sequence[FileOutcome], settings: Sequence[str] = ()) -> Iterator[str]:
    """A CI annotation for each clause that did not pass and each file with failed runs, with ``--set`` settings."""
    for one in outcomes:
        for judgement in one.judgements:
            if judgement.outcome is not Outcome.PASSED:
                message = f"{judgement_text(judgement)}\n{command_text(one.test, judgement.run, settings)}"
                title = f"{judgement.title}: {judgement.outcome}"
                yield _command(one.test.lines[judgement.name], title, message)
        if one.broken:
            message = f"{broken_text(one.broken)}\n{command_text(one.test, one.broken[0].run, settings)}"
            yield _command(str(one.test.path), f"{one.test.name}: error", message)


def _command(where: str, title: str, message: str) -> str:
    file, _, line = where.rpartition(":")
    placed = f"file={_property(file)},line={line}" if line.isdecimal() else f"file={_property(where)}"
    return f"::error {placed},title={_property(title)}::{_data(message)}"


def _data(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _property(text: str) -> str:
    return _data(text).replace(":", "%3A").replace(",", "%2C")
