"""Fog by night from the veil of the own head lamps: Gallen et al. 2014, sections III-A and III-D."""

from collections import deque
from dataclasses import replace
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from fogsim.core.parameters import Range, checked_parameters
from fogsim.estimators.image_check import ObservationCheck
from fogsim.estimators.night.night_road import NightRoad
from fogsim.estimators.night.own_light import FORGOTTEN, HeadLamps, lit_head_lamps, setback_of, without_noise
from fogsim.estimators.night.veil_correlation import (
    CellMeans,
    VeilScores,
    VeilTemplates,
    cell_means,
    cell_size,
    visibility_by_parabola,
)
from fogsim.estimators.protocol import Calibrations
from fogsim.units import extinction_from_visibility
from fogsim.values.camera import Camera, Response
from fogsim.values.estimate import Estimate
from fogsim.values.light import Lamp
from fogsim.values.observation import Observation
from fogsim.vision.light.daylight import lit_by_lamps
from fogsim.vision.light.luminance import linear_pixels
from fogsim.vision.lines.horizon import levelled

_PUBLISHED = (15.0, 50.0, 100.0, 200.0, 500.0)
"""Visibilities of the simulated references (figure 12) next to that of a clear night [m]."""

BANDS = ((50.0, 10.0), (100.0, 20.0), (200.0, 40.0), (np.inf, 100.0))
"""Published accuracy: up to a visibility, so much [m] (section IV-C)."""

_LIGHT_FOG = 300.0
"""Visibility from which fog is light, and is not to be detected [m] (table I)."""

_MOST_CLIPPED = 0.3
"""Share of the cells that may be clipped."""

LEAST_ROWS = 4
"""Rows that must be seen above and below the horizon."""

_LEAST_BRIGHT = 8.0
"""Pixel value that something must have."""

_NORMAL_95_PERCENT = 1.645


@checked_parameters
class Gallen2014Veil:
    """The own head lamps' veil (Gallen et al. 2014).

    As published, the mean of some frames is compared with references, each inside its own mask, by Otsu's threshold, by
    the zero-mean normalised cross-correlation; the best score detects fog. The visibility is that at the top of
    exp(a V² + b V + c) through the scores (equation 13), and its error the published one. That top lies far off where
    references are far apart: with the paper's six it is near 1100 m in any fog thinner than 80 m; and scores discard
    amplitude and know one beam, one pavement and one kind of droplets. By default `NightRoad`, which averages over
    these, takes the place of the correlation.

    Parameters
    ----------
    camera : Camera
        The assumed calibration.
    head_lamps : str
        See `NightRoad`; as published, those of a usual car.
    frames : int
        How many successive frames are composed.
    median : bool
        Whether, as published, the rank filter composes them in place of the mean.
    threshold : float
        Score from which on there is fog, as published; 0.4 in figure 11.
    as_published : bool
        Whether the visibility is found as the paper has it; docs/explanation/night.md lists what this adds.

    Raises
    ------
    InputError
        If a parameter is out of range.
    """

    method = "gallen2014_veil"

    def __init__(
        self,
        camera: Camera,
        *,
        head_lamps: HeadLamps = "usual",
        frames: Annotated[int, Range(1, 1000)] = 10,
        median: bool = False,
        threshold: Annotated[float, Range(0.0, 1.0)] = 0.4,
        as_published: bool = False,
    ) -> None:
        self._camera, self._check = camera, ObservationCheck(camera)
        # Scores are of pixel values, not of light.
        self._values = replace(camera, response=Response.LINEAR, black_level=0.0)
        self._frames, self._median, self._threshold = int(frames), median, threshold
        self._model = None if as_published else NightRoad(camera, head_lamps=head_lamps, frames=frames)
        self._source: Calibrations | None = None
        self.reset()

    def take_calibrations(self, source: Calibrations) -> None:
        """Take what the lamps light from a source."""
        self._source = source
        if self._model is not None:
            self._model.take_calibrations(source)

    def reset(self) -> None:
        """Forget all earlier frames."""
        self._check.reset()
        if self._model is not None:
            self._model.reset()
        self._earlier: deque[CellMeans] = deque(maxlen=self._frames)
        self._time = 0.0
        self._templates: tuple[Lamp, VeilTemplates] | None = None

    def update(self, observation: Observation) -> Estimate:
        """Estimate the fog from the mean of the last images and the lamps that are lit.

        Parameters
        ----------
        observation : Observation
            Its image, lamps and the camera's place are used; without lamps, low beams are assumed.

        Returns
        -------
        Estimate
            Diagnostics: those of `NightRoad`; as published ``score`` (best), ``scores`` by reference, and ``detected``,
            whether fog is likelier than a clear night; or ``reason``.

        Raises
        ------
        InputError
            If camera, image or time do not fit (see `fogsim.estimators.image_check`).
        """
        if self._model is not None:
            return replace(self._model.update(observation), method=self.method)
        image = self._check.kernel_image(observation)
        lit = lit_head_lamps(observation)
        if not lit:
            return Estimate.invalid(self.method, "no head lamp is lit: this is a method for the night")
        means = cell_means(linear_pixels(image, self._values), cell_size(self._camera))
        if why := self._unfit(image, means):
            return Estimate.invalid(self.method, why)
        if self._source is None:
            return Estimate.invalid(self.method, "it has no calibration; fogsim.estimators.make supplies one")
        if self._templates is None or self._templates[0] != lit:
            self._earlier.clear()
            made = self._source.veil_references(without_noise(self._camera), lit, setback_of(observation))
            self._templates = lit, VeilTemplates(replace(made, camera=self._camera), _PUBLISHED)
        if observation.time - self._time > FORGOTTEN:
            self._earlier.clear()
        self._time = observation.time
        self._earlier.append(means)
        return self._estimate(self._templates[1].scores(self._composed()))

    def _unfit(self, image: NDArray[np.uint8] | NDArray[np.uint16], means: CellMeans) -> str:
        row = self._camera.horizon_row
        if not LEAST_ROWS <= row <= self._camera.height - 1 - LEAST_ROWS:
            return f"the horizon (row {row:.1f}) is outside the image, or at its border"
        if float(means.luminance.max()) < _LEAST_BRIGHT:
            return "too dark: the head lamps light nothing"
        if float((means.luminance > 250.0).mean()) > _MOST_CLIPPED:
            return "the picture is saturated"
        if lit_by_lamps(levelled(image, self._camera), self._camera):
            return ""
        return "no lamps light the road: this is a method for the night"

    def _composed(self) -> NDArray[np.float64]:
        frames = np.array([one.luminance for one in self._earlier])
        composed: NDArray[np.float64] = np.median(frames, axis=0) if self._median else frames.mean(axis=0)
        return composed

    def _estimate(self, scores: VeilScores) -> Estimate:
        best = float(np.nanmax(np.nan_to_num(scores.score, nan=-1.0)))
        found: dict[str, object] = {"score": best, "scores": tuple(scores.score.tolist())}
        found["detected"] = best >= self._threshold and not scores.clear >= best
        if not found["detected"]:
            least = extinction_from_visibility(_LIGHT_FOG)
            return Estimate(self.method, 0.0, least / _NORMAL_95_PERCENT, diagnostics=found)
        visibility = visibility_by_parabola(scores)
        if visibility is None:
            return Estimate.invalid(self.method, "the scores have no top between the references", **found)
        extinction = extinction_from_visibility(visibility)
        accuracy = next(error for most, error in BANDS if visibility < most) / visibility / _NORMAL_95_PERCENT
        return Estimate(self.method, extinction, extinction * accuracy, diagnostics=found)
