"""Make scenarios/motorway_fog_bank/motorway.net.xml: two carriageways of three lanes along a gently curved axis.

Needs ``netconvert`` (``pip install eclipse-sumo``). Run from the top of a checkout:

    python tools/make_motorway_net.py

The axis is a chain of straights and arcs; each carriageway lies next to it, a median apart.
"""

import argparse
import math
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

# (length [m], radius [m]; positive radii turn left, None is straight)
SEGMENTS: tuple[tuple[float, float | None], ...] = (
    (1200.0, None),
    (1300.0, 2400.0),
    (900.0, None),
    (1300.0, -2800.0),
    (800.0, None),
)
MEDIAN = 4.0  # [m] between the two carriageways
POINT_SPACING = 20.0  # [m] between shape points on arcs
LANES = 3
LANE_WIDTH = 3.75
# Where the limit changes along the forward carriageway: (name, from [m], limit [km/h])
STRETCHES = (("approach", 0.0, 130.0), ("bank", 900.0, 110.0), ("exit", 3400.0, 130.0))


def axis_points() -> list[tuple[float, float, float, float]]:
    """Points (station, x, y, heading) along the axis."""
    station, x, y, heading = 0.0, 0.0, 0.0, 0.35
    points = [(station, x, y, heading)]
    for length, radius in SEGMENTS:
        count = max(2, math.ceil(length / POINT_SPACING))
        for _ in range(count):
            step = length / count
            turn = 0.0 if radius is None else step / radius
            chord = step if turn == 0 else 2 * abs(step / turn) * math.sin(abs(turn) / 2)
            x += chord * math.cos(heading + turn / 2)
            y += chord * math.sin(heading + turn / 2)
            heading += turn
            station += step
            points.append((station, x, y, heading))
    return points


def beside(points: list[tuple[float, float, float, float]], offset: float) -> list[tuple[float, float]]:
    """Shift the axis to the left by an offset [m]."""
    return [(x - offset * math.sin(h), y + offset * math.cos(h)) for _, x, y, h in points]


def shape(points: list[tuple[float, float]]) -> str:
    """Shape attribute of a plain edge."""
    return " ".join(f"{x:.2f},{y:.2f}" for x, y in points)


def edge(name: str, start: str, end: str, limit: float, points: list[tuple[float, float]]) -> str:
    """One plain edge."""
    return (
        f'  <edge id="{name}" from="{start}" to="{end}" numLanes="{LANES}" width="{LANE_WIDTH}" priority="10"'
        f' speed="{limit / 3.6:.3f}" spreadType="right" shape="{shape(points)}"/>'
    )


def plain_files() -> tuple[str, str]:
    """Texts of the plain node and edge files."""
    points = axis_points()
    total = points[-1][0]
    nodes, edges = [], []
    bounds = [s[1] for s in STRETCHES] + [total]
    for index, (name, _, limit) in enumerate(STRETCHES):
        part = [p for p in points if bounds[index] - 1e-6 <= p[0] <= bounds[index + 1] + 1e-6]
        forward = beside(part, -MEDIAN / 2)
        edges.append(edge(name, f"n{index}", f"n{index + 1}", limit, forward))
        if index == 0:
            nodes.append(("n0", forward[0]))
        nodes.append((f"n{index + 1}", forward[-1]))
    back = list(reversed(beside(points, MEDIAN / 2)))
    nodes += [("m0", back[0]), ("m1", back[-1])]
    edges.append(edge("opposite", "m0", "m1", 130.0, back))
    node_lines = [f'  <node id="{name}" x="{x:.2f}" y="{y:.2f}" type="priority"/>' for name, (x, y) in nodes]
    return (
        "<nodes>\n" + "\n".join(node_lines) + "\n</nodes>\n",
        "<edges>\n" + "\n".join(edges) + "\n</edges>\n",
    )


def main() -> None:
    """Write the net."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--out", type=Path, default=Path("scenarios/motorway_fog_bank/motorway.net.xml"))
    arguments = parser.parse_args()
    netconvert = shutil.which("netconvert")
    if netconvert is None:
        parser.exit(2, "netconvert is not on the PATH: pip install eclipse-sumo\n")
    with tempfile.TemporaryDirectory() as folder:
        nodes, edges = Path(folder, "motorway.nod.xml"), Path(folder, "motorway.edg.xml")
        for path, text in zip((nodes, edges), plain_files(), strict=True):
            path.write_text(text, encoding="utf-8")
        subprocess.run(  # noqa: S603 - our own arguments
            [
                netconvert,
                "-n",
                str(nodes),
                "-e",
                str(edges),
                "-o",
                str(arguments.out),
                "--no-turnarounds",
                "true",
                "--offset.disable-normalization",
                "true",
                "--output.street-names",
                "false",
                "--default.junctions.radius",
                "0.1",
                "--no-internal-links",
                "false",
            ],
            check=True,
        )
    text = arguments.out.read_text(encoding="utf-8")
    # netconvert's header holds the time and the temporary paths of its run: leave both out.
    arguments.out.write_text(re.sub(r"<!--.*?-->\n", "", text, flags=re.DOTALL), encoding="utf-8")


if __name__ == "__main__":
    main()
