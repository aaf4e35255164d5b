"""Calibrations of the camera in use: made when a method first needs them, and kept in the user's cache directory."""

import contextlib
import fcntl
import functools
import hashlib
import io
import json
import logging
import pickle
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar, cast

import numpy as np

from fogsim.calibration.halo_calibration import measure_halo_threshold
from fogsim.calibration.lit_fog import lit_fog
from fogsim.calibration.sign_calibration import Watch, measure_operating_range
from fogsim.calibration.veil_references import usual_references
from fogsim.core.files.user_cache import cache_directory, keep_newest, read_entry, write_entry
from fogsim.estimators.night.halos import HaloThreshold
from fogsim.estimators.night.own_light import KNOWN_HEAD_LAMPS, OwnLight
from fogsim.estimators.night.veil_correlation import VeilReferences
from fogsim.estimators.signs.operating_range import OperatingRange
from fogsim.lighting import LampMount
from fogsim.values import Camera, Lamp
from fogsim.values.light import lamp_names

_T = TypeVar("_T")

_RESTS_ON = (
    "atmosphere",
    "calibration",
    "camera",
    "estimators",
    "lighting",
    "render",
    "scene",
    "sensors",
    "units",
    "values",
    "vision",
)
"""Packages whose code decides what is drawn and detected: after a change in one of them calibrations are made again."""

_MOST_KEPT = 200
_NEWS_PERIOD = 10.0  # between two lines about the progress [s]


class CachedCalibrations:
    """Calibrations by staged scenes and by the night model, made once for each camera and then read."""

    def __init__(self, read_lamps: Callable[[Path], LampMount]) -> None:
        self._read_lamps = read_lamps

    def veil_references(self, camera: Camera, lamps: Lamp, setback: float) -> VeilReferences:
        """References for a car's head lamps, computed once in each process."""
        return usual_references(camera, lamps, setback)

    def own_light(self, camera: Camera, lamps: Lamp, setback: float, head_lamps: str) -> OwnLight:
        """What a camera sees of its own head lamps: a car's, of an unknown pattern, or of a file."""
        mount = LampMount() if head_lamps in KNOWN_HEAD_LAMPS else self._read_lamps(Path(head_lamps))
        return _own_light(camera, lamps, setback, mount, known=head_lamps != "unknown")

    def halo_threshold(self, camera: Camera) -> HaloThreshold:
        """Sharpness of halos below which there is fog; InputError if the camera shows none."""
        return _cached(
            _as_json(HaloThreshold), "halos", camera, lambda watch: measure_halo_threshold(camera, watch=watch)
        )

    def operating_range(self, camera: Camera, diameter: float) -> OperatingRange:
        """Distances at which signs of a diameter [m] are detected in fog; InputError if the camera is too coarse."""
        name = f"signs of {diameter:g} m"
        return _cached(
            _as_json(OperatingRange), name, camera, lambda watch: measure_operating_range(camera, diameter, watch=watch)
        )


def _own_light(camera: Camera, lamps: Lamp, setback: float, mount: LampMount, *, known: bool) -> OwnLight:
    beams = [(str(lamp), one.azimuth, one.elevation, one.intensity) for lamp, one in mount.beams.items()]
    digest = hashlib.sha256(pickle.dumps((known, replace(mount, beams={}), beams))).hexdigest()
    name = f"the light of {lamp_names(lamps)} {setback:g} m ahead"
    return _cached(
        _OWN_LIGHT,
        name,
        camera,
        lambda watch: lit_fog(camera, lamps, setback, mount=mount, known=known, watch=watch),
        digest,
    )


class _Form(NamedTuple, Generic[_T]):
    """How a calibration is kept in a file."""

    encode: Callable[[_T], bytes]
    decode: Callable[[bytes], _T]


def _as_json(kind: Callable[..., _T]) -> _Form[_T]:
    def decode(kept: bytes) -> _T:
        values = json.loads(kept)
        return kind(**{name: tuple(value) if isinstance(value, list) else value for name, value in values.items()})

    return _Form(lambda made: json.dumps(asdict(cast("Any", made))).encode(), decode)


def _encoded_light(light: OwnLight) -> bytes:
    file = io.BytesIO()
    np.savez_compressed(file, veil=light.veil, road=light.road, depth=light.depth)
    return file.getvalue()


def _decoded_light(kept: bytes) -> OwnLight:
    with np.load(io.BytesIO(kept), allow_pickle=False) as arrays:
        return OwnLight(arrays["veil"], arrays["road"], arrays["depth"])


_OWN_LIGHT = _Form(_encoded_light, _decoded_light)


def _cached(form: _Form[_T], name: str, camera: Camera, measure: Callable[[Watch], _T], digest: str = "") -> _T:
    """The calibration from the cache; measured if it is not there, by one process at a time."""
    key = hashlib.sha256(repr((name, digest, camera, _code())).encode()).hexdigest()[:24]
    folder = cache_directory() / "calibrations"
    path = folder / f"{key}.json"
    if (kept := read_entry(path)) is not None:
        return form.decode(kept)
    with _turn(folder):
        # Another process may have made it in the meantime.
        if (kept := read_entry(path)) is not None:
            return form.decode(kept)
        made = measure(_Progress(f"{name} for a camera of {camera.width} × {camera.height} px"))
        with contextlib.suppress(OSError):
            write_entry(path, form.encode(made))
            keep_newest(folder, _MOST_KEPT)
        return made


@functools.cache
def _code() -> str:
    """Identity of the code that calibrates; its files alone, since FogSim is not installed where a wheel is built."""
    digest, package = hashlib.sha256(), Path(__file__).parents[1]
    for file in sorted(file for room in _RESTS_ON for file in (package / room).rglob("*.py")):
        digest.update(file.read_bytes())
    return digest.hexdigest()


@contextlib.contextmanager
def _turn(folder: Path) -> Iterator[None]:
    """Wait while another process calibrates; without a writable cache directory, do not wait."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = folder.with_suffix(".lock").open("wb")
    except OSError:
        yield
        return
    with lock:
        with contextlib.suppress(OSError):  # a file system without locks
            fcntl.flock(lock, fcntl.LOCK_EX)
        yield


class _Progress:
    """Logs that a calibration is made, and now and then how far it is."""

    def __init__(self, name: str) -> None:
        self._name, self._last = name, time.monotonic()
        self._log = logging.getLogger("fogsim").warning
        self._log("fogsim: calibrating %s, once (kept in %s)", name, cache_directory())

    def __call__(self, done: int, total: int) -> None:
        """Log the number of finished scenes every ten seconds."""
        if time.monotonic() - self._last > _NEWS_PERIOD:
            self._last = time.monotonic()
            self._log("fogsim: calibrating %s: %d of %d", self._name, done, total)
