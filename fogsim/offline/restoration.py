"""Contrast restoration of images and videos from disk."""

import hashlib
from collections import Counter
from collections.abc import Generator, Iterator
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fogsim.core.files.atomic import write_text
from fogsim.core.files.output_targets import refuse_unwritable_folder
from fogsim.errors import InputError
from fogsim.offline.estimation import estimates_of, place_of, unless_none_fits
from fogsim.offline.image_files import Pixels, refuse_unwritable_image, write_image
from fogsim.offline.rectification import StraightenedSource
from fogsim.offline.source import ImageFiles, Picture, Source
from fogsim.offline.video_source import VideoWriter, refuse_unfit_video
from fogsim.units import LUMINANCE_WEIGHTS, extinction_from_visibility
from fogsim.values import Camera, Estimate
from fogsim.values.camera_response import respond
from fogsim.vision.restoration import METHODS, MOST_GAIN, restore_contrast
from fogsim.vision.restoration.picture import largest_value

_ESTIMATOR = "joint_road"
"""Method that estimates the extinction if no visibility is given."""

_UNFINISHED = ".unfinished"
"""File in a folder of restored images until all are written; it has a digest of what they are made from."""


@dataclass(frozen=True, slots=True)
class RestorationWish:
    """How to restore images.

    `visibility` is V_met [m] (``inf`` for nothing to undo; None to estimate it), `most_gain` limits the amplification
    of light [-], and `airlight` has one pixel value or red, green and blue (None to take it from the images).
    `tone_map` makes results for viewing, `beside` puts the original to the left.
    """

    method: str = "planar"
    visibility: float | None = None
    most_gain: float = MOST_GAIN
    airlight: tuple[float, ...] | None = None
    tone_map: bool = False
    beside: bool = False

    def __post_init__(self) -> None:
        """Refuse an invalid restoration."""
        needs = METHODS.find(self.method).needs_extinction
        if self.visibility is None:
            return
        if not self.visibility > 0:
            raise InputError(f"--visibility must be a positive length in metres, got {self.visibility!r}")
        if not needs:
            raise InputError(f"--visibility goes with planar; {self.method} finds the veil in the image itself")

    @property
    def estimates(self) -> bool:
        """Whether the extinction comes from an estimator."""
        return self.visibility is None and METHODS.find(self.method).needs_extinction


@dataclass(frozen=True, slots=True)
class Restored:
    """Result for one image; `image` is None and `reason` not empty if it could not be restored.

    `extinction` [1/m] is None for methods without it, and `held` if it is that of an earlier image.
    """

    picture: Picture
    image: Pixels | None
    extinction: float | None = None
    reason: str = ""
    held: bool = False


def _restored_images(source: Source, camera: Camera, wish: RestorationWish) -> Iterator[Restored]:
    """Restore the images of a source in turn.

    `joint_road` estimates the extinction of each image; in a sequence, the last valid estimate is kept. An image that
    does not fit the camera is not restored.
    """
    return unless_none_fits(_judged(source, camera, wish))


def _judged(source: Source, camera: Camera, wish: RestorationWish) -> Iterator[tuple[Restored, str | None]]:
    """Restored images, and why an image does not fit; see `unless_none_fits`."""
    last: Estimate | None = None
    for picture, estimate in _estimated(source, camera, wish):
        if picture.image is None:
            yield Restored(picture, None, reason=picture.error), None
            continue
        held = False
        if estimate is not None:
            held = not estimate.valid and source.temporal and last is not None
            last = estimate if estimate.valid or not source.temporal else last
            if last is None or not last.valid:
                reason = f"no visibility: {estimate.diagnostics.get('reason', 'unknown')}"
                yield Restored(picture, None, reason=reason), ""
                continue
        try:
            yield _restored(picture, picture.image, camera, wish, last, held), ""
        except InputError as error:
            yield Restored(picture, None, reason=str(error)), f"{place_of(source, picture)}: {error}"


def _estimated(source: Source, camera: Camera, wish: RestorationWish) -> Iterator[tuple[Picture, Estimate | None]]:
    """Images, with their estimates if needed."""
    if wish.estimates:
        for result in estimates_of(source, camera, (_ESTIMATOR,)):
            yield result.picture, next(iter(result.estimates), None)
        return
    for picture in source.pictures():
        yield picture, None


def _restored(
    picture: Picture, image: Pixels, camera: Camera, wish: RestorationWish, estimate: Estimate | None, held: bool
) -> Restored:
    extinction = None if estimate is None else estimate.extinction
    if wish.visibility is not None:
        extinction = extinction_from_visibility(wish.visibility)
    done = restore_contrast(
        image,
        camera,
        extinction,
        _airlight(image, camera, wish, estimate),
        method=wish.method,
        most_gain=wish.most_gain,
        tone_map=wish.tone_map,
    ).image
    shown = np.concatenate([image, done], axis=1) if wish.beside else done
    return Restored(picture, shown, extinction, held=held)


def _airlight(
    image: Pixels, camera: Camera, wish: RestorationWish, estimate: Estimate | None
) -> NDArray[np.float64] | None:
    """Pixel values of the given airlight, or of the image's own with the estimate's luminance."""
    if wish.airlight is not None:
        return np.array(wish.airlight)
    airlight = None if estimate is None else estimate.diagnostics.get("airlight")
    if not isinstance(airlight, float):
        return None
    full = largest_value(image, camera)
    channels = image.reshape(*image.shape[:2], -1)
    light = METHODS.find(wish.method).airlight(channels, camera, int(full))
    weights = np.array(LUMINANCE_WEIGHTS if len(light) == 3 else (1.0,))
    scaled = np.minimum(light * (airlight / 255.0 / float((light * weights).sum())), 1.0)
    return np.asarray(full * respond(scaled, camera.response, camera.black_level))


def restore_files(
    source: Source, camera: Camera, wish: RestorationWish, out: Path, *, overwrite: bool = False
) -> Generator[Restored]:
    """Restore image files and yield each after it was written: one into a file, several into a folder by name.

    After an interruption, those that are in the folder are left out.
    """
    targets = _targets(source.paths, out)
    is_folder, finished = len(targets) > 1, frozenset[Path]()
    mark, digest = out / _UNFINISHED, _digest(source, camera, wish)
    if is_folder:
        refuse_unwritable_folder(out)
        finished = _finished(targets, mark, digest)
    # Comparing each target with all sources would take minutes for thousands of images.
    sources = {_identity(path): (path,) for path in source.paths}
    for target in (one for one in targets if one not in finished):
        read = sources.get(_identity(target), ())
        refuse_unwritable_image(target, "--out", overwrite=overwrite, read=read, makes_folder=is_folder)
    if is_folder:
        out.mkdir(parents=True, exist_ok=True)
        if not finished:
            write_text(mark, digest)
    if not (source.temporal and wish.estimates):  # otherwise, earlier images count
        source = _rest(source, {path for path, target in zip(source.paths, targets, strict=True) if target in finished})
        targets = tuple(one for one in targets if one not in finished)
    results = _restored_images(source, camera, wish) if targets else ()
    for target, one in zip(targets, results, strict=True):
        if target not in finished:
            yield _written(target, one, is_one_of_several=is_folder)
    if is_folder:
        mark.unlink(missing_ok=True)


def _digest(source: Source, camera: Camera, wish: RestorationWish) -> str:
    """Digest of what determines restored images."""
    calibration = source.straightener.calibration if isinstance(source, StraightenedSource) else camera
    stats = [(path, path.stat()) for path in source.paths if path.exists()]
    files = [(path, found.st_size, found.st_mtime_ns) for path, found in stats]
    return hashlib.sha256(repr((version("fogsim"), source.temporal, calibration, wish, files)).encode()).hexdigest()


def _finished(targets: tuple[Path, ...], mark: Path, digest: str) -> frozenset[Path]:
    """Targets that an interrupted restoration with the same digest has written."""
    if not mark.is_file() or mark.read_text(encoding="utf-8", errors="replace") != digest:
        return frozenset()
    begun = mark.stat().st_mtime_ns
    return frozenset(one for one in targets if one.is_file() and one.stat().st_mtime_ns >= begun)


def _rest(source: Source, finished: set[Path]) -> Source:
    """A source without some of its files."""
    if isinstance(source, StraightenedSource):
        return replace(source, source=_rest(source.source, finished))
    assert isinstance(source, ImageFiles)  # noqa: S101 - no other has several files
    return replace(source, paths=tuple(path for path in source.paths if path not in finished))


def _written(target: Path, one: Restored, *, is_one_of_several: bool) -> Restored:
    """Write a restored image; one of several that its format cannot hold counts as not restored."""
    if one.image is None:
        return one
    try:
        write_image(target, _as_stored(one.image, one.picture.opacity))
    except InputError as error:
        if not is_one_of_several:
            raise
        return replace(one, image=None, reason=str(error))
    return one


def _as_stored(image: Pixels, opacity: Pixels | None) -> Pixels:
    """An image with blue first, and its opacity, if any; two side by side have the same."""
    stored = image if image.ndim == 2 else image[..., ::-1].copy()
    if opacity is None:
        return stored
    return np.dstack([stored, np.tile(opacity, image.shape[1] // opacity.shape[1])])


def _targets(paths: tuple[Path, ...], out: Path) -> tuple[Path, ...]:
    """Output path of each image; InputError if two are the same."""
    if len(paths) == 1:
        return (out,)
    name, count = Counter(path.name for path in paths).most_common(1)[0]
    if count > 1:
        raise InputError(f"{name}: {count} images have this name, and would all go to {out / name}; restore them apart")
    return tuple(out / path.name for path in paths)


def _identity(path: Path) -> tuple[int, int] | None:
    """Device and inode of a file; None if there is none."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino


def restore_video(
    source: Source, camera: Camera, wish: RestorationWish, out: Path, *, overwrite: bool = False
) -> Generator[Restored]:
    """Restore a video, whole or not at all; frames before the first estimate stay. InputError if no frame has one."""
    refuse_unfit_video(out, source.paths, camera, kind="restored", overwrite=overwrite)
    found, reason, damage = False, "", ""
    with VideoWriter(out) as writer:
        for one in _restored_images(source, camera, wish):
            seen = one.picture.image
            if seen is None:
                damage = damage or one.picture.error
                continue
            as_it_was = np.concatenate([seen, seen], axis=1) if wish.beside else seen
            writer.write(as_it_was if one.image is None else one.image, one.picture.time)
            found, reason = found or one.image is not None, reason or one.reason
            yield one
        if not found:
            raise InputError(
                f"{source.paths[0]}: {reason}, and none in any other frame; --visibility restores it all the same"
            )
    if damage:
        raise InputError(f"{damage}; {out} has what could be read")
