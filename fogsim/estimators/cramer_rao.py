"""Cramér–Rao bound of fog's extinction: the best precision that any method can reach on one image of an even road."""

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import inverse_of, matrix_product
from fogsim.core.parameters import Range, checked_parameters
from fogsim.values.camera import Camera

Floats = NDArray[np.float64]

_NEAREST_ROW = 1.0
"""How far the middle of a row is from the horizon at least for the row to count, as road or as sky [px]."""

_LEAST_LEFT = 1e-12
"""Information about k in an image, all else known, below whose share what is left is rounding [-]."""

_DARKEST = 1e-9
"""Least luminance of a road that is divided by [linear grey levels]."""

_PITCH = 3
"""Place of the pitch among k, airlight, road and pitch."""

_GreyLevels = Annotated[float, Range(0.0, 1e6, "grey levels")]


@checked_parameters
@dataclass(frozen=True, slots=True, kw_only=True)
class FoggyRoad:
    """An even, straight road in even fog under an even sky, and the picture that is taken of it.

    Attributes
    ----------
    extinction : float
        Extinction coefficient k [1/m]; 0 is clear air.
    airlight, road : float
        Luminance A of the airlight and R of the road from nearby [linear grey levels].
    noise : float
        Standard deviation of single pixels [linear grey levels]: 0.001 and more.
    lane_width : float
        Width of what is surely road in each lane [m].
    lanes : int
        How many lanes are looked at.
    pitch_deviation : float
        Standard deviation of the true pitch about the assumed one, before the picture [rad]; 0 if it is known.
    patch_deviation : float
        Standard deviation of the albedo from patch to patch, relative to its mean [-]; 0 for a road without patches.
    patch_length : float
        Length of the patches along the road [m]. Each is as wide as its lane, and their edges may lie anywhere.
    """

    extinction: Annotated[float, Range(0.0, 10.0, "1/m")]
    airlight: _GreyLevels
    road: _GreyLevels
    noise: Annotated[float, Range(1e-3, 1e6, "grey levels")]
    lane_width: Annotated[float, Range(0.1, 100.0, "m")] = 2.8
    lanes: Annotated[int, Range(1, 20)] = 1
    pitch_deviation: Annotated[float, Range(0.0, 0.2, "rad")] = 0.0
    patch_deviation: Annotated[float, Range(0.0, 1.0)] = 0.0
    patch_length: Annotated[float, Range(0.01, 1000.0, "m")] = 3.0


@dataclass(frozen=True, slots=True)
class _Rows:
    """Rows of road in a picture, from the horizon down."""

    slant: Floats  # (n,): Length of the ray to the road [m]
    slant_slope: Floats  # (n,): Its change with the pitch [m/rad]
    # near, far (n,): where each row begins and ends along the road [m]
    near: Floats
    far: Floats
    pixels: Floats  # (n,): How many show one lane


@checked_parameters
def extinction_bound(camera: Camera, scene: FoggyRoad) -> float:
    """Least standard deviation of k that a method without bias can have of one picture (Cramér–Rao).

    A pixel of road at the slant distance d has the level A (1 − e^(−kd)) + R e^(−kd) (Koschmieder) plus white noise,
    one of sky A. Unknown are k, A, R and, with its prior, the pitch. Patches of albedo are a Gaussian process of mean 0
    whose correlation falls linearly to 0 over the length of a patch; its deviation and length are known, so that a
    image also informs about k by how the patches fade. The information of a Gaussian image is that of its mean and that
    of its covariance (Kay 1993, Fundamentals of Statistical Signal Processing, eq. 3.31); that of a prior is added to
    it (Van Trees 1968, section 2.4.3). The bound is that of k when the others are fitted too.

    Each row is taken for one distance, that of its middle below the camera's axis; those within a pixel of the horizon
    are none. Roll and response are taken for undone. What else a picture holds is not in it: marks, vehicles, bends, an
    uneven sky.

    Parameters
    ----------
    camera : Camera
        Its calibration.
    scene : FoggyRoad
        What is in front of it, and what is known beforehand.

    Returns
    -------
    float
        [1/m]; ``inf`` where the image does not determine k. Over k it is the relative deviation of the visibility too.

    Examples
    --------
    >>> camera = Camera(688, 515, 700.0, (343.5, 257.0), 1.3)
    >>> scene = FoggyRoad(extinction=0.03, airlight=200.0, road=60.0, noise=2.0)
    >>> f"{extinction_bound(camera, scene) / scene.extinction:.2%}"
    '0.07%'
    """
    information = _information(camera, scene)
    if scene.pitch_deviation == 0.0:
        information = information[:_PITCH, :_PITCH]
    else:
        information[_PITCH, _PITCH] += scene.pitch_deviation**-2
    of_k, shared, others = information[0, 0], information[1:, 0], np.ascontiguousarray(information[1:, 1:])
    left = of_k - float(matrix_product(shared, matrix_product(inverse_of(others), shared)))
    return 1.0 / math.sqrt(left) if left > _LEAST_LEFT * of_k else math.inf


def _information(camera: Camera, scene: FoggyRoad) -> Floats:
    """(4, 4) float64: Fisher information of a picture about k, A, R and pitch, without priors."""
    rows = _rows_of_road(camera, scene)
    slopes = _slopes(rows, scene)
    noise = scene.noise**2 / rows.pixels
    if scene.patch_deviation == 0.0:
        information = matrix_product(slopes.T / noise, slopes)
    else:
        patches = _patch_covariance(rows, scene)
        weights = inverse_of(np.diag(noise) + patches)
        information = matrix_product(matrix_product(slopes.T, weights), slopes)
        information += _information_of_fading(rows, scene, weights, patches)
    information *= scene.lanes
    information[1, 1] += _sky_pixels(camera) / scene.noise**2
    return information


def _rows_of_road(camera: Camera, scene: FoggyRoad) -> _Rows:
    rows = np.arange(camera.height, dtype=np.float64)
    rows = rows[rows >= camera.horizon_row + _NEAREST_ROW]
    slant, slope = _slant(camera, rows)
    near, far = (np.sqrt(_slant(camera, rows + half)[0] ** 2 - camera.mount_height**2) for half in (0.5, -0.5))
    # A metre across the road is as many pixels as the focal length over the depth along the optical axis.
    across = scene.lane_width * camera.focal_length / camera.row_distance * (rows - camera.horizon_row)
    return _Rows(slant, slope, near, far, np.minimum(across, camera.width / scene.lanes))


def _slant(camera: Camera, rows: Floats) -> tuple[Floats, Floats]:
    """Length of the rays to the road below the camera's axis [m], and its slope with the pitch [m/rad]."""
    y = (rows - camera.principal_point[1]) / camera.focal_length
    ahead, under = math.cos(camera.pitch), math.sin(camera.pitch)
    falling = y * ahead + under
    slant = camera.mount_height * np.sqrt(1.0 + y**2) / falling
    return slant, -slant * (ahead - y * under) / falling


def _sky_pixels(camera: Camera) -> int:
    """How many pixels show the sky."""
    return camera.width * int(np.count_nonzero(np.arange(camera.height) <= camera.horizon_row - _NEAREST_ROW))


def _slopes(rows: _Rows, scene: FoggyRoad) -> Floats:
    """(n, 4) float64: change of each row's mean level with k, A, R and pitch."""
    kept, veil = np.exp(-scene.extinction * rows.slant), scene.airlight - scene.road
    by_slant = veil * scene.extinction * kept
    return np.stack((veil * rows.slant * kept, 1.0 - kept, kept, by_slant * rows.slant_slope), axis=1)


def _patch_covariance(rows: _Rows, scene: FoggyRoad) -> Floats:
    """(n, n) float64: covariance of the rows' mean levels by patches, each the mean over what a row shows of road."""
    near, far, length = rows.near, rows.far, scene.patch_length

    def integral(one: Floats, other: Floats) -> Floats:
        """Twice integrated correlation over the distance of two places."""
        x = np.abs(one[:, None] - other)
        return np.where(x < length, x**2 / 2.0 - x**3 / (6.0 * length), length * (x / 2.0 - length / 6.0))

    extent = far - near
    alike = integral(far, near) + integral(near, far) - integral(near, near) - integral(far, far)
    level = scene.patch_deviation * scene.road * np.exp(-scene.extinction * rows.slant) / extent
    return level[:, None] * alike * level


def _information_of_fading(rows: _Rows, scene: FoggyRoad, weights: Floats, patches: Floats) -> Floats:
    """(4, 4) float64: information in the covariance of the patches, which fade with distance as all contrast does."""
    # The covariance is that of albedos times R e^(−kd) of both rows: relative slopes are sums of theirs.
    by_road = np.full(len(rows.slant), 1.0 / max(scene.road, _DARKEST))
    relative = (-rows.slant, np.zeros(len(rows.slant)), by_road, -scene.extinction * rows.slant_slope)
    changes = [matrix_product(weights, (one[:, None] + one) * patches) for one in relative]
    return np.array([[0.5 * float(np.sum(one * other.T)) for other in changes] for one in changes])
