"""Draw the rooms of the code and their imports, or list them: floors are the layers that import-linter holds.

    python tools/rooms.py                  # rooms with their files, lines of code and of docstrings, and imports
    python tools/rooms.py --draw           # docs/pictures/rooms.svg
    python tools/rooms.py --check          # exit code 1 if that drawing is not of today's rooms
    python tools/rooms.py --summary        # the size of the code, the tests and the docs

Arrows that follow from others are left out, as are those to the foundations, on which every room may stand; the
stages, which do not know one another, are drawn in one frame, and an arrow to it is one to some of them.
"""

import argparse
import ast
import io
import subprocess
import sys
import textwrap
import tokenize
import tomllib
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from html import escape
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DRAWING = ROOT / "docs" / "pictures" / "rooms.svg"
SOURCES = (ROOT, ROOT / "envs")
FOUNDATIONS = "values"
"""From this room down, all are drawn as one floor, without arrows."""

STAGES = "stages"
MOST_ROOMS = 6
"""Rooms side by side; a floor of more is the stages'."""

WIDTH, MARGIN, GAP, LINE, FLOOR = 1160, 20, 14, 15, 30
BOX = 176
LANES = 40
"""Space to the right of the stages' frame, for arrows past it."""

Span = tuple[float, float, float, float]
"""Middle, width, top and bottom of what is drawn."""


@dataclass(frozen=True, slots=True)
class Room:
    """A package or a module at the top level."""

    name: str  # as imports have it, without ``fogsim.``
    purpose: str  # first sentence of its docstring
    parts: tuple[str, ...]  # packages in it
    files: int  # modules in it
    code: int  # lines: not blank and no docstring, and of docstrings
    docstrings: int
    imports: Counter[str]  # imports of other rooms, by room


def room_of(module: str) -> str:
    """Room of a module: ``fogsim.vision.lines.edges`` is in ``vision``."""
    return module if "." not in module or module.startswith("fogsim_envs") else module.split(".")[1]


def modules() -> dict[str, Path]:
    """Files by module; a package's is its ``__init__``."""
    found = {}
    for source, package in zip(SOURCES, ("fogsim", "fogsim_envs"), strict=True):
        for path in sorted((source / package).rglob("*.py")):
            parts = path.relative_to(source).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def read_rooms() -> dict[str, Room]:
    """Rooms by name, as the files have them now."""
    files = modules()
    members: dict[str, list[str]] = {}
    for module in files:
        name = "fogsim_envs" if module.startswith("fogsim_envs") else room_of(module)
        members.setdefault(name, []).append(module)
    rooms = {}
    for name, names in members.items():
        if name == "fogsim":
            continue
        trees = [(ast.parse(files[module].read_text()), files[module].read_text()) for module in names]
        face = ast.get_docstring(trees[0][0]) or ""
        imports: Counter[str] = Counter()
        for tree, _ in trees:
            imports += Counter(_imported(tree, set(files)))
        sizes = [_lines(tree, text) for tree, text in trees]
        # Environments are registered by name, so their package's face defines nothing for others.
        rooms[name] = Room(
            name,
            face.split("\n")[0].rstrip("."),
            tuple(
                module.split(".")[2] for module in names if module.count(".") == 2 and files[module].stem == "__init__"
            ),
            len(names),
            sum(code for code, _ in sizes),
            sum(told for _, told in sizes),
            Counter({room: count for room, count in imports.items() if room not in (name, "fogsim")}),
        )
    return rooms


def _imported(tree: ast.Module, known: set[str]) -> list[str]:
    found = []
    for node in _statements(tree):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] in ("fogsim", "fogsim_envs"):
            for alias in node.names:
                module = f"{node.module}.{alias.name}"
                found.append(module if module in known else node.module)
        elif isinstance(node, ast.Import):
            found += [alias.name for alias in node.names if alias.name in known]
    return ["fogsim_envs" if module.startswith("fogsim_envs") else room_of(module) for module in found]


def _statements(tree: ast.AST) -> Iterable[ast.AST]:
    """All statements; to look into their expressions takes most of the time."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.stmt | ast.excepthandler | ast.match_case):
            yield node
            yield from _statements(node)


def _lines(tree: ast.Module, text: str) -> tuple[int, int]:
    told = set()
    for node in _statements(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            told |= set(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    rest = [line for number, line in enumerate(text.splitlines(), 1) if number not in told]
    return sum(bool(line.strip()) for line in rest), len(told)


def read_floors() -> list[list[str]]:
    """Rooms floor by floor, the highest first: the layers of fogsim in pyproject.toml, environments above them."""
    with (ROOT / "pyproject.toml").open("rb") as file:
        contracts = tomllib.load(file)["tool"]["importlinter"]["contracts"]
    layers = next(contract["layers"] for contract in contracts if contract.get("containers") == ["fogsim"])
    floors = [[name.strip() for name in layer.split("|")] for layer in layers if layer != "__main__"]
    floors[0].append("fogsim_envs")
    return floors


def direct_arrows(rooms: dict[str, Room], floors: list[list[str]]) -> list[tuple[str, str]]:
    """Imports between rooms, or the stages as one, that do not follow from a longer way (the transitive reduction)."""
    node = {name: STAGES if len(floor) > MOST_ROOMS else name for floor in floors for name in floor}
    below: dict[str, set[str]] = {name: set() for name in node.values()}
    for name, drawn in node.items():
        below[drawn] |= {node[other] for other in rooms[name].imports if other in node} - {drawn}

    def reached(name: str) -> set[str]:
        return below[name].union(*(reached(other) for other in below[name]))

    return sorted(
        (name, other)
        for name, others in below.items()
        for other in others
        if not any(other in reached(between) for between in others - {other})
    )


def draw(rooms: dict[str, Room], floors: list[list[str]]) -> str:
    """SVG of the rooms, floor by floor, and of their direct arrows."""
    ground = next(number for number, floor in enumerate(floors) if FOUNDATIONS in floor)
    drawn = floors[:ground]
    boxes: dict[str, Span] = {}
    shapes: list[str] = []
    top = float(MARGIN)
    for number, floor in enumerate(drawn):
        colour = "#eef3f8" if number % 2 else "#f7f1e6"
        first_top = top
        rows = [floor[first : first + MOST_ROOMS] for first in range(0, len(floor), MOST_ROOMS)]
        for row in rows:
            contents = [_caption(rooms[name]) for name in row]
            height = 12.0 + LINE * max(len(caption) for caption in contents)
            left = (WIDTH - len(row) * BOX - (len(row) - 1) * GAP) / 2
            for name, caption in zip(row, contents, strict=True):
                boxes[name] = (left + BOX / 2, BOX, top, top + height)
                shapes.append(_box(left, top, BOX, height, caption, colour))
                left += BOX + GAP
            top += height + GAP
        if len(rows) > 1:
            frame = (MARGIN / 2, first_top - GAP, WIDTH - MARGIN, top - first_top + GAP)
            shapes.insert(0, _box(*frame, [], "#fbfbfb"))
            boxes[STAGES] = (WIDTH / 2, WIDTH - MARGIN, first_top - GAP, top)
        top += FLOOR
    names = [name for floor in floors[ground:] for name in floor]
    lines = ["foundations, on which all stand", " · ".join(names)]
    shapes.append(_box(MARGIN / 2, top, WIDTH - MARGIN, 12.0 + LINE * len(lines), lines, "#e9e9e9"))
    total = top + 12.0 + LINE * len(lines) + MARGIN
    blocks = list(boxes.values())
    arrows = [_arrow(boxes[start], boxes[end], blocks) for start, end in direct_arrows(rooms, drawn)]
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH + LANES} {total:.0f}" font-family="sans-serif" '
        f'font-size="11"><defs><marker id="head" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" '
        f'markerHeight="7" orient="auto"><path d="M0 0 8 4 0 8z" fill="#56718c"/></marker></defs>'
        f'<rect width="{WIDTH + LANES}" height="{total:.0f}" fill="white"/>'
    )
    return "\n".join([head, *shapes, *arrows, "</svg>", ""])


def _caption(room: Room) -> list[str]:
    return [room.name, *textwrap.wrap(room.purpose.replace("`", ""), 25), *textwrap.wrap(" · ".join(room.parts), 25)]


def _box(left: float, top: float, width: float, height: float, lines: list[str], colour: str) -> str:
    text = "".join(
        f'<text x="{left + 8:.0f}" y="{top + 16 + LINE * number:.0f}"'
        + (' font-weight="bold" font-size="13"' if number == 0 else ' fill="#444"')
        + f">{escape(line)}</text>"
        for number, line in enumerate(lines)
    )
    return (
        f'<rect x="{left:.0f}" y="{top:.0f}" width="{width:.0f}" height="{height:.0f}" rx="5" fill="{colour}" '
        f'stroke="#7a7a7a"/>{text}'
    )


def _arrow(start: Span, end: Span, blocks: list[Span]) -> str:
    """From floor to floor straight down or in a bend; past other floors along a free lane, which then blocks others."""
    (x, width, _, y), (x_end, width_end, top, _) = start, end
    if top - y < 3 * FLOOR:
        bend, x_end = (top - y) / 2, x if abs(x_end - x) + width / 2 <= width_end / 2 else x_end
        way = f"M{x:.0f} {y:.0f}C{x:.0f} {y + bend:.0f} {x_end:.0f} {top - bend:.0f} {x_end:.0f} {top:.0f}"
    else:
        reach, reach_end = width / 2 - GAP, width_end / 2 - GAP
        free = [at for at in range(MARGIN, WIDTH + LANES) if not _is_blocked(at, y, top, blocks)]
        lane = min(free, key=lambda at: abs(at - x) + abs(at - x_end))
        x, x_end = min(max(lane, x - reach), x + reach), min(max(lane, x_end - reach_end), x_end + reach_end)
        way = f"M{x:.0f} {y:.0f}v{GAP}H{lane}V{top - GAP:.0f}H{x_end:.0f}v{GAP}"
        blocks.append((lane, GAP, y, top))
    return f'<path d="{way}" fill="none" stroke="#56718c" stroke-width="1.3" marker-end="url(#head)"/>'


def _is_blocked(lane: float, y: float, y_end: float, blocks: Iterable[Span]) -> bool:
    return any(
        abs(lane - middle) < width / 2 + 6 and top < y_end and bottom > y for middle, width, top, bottom in blocks
    )


def main() -> None:
    """Print, draw or compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draw", action="store_true", help="write docs/pictures/rooms.svg")
    parser.add_argument("--check", action="store_true", help="compare it with the rooms of today")
    parser.add_argument("--summary", action="store_true", help="print the size of the code, the tests and the docs")
    arguments = parser.parse_args()
    if arguments.summary:
        print("\n".join(f"{value:7,} {name}" for name, value in summary().items()))  # noqa: T201 - what it is for
        return
    rooms = read_rooms()
    drawing = draw(rooms, read_floors())
    if arguments.draw:
        DRAWING.write_text(drawing)
    elif arguments.check:
        sys.exit(None if DRAWING.read_text() == drawing else f"{DRAWING.name} is not of today: tools/rooms.py --draw")
    else:
        _print_table(rooms)


def summary() -> dict[str, int]:
    """Sizes by name; attributes' docstrings and comments are no lines of code."""
    texts = [path.read_text(encoding="utf-8") for path in sorted((ROOT / "fogsim").rglob("*.py"))]
    trees = [ast.parse(text) for text in texts]
    public = [node for tree in trees for node in tree.body if isinstance(node, ast.FunctionDef | ast.ClassDef)]
    loop = next(name for name in ("fogsim.simulation.loop", "fogsim.simulation.loop") if name in modules())
    loaded = f"import sys, {loop}; print(sum(name.partition('.')[0] == 'fogsim' for name in sys.modules))"
    scripts = [path for folder in ("benchmarks", "docs", "tools") for path in (ROOT / folder).rglob("*.py")]
    pages = [*(ROOT / "docs").rglob("*.md"), *(ROOT / f"{name}.md" for name in ("README", "CONTRIBUTING", "CHANGELOG"))]
    return {
        "lines of code in fogsim/": sum(_code_lines(*pair) for pair in zip(trees, texts, strict=True)),
        "lines of docstrings in fogsim/": sum(_docstring_lines(tree) for tree in trees),
        "files in fogsim/": len(texts),
        f"modules of fogsim that import {loop} loads": int(subprocess.check_output([sys.executable, "-c", loaded])),  # noqa: S603 - Python itself
        "public functions and classes": sum(not node.name.startswith("_") for node in public),
        "rooms": len(read_rooms()) - 1,
        "lines of benchmarks, docs' scripts and tools": _all_lines(scripts),
        "lines of tests": _all_lines((ROOT / "tests").rglob("*.py")),
        "words of pages outside tables": sum(_words(page) for page in pages),
    }


def _all_lines(paths: Iterable[Path]) -> int:
    return sum(len(path.read_text(encoding="utf-8").splitlines()) for path in paths)


def _words(page: Path) -> int:
    lines = page.read_text(encoding="utf-8").splitlines()
    return sum(len(line.split()) for line in lines if not line.startswith(("|", "<!--")))


def _code_lines(tree: ast.Module, text: str) -> int:
    _, told = _lines(tree, text)
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    quiet = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
    spans = [(token.start[0], token.end[0]) for token in tokens if token.type not in quiet]
    return len({line for first, last in spans for line in range(first, last + 1)}) - told


def _docstring_lines(tree: ast.Module) -> int:
    documented = (ast.Module, ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
    nodes = [node for node in ast.walk(tree) if isinstance(node, documented) and ast.get_docstring(node)]
    return sum((node.body[0].end_lineno or 0) - node.body[0].lineno + 1 for node in nodes)


def _print_table(rooms: dict[str, Room]) -> None:
    print(f"{'room':16}{'files':>6}{'code':>7}{'docs':>7}  imports")  # noqa: T201 - what the command is for
    for room in sorted(rooms.values(), key=lambda room: -room.code):
        told = ", ".join(f"{name} {count}" for name, count in room.imports.most_common())
        print(f"{room.name:16}{room.files:6}{room.code:7}{room.docstrings:7}  {told}")  # noqa: T201 - the same
    sums = [sum(getattr(room, name) for room in rooms.values()) for name in ("files", "code", "docstrings")]
    print(f"{'all':16}{sums[0]:6}{sums[1]:7}{sums[2]:7}")  # noqa: T201 - the same


if __name__ == "__main__":
    main()
