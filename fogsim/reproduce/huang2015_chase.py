"""A vehicle that is followed on a straight road, drawn once for each range and fogged as often as wanted."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere import fogged_radiance
from fogsim.camera import Sensor, expose
from fogsim.render import Renderer, make_renderer
from fogsim.reproduce.scenes import AIRLIGHT, ILLUMINANCE, straight_road
from fogsim.scene import build_scene, vehicle_batches
from fogsim.units import extinction_from_visibility
from fogsim.values import (
    Camera,
    CameraPose,
    FogField,
    Frame,
    Lamp,
    LeadMeasurement,
    Observation,
    SignMap,
    TrafficState,
    View,
)
from fogsim.values.pinhole import ray_from_pixel

OWN_SPEED, FASTER = 20.0, 5.0
"""Own speed, and by how much the vehicle ahead is faster [m/s] (huang2015 section 4.3.2)."""


@dataclass(frozen=True, slots=True)
class Followed:
    """The vehicle ahead.

    Attributes
    ----------
    kind : str
        "car", "van", "truck".
    length, width, height : float
        Its size [m].
    paint : tuple of float
        Reflectance of its paint, red first [-].
    left : float
        How far its middle is left of the camera [m].
    name : str
        Its id, which chooses among the shapes that its size leaves open.
    """

    kind: str = "car"
    length: float = 4.5
    width: float = 1.8
    height: float = 1.5
    paint: tuple[float, float, float] = (0.2, 0.2, 0.2)
    left: float = 0.1
    name: str = "followed"


@dataclass(frozen=True, slots=True)
class Scene:
    """What a camera saw without air.

    Attributes
    ----------
    view : View
        What there is.
    camera : Camera
        The true calibration.
    pose : CameraPose
        Where it was.
    """

    view: View
    camera: Camera
    pose: CameraPose


@contextmanager
def road() -> Iterator[Renderer]:
    """Renderer of a straight road with trees beside it."""
    renderer = make_renderer(
        "auto", build_scene(straight_road(), SignMap(()), np.random.default_rng(0)), illuminance=ILLUMINANCE
    )
    try:
        yield renderer
    finally:
        renderer.close()


def drawn(renderer: Renderer, camera: Camera, vehicle: Followed | None, ahead: float, driven: float = 0.0) -> Scene:
    """Draw the road with a vehicle ahead.

    Parameters
    ----------
    renderer : Renderer
        That of the road.
    camera : Camera
        The true calibration.
    vehicle : Followed or None
        None for an empty road.
    ahead : float
        From the camera to the vehicle's rear [m].
    driven : float
        How far along the road the camera is [m].
    """
    pose = CameraPose((driven, 0.0, camera.mount_height), heading=0.0)
    batches = () if vehicle is None else vehicle_batches(_standing(vehicle, driven + ahead), None)
    return Scene(renderer.render(batches, camera, pose), camera, pose)


def _standing(vehicle: Followed, rear: float) -> TrafficState:
    return TrafficState(
        time=0.0,
        ids=(vehicle.name,),
        types=(vehicle.kind,),
        position=np.array([[rear + vehicle.length, vehicle.left, 0.0]]),
        heading=np.zeros(1),
        speed=np.full(1, OWN_SPEED + FASTER),
        acceleration=np.zeros(1),
        length=np.array([vehicle.length]),
        width=np.array([vehicle.width]),
        height=np.array([vehicle.height]),
        lane=("",),
        lamps=np.full(1, int(Lamp.NONE), np.int32),
        paint=np.array([vehicle.paint]),
    )


def fogged(
    scene: Scene, visibility: float, levels: float, rng: np.random.Generator, *, noisy: bool = True
) -> NDArray[np.uint8]:
    """Image of a scene in homogeneous fog.

    Parameters
    ----------
    scene : Scene
        The scene.
    visibility : float
        V_met [m].
    levels : float
        Linear pixel value of the airlight, of 255.
    rng : numpy.random.Generator
        Noise.
    noisy : bool
        Whether the sensor has photon and read noise.
    """
    field = FogField(extinction_from_visibility(visibility), (AIRLIGHT,) * 3)
    radiance = fogged_radiance(scene.view, field, scene.pose.position, ray_from_pixel(scene.camera, scene.pose))
    sensor = Sensor(AIRLIGHT * 255.0 / levels)
    sensor = sensor if noisy else replace(sensor, full_well=1e9, read_noise=0.0)
    return expose(radiance, sensor, scene.camera.response, rng).astype(np.uint8)


@dataclass(frozen=True, slots=True)
class Chase:
    """How a vehicle is followed.

    Attributes
    ----------
    camera : Camera
        The calibration, true and told.
    vehicle : Followed
        The vehicle.
    levels : float
        Linear pixel value of the airlight, of 255.
    range_deviation : float
        Noise of the radar [m].
    noisy : bool
        Whether the sensor has noise.
    """

    camera: Camera
    vehicle: Followed
    levels: float = 200.0
    range_deviation: float = 0.25
    noisy: bool = True

    def seen(
        self, renderer: Renderer, wanted: Mapping[float, Sequence[float]], rng: np.random.Generator
    ) -> Iterator[tuple[float, dict[float, Observation]]]:
        """Every range once, in every fog that is wanted there.

        Parameters
        ----------
        renderer : Renderer
            That of the road.
        wanted : mapping of float to sequence of float
            Visibilities by range, both [m]; in the order in which they are driven.
        rng : numpy.random.Generator
            Noise of sensor and radar.

        Yields
        ------
        tuple of float and dict
            Range and what the vehicle has by visibility.
        """
        for ahead, visibilities in wanted.items():
            time = abs(ahead - next(iter(wanted))) / FASTER
            scene = drawn(renderer, self.camera, self.vehicle, ahead, time * OWN_SPEED)
            lead = LeadMeasurement(ahead + self.range_deviation * float(rng.normal()), FASTER)
            yield (
                ahead,
                {
                    v: Observation(
                        Frame(time, fogged(scene, v, self.levels, rng, noisy=self.noisy), self.camera), OWN_SPEED, lead
                    )
                    for v in visibilities
                },
            )
