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

    python benchmarks/frames.py [--json] [--docs] [--renderer cpu ...] [--light night ...] [--size 640x480 ...]
        [--samples 2 ...] [--frames 60] [--repeat 5]
"""

import argparse
import itertools
import json
import math
import statistics
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
from docs_table import write_table
from numpy.typing import NDArray

import fogsim
from fogsim.camera import mounted_pose
from fogsim.ego.view_rendering import ViewRenderer
from fogsim.scenario import Scenario, build
from fogsim.scene import build_scene, vehicle_batches
from fogsim.traffic.road.network import read_net, road_network
from fogsim.values import Lamp, RoadNetwork, Sign, SignMap, TrafficState

ROUTE = ("approach", "bank", "exit")
LANES = (-3.75, 0.0, 3.75)  # to the left of the route, which is the middle lane [m]
VEHICLES, SIGNS, START, STEP, ROUND = 30, 10, 400.0, 2.5, 20
SIZES = {  # length, width and height [m]
    "car": (4.5, 1.8, 1.5),
    "van": (5.9, 2.0, 2.6),
    "truck": (16.5, 2.5, 4.0),
    "bus": (12.0, 2.55, 3.2),
    "motorcycle": (2.1, 0.8, 1.5),
}
KINDS = ("car", "car", "truck", "car", "van", "car", "bus", "car", "car", "motorcycle")
LIGHTS = {"day": 10_000.0, "night": 0.5, "photons": 10_000.0}  # [lx]; the last with the airlight of photons
Key = tuple[str, str, str, int]
"""Renderer, light, size and samples a pixel side of a case."""

RENDERERS = ("opengl", "cpu")
STAGES = ("scene", "render", "air", "camera")


def scenario(renderer: str, light: str, size: str, samples: int) -> Scenario:
    """The scenario with homogeneous fog and a camera of a given size and antialiasing."""
    width, height = size.split("x")
    camera = (f"camera.width={width}", f"camera.height={height}", f"camera.samples={samples}")
    airlight = "photons" if light == "photons" else "koschmieder"
    lit = (
        f"fog={{visibility_m: 100, airlight: {airlight}}}",
        f"light.illuminance_lx={LIGHTS[light]}",
        f"renderer={renderer}",
    )
    return fogsim.load_scenario("motorway_fog_bank", [*camera, *lit])


def read_network() -> RoadNetwork:
    """Roads of the scenario."""
    described = fogsim.load_scenario("motorway_fog_bank")
    net = build.traffic_setup(described).net
    if net is None:
        raise ValueError("the scenario motorway_fog_bank has no net")
    return road_network(read_net(net), ROUTE)


def place(route: NDArray[np.float64], station: float, left: float) -> tuple[NDArray[np.float64], float]:
    """Point next to the route and the direction there."""
    stations = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(route[:, :2], axis=0), axis=1))))
    here, ahead = (np.array([np.interp(s, stations, route[:, i]) for i in range(3)]) for s in (station, station + 1.0))
    heading = math.atan2(ahead[1] - here[1], ahead[0] - here[0])
    return here + left * np.array([-math.sin(heading), math.cos(heading), 0.0]), heading


def signs_beside(route: NDArray[np.float64]) -> SignMap:
    """Signs to the right of the road."""
    signs = []
    for number in range(SIGNS):
        (x, y, z), heading = place(route, START + 65.0 + 25.0 * number, -6.0)
        signs.append(Sign(f"sign {number}", "speed_limit", 80 / 3.6, (x, y, z + 2.2), heading, 0.75))
    return SignMap(tuple(signs))


def traffic_at(route: NDArray[np.float64], travelled: float) -> TrafficState:
    """The ego and the vehicles ahead of it; all have travelled as far."""
    kinds = ["car", *(KINDS[number % len(KINDS)] for number in range(VEHICLES))]
    stations = [0.0, *(12.0 + 8.0 * number + SIZES[kind][0] for number, kind in enumerate(kinds[1:]))]
    lanes = [0.0, *(LANES[number % 3] for number in range(VEHICLES))]
    places = [place(route, START + travelled + s, lane) for s, lane in zip(stations, lanes, strict=True)]
    n, lit = len(kinds), Lamp.POSITION | Lamp.LOW_BEAM | Lamp.REAR_FOG
    size = np.array([SIZES[kind] for kind in kinds])
    return TrafficState(
        time=0.0,
        ids=tuple(f"vehicle {number}" for number in range(n)),
        types=tuple(kinds),
        position=np.array([position for position, _ in places]),
        heading=np.array([heading for _, heading in places]),
        speed=np.full(n, 25.0),
        acceleration=np.zeros(n),
        length=size[:, 0],
        width=size[:, 1],
        height=size[:, 2],
        lane=("",) * n,
        lamps=np.full(n, int(lit), np.int32),
        paint=np.random.default_rng(1).uniform(0.05, 0.6, (n, 3)),
    )


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
    """One renderer in one light at one size, ready to take frames.

    Parameters
    ----------
    key : Key
        Renderer, light, size, and samples a pixel side.
    network : RoadNetwork
        The roads.
    """

    def __init__(self, key: Key, network: RoadNetwork) -> None:
        described = scenario(*key)
        camera, setback = build.camera(described), build.camera_mount(described).setback
        self._view_renderer = ViewRenderer(described, network, signs_beside(network.route))
        self._camera_sensor, self._rng = build.camera_sensor(described), np.random.default_rng(1)
        self.traffic = [traffic_at(network.route, STEP * number) for number in range(ROUND)]
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


def triangles(network: RoadNetwork, state: TrafficState) -> int:
    """Number of triangles in the scene at full detail, the vehicles' among them."""
    scene = build_scene(network, signs_beside(network.route), np.random.default_rng(1))
    copies = (*scene.scenery, *vehicle_batches(state, 0))
    return len(scene.ground.faces) + sum(len(scene.shapes[b.shape].faces) * len(b.transforms) for b in copies)


def measure(cases: dict[Key, Case], frames: int, repeat: int) -> Iterator[dict[str, Any]]:
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


def record(key: Key, runs: list[NDArray[np.float64]]) -> dict[str, Any]:
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


def table(records: list[dict[str, Any]]) -> list[str]:
    """Lines of the table of docs/benchmarks/performance.md: the fastest frames [ms] by day and night."""
    shown = [one for one in records if one["light"] in ("day", "night") and one["samples"] == 1]
    cells = {(one["renderer"], f"{one['light']} {one['width']}×{one['height']}"): one["ms_min"] for one in shown}
    cases = list(dict.fromkeys(case for _, case in cells))
    lines = [f"| | {' | '.join(cases)} |", "|---" * (len(cases) + 1) + "|"]
    for renderer, told in (("cpu", "cpu"), ("opengl", "opengl on llvmpipe")):
        values = [cells.get((renderer, case), math.nan) for case in cases]
        lines.append(f"| {told} | {' | '.join(f'{one:.1f}' if one < 9.95 else f'{one:.0f}' for one in values)} |")
    return lines


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print a list of flat records")
    parser.add_argument("--docs", action="store_true", help="write the table of docs/benchmarks/performance.md")
    parser.add_argument("--renderer", action="append", choices=RENDERERS, help="default: all")
    parser.add_argument("--light", action="append", choices=LIGHTS, help="default: all")
    parser.add_argument("--size", action="append", help="camera WIDTHxHEIGHT (default 160x120 and 640x480)")
    parser.add_argument("--samples", action="append", type=int, help="samples a pixel side (default 1)")
    parser.add_argument("--frames", type=int, default=60, help="frames a repetition")
    parser.add_argument("--repeat", type=int, default=5, help="repetitions")
    arguments = parser.parse_args()
    keys = list(
        itertools.product(
            arguments.renderer or RENDERERS,
            arguments.light or LIGHTS,
            arguments.size or ["160x120", "640x480"],
            arguments.samples or [1],
        )
    )
    network = read_network()
    cases = {key: Case(key, network) for key in keys}
    shared = {"triangles": triangles(network, cases[keys[0]].traffic[0]), "vehicles": VEHICLES, "signs": SIGNS}
    records = [one | shared for one in measure(cases, arguments.frames, arguments.repeat)]
    for one in cases.values():
        one.close()
    if arguments.docs:
        write_table("benchmarks/performance.md", "frames", table(records))
    if arguments.json:
        print(json.dumps(records, indent=2))
        return
    print(f"{shared['triangles']} triangles, {VEHICLES} vehicles, {SIGNS} signs; milliseconds a frame")
    print(
        f"{'renderer':10}{'light':7}{'size':>9}{'samples':>9}{'median':>9}{'min':>9}"
        + "".join(f"{name:>9}" for name in STAGES)
    )
    for one in records:
        size = f"{one['width']}x{one['height']}"
        figures = [one[f"ms_{name}"] for name in ("median", "min", *STAGES)]
        print(
            f"{one['renderer']:10}{one['light']:7}{size:>9}{one['samples']:9}"
            + "".join(f"{value:9.2f}" for value in figures)
        )


if __name__ == "__main__":
    main()
