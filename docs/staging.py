"""Pictures for the docs, staged without SUMO: place, vehicles, signs, light and fog, seen as the closed loop sees them.

What is called is what `fogsim run` calls for a frame: `ViewRenderer.render` draws the scene and puts the air before it,
the scenario's camera sensor exposes it.
"""

import math
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

import fogsim
from fogsim.camera import mounted_pose
from fogsim.scenario import Scenario
from fogsim.simulation.ego.view_rendering import ViewRenderer
from fogsim.traffic.road.network import read_net, road_network
from fogsim.values import (
    CameraPose,
    Lamp,
    Lane,
    LaneMarking,
    RoadNetwork,
    Sign,
    SignalColour,
    SignalState,
    SignMap,
    TrafficState,
)

CHECKOUT = Path(__file__).resolve().parents[1]
PICTURES = CHECKOUT / "docs" / "pictures"
NETS = {
    "motorway": ("scenarios/motorway_fog_bank/motorway.net.xml", ("approach", "bank", "exit")),
    "town": ("tests/data/grid/grid.net.xml", ("left0A0", "A0B0", "B0C0", "C0right0")),
}
"""Net of each place, and the edges of the route along which stations count."""

SIZES = {
    "car": (4.5, 1.8, 1.5),
    "van": (5.9, 2.0, 2.6),
    "truck": (16.5, 2.5, 4.0),
    "bus": (12.0, 2.55, 3.2),
    "motorcycle": (2.1, 0.8, 1.5),
}
"""Length, width and height [m]."""

PAINTS = ((0.62, 0.63, 0.64), (0.05, 0.09, 0.25), (0.80, 0.80, 0.79), (0.30, 0.03, 0.03), (0.03, 0.03, 0.035))
LIT = Lamp.POSITION | Lamp.LOW_BEAM
TITLE = 22
"""Height of the line above a picture [px]."""


@dataclass(frozen=True, slots=True)
class Vehicle:
    """A vehicle: its kind, how far its near end is ahead of the camera's car and to the left [m], and its lamps."""

    kind: str
    ahead: float
    left: float = 0.0
    lamps: Lamp = LIT
    oncoming: bool = False


@dataclass(frozen=True, slots=True)
class Board:
    """A sign by its kind, distance ahead of the camera's car and to the left [m], and what it says [km/h]."""

    kind: str
    ahead: float
    left: float = -7.6
    value: float = 0.0
    diameter: float = 0.9


@dataclass(frozen=True, slots=True)
class Shot:
    """What is to be photographed."""

    title: str  # line above the picture
    settings: tuple[str, ...] = ()  # keys of the scenario that differ, as after ``--set``
    place: str = "motorway"  # where; see `network`
    station: float = 400.0  # of the car's front bumper along the route [m]
    vehicles: tuple[Vehicle, ...] = ()  # what stands ahead
    boards: tuple[Board, ...] = ()
    lamps: Lamp = LIT  # lit lamps of the camera's car
    time: float = 0.0  # since the run began [s]


@dataclass(frozen=True, slots=True)
class Taken:
    """A picture, and the light that it was made of."""

    image: NDArray[np.uint8]
    radiance: NDArray[np.float32] = field(repr=False)
    scenario: Scenario
    pose: CameraPose


@cache
def network(place: str) -> RoadNetwork:
    """Roads of a place: a key of `NETS`, or "bend" for a country road that turns left."""
    if place == "bend":
        return bend()
    path, route = NETS[place]
    return road_network(read_net(CHECKOUT / path), route)


def bend(straight: float = 60.0, radius: float = 140.0, width: float = 3.5) -> RoadNetwork:
    """Two lanes: straight on, then along an arc to the left."""

    def line(left: float) -> NDArray[np.float64]:
        turn = np.linspace(0.0, 0.5 * math.pi, 90)
        arc = np.column_stack(((radius - left) * np.sin(turn) + straight, radius - (radius - left) * np.cos(turn)))
        plane = np.vstack(([-40.0, left], arc))
        return np.column_stack((plane, np.zeros(len(plane))))

    def lane(name: str, centreline: NDArray[np.float64]) -> Lane:
        return Lane(name, name, centreline, width, 80 / 3.6, LaneMarking.DASHED, LaneMarking.SOLID, outermost=True)

    return RoadNetwork((lane("out", line(0.0)), lane("back", line(width)[::-1])), line(0.0))


def along(route: NDArray[np.float64], station: float, left: float = 0.0) -> tuple[NDArray[np.float64], float]:
    """Point next to a route, and the direction there."""
    stations = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(route[:, :2], axis=0), axis=1))))
    here, ahead = (np.array([np.interp(s, stations, route[:, i]) for i in range(3)]) for s in (station, station + 1.0))
    heading = math.atan2(ahead[1] - here[1], ahead[0] - here[0])
    return here + left * np.array([-math.sin(heading), math.cos(heading), 0.0]), heading


def scenario(settings: tuple[str, ...], renderer: str, size: tuple[int, int]) -> Scenario:
    """The motorway's scenario with other settings, in clear air unless they say otherwise."""
    camera = (f"camera.width={size[0]}", f"camera.height={size[1]}", "camera.samples=2")
    return fogsim.load_scenario(
        "motorway_fog_bank", ["fog={visibility_m: inf}", f"renderer={renderer}", *camera, *settings]
    )


def photograph(shot: Shot, renderer: str = "cpu", size: tuple[int, int] = (480, 360)) -> Taken:
    """Take a picture."""
    described, roads = scenario(shot.settings, renderer, size), network(shot.place)
    state = replace(traffic(roads.route, shot), signals=traffic_lights(roads))
    config = described.run_config()
    camera, setback = config.camera.on(), config.camera.mount().setback
    pose = mounted_pose(camera, state.position[0], float(state.heading[0]), setback)
    view_renderer = ViewRenderer(config.world, config.camera, roads, signs(roads.route, shot))
    try:
        _, radiance = view_renderer.render(state, 0, pose, shot.time)
    finally:
        view_renderer.close()
    image = (
        config.camera.make_sensor(config.periods.camera_period)
        .take(radiance, np.random.default_rng(1))
        .astype(np.uint8)
    )
    return Taken(image, radiance, described, pose)


def traffic(route: NDArray[np.float64], shot: Shot) -> TrafficState:
    """The camera's car, in row 0, and the vehicles ahead of it."""
    everyone = (Vehicle("car", -SIZES["car"][0], 0.0, shot.lamps), *shot.vehicles)
    size = np.array([SIZES[one.kind] for one in everyone])
    # A position is that of the front bumper: of those ahead the far end, of those who come the near one.
    ahead = [one.ahead + (0.0 if one.oncoming else SIZES[one.kind][0]) for one in everyone]
    places = [along(route, shot.station + a, one.left) for a, one in zip(ahead, everyone, strict=True)]
    turned = [math.pi if one.oncoming else 0.0 for one in everyone]
    n = len(everyone)
    return TrafficState(
        time=shot.time,
        ids=tuple(f"vehicle {number}" for number in range(n)),
        types=tuple(one.kind for one in everyone),
        position=np.array([place for place, _ in places]),
        heading=np.array([heading + turn for (_, heading), turn in zip(places, turned, strict=True)]),
        speed=np.full(n, 25.0),
        acceleration=np.zeros(n),
        length=size[:, 0],
        width=size[:, 1],
        height=size[:, 2],
        lane=("",) * n,
        lamps=np.array([int(one.lamps) for one in everyone], np.int32),
        paint=np.array([PAINTS[number % len(PAINTS)] for number in range(n)]),
    )


def traffic_lights(roads: RoadNetwork) -> SignalState:
    """Traffic lights: green for those who drive east or west, red for the others."""
    heads = roads.signal_heads
    return SignalState(
        ids=tuple(head.signal_id for head in heads),
        lane=tuple(head.lane_id for head in heads),
        position=np.array([head.position for head in heads]).reshape(-1, 3),
        heading=np.array([head.heading for head in heads]),
        diameter=np.array([head.diameter for head in heads]),
        colour=tuple(
            SignalColour.GREEN if abs(math.cos(head.heading)) > math.sqrt(0.5) else SignalColour.RED for head in heads
        ),
    )


def signs(route: NDArray[np.float64], shot: Shot) -> SignMap:
    """Signs of a shot."""
    made = []
    for number, board in enumerate(shot.boards):
        (x, y, z), heading = along(route, shot.station + board.ahead, board.left)
        made.append(Sign(f"sign {number}", board.kind, board.value / 3.6, (x, y, z + 2.4), heading, board.diameter))
    return SignMap(tuple(made))


def sheet(pictures: list[tuple[str, NDArray[np.uint8]]], columns: int) -> Image.Image:
    """Pictures of one size in rows, each under its title."""
    height, width = pictures[0][1].shape[:2]
    rows = math.ceil(len(pictures) / columns)
    whole = Image.new("RGB", (columns * width, rows * (height + TITLE)), "white")
    pen, font = ImageDraw.Draw(whole), ImageFont.load_default(14)
    for number, (title, picture) in enumerate(pictures):
        left, top = corner(number, columns, (width, height))
        pen.text((left + 6, top - TITLE + 3), title, fill="black", font=font)
        whole.paste(Image.fromarray(picture), (left, top))
    return whole


def magnified(
    picture: NDArray[np.uint8], middle: tuple[int, int], size: tuple[int, int], times: int, place: tuple[int, int]
) -> NDArray[np.uint8]:
    """The picture with a part of it shown larger in a frame, pixel by pixel.

    Middle and size (columns, rows) of the part are in pixels, as the place of the frame's upper left corner is.
    """
    u, v = middle[0] - size[0] // 2, middle[1] - size[1] // 2
    part = np.kron(picture[v : v + size[1], u : u + size[0]], np.ones((times, times, 1), np.uint8))
    whole = Image.fromarray(picture)
    whole.paste(Image.fromarray(np.pad(part, ((2, 2), (2, 2), (0, 0)), constant_values=255)), place)
    return np.array(whole)


def corner(number: int, columns: int, size: tuple[int, int]) -> tuple[int, int]:
    """Where the upper left corner of a sheet's picture is [px]."""
    row, column = divmod(number, columns)
    return column * size[0], row * (size[1] + TITLE) + TITLE
