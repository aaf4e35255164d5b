"""Pictures for `estimator_accuracy.py`: instants of motorway traffic, drawn again under any camera, marks and leader.

A drive of the motorway scenario gives the instants; then its own lane is emptied and a vehicle of the traffic's kinds
is put ahead or not, lane marks are painted or not, and the picture is fogged and exposed as asked for.
"""

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import fogsim
from fogsim.atmosphere import Air
from fogsim.camera import Sensor, expose, mounted_pose
from fogsim.render import make_renderer
from fogsim.scenario import build
from fogsim.scene import build_scene, vehicle_batches
from fogsim.traffic.road.network import read_net, road_network
from fogsim.units import LUMINANCE_WEIGHTS, extinction_from_visibility
from fogsim.values import (
    Camera,
    CameraPose,
    FogField,
    LaneMarking,
    LeadMeasurement,
    Pavement,
    SignMap,
    TrafficState,
    View,
)
from fogsim.values.scene import USUAL_PAVEMENT

CAMERAS = (
    (640, 480, 58.0, 1.38, 2.0),
    (688, 515, 45.0, 1.3, 1.0),
    (1280, 720, 40.0, 1.6, 3.0),
    (512, 383, 70.0, 2.0, 4.0),
)
"""Width, height [px], horizontal field of view [deg], mount height [m] and pitch [deg]."""

SCENARIO, ROUTE = "motorway_fog_bank", ("approach", "bank", "exit")
INSTANTS_APART = 4.0  # [s]
NEAREST, FARTHEST = 12.0, 80.0  # of the vehicle ahead, even in its logarithm [m]
OWN_LANE = 2.0  # half of what is emptied before the ego [m]
RANGE_DEVIATION = 0.25  # of the told range [m], as the scenario's radar has
SETBACK = 1.7  # of the camera behind the front bumper [m]


@dataclass(frozen=True)
class Instant:
    """One moment of the drive: everyone, and the row of the ego."""

    state: TrafficState
    ego: int


@dataclass(frozen=True)
class Drive:
    """Instants, and what is the same in all of them."""

    instants: tuple[Instant, ...]
    signs: SignMap
    fog: FogField


def drive(count: int, seed: int) -> Drive:
    """Drive in running traffic with a camera of a few pixels, and keep where everyone was."""
    small = ["camera.width=64", "camera.height=48", "fog.visibility_m=200", "clocks.camera_period_s=0.5"]
    scenario = fogsim.load_scenario(SCENARIO, [*small, f"duration_s={INSTANTS_APART * count}"])
    steps = list(fogsim.run(scenario, seed))
    truth = steps[0].truth
    kept = [step for step in steps if step.index % round(INSTANTS_APART / 0.5) == 0][:count]
    return Drive(tuple(Instant(step.traffic, step.ego) for step in kept), truth.signs, truth.fog)


def camera(number: int) -> Camera:
    """One of the cameras, with the scenario's response."""
    width, height, view, mount, pitch = CAMERAS[number]
    keys = {"width": width, "height": height, "field_of_view_deg": view, "mount_height_m": mount, "pitch_deg": pitch}
    return build.camera_config(
        fogsim.load_scenario(SCENARIO, [f"camera.{key}={value}" for key, value in keys.items()])
    ).on()


class Road:
    """The scenario's road, with lane marks and without, ready to be drawn; its pavement may be another."""

    def __init__(self, signs: SignMap, pavement: Pavement = USUAL_PAVEMENT) -> None:
        scenario = fogsim.load_scenario(SCENARIO)
        network = road_network(read_net(build.traffic_setup(scenario).net), ROUTE)
        bare = [dataclasses.replace(one, left=LaneMarking.NONE, right=LaneMarking.NONE) for one in network.lanes]
        networks = {True: network, False: dataclasses.replace(network, lanes=tuple(bare))}
        self._renderers = {
            marks: make_renderer(
                "auto",
                build_scene(roads, signs, np.random.default_rng(scenario.scenery_seed), pavement=pavement),
                scenario.light.illuminance_lx,
            )
            for marks, roads in networks.items()
        }

    def view(self, state: TrafficState, ego: int, seen_by: Camera, *, marks: bool) -> tuple[View, CameraPose]:
        """Draw an instant without air."""
        pose = mounted_pose(seen_by, state.position[ego], float(state.heading[ego]), SETBACK)
        return self._renderers[marks].render(vehicle_batches(state, ego), seen_by, pose), pose


def _ahead_and_left(state: TrafficState, ego: int) -> NDArray[np.float64]:
    """(n, 2) places in the ego's axes [m]."""
    heading, offset = float(state.heading[ego]), state.position[:, :2] - state.position[ego, :2]
    axes = np.array([[math.cos(heading), math.sin(heading)], [-math.sin(heading), math.cos(heading)]])
    return offset @ axes.T


def without_leader(instant: Instant) -> Instant:
    """The same instant with no one ahead in the own lane."""
    state, ego = instant.state, instant.ego
    ahead, left = _ahead_and_left(state, ego).T
    same = np.array([lane == state.lane[ego] for lane in state.lane])
    rows = np.flatnonzero(~((ahead > 0) & (same | (np.abs(left) < OWN_LANE))))
    return Instant(_rows(state, rows), int(np.flatnonzero(rows == ego)[0]))


def with_leader(free: Instant, rng: np.random.Generator) -> tuple[Instant, LeadMeasurement]:
    """A vehicle of the traffic's kinds ahead in an empty lane, and its range as a radar measures it."""
    state, ego = free.state, free.ego
    others = [row for row in range(len(state.ids)) if row != ego] or [ego]
    kind = int(rng.choice(others))
    gap = float(np.exp(rng.uniform(math.log(NEAREST), math.log(FARTHEST))))
    heading = float(state.heading[ego])
    away = (gap + float(state.length[kind])) * np.array([math.cos(heading), math.sin(heading), 0.0])
    both = _rows(state, np.array([*range(len(state.ids)), kind]))
    position, turned = both.position.copy(), both.heading.copy()
    position[-1], turned[-1] = state.position[ego] + away, heading
    moved = dataclasses.replace(both, ids=(*state.ids, "leader"), position=position, heading=turned)
    return Instant(moved, ego), LeadMeasurement(gap + float(rng.normal(0.0, RANGE_DEVIATION)), 0.0)


def _rows(state: TrafficState, rows: NDArray[np.int64]) -> TrafficState:
    """Some of the vehicles."""
    kept = {}
    for field in dataclasses.fields(state):
        value = getattr(state, field.name)
        if isinstance(value, tuple):
            kept[field.name] = tuple(value[row] for row in rows)
        elif isinstance(value, np.ndarray) and len(value):  # what is not known of anybody is empty
            kept[field.name] = value[rows]
    return dataclasses.replace(state, **kept)


def photograph(
    seen: tuple[View, CameraPose], by: Camera, fog: FogField, visibility: float, levels: float, rng: np.random.Generator
) -> NDArray[np.uint8] | NDArray[np.uint16]:
    """Fog a view evenly, and expose it such that the airlight has so many of 255 levels of light."""
    view, pose = seen
    field = dataclasses.replace(fog, extinction=extinction_from_visibility(visibility), banks=())
    radiance = Air(field).radiance(view, by, pose)
    saturation = float(np.dot(LUMINANCE_WEIGHTS, field.airlight)) * 255.0 / levels
    return expose(radiance, Sensor(saturation), by.response, rng)
