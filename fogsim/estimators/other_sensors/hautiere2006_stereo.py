"""Visibility from two cameras: how far anything of 5 % contrast is seen (Hautière, Labayrade & Aubert 2006)."""

import math
from typing import Annotated, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from fogsim.core.parameters import Range, checked_parameters
from fogsim.errors import InputError
from fogsim.estimators.image_check import ObservationCheck, checked_image
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values.camera import Camera
from fogsim.values.estimate import NORMAL_90_PERCENT, Estimate, ExtinctionBounds
from fogsim.values.image import for_kernels
from fogsim.values.observation import Observation, SecondView
from fogsim.vision.light.daylight import lit_by_lamps
from fogsim.vision.light.luminance import linear_luminance
from fogsim.vision.lines.horizon import levelled, why_no_road

Pixels = NDArray[np.uint8] | NDArray[np.uint16]
Floats = NDArray[np.float64]

_BLOCK = 11
"""Side of the blocks that are compared, odd [px]."""

_ACROSS = 7
"""Width over which the contrast of an edge is taken [px]: its blur by lens and sampling lies within."""

_UNIQUE = 10
"""By how much the best disparity must beat others [%]."""

_NEAREST = 10.0
"""Nearest distance whose disparities are searched [m]."""

_ROOM = 16
"""Numbers of disparities that are searched come in multiples of this [px]."""

_BELOW_ROAD = 1.35
"""Disparity over that of a flat road in the same row below which nothing can be: under the road [-]."""


class _SeenEdges(NamedTuple):
    """Edges that both pictures show."""

    disparity: Floats  # (n,): By how much farther left the second camera has each [px]
    contrast: Floats  # (n,): Local contrast (L_bright − L_dark) / L_bright [-]


def _seen_edges(left: Pixels, right: Pixels, camera: Camera, baseline: float, least: float) -> _SeenEdges:
    """Find edges across which contrast is at least so much, and their disparities.

    Blocks are compared by the sum of absolute differences of their horizontal gradients (OpenCV's StereoBM, after
    Konolige 1998, Small vision systems).

    Takes `baseline` [m].
    """
    light = linear_luminance(left, camera.response, camera.bits, camera.black_level)
    smooth = cv2.blur(light, (3, 3))
    strip = np.ones((1, _ACROSS), np.uint8)
    bright, dark = cv2.dilate(smooth, strip), cv2.erode(smooth, strip)
    contrast = (bright - dark) / np.maximum(bright, 1e-6)
    slope = np.abs(cv2.filter2D(smooth, -1, np.array([[-1.0, 0.0, 0.0, 0.0, 1.0]])))
    is_edge = (slope >= cv2.dilate(slope, np.ones((1, 5), np.uint8))) & (contrast >= least)
    shift = _disparities(_grey(left), _grey(right), camera.focal_length * baseline / _NEAREST)
    # What lies under the road, or so near that its disparity was not sought, is a false match.
    road = _road_disparity(camera, baseline)[:, None]
    is_edge &= (shift > 0.0) & (_BELOW_ROAD * shift + 0.5 >= road) & (road * _NEAREST <= camera.focal_length * baseline)
    return _SeenEdges(shift[is_edge].astype(np.float64), contrast[is_edge].astype(np.float64))


def _disparities(left: NDArray[np.uint8], right: NDArray[np.uint8], most: float) -> NDArray[np.float32]:
    """Disparities (rows, cols) [px]; negative where there is none."""
    matcher = cv2.StereoBM.create(_ROOM * math.ceil((most + 2.0) / _ROOM), _BLOCK)
    matcher.setMinDisparity(-1)
    matcher.setPreFilterCap(31)
    matcher.setUniquenessRatio(_UNIQUE)
    matcher.setDisp12MaxDiff(1)
    return np.asarray(matcher.compute(left, right), np.float32) / 16.0


def _grey(image: Pixels) -> NDArray[np.uint8]:
    """Grey picture of 8 bits, over the range that it has: faint contrasts of 10 and 12 bits are kept."""
    flat = image.astype(np.float32).mean(axis=2) if image.ndim == 3 else image.astype(np.float32)
    most = float(flat.max())
    return np.rint(flat * (255.0 / most)).astype(np.uint8) if most > 255.0 else flat.round().astype(np.uint8)


def _road_disparity(camera: Camera, baseline: float) -> Floats:
    """Disparity of a flat road in each row (rows,), 0 above the horizon [px]."""
    below = np.maximum(np.arange(camera.height) - camera.horizon_row, 0.0)
    return np.asarray(below * math.cos(camera.pitch) * baseline / camera.mount_height)


STEP = 1.35
"""Ratio of the disparities at both ends of a class of distances [-]."""

_FEWEST = 20
"""Fewest edges that a class needs for its contrast."""

_BEST = 0.95
"""Quantile of a class's contrasts that stands for its darkest things before the airlight [-]."""

_INTRINSIC, _INTRINSIC_DEVIATION = 0.95, 0.08
"""Contrast of those without fog, and the standard deviation of its logarithm over scenes [-]."""

_SCATTER = 0.12
"""Standard deviation of ln contrast from class to class [-]."""

_STEPS = 8
"""Iterations of the fit, whose weights go by what it finds."""


class _ContrastClass(NamedTuple):
    """Edges at about one distance."""

    distance: float  # Median distance [m]
    relative_deviation: float  # Its standard deviation over itself, by that of the disparity [-]
    contrast: float  # Their best contrast [-]


class _ContrastDecay(NamedTuple):
    """What the fit of ln C = ln C₀ − k d finds."""

    # extinction, standard_deviation: k and its standard deviation [1/m]
    extinction: float
    standard_deviation: float
    intrinsic: float  # C₀ [-]


def _contrast_classes(edges: _SeenEdges, scale: float, deviation: float, least: float) -> list[_ContrastClass]:
    """Classes of distances in which both pictures show edges, nearest first.

    Takes `scale` [m px], `deviation` [px], `least` [px].
    """
    found: list[_ContrastClass] = []
    far = float(edges.disparity.max(initial=0.0))
    while far > least:
        near, far = far, far / STEP
        inside = (edges.disparity <= near) & (edges.disparity > max(far, least))
        if np.count_nonzero(inside) >= _FEWEST:
            disparity = float(np.median(edges.disparity[inside]))
            best = float(np.quantile(edges.contrast[inside], _BEST))
            found.append(_ContrastClass(scale / disparity, deviation / disparity, best))
    return found


def fit_decay(classes: list[_ContrastClass]) -> _ContrastDecay:
    """Fit the contrast's fall over classes, with what is known of the contrast without fog.

    Iteratively reweighted least squares: a class's deviation is that of its things and of its distance, k σ_d, and one
    that lies far off counts less (Student's t of four degrees of freedom).
    """
    distance, relative, contrast = (np.array(column) for column in zip(*classes, strict=True))
    seen, prior = np.log(contrast), math.log(_INTRINSIC)
    k, start = max(float(np.mean((prior - seen) / distance)), 0.0), prior
    spread = 0.0
    for _ in range(_STEPS):
        variance = _SCATTER**2 + (k * distance * relative) ** 2
        off = seen - start + k * distance
        weight = 5.0 / (4.0 + off**2 / variance) / variance
        # Normal equations of (start, −k), the first with its prior.
        known = 1.0 / _INTRINSIC_DEVIATION**2
        a, b, c = known + weight.sum(), (weight * distance).sum(), (weight * distance**2).sum()
        p, q = known * prior + (weight * seen).sum(), (weight * distance * seen).sum()
        determinant = a * c - b * b
        start, k = float((c * p - b * q) / determinant), max(float((b * p - a * q) / determinant), 0.0)
        spread = math.sqrt(float(a / determinant))
    return _ContrastDecay(k, spread, math.exp(start))


_VISIBLE = 0.05
"""Contrast from which on something is visible, by CIE [-]."""

_TRUSTED = 0.07
"""Contrast of the best edges of a class below which noise counts among them [-]."""

FARTHEST = 0.6
"""Disparity below which no distance is given [px]."""

NEAR = 30.0
"""Distance within which the best contrasts are those of road marks and vehicles' edges, and of nothing dark enough, if
there is contrast at twice that [m]."""

_DEEP_ENOUGH = 0.5
"""Least optical depth to the farthest class at which contrasts determine k [-]."""

_LEAST_DEVIATION = 0.08
"""Relative standard deviation that no fit comes below: what scenes have of dark things [-]."""


@checked_parameters
class Hautiere2006Stereo:
    """Contrast over the distance that two parallel cameras measure.

    Hautière, Labayrade & Aubert (2006, Estimation of the visibility distance by stereovision: a generic approach, IEICE
    Trans. E89-D 7) compute the disparities of a picture's edges and their local contrasts, and take for the visibility
    the distance of the farthest thing that has 5 % (`as_published`). A scene that has nothing there reads short, and so
    do things that are not black. Here the best contrasts of all distances are compared: dark things before the airlight
    have C₀ e^(−k d), with C₀ about 0.95; the fit gives k from what is nearer than the visibility too, with a deviation.
    Where the farthest thing lies within an optical depth of 0.5, there is nothing far enough: the estimate is not
    valid and gives the most that k may be.

    It needs no flat road and no horizon, but its second camera, which costs a picture more; an error of the cameras'
    relative yaw of 0.01° is 0.1 px of disparity at 640 columns, 10 % of a distance of 300 m. Daytime only.

    Parameters
    ----------
    camera : Camera
        The stated calibration of both cameras.
    as_published : bool
        Take the distance of the farthest class of 5 % for the visibility.
    disparity_deviation : float
        Standard deviation of all disparities together, by what calibration and matching leave [px].

    Raises
    ------
    InputError
        If a parameter is out of range.
    """

    method = "hautiere2006_stereo"

    def __init__(
        self,
        camera: Camera,
        *,
        as_published: bool = False,
        disparity_deviation: Annotated[float, Range(0.0, 10.0, "px")] = 0.25,
    ) -> None:
        self._check, self._camera = ObservationCheck(camera), camera
        self._as_published, self._deviation = as_published, disparity_deviation

    def reset(self) -> None:
        """Let time begin again; pictures stand alone."""
        self._check.reset()

    def update(self, observation: Observation) -> Estimate:
        """Estimate the fog from one pair of pictures.

        Parameters
        ----------
        observation : Observation
            Its two images are used.

        Returns
        -------
        Estimate
            Diagnostics: ``visible_distance``, of the farthest thing of 5 % [m], ``intrinsic_contrast`` [-], and
            ``classes``, tuples of distance [m], relative deviation and contrast [-]; or ``reason``.

        Raises
        ------
        InputError
            If camera, images or time do not fit (see `fogsim.estimators.image_check`), or the baseline is no length.
        """
        image, right = self._check.kernel_image(observation), observation.right
        if right is None:
            return Estimate.invalid(self.method, "there is no second camera (scenario key camera.stereo)")
        if not (math.isfinite(right.baseline) and right.baseline > 0.0):
            raise InputError(f"the baseline of the second camera must be a positive length, got {right.baseline!r} m")
        second = for_kernels(checked_image(right.image, self._camera))
        if why := self._why_no_day(image, observation):
            return Estimate.invalid(self.method, why)
        edges = _seen_edges(image, second, self._camera, right.baseline, _VISIBLE)
        classes = _contrast_classes(edges, self._scale(right), self._deviation, FARTHEST)
        sure = [one for one in classes if one.contrast >= _TRUSTED]
        sure = [one for one in sure if one.distance >= min(NEAR, 0.5 * sure[-1].distance)]
        if not sure:
            return Estimate.invalid(self.method, "nothing that both cameras show has contrast")
        return self._estimate(classes, sure)

    def _why_no_day(self, image: Pixels, observation: Observation) -> str:
        """Say why the pictures show no road by day; empty if they do."""
        if why := why_no_road(self._camera):
            return why
        return lit_by_lamps(levelled(image, self._camera), self._camera, observation.lead)

    def _scale(self, right: SecondView) -> float:
        return self._camera.focal_length * right.baseline

    def _estimate(self, classes: list[_ContrastClass], sure: list[_ContrastClass]) -> Estimate:
        """By classes of distances, and those of them whose contrasts are no noise."""
        fit, last = fit_decay(sure), max(classes, key=lambda one: one.distance)
        found: dict[str, object] = {
            "visible_distance": last.distance,
            "intrinsic_contrast": fit.intrinsic,
            "classes": tuple(map(tuple, classes)),
        }
        if self._as_published:
            k = OPTICAL_DEPTH_AT_VISIBILITY / last.distance
            return Estimate(self.method, k, k * max(last.relative_deviation, 0.2), diagnostics=found)
        farthest = sure[-1].distance
        deviation = math.hypot(fit.standard_deviation, _LEAST_DEVIATION * fit.extinction)
        if fit.extinction * farthest < _DEEP_ENOUGH:
            return self._nothing_far_enough(fit, deviation, farthest, found)
        return Estimate(self.method, fit.extinction, deviation, diagnostics=found, reach=farthest)

    def _nothing_far_enough(
        self, fit: _ContrastDecay, deviation: float, farthest: float, found: dict[str, object]
    ) -> Estimate:
        most = fit.extinction + NORMAL_90_PERCENT * deviation
        reason = f"the farthest thing that both cameras show, at {farthest:.0f} m, has lost too little contrast"
        bounds = ExtinctionBounds(most=most, softness=0.2)
        return Estimate(self.method, 0.0, math.inf, valid=False, diagnostics={"reason": reason, **found}, bounds=bounds)
