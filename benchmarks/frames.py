"""Time of a camera frame: from where the vehicles are to an 8-bit image, in fog and with noise.

What is timed is what the closed loop does for a frame: `ViewRenderer.render` (vehicles to batches, lit lamps to lights,
drawing to radiance, distance and ids, fog and lamplight) and `CameraSensor.take` (exposure with photon and read noise,
response curve and quantisation). Traffic and estimators are not in it. Of the stages, "render" is the drawing, "air"
fog and lamplight, "camera" the taking, and "scene" what is left.

The scene is the road of the scenario motorway_fog_bank with trees, rails and posts, 30 vehicles of every kind with lit
lamps on its lanes 12 ... 250 m ahead and 10 signs next to it, in homogeneous fog of 100 m visibility; by night the
camera's own low beam and everyone's lamps light it; `photons` is the day with that airlight. The camera drives on by
2.5 m a frame, over 50 m and again from the start. Repetitions of all cases alternate, and each record has the median of
the repetitions' medians, the fastest frame, and each stage's median; on a machine that does other work too, only the
fastest says something.
"""

import itertools
import math
import statistics
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from harness import Row, lines_of, parse_options, publish
from numpy.typing import NDArray
from staging import Board, Shot, Vehicle, network, signs, traffic
from staging import scenario as staged

from fogsim.camera import mounted_pose
from fogsim.scenario import Scenario
from fogsim.scene import build_scene, vehicle_batches
from fogsim.simulation.ego.view_rendering import ViewRenderer
from fogsim.values import Lamp, TrafficState

VEHICLES, SIGNS, START, STEP, ROUND = 30, 10, 400.0, 2.5, 20
KINDS = ("car", "car", "truck", "car", "van", "car", "bus", "car", "car", "motorcycle")
LIGHTS = {"day": 10_000.0, "night": 0.5, "photons": 10_000.0}  # [lx]; the last with the airlight of photons
Key = tuple[str, str, str, int]
"""Renderer, light, size and samples a pixel side of a case."""

LIT = Lamp.POSITION | Lamp.LOW_BEAM | Lamp.REAR_FOG
LANES = (-3.75, 0.0, 3.75)  # to the left of the route, which is the middle lane [m]
SHOT = Shot(
    "",
    station=START,
    vehicles=tuple(Vehicle(KINDS[n % len(KINDS)], 12.0 + 8.0 * n, LANES[n % 3], LIT) for n in range(VEHICLES)),
    boards=tuple(Board("speed_limit", 65.0 + 25.0 * n, -6.0, 80.0, 0.75) for n in range(SIGNS)),
    lamps=LIT,
)
"""What is drawn."""

RENDERERS = ("opengl", "cpu")
STAGES = ("scene", "render", "air", "camera")


def scenario(renderer: str, light: str, size: str, samples: int) -> Scenario:
    """The scenario with homogeneous fog and a camera of a given size and antialiasing."""
    airlight = "photons" if light == "photons" else "koschmieder"
    settings = (f"camera.samples={samples}", f"light.illuminance_lx={LIGHTS[light]}")
    width, height = map(int, size.split("x"))
    return staged((*settings, f"fog={{visibility_m: 100, airlight: {airlight}}}"), renderer, (width, height))


class Timed:
    """Stands before a part of the view renderer and adds up the time [s] that one of its methods takes."""

    def __init__(self, part: Any, method: str) -> None:
        self._part, self._method, self.spent = part, method, 0.0

    def __getattr__(self, name: str) -> Any:
        """The part's own methods, the one of interest by a stopwatch."""
        own = getattr(self._part, name)
        if name != self._method:
            return own

        def timed(*arguments: Any, **options: Any) -> Any:
            started = time.perf_counter()
            result = own(*arguments, **options)
            self.spent += time.perf_counter() - started
            return result

        return timed


class Case:
    """One renderer in one light at one size, ready to take frames."""

    def __init__(self, key: Key) -> None:
        described, roads = scenario(*key), network("motorway")
        config = described.run_config()
        camera, setback = config.camera.on(), config.camera.mount().setback
        self._view_renderer = ViewRenderer(config.world, config.camera, roads, signs(roads.route, SHOT))
        self._camera_sensor, self._rng = (
            config.camera.make_sensor(config.periods.camera_period),
            np.random.default_rng(1),
        )
        shots = [replace(SHOT, station=START + STEP * number) for number in range(ROUND)]
        self.traffic = [traffic(roads.route, shot) for shot in shots]
        self.poses = [mounted_pose(camera, one.position[0], float(one.heading[0]), setback) for one in self.traffic]
        self._render = self._view_renderer._renderer = Timed(self._view_renderer._renderer, "render")
        self._air = self._view_renderer._air = Timed(self._view_renderer._air, "radiance")

    def frame(self, number: int) -> list[float]:
        """Take a frame; seconds that each stage took."""
        number %= ROUND
        self._render.spent = self._air.spent = 0.0
        started = time.perf_counter()
        _, radiance = self._view_renderer.render(self.traffic[number], 0, self.poses[number], 0.1 * number)
        seen = time.perf_counter()
        self._camera_sensor.take(radiance, self._rng)
        render, air = self._render.spent, self._air.spent
        return [seen - started - render - air, render, air, time.perf_counter() - seen]

    def close(self) -> None:
        """Free the renderer."""
        self._view_renderer.close()


def triangles(state: TrafficState) -> int:
    """Number of triangles in the scene at full detail, the vehicles' among them."""
    roads = network("motorway")
    scene = build_scene(roads, signs(roads.route, SHOT), np.random.default_rng(1))
    copies = (*scene.scenery, *vehicle_batches(state, 0))
    return len(scene.ground.faces) + sum(len(scene.shapes[b.shape].faces) * len(b.transforms) for b in copies)


def measure(cases: dict[Key, Case], frames: int, repeat: int) -> Iterator[Row]:
    """A record for each case."""
    spent: dict[Key, list[NDArray[np.float64]]] = {key: [] for key in cases}
    for one in cases.values():
        for number in range(ROUND):
            one.frame(number)
    for _ in range(repeat):
        for key, one in cases.items():
            spent[key].append(1e3 * np.array([one.frame(number) for number in range(frames)]))
    for key, runs in spent.items():
        yield record(key, runs)


def record(key: Key, runs: list[NDArray[np.float64]]) -> Row:
    """One record: repetitions (frames, stages) [ms] of a case."""
    renderer, light, size, samples = key
    width, height = map(int, size.split("x"))
    whole, stages = [run.sum(axis=1) for run in runs], np.median(np.concatenate(runs), axis=0)
    return {
        "renderer": renderer,
        "light": light,
        "width": width,
        "height": height,
        "samples": samples,
        "ms_median": round(statistics.median(float(np.median(one)) for one in whole), 3),
        "ms_min": round(float(min(one.min() for one in whole)), 3),
    } | {f"ms_{name}": round(float(value), 3) for name, value in zip(STAGES, stages, strict=True)}


def table(records: list[Row]) -> list[str]:
    """Lines of the table of docs/benchmarks/performance.md: the fastest frames [ms] by day and night."""
    shown = [one for one in records if one["light"] in ("day", "night") and one["samples"] == 1]
    cells = {(one["renderer"], f"{one['light']} {one['width']}×{one['height']}"): one["ms_min"] for one in shown}
    cases = list(dict.fromkeys(case for _, case in cells))
    rows = []
    for renderer, told in (("cpu", "cpu"), ("opengl", "opengl on llvmpipe")):
        values = [cells.get((renderer, case), math.nan) for case in cases]
        rows.append((told, *(f"{one:.1f}" if one < 9.95 else f"{one:.0f}" for one in values)))
    return lines_of(("", *cases), rows)


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        docs=("benchmarks/performance.md", "frames"),
        renderer=(list(RENDERERS), "which", RENDERERS),
        light=(list(LIGHTS), "which", LIGHTS),
        size=(["160x120", "640x480"], "cameras, WIDTHxHEIGHT"),
        samples=([1], "samples a pixel side"),
        frames=(60, "frames a repetition"),
        repeat=(5, "repetitions"),
    )
    cases = {key: Case(key) for key in itertools.product(given.renderer, given.light, given.size, given.samples)}
    shown = triangles(next(iter(cases.values())).traffic[0])
    shared = {"triangles": shown, "vehicles": VEHICLES, "signs": SIGNS}
    records = [one | shared for one in measure(cases, given.frames, given.repeat)]
    for one in cases.values():
        one.close()
    publish(given, records, docs=table)


if __name__ == "__main__":
    main()
