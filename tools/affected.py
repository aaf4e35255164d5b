"""Tests that a change can touch: ``python tools/affected.py [REF]`` prints their paths; ``make affected`` runs them.

Files that differ from REF (default: where the branch left main) are followed to the test files that import or name
them, directly or not (`docs/code_digests.py`). Other files touch the folder of tests with the name of theirs, and all
tests that name them.
"""

import re
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "docs"))

from code_digests import Checkout  # noqa: E402 - a script of docs/

WHOLE_SUITE = {"pyproject.toml", "Makefile", "tests/conftest.py"}
"""Files that every test depends on."""

OWN_COMMAND = ("cluster", "notebooks", "portability", "pythons", "site")
"""Folders of tests that have their own command."""

CALLS_COMMANDS = re.compile(r'\bcommand\b|CliRunner|"-m", "fogsim')
"""How tests call the command line, which imports its modules late."""

READS_SOURCES = re.compile(r'CHECKOUT / "fogsim"|"--check"|Checkout\(CHECKOUT\)|Stamps\(CHECKOUT\)')
"""How tests read all modules, without importing them."""


def affected(changed: set[str], checkout: Checkout, tests: Sequence[str]) -> list[str]:
    """Those of some test files that a change of files can touch."""
    if changed & WHOLE_SUITE:
        return list(tests)
    modules = {path for path in changed if path.startswith(("fogsim/", "envs/"))}
    others = {Path(path) for path in changed - modules if not path.startswith("tests/") or not path.endswith(".py")}

    def is_affected(test: str) -> bool:
        text = (checkout.root / test).read_text(encoding="utf-8")
        entries = [test, *_conftests(test, checkout.root)]
        if CALLS_COMMANDS.search(text):
            entries.append("fogsim/cli/app.py")
        if changed & set(checkout.files(entries)) or (modules and READS_SOURCES.search(text)):
            return True
        return any(_touches(other, test.split("/")[1], text) for other in others)

    return [test for test in tests if is_affected(test)]


def _touches(changed: Path, folder: str, text: str) -> bool:
    named = changed.name in text or (changed.parts[0] == "tests" and f'"{changed.parent.name}"' in text)
    return named or folder in changed.parts[:2]


def _conftests(test: str, root: Path) -> Iterator[str]:
    """Fixtures of a test's folders, without those of the whole suite."""
    for folder in Path(test).parents[:-2]:
        if (root / folder / "conftest.py").exists():
            yield f"{folder}/conftest.py"


def _git(*arguments: str) -> list[str]:
    done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=False)  # noqa: S603, S607
    return done.stdout.split()


def main(reference: str = "") -> None:
    """Print the paths."""
    since = reference or next(iter(_git("merge-base", "HEAD", "main")), "HEAD")
    new = ("ls-files", "--others", "--exclude-standard")
    changed = {*_git("diff", "--name-only", since), *_git(*new)}
    checkout = Checkout(ROOT)
    others = (f":!tests/{folder}" for folder in OWN_COMMAND)
    tests = _git(*new, "--cached", "tests/**/test_*.py", "tests/test_*.py", *others)
    sys.stdout.writelines(f"{test}\n" for test in affected(changed, checkout, sorted(set(tests))))


if __name__ == "__main__":
    main(*sys.argv[1:2])
