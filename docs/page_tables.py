"""Tables between marks of pages, ``<!-- table: NAME -->`` … ``<!-- end of … -->``, and the dated line below each."""

import contextlib
import fcntl
import hashlib
import os
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
NUMBER = r"\d+(?:\.\d+)?"
MARK = re.compile(r"<!-- table: (.+?) -->\n")
END = "<!-- end of "
LINE = "\n\n*Measured with {} <!-- measured: {} -->"


def pages(root: Path) -> list[Path]:
    """Pages that have tables."""
    return [root / "README.md", *sorted(root.glob("docs/**/*.md")), *sorted(root.glob("scenarios/*/README.md"))]


def places(root: Path) -> dict[str, Path]:
    """Page of every table, by its name."""
    return {name: page for page in pages(root) for name in MARK.findall(page.read_text(encoding="utf-8"))}


def block(text: str, name: str) -> str:
    """The text between a table's marks."""
    return _parts(text, name)[1]


def with_block(text: str, name: str, new: str) -> str:
    """A page's text with other text between a table's marks."""
    before, _, after = _parts(text, name)
    return before + new + after


@contextlib.contextmanager
def locked(root: Path) -> Iterator[None]:
    """Keep other processes from changing pages in the meantime: two commands may finish at the same moment."""
    folder = os.open(root / "docs", os.O_RDONLY)
    try:
        fcntl.flock(folder, fcntl.LOCK_EX)
        yield
    finally:
        os.close(folder)


def replace(page: Path, text: str) -> None:
    """Write a page whole or, if interrupted, not at all."""
    new = page.with_suffix(".new")
    new.write_text(text, encoding="utf-8")
    new.replace(page)


def write_table(page: str | Path, name: str, lines: Iterable[str]) -> None:
    """Put lines between a table's marks; the page's path is given from docs/."""
    path = ROOT / "docs" / page
    with locked(ROOT):
        replace(path, filled(path.read_text(encoding="utf-8"), name, lines))


def filled(text: str, name: str, lines: Iterable[str]) -> str:
    """A page's text with lines between a table's marks."""
    return with_block(text, name, "\n" + "\n".join(lines) + "\n\n")


def lines_of(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Lines of a table; each cell is put in one line, its pipes escaped."""
    cells = ([" ".join(cell.split()).replace("|", r"\|") for cell in row] for row in (headings, *rows))
    heading, *body = (f"| {' | '.join(row)} |" for row in cells)
    return [heading, "|" + " --- |" * len(headings), *body]


def with_line(text: str, name: str, origin: str) -> str:
    """A page's text with a line below a table that states when it was measured."""
    text = re.sub(rf"\n\n\*Measured with [^\n]* <!-- measured: {re.escape(name)} -->", "", text)
    before, table, after = _parts(text, name)
    end, rest = after.split("\n", 1)
    return before + table + end + LINE.format(origin, name) + "\n" + rest


def _parts(text: str, name: str) -> tuple[str, str, str]:
    mark = f"<!-- table: {name} -->\n"
    before, rest = text.split(mark, 1)
    table, _, after = rest.partition(END)
    return before + mark, table, END + after


def link(page: Path, to: Path, anchor: str = "") -> str:
    """A relative link from one page to another."""
    return os.path.relpath(to, page.parent) + anchor


def grid(table: str) -> list[list[str]]:
    """Cells by row, without the rules below headings; a line that is not a row is one cell."""
    rows = [re.split(r"(?<!\\)\|", line.strip().strip("|")) for line in table.splitlines() if line.strip()]
    cells = [[cell.strip() for cell in row] for row in rows]
    return [row for row in cells if not all(re.fullmatch(r":?-+:?", cell) for cell in row)]


def digest(table: str) -> str:
    """Digest of a table's cells."""
    return hashlib.sha256(repr(grid(table)).encode()).hexdigest()[:12]


def same(kept: str, measured: str) -> bool:
    """Whether two texts differ only in the last digits of their numbers, by one."""
    ours, theirs = re.findall(NUMBER, kept), re.findall(NUMBER, measured)
    return re.split(NUMBER, kept) == re.split(NUMBER, measured) and all(
        len(one.partition(".")[2]) == len(other.partition(".")[2])
        and abs(round((float(one) - float(other)) * 10 ** len(one.partition(".")[2]))) <= 1
        for one, other in zip(ours, theirs, strict=True)
    )


@dataclass(frozen=True, slots=True)
class Moved:
    """A table's cell that has changed: the row is named by its first cells, the column by its heading."""

    table: str
    row: str
    column: str
    old: str
    new: str


def moved(name: str, before: str, after: str) -> list[Moved]:
    """Cells that differ by more than one in the last digit, and rows that are new, gone or have other columns."""
    old, new = grid(before), grid(after)
    if [len(row) for row in old] == [len(row) for row in new]:
        pairs = list(zip(old, new, strict=True))
    else:
        known = {_label(row): row for row in old}
        pairs = [(known.pop(_label(row), []), row) for row in new]
        pairs += [(row, []) for row in known.values()]
    found, heading = [], new[0] if new else []
    for ours, theirs in pairs:
        row = _label(theirs or ours)
        if len(ours) != len(theirs):
            found.append(Moved(name, row, "all", " | ".join(ours) or "–", " | ".join(theirs) or "–"))
            continue
        heading = heading if len(heading) == len(theirs) else theirs
        cells = zip(heading, ours, theirs, strict=True)
        found += [Moved(name, row, column, one, other) for column, one, other in cells if not same(one, other)]
    return found


def _label(row: list[str]) -> str:
    """A row's name: its first cells, three at most, before the first with figures."""
    figures = (number for number, cell in enumerate(row[:3]) if re.match(r"[-+−]?\d.*[./±\[]", cell))
    return " | ".join(row[: max(1, next(figures, 3))])
