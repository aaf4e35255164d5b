"""How the time of a frame grows with vehicles, cameras, pixels, lamps, the length of a run, and the size of a city.

The closed loop runs on the motorway or in the town of `traffic.py`, in fog of 100 m, with a camera of 160×120 and
`joint_road` (by night `night_road`). Each line varies one thing; `size` is how much of it there was. `ms` is the
median processor time of a frame, and `exponent` the slope of its logarithm by that of the size over the line: 0 does
not grow, 1 grows in proportion. Most of a frame does not depend on any of them, so that exponents of large sizes, from
the last two levels, are given too.
"""

import math
import statistics
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from harness import Row, lines_of, parse_options, progress, publish
from traffic import configuration, has_programs, town_configuration

import fogsim
from fogsim.scenario.loading import clock_settings, scenario_from_config
from fogsim.values import Step

FIRST = 20
"""Frames that are not counted: drawing makes room, and estimators look at their first images more closely."""

BASE = (*clock_settings(0.1, 0.1, 0.5), "fog.visibility_m=100", "end_on_collision=false", "duration_s=600")
DAY = ("estimators=[joint_road]",)
NIGHT = ("light.illuminance_lx=0.05", "estimators=[night_road]")
SMALL = ("camera.width=160", "camera.height=120")
REPORTS = "sensors.reports={cameras: {}}"


@dataclass(frozen=True)
class Line:
    """What is varied: settings and vehicles at each level, the network, and the size that a step shows."""

    levels: tuple[float, ...]
    settings: Callable[[float], tuple[str, ...]]
    vehicles: Callable[[float], int]
    size: Callable[[float, Step], float]
    network: Callable[[Path, int], Path] = configuration
    wait: Callable[[float], int] = lambda _: 0  # Frames that pass first


def near(_: float, step: Step) -> float:
    """How many vehicles are read."""
    return len(step.traffic.ids)


LINES = {
    "vehicles near": Line((10, 40, 160, 640), lambda _: (*DAY, *SMALL), int, near),
    "vehicles near, by night": Line((10, 40, 160, 640), lambda _: (*NIGHT, *SMALL), int, near),
    "cameras": Line(
        (0, 10, 90),
        lambda share: (*DAY, *SMALL, *((f"traffic.equipped={share:g} %", REPORTS) if share else ())),
        lambda _: 160,
        lambda _, step: 1.0 + len(step.equipped),
    ),
    "pixels": Line(
        (160, 320, 640, 1280),
        lambda width: (*DAY, f"camera.width={width:g}", f"camera.height={0.75 * width:g}"),
        lambda _: 40,
        lambda width, _: 0.75 * width * width,
    ),
    "seconds of a run": Line(
        (5, 20, 60),
        lambda _: (*DAY, *SMALL),
        lambda _: 100,
        lambda seconds, _: seconds,
        town_configuration,
        lambda seconds: round(10.0 * seconds),
    ),
    "vehicles in a city": Line(
        (50, 200, 800), lambda _: (*DAY, *SMALL), int, lambda vehicles, _: vehicles, town_configuration
    ),
}


def frame_times(line: Line, level: float, frames: int) -> tuple[float, float]:
    """Mean size over some frames, and the median processor time of one [ms]."""
    sizes, times = [], []
    with tempfile.TemporaryDirectory() as folder:
        config = line.network(Path(folder), line.vehicles(level))
        steps = fogsim.run(scenario_from_config(config, "ego", [*BASE, *line.settings(level)]), seed=1)
        for _ in islice(steps, max(line.wait(level), FIRST)):
            pass
        for _ in range(frames):
            started = time.process_time()
            step = next(steps)
            times.append(1e3 * (time.process_time() - started))
            sizes.append(line.size(level, step))
        steps.close()
    return statistics.fmean(sizes), statistics.median(times)


def exponent(some: Sequence[tuple[float, float]]) -> float:
    """Slope of the logarithm of the time by that of the size."""
    fit = statistics.linear_regression([math.log(size) for size, _ in some], [math.log(ms) for _, ms in some])
    return round(fit.slope, 2)


def measure(name: str, frames: int) -> Row:
    """One record."""
    found = [frame_times(LINES[name], level, frames) for level in progress(LINES[name].levels, name)]
    return {
        "of": name,
        "size": [round(size, 1) for size, _ in found],
        "ms": [round(ms, 2) for _, ms in found],
        "exponent": exponent(found),
        "exponent_of_largest": exponent(found[-2:]),
    }


def table(records: Sequence[Row]) -> list[str]:
    """Lines of a table."""
    rows = [
        (one["of"], *(", ".join(f"{v:g}" for v in one[key]) for key in ("size", "ms")), *list(one.values())[3:])
        for one in records
    ]
    heading = ("growing", "sizes", "a frame [ms of processor time]", "exponent", "of the last two")
    lines: list[str] = lines_of(heading, [tuple(map(str, row)) for row in rows])
    return lines


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        docs=("benchmarks/performance.md", "growth"),
        lines=(list(LINES), "what is varied", LINES),
        frames=(40, "frames of each level"),
    )
    if not has_programs():
        given.error("towns need SUMO's netgenerate and netconvert: pip install eclipse-sumo")
    publish(given, [measure(name, given.frames) for name in given.lines], table)


if __name__ == "__main__":
    main()
