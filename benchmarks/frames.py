"""Time of a camera frame: from where the vehicles are to an 8-bit image, in fog and with noise.

What is timed is what the closed loop does for a frame (fogsim/onboard.py), stage by stage: batches of vehicles
("scene"), drawing to radiance, distance and ids ("render"), fog and lamplight ("air"), exposure with photon and read
noise, response curve and quantisation ("camera"). Traffic and estimators are not in it.

The scene is the road of the scenario motorway_fog_bank with trees, rails and posts, 30 vehicles of every kind with lit
lamps on its lanes 12 … 250 m ahead and 10 signs beside it, in homogeneous fog of 100 m visibility. The camera
drives on by 2.5 m a frame, over 50 m and again from the start. Repetitions of all renderers alternate, and each record
has the median of the repetitions' medians and the fastest frame; on a machine that does other work too, only the
fastest says something.

    python benchmarks/frames.py [--json] [--renderer cpu …] [--light night …] [--size 640x480 …] [--frames 60]
        [--repeat 5]
"""

import argparse
import itertools
import json
import math
import statistics
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import fogsim
from fogsim.atmosphere import Air
from fogsim.camera import Photographer, mounted_pose
from fogsim.render import RENDERERS, Renderer, make_renderer
from fogsim.scenario import Scenario, build
from fogsim.scene import build_scene, vehicle_batches
from fogsim.traffic.network import read_net, road_network
from fogsim.values import Camera, CameraPose, Lamp, RoadNetwork, Scene, Sign, SignMap, TrafficState

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
LIGHTS = {"day": 10_000.0}
Key = tuple[str, str, str]
"""Renderer, light and size of a case."""

STAGES = ("scene", "render", "air", "camera")


def scenario(light: str, size: str) -> Scenario:
    """The scenario with homogeneous fog and a camera of a given size."""
    width, height = size.split("x")
    overrides = (f"camera.width={width}", f"camera.height={height}", "fog={visibility_m: 100}")
    return fogsim.load_scenario("motorway_fog_bank", [*overrides, f"light.illuminance_lx={LIGHTS[light]}"])


def read_network() -> RoadNetwork:
    """Roads of the scenario."""
    described = fogsim.load_scenario("motorway_fog_bank")
    net = build.traffic_setup(described).net
    if net is None:
        raise ValueError("the scenario motorway_fog_bank has no net")
    return road_network(read_net(net), ROUTE)


def place(route: NDArray[np.float64], station: float, left: float) -> tuple[NDArray[np.float64], float]:
    """Point beside the route and the direction there."""
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
    """The ego and the vehicles ahead of it, all of which have travelled as far."""
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


@dataclass(frozen=True, slots=True)
class Case:
    """One renderer in one light at one size, ready to take frames."""

    renderer: Renderer
    camera: Camera
    air: Air
    photographer: Photographer
    traffic: tuple[TrafficState, ...]
    poses: tuple[CameraPose, ...]
    rng: np.random.Generator

    def frame(self, number: int) -> list[float]:
        """Take a frame; seconds spent in each stage."""
        number %= len(self.poses)
        state, pose = self.traffic[number], self.poses[number]
        times = [time.perf_counter()]
        batches = vehicle_batches(state, 0)
        times.append(time.perf_counter())
        view = self.renderer.render(batches, self.camera, pose)
        times.append(time.perf_counter())
        radiance = self.air.radiance(view, self.camera, pose, time=0.1 * number)
        times.append(time.perf_counter())
        self.photographer.take(radiance, self.rng)
        times.append(time.perf_counter())
        return [after - before for before, after in itertools.pairwise(times)]


def world() -> tuple[Scene, RoadNetwork]:
    """The scene, and the roads that it was made of."""
    network = read_network()
    return build_scene(network, signs_beside(network.route), np.random.default_rng(1)), network


def case(renderer: str, light: str, size: str, scene: Scene, route: NDArray[np.float64]) -> Case:
    """Everything that a frame needs."""
    described = scenario(light, size)
    camera = build.camera(described)
    traffic = tuple(traffic_at(route, STEP * number) for number in range(ROUND))
    poses = tuple(
        mounted_pose(camera, state.position[0], float(state.heading[0]), described.camera.setback_m)
        for state in traffic
    )
    return Case(
        renderer=make_renderer(renderer, scene, LIGHTS[light]),
        camera=camera,
        air=Air(build.fog_field(described, route)),
        photographer=build.photographer(described),
        traffic=traffic,
        poses=poses,
        rng=np.random.default_rng(1),
    )


def triangles(scene: Scene, state: TrafficState) -> int:
    """Number of triangles in the scene at full detail, the vehicles' among them."""
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
    renderer, light, size = key
    width, height = map(int, size.split("x"))
    whole, stages = [run.sum(axis=1) for run in runs], np.median(np.concatenate(runs), axis=0)
    return {
        "renderer": renderer,
        "light": light,
        "width": width,
        "height": height,
        "ms_median": round(statistics.median(float(np.median(one)) for one in whole), 3),
        "ms_min": round(float(min(one.min() for one in whole)), 3),
    } | {f"ms_{name}": round(float(value), 3) for name, value in zip(STAGES, stages, strict=True)}


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print a list of flat records")
    parser.add_argument("--renderer", action="append", choices=list(RENDERERS), help="default: all")
    parser.add_argument("--light", action="append", choices=LIGHTS, help="default: all")
    parser.add_argument("--size", action="append", help="camera WIDTHxHEIGHT (default 160x120 and 640x480)")
    parser.add_argument("--frames", type=int, default=60, help="frames a repetition")
    parser.add_argument("--repeat", type=int, default=5, help="repetitions")
    arguments = parser.parse_args()
    keys = list(
        itertools.product(
            arguments.renderer or list(RENDERERS), arguments.light or LIGHTS, arguments.size or ["160x120", "640x480"]
        )
    )
    scene, network = world()
    cases = {key: case(*key, scene, network.route) for key in keys}
    state = next(iter(cases.values())).traffic[0]
    shared = {"triangles": triangles(scene, state), "vehicles": VEHICLES, "signs": SIGNS}
    records = [one | shared for one in measure(cases, arguments.frames, arguments.repeat)]
    for one in cases.values():
        one.renderer.close()
    if arguments.json:
        print(json.dumps(records, indent=2))
        return
    print(f"{shared['triangles']} triangles, {VEHICLES} vehicles, {SIGNS} signs; milliseconds a frame")
    print(f"{'renderer':10}{'light':7}{'size':>9}{'median':>9}{'min':>9}" + "".join(f"{name:>9}" for name in STAGES))
    for one in records:
        size = f"{one['width']}x{one['height']}"
        figures = [one[f"ms_{name}"] for name in ("median", "min", *STAGES)]
        print(f"{one['renderer']:10}{one['light']:7}{size:>9}" + "".join(f"{value:9.2f}" for value in figures))


if __name__ == "__main__":
    main()
