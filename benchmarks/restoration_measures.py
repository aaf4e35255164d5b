"""What `restoration.py` measures on pictures: likeness to a clear one, blind indicators, whether a vehicle is found."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from fogsim.calibration.staged_road import StagedVehicle
from fogsim.values import Camera, CameraPose
from fogsim.values.pinhole import camera_axes

Image = NDArray[np.uint8]
Floats = NDArray[np.float32]

VISIBLE_CONTRAST = 0.05
"""Contrast of a visible edge [-] (Hautière et al. 2008)."""

DETECTORS = ("SIFT", "MSER", "SimpleBlobDetector")
"""OpenCV's detectors of blobs, with their default parameters."""

FITTING, CAR = (0.4, 1.5), (1.8, 1.5)
"""Side of what fits a vehicle, at least of its smaller and at most of its larger side [-]; and sides of a car [m]."""

ROAD = (15.0, 5.25, -1.75)
"""Where false alarms count: from how far on, and between which distances to the left: both lanes [m]."""


def psnr(image: Image, clear: Image, where: NDArray[np.bool_] | None = None) -> float:
    """Peak signal-to-noise ratio [dB], of some of the pixels."""
    squares = (image.astype(np.float64) - clear) ** 2
    return float(
        10.0 * math.log10(255.0**2 / max(float(squares.mean() if where is None else squares[where].mean()), 1e-9))
    )


def ssim(image: Image, clear: Image) -> float:
    """Structural similarity of the grey pictures (Wang et al. 2004, eq. 13; Gaussian window of 11, σ 1.5)."""
    one, other = grey(image).astype(np.float64), grey(clear).astype(np.float64)

    def mean(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(cv2.GaussianBlur(values, (11, 11), 1.5))

    c1, c2 = (0.01 * 255) ** 2, (0.03 * 255) ** 2
    mu, nu = mean(one), mean(other)
    variance, variances, covariance = mean(one * one) - mu**2, mean(other * other) - nu**2, mean(one * other) - mu * nu
    return float(
        ((2 * mu * nu + c1) * (2 * covariance + c2) / ((mu**2 + nu**2 + c1) * (variance + variances + c2))).mean()
    )


def blind_indicators(foggy: Image, restored: Image) -> tuple[float, float, float]:
    """Rate e of new visible edges, mean ratio r of gradients, share s of saturated pixels (Hautière et al. 2008).

    Image Analysis & Stereology 27(2), 87–95, eqs. 8–11. An edge is visible where two neighbours a < b have a Köhler
    contrast 2 (1 − √(a/b)) over 5 %, after a Gaussian of σ 1 px, without which noise is edges.
    """
    before, after = grey(foggy), grey(restored)
    soft = [cv2.GaussianBlur(one, (0, 0), 1.0).astype(np.float32) for one in (before, after)]
    seen, seen_after = (_visible(one) for one in soft)
    slopes, slopes_after = (np.maximum(_gradient(one), 0.1) for one in soft)
    ratios = np.log(slopes_after[seen_after] / slopes[seen_after])
    saturated = ((after == 0) & (before > 0)) | ((after == 255) & (before < 255))
    e = float(seen_after.sum() - seen.sum()) / max(int(seen.sum()), 1)
    return e, float(np.exp(ratios.mean())) if len(ratios) else 1.0, float(saturated.mean())


def _visible(image: Floats) -> NDArray[np.bool_]:
    out = np.zeros(image.shape, bool)
    for one, other, place in ((image[1:], image[:-1], out[1:]), (image[:, 1:], image[:, :-1], out[:, 1:])):
        low, high = np.minimum(one, other), np.maximum(np.maximum(one, other), 1.0)
        np.logical_or(place, 2.0 * (1.0 - np.sqrt(low / high)) > VISIBLE_CONTRAST, out=place)
    return out


def _gradient(image: Floats) -> Floats:
    return np.hypot(cv2.Sobel(image, cv2.CV_32F, 1, 0), cv2.Sobel(image, cv2.CV_32F, 0, 1))


def grey(image: Image) -> Image:
    """Grey picture of a colour one, as OpenCV has it."""
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), np.uint8)


@dataclass(frozen=True, slots=True)
class Found:
    """What a detector finds: whether the vehicle, and how many other things on the road."""

    vehicle: bool
    others: int


def projected(camera: Camera, places: Sequence[tuple[float, float, float]]) -> NDArray[np.float64]:
    """Columns and rows of places ahead, to the left and up [m], (n, 2)."""
    right, down, forward = camera_axes(camera, CameraPose((0.0, 0.0, camera.mount_height), 0.0))
    rays = np.array(places) - (0.0, 0.0, camera.mount_height)
    depth = (rays * forward).sum(axis=1)
    u0, v0 = camera.principal_point
    across, below = ((rays * axis).sum(axis=1) / depth * camera.focal_length for axis in (right, down))
    return np.stack([u0 + across, v0 + below], axis=1)


def vehicle_box(camera: Camera, vehicle: StagedVehicle, ahead: float) -> tuple[float, float, float, float]:
    """Left, top, right and bottom of a vehicle's rear [px]."""
    half = 0.5 * vehicle.width
    corners = projected(camera, [(ahead, vehicle.left + half, vehicle.height), (ahead, vehicle.left - half, 0.0)])
    return float(corners[0, 0]), float(corners[0, 1]), float(corners[1, 0]), float(corners[1, 1])


def detect(
    image: Image, camera: Camera, box: tuple[float, float, float, float], crop: tuple[int, int, int, int]
) -> dict[str, Found]:
    """What OpenCV's stock detectors, as they come, find of a vehicle in the grey picture."""
    left, top, right, bottom = crop
    part = np.ascontiguousarray(grey(image)[top:bottom, left:right])
    finders = dict(zip(DETECTORS, (_keypoints, _regions, _blobs), strict=True))
    size, corner = (right - left, bottom - top), np.array([left, top, left, top])
    return {name: _judged(_whole(find(part), size) + corner, camera, box) for name, find in finders.items()}


def _whole(found: NDArray[np.float64], size: tuple[int, int]) -> NDArray[np.float64]:
    """Boxes that the edge of the part looked at does not cut off."""
    return found[(found[:, :2] > 0.0).all(axis=1) & (found[:, 2:] < np.array(size) - 1.0).all(axis=1)]


@cache
def _detectors() -> tuple[Any, Any, Any]:
    return cv2.SimpleBlobDetector.create(), cv2.MSER.create(), cv2.SIFT.create()


def _blobs(part: Image) -> NDArray[np.float64]:
    return _round((*point.pt, 0.5 * point.size) for point in _detectors()[0].detect(part))


def _keypoints(part: Image) -> NDArray[np.float64]:
    # OpenCV's size is 2 σ, and a disc answers most at a radius of √2 σ.
    return _round((*point.pt, math.sqrt(0.5) * point.size) for point in _detectors()[2].detect(part))


def _round(found: Iterable[tuple[float, float, float]]) -> NDArray[np.float64]:
    return np.array([(u - r, v - r, u + r, v + r) for u, v, r in found], np.float64).reshape(-1, 4)


def _regions(part: Image) -> NDArray[np.float64]:
    _, boxes = _detectors()[1].detectRegions(part)
    found = np.array(boxes, np.float64).reshape(-1, 4)
    return np.concatenate([found[:, :2], found[:, :2] + found[:, 2:]], axis=1)


def _judged(found: NDArray[np.float64], camera: Camera, box: tuple[float, float, float, float]) -> Found:
    """Separate the vehicle from other things on the road that are as large as one would be there."""
    left, top, right, bottom = box
    wide, high = right - left, bottom - top
    middle = 0.5 * (found[:, :2] + found[:, 2:])
    side = np.sqrt((found[:, 2] - found[:, 0]) * (found[:, 3] - found[:, 1]))
    fits = _within(middle, box) & (side > FITTING[0] * min(wide, high)) & (side < FITTING[1] * max(wide, high))
    near = _within(middle, (left - 0.5 * wide, top - 0.5 * high, right + 0.5 * wide, bottom + 0.5 * high))
    return Found(bool(fits.any()), _places(found[~near & _vehicle_like(found, side, camera)]))


def _within(points: NDArray[np.float64], box: tuple[float, float, float, float]) -> NDArray[np.bool_]:
    left, top, right, bottom = box
    u, v = points.T
    return (u > left) & (u < right) & (v > top) & (v < bottom)


def _vehicle_like(found: NDArray[np.float64], side: NDArray[np.float64], camera: Camera) -> NDArray[np.bool_]:
    """Whether boxes stand on the road ahead, by the middle of their lower edge, and are as large as a car there."""
    nearest, most_left, most_right = ROAD
    below = np.maximum(found[:, 3] - camera.horizon_row, 1e-3)
    ahead = camera.row_distance / below
    left = (camera.principal_point[0] - 0.5 * (found[:, 0] + found[:, 2])) * ahead / camera.focal_length
    size = side * ahead / camera.focal_length
    fits = (size > FITTING[0] * CAR[1]) & (size < FITTING[1] * CAR[0])
    return fits & (below > 1.0) & (ahead > nearest) & (left < most_left) & (left > most_right)


def _places(found: NDArray[np.float64]) -> int:
    """How many of the boxes stand apart: of those whose middles lie within one another's one counts."""
    kept: list[NDArray[np.float64]] = []
    for one in found:
        middle = 0.5 * (one[:2] + one[2:])
        if not any((other[:2] < middle).all() and (middle < other[2:]).all() for other in kept):
            kept.append(one)
    return len(kept)
