"""Belaroussi & Gruyer (2015): visibility from the distance at which signs of the map are first detected."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Self

from fogsim.core.linear_algebra import majority, reduced
from fogsim.core.parameters import FileName, Range, checked_parameters
from fogsim.errors import InputError
from fogsim.estimators.image_check import ObservationCheck
from fogsim.estimators.protocol import Calibrations
from fogsim.estimators.signs.operating_range import OperatingRange
from fogsim.estimators.signs.regions import PoseDeviation
from fogsim.estimators.signs.watch import SignTrack, SignWatch, Watched, sign_looks
from fogsim.units import extinction_from_visibility, visibility_from_extinction
from fogsim.values.camera import Camera
from fogsim.values.estimate import Estimate, ExtinctionBounds
from fogsim.values.observation import Observation

_FORGOTTEN = 0.05
"""p(c) below which a sign does not count any more [-]."""

_SYSTEMATIC = 0.08
"""Deviation of a drive's visibility that all of its signs share, relative to it: how the picture is exposed [-]."""

_SOFTNESS = 0.1
"""Standard deviation of a bound, in ln k [-]."""

_MISSES = 3
"""Looks at which a sign should have been seen and was not, from which on it was missed."""

_MISSED_SIGNS = 2
"""Signs that must have been missed: one alone may be missing in the world, or hidden."""

_LIKE = 0.1
"""Largest difference of the calibrated focal length from the camera's, relative to it [-]."""


@dataclass(frozen=True, slots=True)
class _Seen:
    """One sign's measurement: its visibility [m] and standard deviation [m], p(c), and when and where it was made."""

    visibility: float
    deviation: float
    confidence: float
    time: float
    way: float


@checked_parameters
class Belaroussi2015:
    """Detect the signs of the map; the distance at which each is first detected gives the visibility.

    A sign comes out of the fog at d_sign, the operating range of the detector; the visibility is a function of it,
    calibrated for the camera and the size of the sign. Each sign gives one measurement; k-means with three
    clusters sets outliers aside, and a mixture of normal distributions is reduced to one (sections 4.2 to 4.4). What a
    sign says fades with the way driven since and with time. Where the curve is flat, or was not measured, a sign has no
    information: the camera's resolution set the distance at which it came out.

    Belaroussi & Gruyer, "Road sign-aided estimation of visibility conditions", MVA 2015. The detector is `fogsim.vision
    .symmetry`, after the Bilateral Chinese Transform.

    Parameters
    ----------
    camera : Camera
        The assumed calibration.
    operating_range : str or None
        File of ``fogsim calibrate signs`` for this camera, which then counts for signs of all sizes; None to calibrate
        the camera for each size of signs, once, when the first is ahead.
    as_published : bool
        Whether the curve is the paper's cubic through the distances of 80 % detection, in place of the monotone one
        through the distances of first detection, and p(c) is 1.
    setback : float or None
        Distance of the camera behind the front bumper [m]; None to use what observations report.
    position_deviation : float
        Standard deviation of a sign's place by map and own position [m].
    heading_deviation, pitch_deviation : float
        Standard deviations of the own heading, and of the true pitch about the assumed one [rad].
    fading_way, fading_time : float
        Way [m] and time [s] after which a sign's p(c) is 1/e of what it was.

    Raises
    ------
    InputError
        If the file cannot be read, or is of a camera of another focal length.
    """

    method = "belaroussi2015"

    def __init__(
        self,
        camera: Camera,
        *,
        operating_range: FileName | None = None,
        as_published: bool = False,
        setback: Annotated[float, Range(0.0, 10.0, "m")] | None = None,
        position_deviation: Annotated[float, Range(0.0, 100.0, "m")] = 0.5,
        heading_deviation: Annotated[float, Range(0.0, 1.0, "rad")] = math.radians(0.2),
        pitch_deviation: Annotated[float, Range(0.0, 1.0, "rad")] = math.radians(0.1),
        fading_way: Annotated[float, Range(1.0, 1e9, "m")] = 700.0,
        fading_time: Annotated[float, Range(1.0, 1e9, "s")] = 45.0,
    ) -> None:
        self._check = ObservationCheck(camera)
        self._camera = camera
        self._given: OperatingRange | None = None
        self._source: Calibrations | None = None
        self._made: dict[float, OperatingRange | None] = {}
        self._trouble = "the detector is not calibrated for this camera: fogsim calibrate signs"
        if operating_range is not None:
            self.calibrated(OperatingRange.read(Path(operating_range)))
        self._as_published = as_published
        deviation = PoseDeviation(position_deviation, heading=heading_deviation, pitch=pitch_deviation)
        self._watch = SignWatch(camera, setback, deviation)
        self._fading_way, self._fading_time = fading_way, fading_time
        self._horizon = camera.horizon_row
        self.reset()

    def calibrated(self, measured: OperatingRange, watch: SignWatch | None = None) -> Self:
        """Take a calibration that was not read from a file.

        Parameters
        ----------
        measured : OperatingRange
            Of this camera.
        watch : SignWatch, optional
            Looks for signs in place of this estimator's own, such as one that several estimators share.

        Raises
        ------
        InputError
            If it is of a camera of another focal length.
        """
        if abs(measured.focal_length / self._camera.focal_length - 1.0) > _LIKE:
            raise InputError(
                f"the operating range was calibrated for a focal length of {measured.focal_length:g} px, and the "
                f"camera has {self._camera.focal_length:g} px: calibrate it for this camera"
            )
        self._given, self._trouble = measured, ""
        if watch is not None:
            self._watch = watch
        return self

    def take_calibrations(self, source: Calibrations) -> None:
        """Take calibrations from a source where no file was named."""
        self._source, self._trouble = source, ""

    def reset(self) -> None:
        """Forget all signs."""
        self._check.reset()
        self._watch.reset()
        self._counted: set[str] = set()
        self._seen: list[_Seen] = []
        self._way, self._time = 0.0, -math.inf
        self._least: tuple[float, float] | None = None
        self._missed: dict[str, tuple[OperatingRange, float, float]] = {}
        self._map_holds = False

    def update(self, observation: Observation) -> Estimate:
        """Look for the signs ahead, and estimate from all that were seen to come out of the fog.

        Parameters
        ----------
        observation : Observation
            Its image, time, speed and signs are used.

        Returns
        -------
        Estimate
            Diagnostics: ``signs``, how many count; ``single_visibilities`` of them [m]; ``sign_boxes``, (left, right,
            top, bottom) of those that were found [px]; ``sign_looks``, a `SignLook` of each that is ahead;
            ``visibility_at_least`` [m], of a sign that was seen from beyond the curve's range, or
            ``visibility_at_most`` [m], of two that were missed; or ``reason``.

        Raises
        ------
        InputError
            If camera, image or time do not fit (see `fogsim.estimators.image_check`), or two signs have one id.
        """
        self._check.image_of(observation)
        time = observation.time
        if math.isfinite(self._time):
            self._way += observation.speed * max(time - self._time, 0.0)
        self._time = time
        watched = self._watch.look(observation)
        found: dict[str, object] = {"horizon_row": self._horizon, "sign_boxes": _boxes(watched)}
        found["sign_looks"] = sign_looks(watched, self._watch.tracks)
        self._count(watched)
        self._note_missed()
        return self._estimate(found)

    def _range_of(self, track: SignTrack) -> OperatingRange | None:
        """The calibration for signs of a size; None without one, and `_trouble` has the reason."""
        size = round(track.sign.sighting.diameter, 1)
        if self._given is not None or self._source is None:
            return self._given
        if size not in self._made:
            try:
                self._made[size] = self._source.operating_range(self._camera, size)
            except InputError as error:
                self._made[size], self._trouble = None, str(error)
        return self._made[size]

    def _count(self, watched: Watched) -> None:
        """Measurements of the signs that are confirmed now."""
        self._counted -= {track.sign.sighting.sign_id for track in watched.passed}
        for track in self._watch.tracks:
            if track.confirmed and track.first_seen is not None and track.sign.sighting.sign_id not in self._counted:
                self._counted.add(track.sign.sighting.sign_id)
                if (measured := self._range_of(track)) is not None:
                    self._add(track, track.first_seen, measured)

    def _note_missed(self) -> None:
        """Note signs that should be seen and are not: their calibration, the nearest such distance, and when."""
        for track in self._watch.tracks:
            sign_id = track.sign.sighting.sign_id
            if track.confirmed:
                self._map_holds = True
                self._missed.pop(sign_id, None)
            elif (
                track.misses >= _MISSES
                and track.unseen_before is not None
                and (measured := self._range_of(track)) is not None
            ):
                self._missed[sign_id] = measured, track.unseen_before, self._time
        self._missed = {
            sign_id: missed for sign_id, missed in self._missed.items() if self._time - missed[2] < self._fading_time
        }

    def _add(self, track: SignTrack, first_seen: float, measured: OperatingRange) -> None:
        confidence = 1.0 if self._as_published else track.confidence
        if self._as_published:
            result: tuple[float, float] | None = measured.visibility_by_cubic(first_seen), 0.0
        elif track.unseen_before is None:
            # Who sees a sign at the first look may have been able to see it before: no first detection.
            result = None
        else:
            result = measured.visibility_at(first_seen)
        if result is not None and math.isfinite(result[0]) and result[0] > 0.0:
            self._seen.append(_Seen(*result, confidence, self._time, self._way))
        elif first_seen > measured.reach[1]:
            self._least = measured.farthest, self._time

    def _estimate(self, found: dict[str, object]) -> Estimate:
        weighted = [(one, self._weight(one)) for one in self._seen]
        weighted = [(one, weight) for one, weight in weighted if weight >= _FORGOTTEN]
        self._seen = [one for one, _ in weighted]
        if self._least is not None and self._time - self._least[1] < self._fading_time:
            found["visibility_at_least"] = self._least[0]
        if not weighted:
            why = self._trouble or self._watch.trouble or "no sign has come out of the fog yet"
            if "visibility_at_least" in found:
                why = f"signs are seen from beyond the curve's range: at least {found['visibility_at_least']:.0f} m"
            bounds = self._bounds(found)
            if bounds is not None and bounds.least > 0.0:
                found["visibility_at_most"] = visibility_from_extinction(bounds.least)
                why = f"signs of the map are not seen: at most {found['visibility_at_most']:.0f} m"
            return replace(Estimate.invalid(self.method, why, **found), bounds=bounds)
        values, weights = [one.visibility for one, _ in weighted], [weight for _, weight in weighted]
        chosen = majority(values, weights)
        kept = [(v, w) for v, w, keep in zip(values, weights, chosen, strict=True) if keep]
        mean, deviation = reduced([v for v, _ in kept], [w for _, w in kept])
        single = [one.deviation for (one, _), keep in zip(weighted, chosen, strict=True) if keep]
        # Signs of one drive share exposure and told pitch, so what the calibration scatters by does not average out.
        deviation = max(deviation, math.hypot(sum(single) / len(single), _SYSTEMATIC * mean))
        k = extinction_from_visibility(mean)
        found |= {"signs": len(kept), "single_visibilities": tuple(values)}
        return Estimate(self.method, k, k * deviation / mean, diagnostics=found)

    def _bounds(self, found: Mapping[str, object]) -> ExtinctionBounds | None:
        """Bounds from signs that were first seen beyond the curve's end, or not at all: at least, or at most, so much.

        A sign that is not seen where it should be has not come out of the fog, unless it is missing or hidden; so there
        must be two of them, and signs must have been found on the map before.
        """
        least = found.get("visibility_at_least")
        if isinstance(least, float):
            return ExtinctionBounds(most=extinction_from_visibility(least), softness=_SOFTNESS)
        if not self._map_holds or len(self._missed) < _MISSED_SIGNS:
            return None
        most = [
            measured.visibility_at(max(nearest, measured.reach[0])) for measured, nearest, _ in self._missed.values()
        ]
        lowest = sorted(one for one in most if one is not None)
        if len(lowest) < _MISSED_SIGNS:
            return None
        found_at_most, deviation = lowest[_MISSED_SIGNS - 1]
        softness = math.hypot(_SOFTNESS, deviation / found_at_most)
        return ExtinctionBounds(least=extinction_from_visibility(found_at_most), softness=softness)

    def _weight(self, one: _Seen) -> float:
        faded = (self._way - one.way) / self._fading_way + (self._time - one.time) / self._fading_time
        return one.confidence * math.exp(-faded)


def _boxes(watched: Watched) -> tuple[tuple[float, float, float, float], ...]:
    """(left, right, top, bottom) of the signs that were found [px]."""
    found = [one.detection for one in watched.found]
    return tuple((one.u - one.radius, one.u + one.radius, one.v - one.radius, one.v + one.radius) for one in found)
