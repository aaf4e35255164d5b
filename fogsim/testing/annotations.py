"""Failures as GitHub shows them next to the lines of the files: workflow commands on stdout."""

from collections.abc import Iterator, Sequence

from fogsim.testing.judgement import Outcome
from fogsim.testing.page import broken_text, command_text, judgement_text
from fogsim.testing.session import FileOutcome


def annotations(outcomes: Sequence[FileOutcome], settings: Sequence[str] = ()) -> Iterator[str]:
    """A CI annotation for each clause that did not pass and each file with failed runs, with ``--set`` settings."""
    for one in outcomes:
        for judgement in one.judgements:
            if judgement.outcome is not Outcome.PASSED:
                told = f"{judgement_text(judgement)}\n{command_text(one.test, judgement.run, settings)}"
                title = f"{judgement.title}: {judgement.outcome}"
                yield _command(one.test.lines[judgement.name], title, told)
        if one.broken:
            told = f"{broken_text(one.broken)}\n{command_text(one.test, one.broken[0].run, settings)}"
            yield _command(str(one.test.path), f"{one.test.name}: error", told)


def _command(where: str, title: str, message: str) -> str:
    file, _, line = where.rpartition(":")
    placed = f"file={_property(file)},line={line}" if line.isdecimal() else f"file={_property(where)}"
    return f"::error {placed},title={_property(title)}::{_data(message)}"


def _data(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _property(text: str) -> str:
    return _data(text).replace(":", "%3A").replace(",", "%2C")
