"""Gallen et al. (2014), section III-C: fog by halos where there are lamps, by the own lamps' veil where none is."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Self

from fogsim.core.parameters import FileName, Range, checked_parameters
from fogsim.errors import InputError
from fogsim.estimators.image_check import ObservationCheck
from fogsim.estimators.night.gallen2014_veil import LEAST_ROWS, Gallen2014Veil
from fogsim.estimators.night.halos import (
    NEAREST,
    PUBLISHED,
    WINDOW,
    HaloReading,
    HaloThreshold,
    HaloWatch,
    largest_sharpness,
)
from fogsim.estimators.night.own_light import FORGOTTEN, HeadLamps
from fogsim.estimators.protocol import Calibrations
from fogsim.units import extinction_from_visibility
from fogsim.values.camera import Camera
from fogsim.values.estimate import Estimate, ExtinctionBounds
from fogsim.values.observation import Observation
from fogsim.vision.light.daylight import lit_by_lamps
from fogsim.vision.lines.horizon import levelled

DENSE, LIGHT = 100.0, 300.0
"""Visibilities between the paper's classes of fog [m] (table I)."""

_SURELY_SEEN, _HARDLY_SEEN = 200.0, 1000.0
"""Visibilities of the thinnest fog that halos surely show, and of what they may take for fog at most [m]."""

_SOFTNESS = 0.3
"""Standard deviation of these, in ln k [-]."""


def fog_class(visibility: float) -> int:
    """The paper's class of fog: 3, dense, below 100 m; 2, fog; 1, light fog, above 300 m (table I).

    Takes `visibility` [m].
    """
    return 3 if visibility < DENSE else 2 if visibility <= LIGHT else 1


@checked_parameters
class Gallen2014:
    """Halos about lamps first, the own head lamps' veil without lamps (figure 9).

    Where lamps are seen, their halos show whether there is fog, but not how much: estimates are then not valid and have
    bounds. Where none are, the veil is compared with references, which gives the density.

    Gallen, Cord, Hautière, Dumont & Aubert, "Nighttime Visibility Analysis and Estimation Method in the Presence of
    Dense Fog", IEEE Transactions on Intelligent Transportation Systems, 2014.

    Parameters
    ----------
    camera : Camera
        The assumed calibration.
    halos : str or None
        File of ``fogsim calibrate halos`` for this camera; None to calibrate it, once, when
        it is first needed.
    head_lamps : str
        See `NightRoad`.
    window : int
        Pictures over which the halos' value is smoothed.
    as_published : bool
        Whether the value is the mean Br50 in place of the largest sharpness, and the veil's visibility is found to the
        letter of the paper.

    Raises
    ------
    InputError
        If a parameter is out of range, or a file cannot be read or is of another camera.
    """

    method = "gallen2014"

    def __init__(
        self,
        camera: Camera,
        *,
        halos: FileName | None = None,
        head_lamps: HeadLamps = "usual",
        window: Annotated[int, Range(1, 10_000)] = WINDOW,
        as_published: bool = False,
    ) -> None:
        self._camera, self._check = camera, ObservationCheck(camera)
        self._window, self._as_published = int(window), as_published
        self._veil = Gallen2014Veil(camera, head_lamps=head_lamps, as_published=as_published)
        self._watch, self._is_calibrated = HaloWatch(PUBLISHED, window=self._window), False
        self._source: Calibrations | None = None
        self._time = 0.0
        self._trouble = "halos are not calibrated for this camera: fogsim calibrate halos, parameter halos"
        if halos is not None:
            self.calibrated(HaloThreshold.read(Path(halos)))

    def calibrated(self, measured: HaloThreshold) -> Self:
        """Take a threshold that was not read from a file.

        Parameters
        ----------
        measured : HaloThreshold
            Of this camera.

        Raises
        ------
        InputError
            If it is of another camera.
        """
        checked, window = measured.checked_for(self._camera), self._window
        self._is_calibrated = True
        if self._as_published:
            self._watch = HaloWatch(checked.steepness, window=window)
        else:
            self._watch = HaloWatch(checked.sharpness, largest_sharpness, window=window)
        return self

    def take_calibrations(self, source: Calibrations) -> None:
        """Take calibrations from a source where no file was named."""
        self._source = source
        self._veil.take_calibrations(source)

    def reset(self) -> None:
        """Forget all earlier frames."""
        self._check.reset()
        self._watch.reset()
        self._veil.reset()
        self._time = 0.0

    def update(self, observation: Observation) -> Estimate:
        """Look for lamps, and where there are none for the veil.

        Parameters
        ----------
        observation : Observation
            Its image, lamps and the camera's place are used.

        Returns
        -------
        Estimate
            Diagnostics: ``by``, "halos" or "veil"; ``detected``, whether there is fog; by halos ``value`` of this
            picture, ``smoothed`` over pictures [levels a pixel], and ``lamps``, how many; by the veil what
            `Gallen2014Veil` reports, and ``fog_class`` 1 … 3; or ``reason``.

        Raises
        ------
        InputError
            If camera, image or time do not fit (see `fogsim.estimators.image_check`).
        """
        image = self._check.kernel_image(observation)
        row = self._camera.horizon_row
        if not LEAST_ROWS <= row <= self._camera.height - 1 - LEAST_ROWS:
            why = f"the horizon (row {row:.1f}) is outside the image, or at its border"
            return Estimate.invalid(self.method, why)
        if not lit_by_lamps(levelled(image, self._camera), self._camera):
            return Estimate.invalid(self.method, "no lamps light the road: this is a method for the night")
        if not self._as_published and observation.lead is not None and observation.lead.distance < NEAREST:
            return Estimate.invalid(self.method, "a vehicle close ahead: so near, lamps have no halo in any fog")
        self._calibrate()
        if observation.time - self._time > FORGOTTEN:
            self._watch.reset()
        self._time = observation.time
        reading = self._watch.look(image, self._camera.bits)
        if reading.is_fog is not None:
            return self._by_halos(reading)
        return self._by_veil(observation)

    def _calibrate(self) -> None:
        """Calibrate the camera, unless it is or cannot be."""
        if self._is_calibrated or self._source is None:
            return
        try:
            self.calibrated(self._source.halo_threshold(self._camera))
        except InputError as error:
            self._source, self._trouble = None, str(error)

    def _by_veil(self, observation: Observation) -> Estimate:
        told = self._veil.update(observation)
        found = {**told.diagnostics, "by": "veil"}
        if told.valid:
            found["fog_class"] = fog_class(told.visibility)
        return replace(told, method=self.method, diagnostics=found)

    def _by_halos(self, reading: HaloReading) -> Estimate:
        found: dict[str, object] = {"by": "halos", "detected": reading.is_fog, "lamps": len(reading.halos)}
        found |= {"value": reading.value, "smoothed": reading.smoothed}
        if not self._is_calibrated:
            return Estimate.invalid(self.method, self._trouble, **found)
        if reading.is_fog:
            why, bounds = (
                "halos show fog, but not how much",
                ExtinctionBounds(least=extinction_from_visibility(_HARDLY_SEEN), softness=_SOFTNESS),
            )
        else:
            why, bounds = (
                "lamps have no halo: there is no dense fog",
                ExtinctionBounds(most=extinction_from_visibility(_SURELY_SEEN), softness=_SOFTNESS),
            )
        return replace(Estimate.invalid(self.method, why, **found), bounds=bounds)


@checked_parameters
class Gallen2014Halo(Gallen2014):
    """Halos about lamps alone, without the own head lamps' veil (section III-B).

    Parameters
    ----------
    camera : Camera
        The assumed calibration.
    halos : str or None
        File of ``fogsim calibrate halos``; see `Gallen2014`.
    window : int
        Pictures over which the mean Br50 is smoothed.
    as_published : bool
        Whether halos' threshold is found to the letter of the paper.

    Raises
    ------
    InputError
        If a parameter is out of range, or the file cannot be read or is of another camera.
    """

    method = "gallen2014_halo"

    def __init__(
        self,
        camera: Camera,
        *,
        halos: FileName | None = None,
        window: Annotated[int, Range(1, 10_000)] = WINDOW,
        as_published: bool = False,
    ) -> None:
        super().__init__(camera, halos=halos, window=window, as_published=as_published)

    def _by_veil(self, observation: Observation) -> Estimate:  # noqa: ARG002 - what the combination is given
        return Estimate.invalid(self.method, "no lamp is seen whose halo could be measured")
