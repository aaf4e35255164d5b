"""Make scenarios/graded_motorway/graded.net.xml: two lanes that climb, pass a crest, fall and pass a sag, straight on.

Run from the top of a checkout:

    python tools/make_graded_net.py

Between constant grades lie arcs in the vertical plane, so that the grade changes evenly with the distance along the
road; the heights at the vertices are those of the arcs, and between vertices roads are straight.
"""

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

CREST, SAG = 13_000.0, 8_800.0  # [m] radii of crests and sags, those of a motorway for 130 km/h and more
SPACING = 8.0  # [m] between vertices in arcs
LANES, LANE_WIDTH, LIMIT = 2, 3.75, 130.0 / 3.6

# Grade [-], and the length for which it is held [m]. Going to the next one, a crest or a sag lies between.
GRADES: tuple[tuple[float, float], ...] = (
    (0.0, 350.0),
    (0.02, 500.0),
    (0.04, 500.0),
    (-0.04, 500.0),
    (-0.02, 500.0),
    (0.0, 500.0),
)


def profile() -> NDArray[np.float64]:
    """Vertices (n, 2): distance along the map and height [m]."""
    grades = []
    for number, (grade, length) in enumerate(GRADES):
        if number:
            before = grades[-1][0]
            arc = abs(grade - before) * (CREST if grade < before else SAG)
            pieces = int(np.ceil(arc / SPACING))
            # The grade of each piece is that of the arc in the piece's middle.
            grades += [(before + (grade - before) * (i + 0.5) / pieces, arc / pieces) for i in range(pieces)]
        grades.append((grade, length))
    slope, length = np.array(grades).T
    angle = np.arctan(slope)
    steps = np.column_stack((length * np.cos(angle), length * np.sin(angle)))
    return np.vstack(((0.0, 0.0), np.cumsum(steps, axis=0)))


def net() -> str:
    """The SUMO network."""
    points = profile()
    length = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    lanes, ends = [], []
    for index in range(LANES):
        left = -(LANES - 0.5 - index) * LANE_WIDTH
        shape = " ".join(f"{x:.3f},{left:.3f},{z:.4f}" for x, z in points)
        lanes.append(
            f'        <lane id="road_{index}" index="{index}" speed="{LIMIT:.2f}" length="{length:.2f}" '
            f'width="{LANE_WIDTH}" shape="{shape}"/>'
        )
        ends.append(f"road_{index}")
    (_, _), (x, z) = points[0], points[-1]
    width = LANES * LANE_WIDTH
    return "\n".join(
        (
            '<?xml version="1.0" encoding="UTF-8"?>',
            "<!-- Made by tools/make_graded_net.py. -->",
            '<net version="1.20">',
            f'    <location netOffset="0.00,0.00" convBoundary="0.00,{-width:.2f},{x:.2f},0.00" '
            f'origBoundary="0.00,{-width:.2f},{x:.2f},0.00" projParameter="!"/>',
            '    <edge id="road" from="start" to="end" priority="10">',
            *lanes,
            "    </edge>",
            '    <junction id="start" type="dead_end" x="0.00" y="0.00" z="0.00" incLanes="" intLanes="" '
            f'shape="0.00,0.00,0.00 0.00,{-width:.2f},0.00"/>',
            f'    <junction id="end" type="dead_end" x="{x:.2f}" y="0.00" z="{z:.2f}" incLanes="{" ".join(ends)}" '
            f'intLanes="" shape="{x:.2f},{-width:.2f},{z:.2f} {x:.2f},0.00,{z:.2f}"/>',
            "</net>",
            "",
        )
    )


def main() -> None:
    """Write the net."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--out", type=Path, default=Path("scenarios/graded_motorway/graded.net.xml"))
    arguments = parser.parse_args()
    arguments.out.write_text(net(), encoding="utf-8")


if __name__ == "__main__":
    main()
