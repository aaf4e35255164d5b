"""The docs say what the code says, and hang together: tables, links, and the files and names that they speak of."""

import re
from collections.abc import Iterator
from pathlib import Path
from pkgutil import resolve_name

import gymnasium
import pytest

import fogsim_envs  # noqa: F401 - registers the environments
from fogsim_envs.corridor import FogCorridorEnv
from tests.helpers.command import run_script

CHECKOUT = Path(__file__).resolve().parents[2]
PAGES = [
    *(CHECKOUT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")),
    *sorted((CHECKOUT / "docs").glob("**/*.md")),
    *sorted((CHECKOUT / "scenarios").glob("*/README.md")),
]


def prose(page: Path) -> str:
    """Text of a page without its fenced blocks."""
    return re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)


def anchors(page: Path) -> set[str]:
    """Anchors that GitHub makes of a page's headings."""
    titles = re.findall(r"^#+ (.+)$", prose(page), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).strip().replace(" ", "-") for title in titles}


def tables(text: str) -> Iterator[list[str]]:
    """Rows of each table: a table ends at an empty line, and only there."""
    for paragraph in re.split(r"\n\s*\n", text):
        lines = paragraph.splitlines()
        first = next((number for number, line in enumerate(lines) if line.startswith("|")), None)
        if first is not None:
            yield lines[first:]


def cells(row: str) -> int:
    """How many cells a row has; a pipe parts them in code too, unless a backslash stands before it."""
    assert row.startswith("|"), f"a row that is broken in two: {row!r}"
    assert re.search(r"(?<!\\)\|$", row.rstrip()), f"a row that does not end: {row!r}"
    return len(re.findall(r"(?<!\\)\|", row)) - 1


@pytest.mark.parametrize(
    "command",
    [("make_tables.py",), pytest.param(("make_measured_tables.py", "excerpt", "night"), marks=pytest.mark.nightly)],
)
def test_tables_are_up_to_date(command: tuple[str, ...]) -> None:
    script, *names = command
    done = run_script(CHECKOUT / "docs" / script, "--check", *names)
    assert done.returncode == 0, done.stdout + done.stderr


def test_rows_of_a_table_have_the_same_cells() -> None:
    for page in PAGES:
        for heading, rule, *rows in tables(prose(page)):
            assert re.fullmatch(r"\|( ?:?-+:? ?\|)+", rule), (page, rule)
            assert {row: cells(row) for row in (rule, *rows) if cells(row) != cells(heading)} == {}, page


def test_pipes_and_broken_rows_are_found() -> None:
    assert cells(r"| a | \|V\| | `x \| y` |") == 3
    assert cells("| a | |V| | b |") == 5
    (rows,) = tables("text\n| a | b |\n|---|---|\n| 1 | below\nlamps |\n\nmore text\n")
    with pytest.raises(AssertionError, match=r"broken in two|does not end"):
        [cells(row) for row in rows]


def named(pattern: str) -> Iterator[tuple[Path, str]]:
    """What a pattern finds in the text of each page."""
    for page in PAGES:
        yield from ((page, found) for found in re.findall(pattern, prose(page)))


def test_links_lead_somewhere() -> None:
    for page, link in named(r"\]\(([^)\s]+)\)"):
        if "://" in link:
            continue
        target, _, anchor = link.partition("#")
        file = page.parent / target if target else page
        assert file.exists(), (page, link)
        if anchor:
            assert anchor in anchors(file), (page, link)


def test_files_that_are_named_exist() -> None:
    """What stands as code and begins like a path of the repository is one, seen from its root."""
    ids = {*gymnasium.registry, FogCorridorEnv.metadata["name"]}
    for page, name in named(r"`(?:python )?((?:benchmarks|docs|envs|fogsim|tests|tools)/[\w./-]+)"):
        assert name in ids or (CHECKOUT / name).exists(), (page, name)


def test_names_of_the_package_exist() -> None:
    for _, name in named(r"`((?:fogsim|fogsim_envs)(?:\.\w+)+)\b"):
        # Types of signs begin likewise, and are data.
        if not name.startswith("fogsim.sign") and name != "fogsim.complete":
            resolve_name(name)
