"""Visibility from two cameras: how far anything of 5 % contrast is seen (Hautière, Labayrade & Aubert 2006)."""

import math
from typing import Annotated

from fogsim.core.parameters import Range, checked_parameters
from fogsim.errors import InputError
from fogsim.estimators.image_check import ObservationCheck, checked_image
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values.camera import Camera
from fogsim.values.estimate import NORMAL_90_PERCENT, Estimate, ExtinctionBounds
from fogsim.values.image import for_kernels
from fogsim.values.observation import Observation, SecondView
from fogsim.vision.light.daylight import lit_by_lamps
from fogsim.vision.lines.horizon import levelled, why_no_road
from fogsim.vision.stereo.contrast_decay import ContrastClass, ContrastDecay, contrast_classes, fit_decay
from fogsim.vision.stereo.matching import Pixels, seen_edges

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
        edges = seen_edges(image, second, self._camera, right.baseline, _VISIBLE)
        classes = contrast_classes(edges, self._scale(right), self._deviation, FARTHEST)
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

    def _estimate(self, classes: list[ContrastClass], sure: list[ContrastClass]) -> Estimate:
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
        self, fit: ContrastDecay, deviation: float, farthest: float, found: dict[str, object]
    ) -> Estimate:
        most = fit.extinction + NORMAL_90_PERCENT * deviation
        reason = f"the farthest thing that both cameras show, at {farthest:.0f} m, has lost too little contrast"
        bounds = ExtinctionBounds(most=most, softness=0.2)
        return Estimate(self.method, 0.0, math.inf, valid=False, diagnostics={"reason": reason, **found}, bounds=bounds)
