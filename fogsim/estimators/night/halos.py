"""Fog by the halos about lamps, after gallen2014 section III-B: whether there is any, never how much.

The paper's value of a picture is the mean Br50 of its halos. Ours is the largest sharpness: in fog no lamp is sharp,
and on a clear night some lamp is, while signs and lamps behind glare spoil a mean.
"""

import json
import math
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from fogsim.core.files.readers import number_within, read_json
from fogsim.errors import InputError, shown
from fogsim.values.camera import Camera, Response
from fogsim.vision.light.pixel_kernels import Pixels
from fogsim.vision.sources.halo_profile import Halo, SourceTree, halos_of, source_tree

PUBLISHED = 9.0
"""The paper's threshold of the mean Br50, of its camera [levels of 255 a pixel]."""

NEAREST = 12.0
"""Distance of the nearest vehicle ahead that the threshold is calibrated with [m]: closer lamps have no halo."""

WINDOW = 25
"""Frames of the sliding mean: a second of the paper's."""


@dataclass(frozen=True, slots=True)
class HaloThreshold:
    """Values of pictures below which there is fog, measured for one camera."""

    # width, height: size of the camera's pictures [px]
    width: int
    height: int
    focal_length: float  # Its focal length [px]
    response: str  # Its response
    black_level: float  # Its black level [-]
    # steepness, sharpness: of the mean Br50, and of the largest sharpness [levels of 255 a pixel]
    steepness: float
    sharpness: float
    # mean_errors, largest_errors: share of pictures of clear nights or of fog, whichever is larger, that either gets
    # wrong of those it was chosen on [-]
    mean_errors: float
    largest_errors: float
    pictures: int  # How many pictures with a halo they were chosen on

    def __post_init__(self) -> None:
        positive = (self.width, self.height, self.focal_length, self.steepness, self.sharpness, self.pictures)
        told: tuple[object, ...] = (*positive, self.black_level, self.mean_errors, self.largest_errors)
        finite = all(isinstance(one, int | float) and math.isfinite(one) for one in told)
        if not finite or min(positive) <= 0 or self.response not in list(Response):
            raise InputError(f"expected finite numbers, sizes and threshold above 0, got {shown(asdict(self))}")

    def as_json(self) -> str:
        """The threshold as a file has it."""
        return json.dumps(asdict(self), indent=2)

    @classmethod
    def read(cls, path: Path) -> "HaloThreshold":
        """Read a file that `fogsim calibrate halos` wrote."""
        try:
            data, names = read_json(path), list(cls.__dataclass_fields__)
            if not isinstance(data, Mapping) or sorted(data) != sorted(names):
                given = sorted(data) if isinstance(data, Mapping) else data
                raise InputError(f"expected the keys {', '.join(names)}, got {shown(given)}")  # noqa: TRY301
            for name in set(names) - {"response"}:
                number_within("", name, data[name])
            return cls(**data)
        except InputError as error:
            raise InputError(f"halos must be a file of `fogsim calibrate halos`, got {str(path)!r}: {error}") from error

    def checked_for(self, camera: Camera) -> "HaloThreshold":
        """Itself, if it was measured for a camera."""
        mine, theirs = _traits(self), _traits(camera)
        if mine != theirs:
            raise InputError(
                f"the threshold of halos was calibrated for a camera of {mine}, and this one has {theirs}: "
                "fogsim calibrate halos"
            )
        return self


def _traits(of: HaloThreshold | Camera) -> str:
    response = Response(of.response).value
    return (
        f"{of.width}x{of.height} px, focal length {of.focal_length:.6g} px, response {response}, "
        f"black level {of.black_level:g}"
    )


@dataclass(frozen=True, slots=True)
class HaloReading:
    """What the halos of one picture say."""

    value: float | None  # Value of this picture [levels of 255 a pixel]; None without a halo
    smoothed: float | None  # Its mean over the last pictures that had one, this one among them; None without a halo
    is_fog: bool | None  # Whether there is fog, by the smoothed value; None without a halo
    halos: tuple[Halo, ...]  # Of the sources that were selected
    tree: SourceTree  # All sources


class HaloWatch:
    """Looks at the halos of picture after picture (`threshold` [levels of 255 a pixel])."""

    def __init__(
        self, threshold: float = PUBLISHED, value_of: "ValueOf | None" = None, *, window: int = WINDOW
    ) -> None:
        self._threshold, self._value_of = threshold, value_of or mean_steepness
        self._last: deque[float | None] = deque(maxlen=window)

    def reset(self) -> None:
        """Forget the pictures before."""
        self._last.clear()

    def look(self, image: Pixels, bits: int = 8) -> HaloReading:
        """Look at one picture (`image` (rows, cols))."""
        tree = source_tree(image, bits)
        halos = halos_of(tree)
        value = self._value_of(halos)
        self._last.append(value)
        if value is None:
            return HaloReading(None, None, None, halos, tree)
        seen = [one for one in self._last if one is not None]
        smoothed = sum(seen) / len(seen)
        return HaloReading(value, smoothed, smoothed < self._threshold, halos, tree)


def mean_steepness(halos: tuple[Halo, ...]) -> float | None:
    """Mean Br50 of a picture [levels of 255 a pixel]; None without a halo."""
    return sum(one.steepness for one in halos) / len(halos) if halos else None


def largest_sharpness(halos: tuple[Halo, ...]) -> float | None:
    """Sharpness of the sharpest halo of a picture [levels of 255 a pixel]; None without a halo."""
    return max((one.sharpness for one in halos), default=None)


ValueOf = Callable[[tuple[Halo, ...]], float | None]
"""Value of a picture by its halos."""
