"""Street lamps light the road, and what stands near them."""

import dataclasses
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.fog.optical_depth import extinction
from fogsim.atmosphere.lamps.pieces import (
    choose_pixels,
    cut_lengths,
    piece_length,
    read_between,
    row_pieces,
    row_points,
    spread_over_row,
    values_of_row,
)
from fogsim.atmosphere.lamps.veil import LOSS_OF_SPREAD_LIGHT
from fogsim.core.exponential import exponential
from fogsim.core.jit import Bands, kernel
from fogsim.values import Camera, CameraPose, FogField, StreetLighting, View
from fogsim.values.pinhole import ray_from_pixel

_ZERO, _ONE = np.float32(0.0), np.float32(1.0)
_LIT, _SURROUNDED = np.uint8(1), np.uint8(2)
_OUTSIDE, _FIRST, _SECOND, _THREE = np.int32(-1), np.uint64(1), np.uint64(2), np.uint64(3)


class Beams(NamedTuple):
    """Head lamps, whose light is added to the cells of a map that are seen."""

    # (n, 9): Place (x, y) [cells] and axis (cosine, sine) [steps of the pattern a cell] on the map, lamps at the place,
    # square of their height above the road [m²], minus the extinction [1/m], their height [m], rise of the road in a
    # step of the pattern [m]
    lamps: NDArray[np.float64]
    pattern: NDArray[np.int64]  # (n,): Number of the pattern of each
    patterns: NDArray[np.float64]  # (m, along, 2 half + 1): Horizontal illuminance by one lamp without fog [lx]
    step: float  # Step of the patterns [m]
    known: NDArray[np.uint8]  # (rows · cols,): Bit 1 of cells that are lit, bit 2 of those whose neighbours are, too

    @classmethod
    def none(cls) -> "Beams":
        """No head lamp."""
        return cls(np.zeros((0, 9)), np.zeros(0, np.int64), np.zeros((0, 2, 3)), 1.0, np.zeros(0, np.uint8))


class GroundLight(NamedTuple):
    """A map of the light on the ground."""

    origin: NDArray[np.float64]  # (2,): Where the middle of the map's first corner is (x, y) [m]
    cell: float  # Side of its cells [m]
    # illuminance, tops (rows, cols): horizontal illuminance [lx] and height of the nearest lamp [m], rows to the north,
    # columns to the east
    illuminance: NDArray[np.float32]
    tops: NDArray[np.float32]
    farthest: np.float32  # Distance from the eye beyond which nothing is lit [m]
    beams: Beams


class EyeOnMap(NamedTuple):
    """Where the eye is on a map."""

    # column, row: place on the map [cells]
    column: np.float32
    row: np.float32
    cells_per_metre: np.float32  # [1/m]
    height: np.float32  # Of the eye [m]


class Reflection(NamedTuple):
    """How surfaces return the lamps' light: as they do the sky's."""

    factor: NDArray[np.float32]  # (3,): The lamps' colour per illuminance of the sky [1/lx]
    most: np.float32  # What is brighter shines by itself, and returns no more than that [cd/m²]


@kernel
def _add_lamp_illuminance(
    lamps: NDArray[np.float64],
    extinction: NDArray[np.float64],
    height: float,
    intensity: NDArray[np.float64],
    farthest: float,
    ground: GroundLight,
) -> None:
    """Add lamps to a map of illuminance, and set how high the nearest lamp hangs.

    Takes `lamps` (n, 3) [m], `extinction` (n,) [1/m], `height` [m], `intensity` (m,) [cd], `farthest` [m].
    """
    origin, cell, illuminance, tops = ground.origin, ground.cell, ground.illuminance, ground.tops
    rows, columns = illuminance.shape
    last = intensity.shape[0] - 1.001
    nearest = np.full((rows, columns), np.float32(np.inf))
    for i in range(lamps.shape[0]):
        x0, y0 = (lamps[i, 0] - origin[0]) / cell, (lamps[i, 1] - origin[1]) / cell
        reach = farthest / cell
        for row in range(max(0, math.ceil(y0 - reach)), min(rows, math.floor(y0 + reach) + 1)):
            for column in range(max(0, math.ceil(x0 - reach)), min(columns, math.floor(x0 + reach) + 1)):
                square = cell**2 * ((column - x0) ** 2 + (row - y0) ** 2)
                if square >= farthest**2:
                    continue
                way = math.sqrt(square + height**2)
                cosine = height / way
                place = min(last, cosine * (intensity.shape[0] - 1))
                n = int(place)
                candela = intensity[n] + (intensity[n + 1] - intensity[n]) * (place - n)
                edge = 1.0 - square / farthest**2
                light = candela * cosine / way**2 * math.exp(-extinction[i] * way) * min(1.0, 4.0 * edge)
                illuminance[row, column] += np.float32(light)
                if square < nearest[row, column]:
                    nearest[row, column], tops[row, column] = np.float32(square), np.float32(lamps[i, 2])


@kernel
def _places_on_map(
    count: np.uint64,
    points: NDArray[np.float32],
    eye: EyeOnMap,
    ground: GroundLight,
    cells: NDArray[np.int32],
    shares: NDArray[np.float32],
) -> None:
    """Cells of a map (n,) that chosen pixels see at `points` (3, n) from the eye, and how far on in them (2, n).

    Outside the map the cell is −1.
    """
    last_row, last_column = np.float32(ground.tops.shape[0] - 1.001), np.float32(ground.tops.shape[1] - 1.001)
    east, north, per_metre, down, aside = points[0], points[1], eye.cells_per_metre, shares[0], shares[1]
    columns = np.int32(ground.tops.shape[1])
    for n in range(count):
        x, y = eye.column + east[n] * per_metre, eye.row + north[n] * per_metre
        is_inside = (x >= _ZERO) & (x < last_column) & (y >= _ZERO) & (y < last_row)
        x, y = x if is_inside else _ZERO, y if is_inside else _ZERO
        column, row = np.int32(x), np.int32(y)
        cells[n] = row * columns + column if is_inside else _OUTSIDE
        down[n], aside[n] = y - np.float32(row), x - np.float32(column)


@kernel
def _cells_to_light(
    count: np.uint64, cells: NDArray[np.int32], columns: int, known: NDArray[np.uint8], unlit: NDArray[np.uint32]
) -> int:
    """Find the cells about those that chosen pixels see that are not lit yet (2, n); their count."""
    found, width, before = np.uint64(0), np.uint32(columns), _OUTSIDE
    for n in range(count):
        seen = cells[n]
        if seen == before:
            continue
        before = seen
        if seen == _OUTSIDE:
            continue
        first = np.uint32(seen)
        if known[first] & _SURROUNDED:
            continue
        known[first] |= _SURROUNDED
        for corner in range(4):
            cell = first + np.uint32(corner & 1) + np.uint32(corner >> 1) * width
            if not known[cell] & _LIT:
                known[cell] |= _LIT
                unlit[0, found], unlit[1, found] = cell % width, cell // width
                found += np.uint64(1)
    return int(found)


@kernel
def _light_cells(cells: NDArray[np.uint32], count: int, beams: Beams, ground: GroundLight) -> None:
    """Set the illuminance of cells by beams, and how high up what stands there is lit: as high as lamps there."""
    illuminance, tops, step = ground.illuminance, ground.tops, beams.step
    ahead, half = beams.patterns.shape[1] - 1, (beams.patterns.shape[2] - 1) // 2
    for n in range(count):
        illuminance[cells[1, n], cells[0, n]], tops[cells[1, n], cells[0, n]] = _ZERO, -np.inf
    for i in range(beams.lamps.shape[0]):
        lamp, pattern = beams.lamps[i], beams.patterns[beams.pattern[i]]
        x0, y0, cosine, sine, lit, square = lamp[0], lamp[1], lamp[2], lamp[3], lamp[4], lamp[5]
        loss, height, rise = lamp[6], lamp[7], lamp[8]
        for n in range(count):
            column, row = cells[0, n], cells[1, n]
            along = (column - x0) * cosine + (row - y0) * sine
            across = (column - x0) * sine - (row - y0) * cosine + half
            if not (0.0 < along < ahead and 0.0 < across < 2 * half):
                continue
            a, b = int(along), int(across)
            down, right = along - a, across - b
            near = pattern[a, b] + (pattern[a, b + 1] - pattern[a, b]) * right
            far = pattern[a + 1, b] + (pattern[a + 1, b + 1] - pattern[a + 1, b]) * right
            way = math.sqrt(square + step**2 * (along**2 + (across - half) ** 2))
            illuminance[row, column] += np.float32(lit * (near + (far - near) * down) * exponential(loss * way))
            # Light fades from the height of the lamps to a metre above it.
            tops[row, column] = max(tops[row, column], np.float32(height + rise * along + 1.0))


@kernel
def _read_map(
    count: np.uint64,
    cells: NDArray[np.int32],
    shares: NDArray[np.float32],
    above: NDArray[np.float32],
    eye: EyeOnMap,
    illuminance: NDArray[np.float32],
    tops: NDArray[np.float32],
    columns: int,
    light: NDArray[np.float32],
) -> bool:
    """Illuminance of what chosen pixels see, `above` the eye, none above the lamps; if there is any.

    Takes `cells` (2, n), which `_places_on_map` sets the first row of, `shares` (2, n), and the map's arrays, flat.
    """
    seen, at, top, found = cells[0], cells[1], shares[0], np.int32(0)
    for n in range(count):
        at[n] = max(seen[n], np.int32(0))
    read_between(count, illuminance, columns, at, shares[0], shares[1], light)
    for n in range(count):
        top[n] = tops[np.uint32(at[n])]
    for n in range(count):
        value = light[n] * min(max(top[n] - (eye.height + above[n]), _ZERO), _ONE)
        is_lit = (seen[n] != _OUTSIDE) & (light[n] > _ZERO)
        light[n] = value if is_lit else _ZERO
        found |= np.int32(is_lit)
    return bool(found != 0)


@kernel
def _light_row(
    luminance: NDArray[np.float32], light: NDArray[np.float32], reflection: Reflection, out: NDArray[np.float32]
) -> None:
    """Add what surfaces return of the light on them to a row (`luminance`, `out` (3 · n,))."""
    red, green, blue, most = reflection.factor[0], reflection.factor[1], reflection.factor[2], reflection.most
    for u in range(np.uint64(out.shape[0]) // _THREE):
        lit, at = light[u], _THREE * u
        out[at] = luminance[at] + min(luminance[at], most) * lit * red
        out[at + _FIRST] = luminance[at + _FIRST] + min(luminance[at + _FIRST], most) * lit * green
        out[at + _SECOND] = luminance[at + _SECOND] + min(luminance[at + _SECOND], most) * lit * blue


@kernel
def add_street_light(
    luminance: NDArray[np.float32],
    distance: NDArray[np.float32],
    ray_map: NDArray[np.float32],
    step: int,
    eye: EyeOnMap,
    ground: GroundLight,
    reflection: Reflection,
    top: int,
    bottom: int,
    out: NDArray[np.float32],
) -> None:
    """Luminance of rows of an image by the sky's light and that of street lamps.

    Takes `luminance`, `out` (rows, cols · 3) [cd/m²], `distance` (rows, cols) [m], `ray_map` (3, 3).
    """
    columns = distance.shape[1]
    points, shares = np.empty((3, columns), np.float32), np.empty((2, columns), np.float32)
    cells, unlit = np.empty((2, columns), np.int32), np.empty((2, 4 * columns), np.uint32)
    length, pieces = np.empty(columns, np.float32), row_pieces(columns, step)
    few, beams = values_of_row(columns), ground.beams
    illuminance, tops = ground.illuminance.reshape(-1), ground.tops.reshape(-1)
    light = few if step == 1 else values_of_row(columns)
    for v in range(top, bottom):
        any_light = False
        # The sky, and what no lamp of the map may light, are left out.
        if cut_lengths(distance[v], ground.farthest, length):
            n = choose_pixels(length, pieces)
            row_points(n, ray_map, v, pieces.pixel, pieces.length, points)
            _places_on_map(n, points, eye, ground, cells[0], shares)
            if len(beams.lamps):
                found = _cells_to_light(n, cells[0], ground.tops.shape[1], beams.known, unlit)
                _light_cells(unlit, found, beams, ground)
            any_light = _read_map(n, cells, shares, points[2], eye, illuminance, tops, ground.tops.shape[1], few)
        if any_light:
            if step > 1:
                spread_over_row(few, pieces, light)
            _light_row(luminance[v], light, reflection, out[v])
        else:
            for j in range(3 * columns):
                out[v, j] = luminance[v, j]


def lit_by_map(
    view: View,
    camera: Camera,
    pose: CameraPose,
    place: NDArray[np.float64],
    ground: GroundLight,
    reflection: Reflection,
    out: NDArray[np.float32],
) -> View:
    """A drawn scene with a map's light, as an image in `out` (`place` (2,) of the eye on the map [cells])."""
    rows, columns = view.distance.shape
    luminance = np.ascontiguousarray(view.radiance, dtype=np.float32).reshape(rows, 3 * columns)
    distance = np.ascontiguousarray(view.distance, dtype=np.float32)
    ray_map, step = ray_from_pixel(camera, pose).astype(np.float32), piece_length(camera.focal_length)
    column, row = place.astype(np.float32)
    eye, lit = EyeOnMap(column, row, np.float32(1.0 / ground.cell), np.float32(pose.position[2])), out.reshape(rows, -1)

    def add(_: int, top: int, bottom: int) -> None:
        add_street_light(luminance, distance, ray_map, step, eye, ground, reflection, top, bottom, lit)

    Bands().work(add, rows, columns)
    return dataclasses.replace(view, radiance=out)


_CELL = 2.0
"""Side of the map's cells [m]."""

REACH = 48.0
"""Distance along the ground beyond which a lamp lights nothing [m]; there it gives less than 0.02 lx."""

_CELLS = 320
_FARTHEST = 500.0  # half the diagonal of the map, and more [m]
_STAY = 64.0  # the map moves on when the camera has left its middle by so much [m]
_CHANGED = 0.002  # change of extinction beyond which the map is made again [1/m]
_WHITEST = 0.95  # reflectance above which a surface must be a lamp
_COSINES = np.linspace(0.0, 1.0, 129)


@dataclass(frozen=True, slots=True)
class _Map:
    """Light on the ground about a place."""

    lamps: StreetLighting  # What lights it
    middle: NDArray[np.float64]  # (2,): Where its middle is [m]
    extinction: NDArray[np.float64]  # (n,): That at each lamp [1/m]
    light: GroundLight  # The map itself


class StreetLight:
    """Adds the light of street lamps to drawn scenes.

    Fog takes light from a lamp's way to the ground and gives back most of it near by: so of the extinction only the
    part counts that the veil's spread light suffers. For lamps at 8 m that is 0.4 % at V_met = 1 km, 7 % at 100 m below
    the lamp, where without what is scattered it would be 21 %.
    """

    def __init__(self) -> None:
        self._map: _Map | None = None
        self._lit = np.empty((0, 0, 3), np.float32)

    def on(self, view: View, camera: Camera, pose: CameraPose, fog: FogField, lamps: StreetLighting) -> View:
        """A drawn scene with the lamps' light.

        Returns Its image is valid until the next call.
        """
        if not len(lamps.position) or lamps.sky_illuminance <= 0:
            return view
        ground = self._about(pose, fog, lamps)
        if self._lit.shape != view.radiance.shape:
            self._lit = np.empty(view.radiance.shape, np.float32)
        place = (np.array(pose.position[:2]) - ground.middle) / _CELL + 0.5 * (_CELLS - 1)
        reflection = Reflection(
            np.array(lamps.colour, dtype=np.float32) / np.float32(lamps.sky_illuminance),
            np.float32(_WHITEST * lamps.sky_illuminance / math.pi),
        )
        return lit_by_map(view, camera, pose, place, ground.light, reflection, self._lit)

    def _about(self, pose: CameraPose, fog: FogField, lamps: StreetLighting) -> _Map:
        """The map about the camera, made again only if the camera, the lamps or the fog have moved."""
        eye, known = np.array(pose.position[:2]), self._map
        if known is not None and known.lamps.position is lamps.position and np.abs(eye - known.middle).max() < _STAY:
            middle = known.middle
        else:
            middle, known = eye, None
        near = lamps.position[np.abs(lamps.position[:, :2] - middle).max(axis=1) < 0.5 * _CELLS * _CELL + REACH]
        dense = extinction(fog, near - (0.0, 0.0, 0.5 * lamps.height))
        if known is None or np.any(np.abs(dense - known.extinction) > _CHANGED):
            known = self._map = _map_of(lamps, middle, near, dense)
        return known


def _map_of(
    lamps: StreetLighting, middle: NDArray[np.float64], near: NDArray[np.float64], dense: NDArray[np.float64]
) -> _Map:
    illuminance, tops = np.zeros((_CELLS, _CELLS), np.float32), np.zeros((_CELLS, _CELLS), np.float32)
    intensity = np.interp(np.arccos(_COSINES), lamps.angle, lamps.intensity)
    light = GroundLight(
        middle - 0.5 * (_CELLS - 1) * _CELL, _CELL, illuminance, tops, np.float32(_FARTHEST), Beams.none()
    )
    _add_lamp_illuminance(near, LOSS_OF_SPREAD_LIGHT * dense, lamps.height, intensity, REACH, light)
    return _Map(lamps, middle, dense, light)
