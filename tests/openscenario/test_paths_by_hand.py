"""The ego's path on five files, within 1 m of what follows from each by hand at any time."""

import math
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.openscenario.test_off_lanes import _absolute, _follows, _offset

from tests.openscenario.writing import (  # isort: skip
    CAR, after, changes_lane, event, group, lane, linear, motion, on, run, speed, world, write,
)  # fmt: skip

FRONT, RIGHT, LEFT = 3.7, -1.75, 1.75  # From the reference point to the front bumper, and middles of the lanes [m]
BEGIN = 2.0  # Time at which what the story orders begins [s]

Place = tuple[float, float]


def _ramp(first: float, last: float, lasts: float) -> Callable[[float], float]:
    """Way driven [m] since a linear change of speed [m/s] began."""
    rate = (last - first) / lasts
    return lambda t: first * t + 0.5 * rate * t * t if t < lasts else 0.5 * (first + last) * lasts + last * (t - lasts)


def _wave(first: float, last: float, lasts: float) -> Callable[[float], float]:
    """Way driven [m] since a sinusoidal change of speed [m/s] began."""

    def driven(t: float) -> float:
        inside = min(t, lasts)
        bend = lasts / math.pi * math.sin(math.pi * inside / lasts)
        return first * inside + 0.5 * (last - first) * (inside - bend) + last * (t - inside)

    return driven


def _smooth(share: float) -> float:
    share = min(max(share, 0.0), 1.0)
    return share * share * (3.0 - 2.0 * share)


def _along(driven: Callable[[float], float]) -> Callable[[float], Place]:
    """Place of the front bumper: at 10 m/s from s = 50 m until the story begins, and then as it orders."""
    return lambda t: (50.0 + FRONT + 10.0 * min(t, BEGIN) + (driven(t - BEGIN) if t > BEGIN else 0.0), RIGHT)


def _across(y: Callable[[float], float]) -> Callable[[float], Place]:
    return lambda t: (50.0 + FRONT + 10.0 * t, RIGHT if t < BEGIN else y(t - BEGIN))


def _by_times(t: float) -> Place:
    """From (70, −1.75) on a straight line in 4 s, then on in the other lane's middle at the same speed."""
    if t < BEGIN:
        return 50.0 + FRONT + 10.0 * t, RIGHT
    share, length = min((t - BEGIN) / 4.0, 1.0), math.hypot(40.0, 1.0)
    return 70.0 + 40.0 * share + FRONT * 40.0 / length, RIGHT + share + FRONT / length


CLOSE = group(
    on(
        '<TimeToCollisionCondition value="3" freespace="true" rule="lessThan" relativeDistanceType="longitudinal">'
        '<TimeToCollisionConditionTarget><EntityRef entityRef="Slow"/></TimeToCollisionConditionTarget>'
        "</TimeToCollisionCondition>",
        edge="rising",
    )
)
OFFSET = math.pi * math.sqrt(0.5 * 0.8 / 1.0)  # Time for 0.8 m at 1 m/s² at most [s]

CASES = {
    "slows smoothly": (
        speed(4, linear(4).replace("linear", "sinusoidal")),
        after(BEGIN),
        _along(_wave(10.0, 4.0, 4.0)),
    ),
    # Bumpers are (90 − 0.9) − (50 + 3.7) = 35.4 m apart, and 3 s are 30 m: after 0.54 s.
    "brakes at a time to collision": (
        speed(0, linear(4, "rate")),
        CLOSE,
        lambda t: (50.0 + FRONT + 10.0 * min(t, 0.54) + (_ramp(10.0, 0.0, 2.5)(t - 0.54) if t > 0.54 else 0.0), RIGHT),
    ),
    "changes lane over a distance": (
        changes_lane(1, "distance", 40.0),
        after(BEGIN),
        _across(lambda t: RIGHT + 3.5 * _smooth(t / 4.0)),
    ),
    "moves within its lane": (
        _offset(_absolute(0.8)),
        after(BEGIN),
        _across(lambda t: RIGHT + 0.4 - 0.4 * math.cos(math.pi * min(t / OFFSET, 1.0))),
    ),
    "follows a trajectory": (_follows((0, world(70, RIGHT)), (4, world(110, RIGHT + 1.0))), after(BEGIN), _by_times),
}


def test_the_egos_path_follows_from_the_file(tmp_path: Path) -> None:
    for action, start, place in CASES.values():
        begin = {"Ego": f"{lane(50)}\n{speed(10)}", "Slow": f"{lane(90)}\n{speed(0)}"}
        others = {"Slow": CAR} if start is CLOSE else {}
        begin = {vehicle: begin[vehicle] for vehicle in ("Ego", *others)}
        file = write(tmp_path, {"Ego": CAR, **others}, begin, {"Ego": event("e", action, start)}, stop=after(6.0))
        steps = run(file)
        assert steps[-1].time == pytest.approx(6.0, abs=0.11)
        for step in steps:
            assert math.dist(motion(step, "Ego")[:2], place(step.time)) < 1.0, step.time
