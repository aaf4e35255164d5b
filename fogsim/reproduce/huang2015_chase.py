"""A vehicle that is followed on a straight road, drawn once for each range and fogged as often as wanted."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogsim.calibration.staged_road import AIRLIGHT, StagedVehicle, foggy_radiance, staged_traffic
from fogsim.camera import Sensor, expose
from fogsim.render import Renderer
from fogsim.scene import vehicle_batches
from fogsim.units import extinction_from_visibility
from fogsim.values import (
    Camera,
    CameraPose,
    Frame,
    LeadMeasurement,
    Observation,
    View,
)

OWN_SPEED, FASTER = 20.0, 5.0
"""Own speed, and by how much the vehicle ahead is faster [m/s] (huang2015 section 4.3.2)."""


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


def drawn(
    renderer: Renderer, camera: Camera, vehicle: StagedVehicle | None, ahead: float, driven: float = 0.0
) -> Scene:
    """Draw the road with a vehicle ahead.

    Parameters
    ----------
    renderer : Renderer
        That of the road.
    camera : Camera
        The true calibration.
    vehicle : StagedVehicle or None
        None for an empty road.
    ahead : float
        From the camera to the vehicle's rear [m].
    driven : float
        How far along the road the camera is [m].
    """
    pose = CameraPose((driven, 0.0, camera.mount_height), heading=0.0)
    batches = (
        ()
        if vehicle is None
        else vehicle_batches(staged_traffic([(driven + ahead, vehicle)], OWN_SPEED + FASTER), None)
    )
    return Scene(renderer.render(batches, camera, pose), camera, pose)


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
    radiance = foggy_radiance(scene.view, scene.pose, scene.camera, extinction_from_visibility(visibility))
    sensor = Sensor(AIRLIGHT * 255.0 / levels)
    sensor = sensor if noisy else replace(sensor, full_well=1e9, read_noise=0.0)
    return expose(radiance, sensor, scene.camera.response, rng).astype(np.uint8)


@dataclass(frozen=True, slots=True)
class Chase:
    """How a vehicle is followed.

    Attributes
    ----------
    camera : Camera
        The calibration, true and assumed.
    vehicle : StagedVehicle
        The vehicle.
    levels : float
        Linear pixel value of the airlight, of 255.
    range_deviation : float
        Noise of the radar [m].
    noisy : bool
        Whether the sensor has noise.
    """

    camera: Camera
    vehicle: StagedVehicle
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
