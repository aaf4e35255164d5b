"""Estimates of any method over images from disk."""

import warnings
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, TypeVar

import numpy as np

from fogsim.core.parameters import NUMBER_OR_NAN, accepted_parameters, checked_parameters
from fogsim.errors import InputError, UnknownNameError
from fogsim.estimators import ESTIMATORS, Estimator, make
from fogsim.offline.calibration_deviations import EXACT, CalibrationDeviations, on_any_scale, scale_left
from fogsim.offline.camera_file import Calibration
from fogsim.offline.drive.road_scale import NightDrive
from fogsim.offline.drive.sign_watch import SignWatch, watch_signs
from fogsim.offline.image_files import Pixels
from fogsim.offline.input_paths import find_source
from fogsim.offline.rectification import straightened
from fogsim.offline.source import ImageFiles, Picture, Source
from fogsim.values import Camera, Estimate, Frame, Observation, SignLook, SignSighting
from fogsim.values.result_checks import checked_estimate
from fogsim.vision.restoration.picture import refuse_short_range

_ALL = "all"
"""Represents every method of the registry."""

_WHOLE_RANGE_BITS = 12
"""Bit depth for estimating images that use all 16 bits; four more bits are noise in any camera."""

_MOST_UNFIT = 10
"""Images at a source's beginning after which, if none fits the calibration, it counts as that of another camera."""

_Result = TypeVar("_Result")


@dataclass(frozen=True, slots=True)
class FrameEstimates:
    """Estimates of the methods for one image.

    Attributes
    ----------
    picture : Picture
        The image, or the reason why it could not be used.
    estimates : tuple of Estimate
        One for each method in their order; empty if the image could not be used.
    signs : tuple of SignLook
        Signs of the map that the image should show; empty without a map.
    """

    picture: Picture
    estimates: tuple[Estimate, ...]
    signs: tuple[SignLook, ...] = ()


def chosen_methods(names: Sequence[str]) -> tuple[str, ...]:
    """Methods with the given names, each once; "all" stands for every method.

    Parameters
    ----------
    names : sequence of str
        Names in the registry, or "all".

    Raises
    ------
    UnknownNameError
        If a name is unknown; the message has the known ones and the nearest.
    """
    for name in names:
        if name != _ALL and name not in ESTIMATORS:
            raise UnknownNameError("method", name, [*ESTIMATORS, _ALL])
    meant = [one for name in names for one in (ESTIMATORS if name == _ALL else (name,))]
    return tuple(dict.fromkeys(meant))


@checked_parameters
def estimate_images(
    inputs: Iterable[str | Path] | str | Path,
    camera: Camera | Calibration,
    methods: Iterable[str] | str = _ALL,
    *,
    sequence: bool | None = None,
    rate: Annotated[float, NUMBER_OR_NAN] | None = None,
    signs: str | Path | None = None,
    track: str | Path | None = None,
    night: NightDrive | None = None,
) -> Iterator[FrameEstimates]:
    """Estimate the fog in your own images or video.

    Parameters
    ----------
    inputs : path or iterable of paths
        One video, or image files, folders and patterns; see `find_source`.
    camera : Camera or Calibration
        Their calibration (`fogsim.offline.load_calibration` reads it from a file, and its standard deviations, which
        widen the intervals; a `Camera` alone counts as exact but for its pitch). Images of a lens that distorts or of
        a camera with yaw are rectified first, and the results contain the rectified images.
    methods : str or iterable of str
        Names in `fogsim.estimators.ESTIMATORS`, or "all".
    sequence : bool or None
        Whether images follow one another in time, so that methods may use earlier ones; None to decide by their names.
    rate : float or None
        Images of a sequence in a second [1/s]; None for that of their EXIF times, or 10 without.
    signs, track : path or None
        A map of signs, GeoJSON, and the positions of the drive from its first image on, GPX or CSV: both or neither;
        see `fogsim.offline.watch_signs`.
    night : NightDrive or None
        Own lamps and calibrations of a drive by night; without it, night methods assume the low beams.

    Yields
    ------
    FrameEstimates
        For each image in turn; an unreadable one has its reason in ``picture.error`` and no estimates.

    Raises
    ------
    InputError
        If there are no images, a method is unknown, the first images do not fit the camera, its lens folds the image,
        none can be read, or map and track cannot be used.
    """
    if (signs is None) != (track is None):
        raise InputError("signs and track go together: a map says nothing without places, nor places without a map")
    names = [methods] if isinstance(methods, str) else [*methods]
    calibration = Calibration(camera) if isinstance(camera, Camera) else camera
    found = find_source(inputs, sequence=sequence, rate=rate)
    for remark in found.remarks if isinstance(found, ImageFiles) else ():
        warnings.warn(remark, stacklevel=2)
    source, pinhole = straightened(found, calibration)
    watch = None if signs is None or track is None else watch_signs(signs, track, source, pinhole)[0]
    return estimates_of(source, pinhole, chosen_methods(names), watch, night, calibration.deviations)


def estimates_of(
    source: Source,
    camera: Camera,
    methods: Sequence[str],
    watch: SignWatch | None = None,
    night: NightDrive | None = None,
    deviations: CalibrationDeviations = EXACT,
) -> Iterator[FrameEstimates]:
    """Estimate the fog in the images of a source; see `estimate_images`.

    An image that does not fit the camera is skipped like an unreadable one, unless none fits of all or of the first
    ten: then the calibration is of another camera.

    Parameters
    ----------
    source : Source
        The images.
    camera : Camera
        Their calibration.
    methods : sequence of str
        Names in the registry.
    watch : SignWatch or None
        Signs along the drive.
    night : NightDrive or None
        Own lamps and calibrations of a drive by night.
    deviations : CalibrationDeviations
        How uncertain the calibration is, which widens the intervals.
    """
    bench = _Bench(camera, methods, night, deviations)
    return unless_none_fits(_judged(bench, source, watch))


def _judged(bench: "_Bench", source: Source, watch: SignWatch | None) -> Iterator[tuple[FrameEstimates, str | None]]:
    """Estimates, and why an image does not fit; see `unless_none_fits`."""
    count, is_readable = 0, False
    for picture in source.pictures():
        count += 1
        if picture.image is None:
            yield FrameEstimates(picture, ()), None
            continue
        is_readable = True
        if not source.temporal:
            bench.reset()
        try:
            sightings = None if watch is None else watch.sightings(picture.time)
            results = bench.results(picture.image, picture.time, sightings or ())
        except InputError as error:
            message = f"{place_of(source, picture)}: {error}"
            yield FrameEstimates(replace(picture, image=None, error=message), ()), message
            continue
        looks = () if watch is None or sightings is None else watch.look(picture.image, picture.time, sightings)
        yield FrameEstimates(picture, bench.estimates(results), looks), ""
    if not is_readable:
        raise InputError(f"none of the {count} images can be read" if count > 1 else "the only image cannot be read")


def unless_none_fits(judged: Iterable[tuple[_Result, str | None]]) -> Iterator[_Result]:
    """Results of images in turn; InputError if none of all or of the first ten fits the calibration.

    Each comes with the reason why its image does not fit: "" if it does, None if it could not be read.
    """
    waiting, reasons, is_fitted = list[_Result](), list[str](), False
    for result, reason in judged:
        waiting.append(result)
        is_fitted = is_fitted or reason == ""
        reasons += [reason] if reason else []
        if is_fitted or not reasons:
            yield from waiting
            waiting.clear()
        elif len(reasons) == _MOST_UNFIT:
            break
    if waiting:
        raise InputError(reasons[0])


def place_of(source: Source, picture: Picture) -> str:
    """Path of an image, or of its video with the number of the frame."""
    return picture.name if isinstance(picture.name, str) else f"{source.paths[0]}, frame {picture.name}"


class _Bench:
    """Estimators of several methods, for each bit depth that occurs."""

    def __init__(
        self, camera: Camera, methods: Sequence[str], night: NightDrive | None, deviations: CalibrationDeviations
    ) -> None:
        self._camera, self._night, self._deviations = camera, night, deviations
        self._methods, self._left = tuple(methods), [scale_left(deviations, name) for name in methods]
        self._estimators: dict[Camera, list[Estimator]] = {camera: self._made(camera)}

    def _made(self, camera: Camera) -> list[Estimator]:
        return [make(name, camera, **self._parameters_of(name)) for name in self._methods]

    def _parameters_of(self, name: str) -> dict[str, object]:
        drive = NightDrive() if self._night is None else self._night
        known, given = accepted_parameters(ESTIMATORS[name]), self._deviations.parameters
        return {**drive.parameters_of(name), **{key: value for key, value in given.items() if key in known}}

    def reset(self) -> None:
        """Forget all earlier images."""
        for estimator in self._all():
            estimator.reset()

    def _all(self) -> Iterable[Estimator]:
        return (one for estimators in self._estimators.values() for one in estimators)

    def results(self, image: Pixels, time: float, signs: tuple[SignSighting, ...]) -> tuple[object, ...]:
        """What all methods return for an image and the signs ahead; InputError if it is not of the camera."""
        pixels, camera = _in_bits(image, self._camera)
        if pixels.shape[:2] != (camera.height, camera.width):
            rows, cols = pixels.shape[:2]
            raise InputError(
                f"the image has {cols} × {rows} pixels, the camera {camera.width} × {camera.height}; "
                "they must be the same: which of them was scaled or cropped?"
            )
        if camera not in self._estimators:
            self._estimators[camera] = self._made(camera)
        observation = Observation(Frame(time, pixels, camera), signs=signs)
        if self._night is not None:
            observation = replace(observation, lamps=self._night.lamps, camera_setback=self._night.setback)
        return tuple(estimator.update(observation) for estimator in self._estimators[camera])

    def estimates(self, results: tuple[object, ...]) -> tuple[Estimate, ...]:
        """Estimates of all methods; InputError if a user's method returned none."""
        checked = (checked_estimate(name, one) for name, one in zip(self._methods, results, strict=True))
        return tuple(map(on_any_scale, checked, self._left))


def _in_bits(image: Pixels, camera: Camera) -> tuple[Pixels, Camera]:
    """Image and camera with the bit depth of the estimation; InputError if the image has fewer bits than the camera."""
    if image.dtype == np.uint8 and camera.bits > 8:
        raise InputError(f"the image has 8 bits, the camera {camera.bits}; leave `bits` out of the camera file")
    if image.dtype == np.uint16 and camera.bits == 8:
        refuse_short_range(int(image.max(initial=0)))
        return (image >> (16 - _WHOLE_RANGE_BITS)).astype(np.uint16), replace(camera, bits=_WHOLE_RANGE_BITS)
    return image, camera
