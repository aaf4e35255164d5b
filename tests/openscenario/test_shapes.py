"""Trajectories that are clothoids or NURBS."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from scipy.special import fresnel

from fogsim.errors import InputError
from fogsim.openscenario import read_openscenario

from tests.openscenario.writing import (  # isort: skip
    CAR, PERSON, TIMED, after, entry, event, follows, lane, motion_at, run, speed, trajectory, world, write,
)  # fmt: skip

HERE = world(100, 20)


def nurbs(order: int, controls: Sequence[tuple[float, float, float, float]], knots: Sequence[float]) -> str:
    """NURBS of control points: time, weight, x and y."""
    points = "".join(f'<ControlPoint time="{t}" weight="{w}">{world(x, y)}</ControlPoint>' for t, w, x, y in controls)
    return f'<Nurbs order="{order}">{points}{"".join(f"<Knot value={chr(34)}{k}{chr(34)}/>" for k in knots)}</Nurbs>'


def written(folder: Path, action: str) -> Path:
    begin = {"Ego": f"{lane(50)}\n{speed(20)}", "Ann": HERE}
    return write(folder, {"Ego": CAR, "Ann": PERSON}, begin, {"Ann": event("goes", action, after(1))})


def path(folder: Path, action: str) -> tuple[np.ndarray, np.ndarray]:
    """Points of a path, and times."""
    read = entry(read_openscenario(written(folder, action)).data, "goes")["do"]["Ann"]["path"]
    return np.array(read["points"]), np.array(read.get("at_s", []))


def off(points: np.ndarray, curve: np.ndarray) -> float:
    """Greatest distance of points of a curve (n, 2) from a polyline [m]."""
    begins, steps = points[:-1, :2], np.diff(points[:, :2], axis=0)
    to = curve[:, None] - begins
    share = np.clip((to * steps).sum(2) / (steps**2).sum(1), 0.0, 1.0)
    return float(np.hypot(*np.moveaxis(to - share[..., None] * steps, 2, 0)).min(1).max())


def test_a_clothoid_is_that_of_fresnel(tmp_path: Path) -> None:
    # From a straight line, curvature s / a²: x and y are Fresnel's integrals, to a radius of 9 m.
    change, length = 0.01, 100.0 / 9.0
    shape = f'<Clothoid curvature="0" curvaturePrime="{change}" length="{length}" startTime="0" stopTime="8">{HERE}'
    points, times = path(tmp_path, follows(f"{shape}</Clothoid>", TIMED))
    scale = math.sqrt(math.pi / change)
    s = np.linspace(0.0, length, 500)
    y, x = fresnel(s / scale)
    assert off(points, np.stack([100.0 + scale * x, 20.0 + scale * y], axis=1)) < 0.002
    assert points[-1] == pytest.approx(
        [100 + scale * x[-1], 20 + scale * y[-1], math.degrees(0.5 * change * length**2)]
    )
    assert np.interp(2.0, times, points[:, 2]) == pytest.approx(math.degrees(0.5 * change * (length / 4) ** 2), abs=0.1)


def test_segments_of_a_spline_follow_one_another(tmp_path: Path) -> None:
    # Straight, a quarter of a circle to the left, a corner to the right, and straight.
    quarter = 5.0 * math.pi
    rows = [(0, 0.0, 0.0, 10.0), (0, 0.1, 0.1, quarter), (-0.5 * math.pi, 0.0, 0.0, 4.0)]
    segments = [
        f'<ClothoidSplineSegment hOffset="{turn}" curvatureStart="{a}" curvatureEnd="{b}" length="{m}" timeStart="{t}">'
        for t, (turn, a, b, m) in enumerate(rows)
    ]
    segments[0] += HERE.replace("Position>", "PositionStart>")
    inner = "</ClothoidSplineSegment>".join([*segments, ""])
    points, times = path(tmp_path, follows(f'<ClothoidSpline timeEnd="5">{inner}</ClothoidSpline>', TIMED))
    assert points[-1, :2] == pytest.approx([124.0, 30.0])
    assert times[[0, -1]] == pytest.approx([0.0, 5.0])
    assert [np.interp(1.5, times, points[:, axis]) for axis in (0, 1)] == pytest.approx(
        [110 + 10 * math.sin(math.pi / 4), 30 - 10 * math.cos(math.pi / 4)], abs=0.01
    )


def test_a_weighted_nurbs_is_a_circle_and_one_of_order_4_a_bezier_curve(tmp_path: Path) -> None:
    weight = math.sqrt(0.5)
    circle = nurbs(3, [(0, 1, 110, 20), (1, weight, 110, 30), (2, 1, 100, 30)], [0, 0, 0, 1, 1, 1])
    points, _ = path(tmp_path, follows(circle))
    angles = np.linspace(0.0, 0.5 * math.pi, 300)
    assert off(points, np.stack([100 + 10 * np.cos(angles), 20 + 10 * np.sin(angles)], axis=1)) < 0.002
    assert points[:, 2] == pytest.approx(90 + np.degrees(np.arctan2(points[:, 1] - 20, points[:, 0] - 100)), abs=1e-3)
    controls = [(0, 1, 100, 20), (1, 1, 130, 20), (4, 1, 101, 40), (6, 1, 130, 50)]
    points, times = path(tmp_path, follows(nurbs(4, controls, [0, 0, 0, 0, 2, 2, 2, 2]), TIMED))
    u = np.linspace(0.0, 1.0, 300)[:, None]
    basis = np.concatenate([(1 - u) ** 3, 3 * u * (1 - u) ** 2, 3 * u**2 * (1 - u), u**3], axis=1)
    time, x, y = ((basis * np.array([one[axis] for one in controls])).sum(1) for axis in (0, 2, 3))
    there = np.stack([np.interp(time, times, points[:, axis]) for axis in (0, 1)], axis=1)
    assert np.abs(there - np.stack([x, y], axis=1)).max() < 0.005


def test_a_car_follows_a_clothoid_from_its_position_on(tmp_path: Path) -> None:
    # The reference point turns to the left on a circle of 20 m, from the lane; the front bumper is 3.7 m ahead.
    arc = f'<Clothoid curvature="0.05" length="30">{lane(100)}</Clothoid>'
    begin = {"Ego": f"{lane(20)}\n{speed(10)}", "Far": f"{follows(arc)}\n{speed(10)}"}
    file = write(tmp_path, {"Ego": CAR, "Far": CAR}, begin)
    x, y, _ = motion_at(run(file, "duration_s=2.2"), 2.0, "Far")
    assert (x, y) == pytest.approx(
        (100 + 20 * math.sin(1) + 3.7 * math.cos(1), -1.75 + 20 * (1 - math.cos(1)) + 3.7 * math.sin(1)), abs=0.05
    )


def test_a_position_may_be_at_the_end_of_a_curve(tmp_path: Path) -> None:
    arc = f'<Clothoid curvature="0.05" length="30">{HERE}</Clothoid>'
    file = written(tmp_path, speed(1))
    there = f'<Position><TrajectoryPosition s="30">{trajectory(arc)}</TrajectoryPosition></Position>'
    file.write_text(file.read_text(encoding="utf-8").replace(HERE, there, 1), encoding="utf-8")
    begins = entry(read_openscenario(file).data, "Init_off_the_lanes")["do"]["Ann"]["path"]["points"][0]
    assert begins[:2] == pytest.approx((100 + 20 * math.sin(1.5), 40 - 20 * math.cos(1.5)), abs=0.01)


def test_shapes_that_fit_no_curve_are_refused(tmp_path: Path) -> None:
    segment = '<ClothoidSplineSegment curvatureStart="0" curvatureEnd="0" length="5">'
    later = segment + world(0, 0).replace("Position>", "PositionStart>")
    bad = {
        f'<Clothoid curvature="0" length="0">{HERE}</Clothoid>': "length: expected more than 0",
        f'<Clothoid curvature="0" length="5" startTime="1">{HERE}</Clothoid>': "startTime and stopTime, or neither",
        f'<Clothoid curvature="0" curvaturePrime="1e300" length="1e300">{HERE}</Clothoid>': "at most 5000 pieces",
        f'<Clothoid curvature="9" length="500">{HERE}</Clothoid>': "at most 5000 pieces",
        f"<ClothoidSpline>{2 * (later + '</ClothoidSplineSegment>')}</ClothoidSpline>": "begins where the one before",
        nurbs(3, [(0, 1, 1, 1)] * 3, [0, 0, 1, 1, 1]): "got order 3, 3 points and 5 knots",
        nurbs(3, [(0, 1, 1, 1)] * 3, [0, 0, 0.2, 1, 1, 1]): "the first and the last 3 times",
        nurbs(3, [(0, 1, 1, 1)] * 5, [0, 0, 0, 1, 1, 2, 2, 2]): "a corner, or a gap",
        nurbs(2, [(0, 0, 1, 1)] * 2, [0, 0, 1, 1]): "expected weights of 1e-06",
    }
    for shape, message in bad.items():
        with pytest.raises(InputError, match=message):
            read_openscenario(written(tmp_path, follows(shape)))
