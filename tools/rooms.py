"""Draw the rooms of the code and their imports in docs/pictures/rooms.svg; floors are the layers of import-linter.

    python tools/rooms.py
    python tools/rooms.py --check          # exit code 1 if that drawing is not of today's rooms

Arrows that follow from others are left out, as are those to the foundations, on which every room may stand; the
stages, which do not know one another, are drawn in one frame, and an arrow to it is one to some of them.
"""

import argparse
import ast
import sys
import textwrap
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from html import escape
from pathlib import Path

import grimp

ROOT = Path(__file__).resolve().parents[1]
DRAWING = ROOT / "docs" / "pictures" / "rooms.svg"
ENVIRONMENTS = "fogsim_envs"
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
    purpose: str  # first line of its docstring
    parts: tuple[str, ...]  # packages in it
    imports: frozenset[str]  # other rooms


def read_rooms() -> dict[str, Room]:
    """Rooms by name, as the files have them now."""
    graph = grimp.build_graph("fogsim", ENVIRONMENTS, cache_dir=None)
    modules = {module.removeprefix("fogsim."): module for module in sorted(graph.find_children("fogsim"))}
    parts: dict[str, tuple[str, ...]] = {}
    for name, module in modules.items():
        packages = sorted(child for child in graph.find_children(module) if graph.find_children(child))
        parts[name] = tuple(package.rpartition(".")[2] for package in packages)
    # Environments are registered by name, so their package's parts are of no concern to others.
    modules[ENVIRONMENTS], parts[ENVIRONMENTS] = ENVIRONMENTS, ()
    for module in modules.values():
        graph.squash_module(module)
    names = {module: name for name, module in modules.items()}
    rooms = {}
    for name, module in modules.items():
        imported = graph.find_modules_directly_imported_by(module) & set(names)
        rooms[name] = Room(name, _purpose(module), parts[name], frozenset(names[one] for one in imported))
    return rooms


def _purpose(module: str) -> str:
    package = ROOT / ("envs" if module == ENVIRONMENTS else "") / module.replace(".", "/")
    file = package / "__init__.py" if package.is_dir() else package.with_suffix(".py")
    text = ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or ""
    return text.split("\n")[0].rstrip(".")


def read_floors() -> list[list[str]]:
    """Rooms floor by floor, the highest first: the layers of fogsim in pyproject.toml, environments above them."""
    with (ROOT / "pyproject.toml").open("rb") as file:
        contracts = tomllib.load(file)["tool"]["importlinter"]["contracts"]
    layers = next(contract["layers"] for contract in contracts if contract.get("containers") == ["fogsim"])
    floors = [[name.strip() for name in layer.split("|")] for layer in layers if layer != "__main__"]
    floors[0].append(ENVIRONMENTS)
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
    """Draw or compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="compare the drawing with the rooms of today")
    drawing = draw(read_rooms(), read_floors())
    if not parser.parse_args().check:
        DRAWING.write_text(drawing, encoding="utf-8")
    elif DRAWING.read_text(encoding="utf-8") != drawing:
        sys.exit(f"{DRAWING.name} is not of today: python tools/rooms.py")


if __name__ == "__main__":
    main()
