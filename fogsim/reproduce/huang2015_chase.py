"""A vehicle that is followed on a straight road, drawn once for each range and fogged as often as wanted."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogsim.calibration.staged_road import AIRLIGHT, StagedVehicle, foggy_radiance, staged_traffic
from fogsim.camera import Sensor, averaged, expose, supersampled
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
    """View without air of the true camera at its pose, with so many samples a pixel side."""

    view: View
    camera: Camera
    pose: CameraPose
    samples: int = 1


def drawn(
    renderer: Renderer,
    camera: Camera,
    vehicle: StagedVehicle | None,
    ahead: float,
    driven: float = 0.0,
    samples: int = 1,
) -> Scene:
    """Draw the road from a camera that has driven so far [m], with a vehicle, if any, whose rear is ahead [m]."""
    pose = CameraPose((driven, 0.0, camera.mount_height), heading=0.0)
    batches = (
        ()
        if vehicle is None
        else vehicle_batches(staged_traffic([(driven + ahead, vehicle)], OWN_SPEED + FASTER), None)
    )
    return Scene(renderer.render(batches, supersampled(camera, samples), pose), camera, pose, samples)


def fogged(
    scene: Scene, visibility: float, levels: float, rng: np.random.Generator, *, noisy: bool = True
) -> NDArray[np.uint8]:
    """Image of a scene in homogeneous fog of V_met [m], its airlight exposed to so many linear levels of 255."""
    drawn_by = supersampled(scene.camera, scene.samples)
    samples = foggy_radiance(scene.view, scene.pose, drawn_by, extinction_from_visibility(visibility))
    radiance = averaged(samples, scene.samples)
    sensor = Sensor(AIRLIGHT * 255.0 / levels)
    sensor = sensor if noisy else replace(sensor, full_well=1e9, read_noise=0.0)
    return expose(radiance, sensor, scene.camera.response, rng).astype(np.uint8)


@dataclass(frozen=True, slots=True)
class Chase:
    """How a vehicle is followed: airlight in linear levels of 255, noise of the radar [m] and of the sensor."""

    camera: Camera
    vehicle: StagedVehicle
    levels: float = 200.0
    range_deviation: float = 0.25
    noisy: bool = True
    samples: int = 1

    def seen(
        self, renderer: Renderer, wanted: Mapping[float, Sequence[float]], rng: np.random.Generator
    ) -> Iterator[tuple[float, dict[float, Observation]]]:
        """Each range [m], in the order given, with what the vehicle has in every visibility [m] wanted there."""
        for ahead, visibilities in wanted.items():
            time = abs(ahead - next(iter(wanted))) / FASTER
            scene = drawn(renderer, self.camera, self.vehicle, ahead, time * OWN_SPEED, self.samples)
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
