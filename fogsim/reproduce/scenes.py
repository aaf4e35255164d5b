"""Staged daytime scenes in fog of any density: a straight country road, its trees, vehicles on it."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere import fogged_radiance
from fogsim.camera import Sensor, expose
from fogsim.render import make_renderer
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
from fogsim.values.pinhole import ray_from_pixel

ILLUMINANCE = 10_000.0  # [lx] an overcast day
AIRLIGHT = 3000.0  # [cd/m²] near E/π, that of a white horizontal surface under it
NOISELESS = Sensor(saturation_luminance=AIRLIGHT, full_well=1e9, read_noise=0.0)
"""A sensor that the airlight fills: pixel value 255."""

_LENGTH, _WIDTH = 1500.0, 3.5  # of the lanes [m]
_CAR = (4.5, 1.8, 1.5)  # length, width and height [m]


def straight_road() -> RoadNetwork:
    """Two lanes of opposite directions, straight along x; too slow for guard rails, too fast for a town."""

    def lane(name: str, left: float, ways: int) -> Lane:
        line = np.array([[-50.0, left, 0.0], [_LENGTH, left, 0.0]])[::ways]
        return Lane(name, name, line, _WIDTH, 70 / 3.6, LaneMarking.DASHED, LaneMarking.SOLID, outermost=True)

    forward = lane("out", 0.0, 1)
    return RoadNetwork((forward, lane("back", _WIDTH, -1)), forward.centreline)


@contextmanager
def views(camera: Camera, cars: Sequence[tuple[float, float]], *, trees: bool) -> Iterator[tuple[View, CameraPose]]:
    """Draw the road without air.

    Parameters
    ----------
    camera : Camera
        The true calibration.
    cars : sequence of (float, float)
        How far the near end of each car is ahead of the camera, and how far left its middle is [m].
    trees : bool
        Whether what stands beside the road is drawn.
    """
    scene = build_scene(straight_road(), SignMap(()), np.random.default_rng(0))
    renderer = make_renderer("auto", scene if trees else replace(scene, scenery=()), illuminance=ILLUMINANCE)
    pose = CameraPose((0.0, 0.0, camera.mount_height), heading=0.0)
    try:
        yield renderer.render(vehicle_batches(standing_cars(cars), None), camera, pose), pose
    finally:
        renderer.close()


def standing_cars(cars: Sequence[tuple[float, float]]) -> TrafficState:
    """Cars along the road.

    Parameters
    ----------
    cars : sequence of (float, float)
        How far along the road the near end of each is, and how far left its middle is [m].
    """
    n = len(cars)
    return TrafficState(
        time=0.0,
        ids=tuple(f"car {i}" for i in range(n)),
        types=("car",) * n,
        position=np.array([(ahead + _CAR[0], left, 0.0) for ahead, left in cars]).reshape(n, 3),
        heading=np.zeros(n),
        speed=np.zeros(n),
        acceleration=np.zeros(n),
        length=np.full(n, _CAR[0]),
        width=np.full(n, _CAR[1]),
        height=np.full(n, _CAR[2]),
        lane=("",) * n,
        lamps=np.full(n, int(Lamp.NONE), np.int32),
        paint=np.full((n, 3), 0.2),
    )


def foggy_image(view: View, pose: CameraPose, camera: Camera, extinction: float) -> NDArray[np.uint8]:
    """Image of a view in homogeneous fog, the airlight at pixel value 255, without noise.

    Parameters
    ----------
    view : View
        What there is.
    pose : CameraPose
        Where it is seen from.
    camera : Camera
        The true calibration.
    extinction : float
        Extinction coefficient k [1/m].
    """
    fog = FogField(extinction, (AIRLIGHT,) * 3)
    radiance = fogged_radiance(view, fog, pose.position, ray_from_pixel(camera, pose))
    return expose(radiance, NOISELESS, camera.response, np.random.default_rng(0)).astype(np.uint8)
