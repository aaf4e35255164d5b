"""Staged daytime scenes in fog of any density: a straight country road, its trees, vehicles on it."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere import Droplets, airlight_from_illuminance, fogged_radiance
from fogsim.camera import Sensor, expose
from fogsim.render import Renderer, make_renderer
from fogsim.scene import build_scene, vehicle_batches
from fogsim.values import (
    Camera,
    CameraPose,
    FogField,
    Lamp,
    Lane,
    LaneMarking,
    RoadNetwork,
    SignMap,
    TrafficState,
    View,
)
from fogsim.values.fog import airlight_share
from fogsim.values.pinhole import ray_from_pixel

ILLUMINANCE = 10_000.0  # [lx] an overcast day
AIRLIGHT = 3000.0  # [cd/m²] near E/π, that of a white horizontal surface under it
_LAYER = 250.0
"""Height of a layer of fog [m]."""

_NOISELESS = Sensor(saturation_luminance=AIRLIGHT, full_well=1e9, read_noise=0.0)
"""A sensor that the airlight fills: pixel value 255."""

_LENGTH, _WIDTH = 1500.0, 3.5  # of the lanes [m]


def straight_road(length: float = _LENGTH) -> RoadNetwork:
    """Two lanes of opposite directions along x, `length` [m] long; too slow for guard rails, too fast for a town."""

    def lane(name: str, left: float, ways: int) -> Lane:
        line = np.array([[-50.0, left, 0.0], [length, left, 0.0]])[::ways]
        return Lane(name, name, line, _WIDTH, 70 / 3.6, LaneMarking.DASHED, LaneMarking.SOLID, outermost=True)

    forward = lane("out", 0.0, 1)
    return RoadNetwork((forward, lane("back", _WIDTH, -1)), forward.centreline)


@dataclass(frozen=True, slots=True)
class StagedVehicle:
    """A vehicle on the road."""

    kind: str = "car"  # "car", "van", "truck"
    # length, width, height: its size [m]
    length: float = 4.5
    width: float = 1.8
    height: float = 1.5
    paint: tuple[float, float, float] = (0.2, 0.2, 0.2)  # Reflectance of its paint, red first [-]
    left: float = 0.1  # How far its middle is left of the camera [m]
    name: str = "followed"  # Its id, which chooses among the shapes that its size leaves open


@contextmanager
def road_renderer(*, trees: bool = True) -> Iterator[Renderer]:
    """Renderer of the straight road, with or without trees next to it."""
    scene = build_scene(straight_road(), SignMap(()), np.random.default_rng(0))
    renderer = make_renderer("auto", scene if trees else replace(scene, scenery=()), illuminance=ILLUMINANCE)
    try:
        yield renderer
    finally:
        renderer.close()


@contextmanager
def views(camera: Camera, cars: Sequence[tuple[float, float]], *, trees: bool) -> Iterator[tuple[View, CameraPose]]:
    """Draw the road without air; `cars` are distances of near ends ahead and of middles to the left [m]."""
    pose = CameraPose((0.0, 0.0, camera.mount_height), heading=0.0)
    with road_renderer(trees=trees) as renderer:
        yield renderer.render(vehicle_batches(standing_cars(cars), None), camera, pose), pose


def standing_cars(cars: Sequence[tuple[float, float]]) -> TrafficState:
    """Cars along the road; `cars` are places of near ends along it and of middles to the left [m]."""
    return staged_traffic([(rear, StagedVehicle(left=left, name=f"car {i}")) for i, (rear, left) in enumerate(cars)])


def staged_traffic(vehicles: Sequence[tuple[float, StagedVehicle]], speed: float = 0.0) -> TrafficState:
    """Vehicles along the road, each with the place of its near end [m]; all drive at `speed` [m/s]."""
    n, kinds = len(vehicles), [vehicle for _, vehicle in vehicles]
    return TrafficState(
        time=0.0,
        ids=tuple(vehicle.name for vehicle in kinds),
        types=tuple(vehicle.kind for vehicle in kinds),
        position=np.array([(rear + vehicle.length, vehicle.left, 0.0) for rear, vehicle in vehicles]).reshape(n, 3),
        heading=np.zeros(n),
        speed=np.full(n, speed),
        acceleration=np.zeros(n),
        length=np.array([vehicle.length for vehicle in kinds]),
        width=np.array([vehicle.width for vehicle in kinds]),
        height=np.array([vehicle.height for vehicle in kinds]),
        lane=("",) * n,
        lamps=np.full(n, int(Lamp.NONE), np.int32),
        paint=np.array([vehicle.paint for vehicle in kinds]).reshape(n, 3),
    )


def foggy_radiance(
    view: View,
    pose: CameraPose,
    camera: Camera,
    extinction: float,
    albedo: float | None = None,
    droplets: Droplets = Droplets.MODERATE_RADIATION,
) -> NDArray[np.float32]:
    """Radiance at the camera in homogeneous fog (rows, cols, 3) [cd/m²]; Koschmieder's airlight without `albedo`."""
    if albedo is None:
        fog = FogField(extinction, (AIRLIGHT,) * 3)
    else:
        fog = FogField(extinction, airlight_from_illuminance(ILLUMINANCE, airlight_share(albedo)), top=_LAYER)
        fog = replace(fog, ground_albedo=albedo)
    return fogged_radiance(view, fog, pose.position, ray_from_pixel(camera, pose), droplets)


def foggy_image(view: View, pose: CameraPose, camera: Camera, extinction: float) -> NDArray[np.uint8]:
    """Image of a view in homogeneous fog, the airlight at pixel value 255, without noise."""
    radiance = foggy_radiance(view, pose, camera, extinction)
    return expose(radiance, _NOISELESS, camera.response, np.random.default_rng(0)).astype(np.uint8)
