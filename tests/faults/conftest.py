"""Commands that end in the middle."""

import json
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[2]


class Ended(NamedTuple):
    """Exit code (negative: a signal killed it), what was printed, and steps that the recorders had for certain."""

    code: int
    said: str
    taken: int


class Nursery:
    """Runs ``fogsim`` on drawn steps, without the time that imports take."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._number = 0
        program = [sys.executable, "-m", "tests.faults.nursery"]
        self._process = subprocess.Popen(program, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def run(
        self, *commands: Sequence[str], signals: Sequence[tuple[float, int]] = (), hold: int | None = None
    ) -> list[Ended]:
        """Run commands at once; the first gets signals, so many seconds after its start or the step it holds at."""
        attempts: list[dict[str, object]] = []
        for command in commands:
            self._number += 1
            log = str(self._folder / f"{self._number}.log")
            attempts.append({"arguments": command, "signals": [], "hold": None, "log": log})
        attempts[0] |= {"signals": signals, "hold": hold}
        self._process.stdin.write(json.dumps(attempts) + "\n")
        self._process.stdin.flush()
        codes = json.loads(self._process.stdout.readline())
        return [self._ended(code, Path(str(attempt["log"]))) for code, attempt in zip(codes, attempts, strict=True)]

    def _ended(self, code: int, log: Path) -> Ended:
        seen = log.with_suffix(".seen")
        # The file may have been cut off while it was written.
        taken = seen.read_text(encoding="utf-8") if seen.exists() else ""
        return Ended(code, log.read_text(encoding="utf-8"), int(taken or 0))


@pytest.fixture(scope="session")
def nursery(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Nursery]:
    """Process that runs commands."""
    made = Nursery(tmp_path_factory.mktemp("nursery"))
    yield made
    made._process.communicate()
