"""What is on the glass before a camera, or shines into it: the faults that change light before it is exposed."""

import math
from collections.abc import Iterable, Iterator
from importlib import import_module
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import matrix_product
from fogsim.values import Camera, CameraPose, RunningFault
from fogsim.values.fault import DirtyLens, Glare, WetLens
from fogsim.values.pinhole import camera_axes

Floats = NDArray[np.float64]

_GLASS_DISTANCE = 0.05
"""From the entrance pupil to the glass along the axis [m]; assumed, for a camera close behind a windscreen."""

_PUPIL_DIAMETER = 0.003
"""Of the entrance pupil [m]: a focal length of 6 mm at F/2, assumed."""

_SIZE_SPREAD = 0.5
"""Standard deviation of the logarithm of blots' diameters [-], assumed."""

PUPIL = 0.5 * _PUPIL_DIAMETER / _GLASS_DISTANCE
"""Radius of the pupil as the glass has it, in distances of the glass [-]."""


class Blots(NamedTuple):
    """Round blots on the glass; lengths over the distance of the glass, so that a pixel is 1 / focal length wide."""

    # right, down (n,): middle, from the optical axis [-]
    right: Floats
    down: Floats
    radius: Floats  # (n,): Radius [-]


class _BlotPixels(NamedTuple):
    """Pixels that a blot dims."""

    # rows, columns: the part of the image about it
    rows: slice
    columns: slice
    hidden: Floats  # (rows, columns): Share of each pixel's light that the blot takes, 0 … 1


def scattered_blots(camera: Camera, coverage: float, diameter: float, rng: np.random.Generator) -> Blots:
    """Blots at random all over the glass (`diameter` [m])."""
    usual = 0.5 * diameter / _GLASS_DISTANCE
    margin = PUPIL + 3.0 * usual
    (u0, v0), focal = camera.principal_point, camera.focal_length
    left, right = -u0 / focal - margin, (camera.width - u0) / focal + margin
    top, bottom = -v0 / focal - margin, (camera.height - v0) / focal + margin
    # The mean square of a log-normal diameter is its median's times e^(2σ²).
    mean_area = math.pi * usual**2 * math.exp(2.0 * _SIZE_SPREAD**2)
    count = round(coverage * (right - left) * (bottom - top) / mean_area)
    return Blots(
        rng.uniform(left, right, count),
        rng.uniform(top, bottom, count),
        usual * np.exp(_SIZE_SPREAD * rng.normal(size=count)),
    )


def passed_light(camera: Camera, blots: Blots) -> NDArray[np.float32]:
    """Share of each pixel's light that passes between blots, 0 … 1; where they overlap, it is by chance."""
    passed = np.ones((camera.height, camera.width))
    for blot in _blot_pixels(camera, blots):
        passed[blot.rows, blot.columns] *= 1.0 - blot.hidden
    return passed.astype(np.float32)[..., None]


def _blot_pixels(camera: Camera, blots: Blots) -> Iterator[_BlotPixels]:
    """What each blot that is in the picture takes of it."""
    (u0, v0), focal = camera.principal_point, camera.focal_length
    for right, down, radius in zip(*blots, strict=True):
        reach = radius + PUPIL
        columns = _pixels(u0 + focal * (right - reach), u0 + focal * (right + reach), camera.width)
        rows = _pixels(v0 + focal * (down - reach), v0 + focal * (down + reach), camera.height)
        if columns.start >= columns.stop or rows.start >= rows.stop:
            continue
        x = (np.arange(columns.start, columns.stop) - u0) / focal - right
        y = ((np.arange(rows.start, rows.stop) - v0) / focal - down)[:, None]
        hidden = shared_area(np.hypot(x, y), radius, PUPIL) / (math.pi * PUPIL**2)
        yield _BlotPixels(rows, columns, hidden)


def _pixels(first: float, last: float, count: int) -> slice:
    return slice(max(math.ceil(first), 0), min(math.floor(last) + 1, count))


def shared_area(distance: Floats, one: float, other: float) -> Floats:
    """Area that two circles share, in the unit of their radii and distance squared (…)."""
    smaller = min(one, other)
    d = np.clip(distance, abs(one - other) + 1e-12, one + other)
    # Two sectors less the kite of both middles and both crossings.
    first = np.arccos(np.clip((d**2 + one**2 - other**2) / (2.0 * d * one), -1.0, 1.0))
    second = np.arccos(np.clip((d**2 + other**2 - one**2) / (2.0 * d * other), -1.0, 1.0))
    kite = np.sqrt(np.maximum((one + other - d) * (d + one - other) * (d - one + other) * (d + one + other), 0.0))
    lens = one**2 * first + other**2 * second - 0.5 * kite
    inside = np.where(distance <= abs(one - other), math.pi * smaller**2, lens)
    return np.asarray(np.where(distance >= one + other, 0.0, inside))


Floats32 = NDArray[np.float32]

_DROP_VIEW = math.radians(165.0)
"""Field of view of a drop of water (Garg and Nayar 2003, Photometric model of a rain drop) [rad]."""

_CELL = 16
"""Rows and columns of the picture that count as one where drops show it small [px]."""

STEP = 4
"""Rows and columns of the blocks of the image that share one value of a drop's light [px]; the pupil is far wider."""


class _DirtyGlass:
    """Dirt takes light from the road and sends some of the light around into the camera: L' = L T + (1 − T) ρ L̄.

    T is what blots leave (Gu et al. 2009, eq. 3), L̄ the mean of the picture, which stands for the light around.
    """

    def __init__(self, camera: Camera, dirt: DirtyLens, rng: np.random.Generator) -> None:
        self._passed = passed_light(camera, scattered_blots(camera, dirt.coverage, dirt.diameter, rng))
        self._albedo = np.float32(dirt.albedo)

    def look_through(self, radiance: Floats32) -> Floats32:
        """Luminance behind the glass (`radiance` (rows, cols, 3) [cd/m²])."""
        around: Floats32 = radiance.mean(axis=(0, 1), dtype=np.float64).astype(np.float32)
        behind: Floats32 = radiance * self._passed + (1.0 - self._passed) * (self._albedo * around)
        return behind


class _WetGlass:
    """Drops show the whole scene upside down and out of focus; the film of water between them blurs the picture.

    A drop is a wide-angle lens of some millimetres' focal length (Garg and Nayar 2003; You et al. 2016, Adherent
    raindrop modeling, detection and removal in video): light comes through it from 165° about, and its upper part shows
    what is below. What is not in the picture is taken to be as what is at its border. Each pixel gets the mean of what
    the drops show over the pupil, whose disc a Gaussian of the same variance stands for.
    """

    def __init__(self, camera: Camera, water: WetLens, rng: np.random.Generator) -> None:
        self._blur = water.blur * camera.focal_length
        drops = scattered_blots(camera, water.coverage, water.diameter, rng)
        self._passed = passed_light(camera, drops)
        self._wet_rows, self._wet_columns = np.nonzero(self._passed[..., 0] < 1.0)
        # Drops next to the picture are in it, too, for they are out of focus.
        self._margin = math.ceil(2.0 * PUPIL * camera.focal_length / STEP)
        self._inside, self._shown = _shown_by(drops, camera, self._margin)
        # A disc of radius R has the variance R²/4 along each axis.
        self._defocus = 0.5 * PUPIL * camera.focal_length / STEP
        self._share = _smoothed(self._inside.astype(float), self._defocus)

    def look_through(self, radiance: Floats32) -> Floats32:
        """Luminance behind the glass (`radiance` (rows, cols, 3) [cd/m²])."""
        behind: Floats32 = radiance
        if self._blur > 0.0:
            behind = _smoothed(radiance, (self._blur, self._blur, 0.0), mode="nearest")
        cells, through = _cells(radiance), np.zeros_like(radiance)
        rows, columns = (place / STEP + self._margin for place in (self._wet_rows, self._wet_columns))
        for channel in range(3):
            light = np.zeros(self._inside.shape)
            light[self._inside] = _between(cells[..., channel], *self._shown)
            mean = _smoothed(light, self._defocus) / np.maximum(self._share, 1e-12)
            through[self._wet_rows, self._wet_columns, channel] = _between(mean, rows, columns)
        wet: Floats32 = behind * self._passed + (1.0 - self._passed) * through
        return wet


def _shown_by(drops: Blots, camera: Camera, margin: int) -> tuple[NDArray[np.bool_], tuple[Floats, Floats]]:
    """Where on the glass drops are, every `STEP` pixels, and which row and column of cells they show there."""
    (u0, v0), focal = camera.principal_point, camera.focal_length
    x, y = (
        (STEP * np.arange(-margin, size // STEP + margin + 2) - centre) / focal
        for centre, size in ((u0, camera.width), (v0, camera.height))
    )
    y = y[:, None]
    inside = np.zeros((y.size, x.size), bool)
    across, along = np.zeros(inside.shape), np.zeros(inside.shape)
    for right, down, radius in zip(*drops, strict=True):
        # However small, it is at one point at least.
        here = (x - right) ** 2 + (y - down) ** 2 < max(radius, STEP / focal) ** 2
        inside |= here
        across = np.where(here, np.clip((x - right) / radius, -1.0, 1.0), across)
        along = np.where(here, np.clip((y - down) / radius, -1.0, 1.0), along)
    rows, columns = (
        np.clip(centre - focal * np.tan(0.5 * _DROP_VIEW * offset[inside]), 0.0, size - 1.0) / _CELL - 0.5
        for offset, centre, size in ((along, v0, camera.height), (across, u0, camera.width))
    )
    return inside, (rows, columns)


def _cells(radiance: Floats32) -> Floats:
    """Means of squares of the picture (rows, cols, 3), as far as they are whole."""
    rows, columns = (max(size // _CELL, 1) for size in radiance.shape[:2])
    used = radiance[: rows * _CELL, : columns * _CELL].astype(np.float64)
    means = used.reshape(rows, used.shape[0] // rows, columns, used.shape[1] // columns, 3).mean(axis=(1, 3))
    return np.asarray(means)


def _between(grid: Floats, rows: Floats, columns: Floats) -> Floats:
    """Bilinear interpolation between the points of a grid."""
    places = []
    for place, count in ((rows, grid.shape[0]), (columns, grid.shape[1])):
        at = np.clip(place, 0.0, count - 1.0)
        before = np.minimum(at.astype(np.int64), max(count - 2, 0))
        places.append((before, np.minimum(before + 1, count - 1), at - before))
    (top, bottom, down), (left, right, across) = places
    upper = grid[top, left] * (1.0 - across) + grid[top, right] * across
    lower = grid[bottom, left] * (1.0 - across) + grid[bottom, right] * across
    return np.asarray(upper * (1.0 - down) + lower * down)


def _smoothed(values: Any, deviation: Any, **options: Any) -> Any:
    """SciPy's Gaussian filter, imported by what is soiled alone."""
    return import_module("scipy.ndimage").gaussian_filter(values, deviation, **options)


_SUN_RADIUS = math.radians(0.267)
"""Half the angle that the sun is seen under [rad]."""

_NEAR_SCATTER = 1.0
"""Veil of a clean windscreen at 1° from a source, falling with the square of the angle [cd/m² per lx]: a tenth of that
of the eye (CIE 146: 10), assumed."""

_NEAREST_SCATTER = math.radians(0.5)
"""Angle within which it grows no more [rad], assumed."""

_FAR_SCATTER = 0.4 * 561.0 / 88_900.0
"""Veil of windscreens far from the sun, as the mean of 18 cars had it [cd/m² per lx]: of 561 cd/m² at 88 900 lx 40 %
were scattered (Mefford and Flannagan 2003, UMTRI-2003-36)."""

_AT_ORIGIN = CameraPose((0.0, 0.0, 0.0), 0.0)


class _Glass(Protocol):
    def look_through(self, radiance: Floats32) -> Floats32:
        """Luminance behind the glass (rows, cols, 3) [cd/m²]."""


class _SunGlare:
    """A small source of light that nothing hides, and the veil that the windscreen makes of it."""

    def __init__(self, camera: Camera, glare: Glare) -> None:
        level = math.cos(glare.elevation)
        towards = np.array(
            [level * math.cos(glare.azimuth), level * math.sin(glare.azimuth), math.sin(glare.elevation)]
        )
        right, down, ahead = matrix_product(camera_axes(camera, _AT_ORIGIN), towards)
        (u0, v0), focal = camera.principal_point, camera.focal_length
        x = (np.arange(camera.width) - u0) / focal
        y = ((np.arange(camera.height) - v0) / focal)[:, None]
        angle = np.arccos(np.clip((x * right + y * down + ahead) / np.sqrt(1.0 + x**2 + y**2), -1.0, 1.0))
        degrees = np.degrees(np.maximum(angle, _NEAREST_SCATTER))
        veil = glare.haze * (_NEAR_SCATTER / degrees**2 + _FAR_SCATTER)
        # The border of the disc is as wide as a pixel.
        disc = np.clip((_SUN_RADIUS - angle) * focal + 0.5, 0.0, 1.0) / (math.pi * _SUN_RADIUS**2)
        self._added: Floats32 = (glare.illuminance * (veil + disc)).astype(np.float32)[..., None]

    def look_through(self, radiance: Floats32) -> Floats32:
        """Luminance behind the glass (`radiance` (rows, cols, 3) [cd/m²])."""
        return radiance + self._added


class FaultyLens:
    """Glass before a camera that faults come onto; what is there stays where it is while a fault lasts."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Begin a run: the glass is clean."""
        self._glasses: list[tuple[RunningFault, Camera, _Glass]] = []

    def look_through(self, radiance: Floats32, camera: Camera, faults: Iterable[RunningFault]) -> Floats32:
        """Luminance behind the glass; the same array where nothing is on it (`radiance` (rows, cols, 3) [cd/m²])."""
        on_glass = [fault for fault in faults if isinstance(fault.kind, DirtyLens | WetLens | Glare)]
        # Light that glares comes through dirt and water.
        for fault in sorted(on_glass, key=lambda one: not isinstance(one.kind, Glare)):
            radiance = self._glass(fault, camera).look_through(radiance)
        return radiance

    def _glass(self, fault: RunningFault, camera: Camera) -> _Glass:
        for known, seen_by, glass in self._glasses:
            if known is fault and seen_by == camera:
                return glass
        made = _glass_with(fault, camera)
        self._glasses = [one for one in self._glasses if one[0] is not fault]
        self._glasses.append((fault, camera, made))
        return made


def _glass_with(fault: RunningFault, camera: Camera) -> _Glass:
    # Drawn from a copy: another calibration finds the same dirt.
    rng = np.random.Generator(type(fault.rng.bit_generator)())
    rng.bit_generator.state = fault.rng.bit_generator.state
    match fault.kind:
        case DirtyLens() as dirt:
            return _DirtyGlass(camera, dirt, rng)
        case WetLens() as water:
            return _WetGlass(camera, water, rng)
        case Glare() as glare:
            return _SunGlare(camera, glare)
    raise TypeError(f"{fault.kind} is nothing on the glass")
