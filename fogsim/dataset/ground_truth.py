"""Ground truth of a step's frame: the transmission of the air, and the object of each pixel."""

import math
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere import Air
from fogsim.core.linear_algebra import matrix_product
from fogsim.core.parameters import checked_parameters
from fogsim.errors import InputError
from fogsim.values import Step, Truth, View
from fogsim.values.observation import sign_map_values
from fogsim.values.pinhole import ray_from_pixel
from fogsim.values.scene import Instance
from fogsim.values.traffic import PEDESTRIAN


class SemanticClass(IntEnum):
    """Classes of pixels in `semantic_mask`."""

    SKY = 0
    TERRAIN = 1
    ROAD = 2
    ROADSIDE = 3
    SIGN = 4
    CAR = 5
    VAN = 6
    TRUCK = 7
    BUS = 8
    MOTORCYCLE = 9
    OTHER_VEHICLE = 10
    TRAFFIC_LIGHT = 11
    PERSON = 12


_OF_TYPE = {
    kind.name.lower(): kind
    for kind in (
        SemanticClass.CAR,
        SemanticClass.VAN,
        SemanticClass.TRUCK,
        SemanticClass.BUS,
        SemanticClass.MOTORCYCLE,
    )
} | {PEDESTRIAN: SemanticClass.PERSON}


def vehicle_class(body: str) -> SemanticClass:
    """Class of a vehicle by its body, one of `TrafficState.types`."""
    return _OF_TYPE.get(body, SemanticClass.OTHER_VEHICLE)


@checked_parameters
def depth(step: Step) -> NDArray[np.float32]:
    """Distance along the ray from the optical centre to what each pixel shows.

    Parameters
    ----------
    step : Step
        From `fogsim.run` or a similar function.

    Returns
    -------
    (rows, cols) float32
        Distance [m], not the depth along the optical axis; ``inf`` for the sky.
    """
    return step.view.distance


@checked_parameters
def transmission(step: Step) -> NDArray[np.float32]:
    """Share of the light of what each pixel shows that comes through the air, T = e^(−τ).

    Parameters
    ----------
    step : Step
        From `fogsim.run` or a similar function.

    Returns
    -------
    (rows, cols) float32
        0 … 1: 1 through clear air, 0.05 at the meteorological visibility. For the sky, that of the whole path to the
        fog's end.

    Raises
    ------
    InputError
        If the step was not made by a camera in a loop.
    """
    truth = step.truth
    if truth.fog is None or truth.camera is None or truth.pose is None:
        raise InputError("the true transmission is known only of steps that a camera in a loop has made")
    return Air(truth.fog).transmittance(step.view, truth.camera, truth.pose)


@checked_parameters
def semantic_mask(step: Step) -> NDArray[np.uint8]:
    """Class of what each pixel shows.

    Parameters
    ----------
    step : Step
        From `fogsim.run` or a similar function.

    Returns
    -------
    (rows, cols) uint8
        Values of `SemanticClass`.
    """
    table = np.full(Instance.FIRST_VEHICLE + len(step.traffic.types), SemanticClass.ROADSIDE, np.uint8)
    table[: SemanticClass.CAR] = range(SemanticClass.CAR)
    table[Instance.TRAFFIC_LIGHT], table[Instance.PERSON] = SemanticClass.TRAFFIC_LIGHT, SemanticClass.PERSON
    table[Instance.FIRST_VEHICLE :] = [vehicle_class(body) for body in step.traffic.types]
    return np.asarray(table[step.view.instance])


@checked_parameters
def instance_mask(step: Step) -> NDArray[np.uint16]:
    """Object that each pixel belongs to.

    Parameters
    ----------
    step : Step
        From `fogsim.run` or a similar function.

    Returns
    -------
    (rows, cols) uint16
        0 for no object; 1 + i for the vehicle in row i of the traffic state; 1 + n + j for the face of sign j in the
        sign map, where there are n vehicles. A sign's post belongs to no object.

    Raises
    ------
    InputError
        If the step was not made by a camera in a loop.
    """
    ids = step.view.instance
    vehicles = len(step.traffic.ids)
    mask = np.where(ids >= Instance.FIRST_VEHICLE, ids - (Instance.FIRST_VEHICLE - 1), 0).astype(np.uint16)
    rows, cols = np.nonzero(ids == SemanticClass.SIGN)
    if rows.size:
        sign = _sign_of(_places(step.view, step.truth, rows, cols), step.truth)
        mask[rows, cols] = np.where(sign >= 0, sign + 1 + vehicles, 0)
    return mask


@checked_parameters
def sign_picture(step: Step, instance: NDArray[np.uint16]) -> NDArray[np.uint8]:
    """The signs whose faces are in the frame and turned to it, coded as those of the map are in `Observation.sign_map`.

    Parameters
    ----------
    step : Step
        From `fogsim.run` or a similar function.
    instance : (rows, cols) uint16
        From `instance_mask`.

    Returns
    -------
    (rows, cols, 3) uint8
        Kind, distance and size; 0 where no sign is seen, whatever the fog leaves of it.
    """
    picture = np.zeros((*instance.shape, 3), np.uint8)
    first = 1 + len(step.traffic.ids)
    (x, y, _), heading = step.traffic.position[step.ego], float(step.traffic.heading[step.ego])
    signs = () if step.truth.signs is None else step.truth.signs.signs
    for number in np.unique(instance[instance >= first]).tolist():
        sign = signs[number - first]
        if math.cos(sign.heading - heading) <= 0.0:
            continue
        ahead = (sign.position[0] - x) * math.cos(heading) + (sign.position[1] - y) * math.sin(heading)
        picture[instance == number] = sign_map_values(sign.kind, ahead, sign.diameter)
    return picture


def _places(view: View, truth: Truth, rows: NDArray[np.intp], cols: NDArray[np.intp]) -> NDArray[np.float64]:
    """Points in the world that pixels show (n, 3) [m]."""
    if truth.camera is None or truth.pose is None:
        raise InputError("signs can be distinguished only in steps made with a camera")
    pixels = np.stack((cols, rows, np.ones(rows.shape)), axis=1)
    rays = matrix_product(pixels, ray_from_pixel(truth.camera, truth.pose).T)
    rays *= (view.distance[rows, cols] / np.linalg.norm(rays, axis=1))[:, None]
    return np.asarray(truth.pose.position + rays)


def _sign_of(points: NDArray[np.float64], truth: Truth) -> NDArray[np.intp]:
    """Number of the sign whose face each point is on; −1 for none."""
    nearest = np.full(len(points), -1, dtype=np.intp)
    least = np.full(len(points), np.inf)
    low, high = points.min(axis=0), points.max(axis=0)
    for number, sign in enumerate(() if truth.signs is None else truth.signs.signs):
        # The corner of a square plate is 0.71 of its size away from its middle.
        reach = 0.75 * sign.diameter
        centre = np.array(sign.position)
        if np.any(centre < low - reach) or np.any(centre > high + reach):
            continue
        apart = np.linalg.norm(points - centre, axis=1)
        on_face = (apart <= reach) & (points[:, 2] >= centre[2] - 0.55 * sign.diameter) & (apart < least)
        nearest[on_face], least[on_face] = number, apart[on_face]
    return nearest
