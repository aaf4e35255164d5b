"""The shading of a whole picture."""

import math
import sys
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import Bands, kernel
from fogsim.render.drawing import Drawing, MeshTable
from fogsim.render.photometry import SKY_TINT, lamp_radiance, lighting_bits, zenith_luminance
from fogsim.render.projection import Lens
from fogsim.render.shading import layout
from fogsim.render.shading.ground_spans import next_coplanar_spans
from fogsim.render.shading.layout import (
    ONE,
    THREE,
    TWO,
    Copies,
    Light,
    Meshes,
    Numbers,
    Picture,
    Spans,
    Wide,
    first_of,
)
from fogsim.render.shading.pavement import Asphalt, asphalt
from fogsim.render.shading.road import shade_road
from fogsim.render.shading.surfaces import set_background_surfaces, set_surfaces, shade_objects, shade_sky
from fogsim.render.shading.texture import GRASS, Noise, Row, memory_for_row, set_texture, tiles
from fogsim.values.fog import EVEN_LIGHT, SideLight
from fogsim.values.image import View
from fogsim.values.scene import Pavement, Surface


@kernel
def find_spans(
    triangle_ids: Numbers, top: int, bottom: int, copies: Copies, rays: Wide, terrain: bool, spans: Spans
) -> tuple[int, int]:
    """Find the spans of some rows.

    Returns numbers of spans and of surfaces. Takes `triangle_ids` (rows, cols) int32, `rays` (3, 3).
    """
    span, surface_of_triangle, triangle_of, copy_of = (
        spans.span,
        spans.surface_of_triangle,
        spans.triangle_id,
        spans.copy,
    )
    first = copies.first
    for copy in range(len(copies.mesh)):
        for own in range(first[copy], first[copy + 1]):
            surface_of_triangle[own] = -2 - copy
    count, surfaces = 0, 2
    columns = np.uint64(triangle_ids.shape[1])
    ends = np.empty(columns, np.int32)
    for v in range(top, bottom):
        begin = np.int32(0)
        for piece in range(_ends(triangle_ids[v], ends)):
            end, triangle_id = ends[piece], triangle_ids[v, begin]
            surface: Any = 0
            if triangle_id >= 0:
                surface = surface_of_triangle[triangle_id]
                if surface < 0:
                    copy_of[surfaces], triangle_of[surfaces] = -2 - surface, triangle_id
                    surface_of_triangle[triangle_id] = surface = surfaces
                    surfaces += 1
                split: Any = end
            else:
                surface, split = _background(v, int(begin), int(end), rays, terrain)
            span[count, 0], span[count, 1], span[count, 2], span[count, 3] = v, begin, split, surface
            count += 1
            if split < end:
                span[count, 0], span[count, 1], span[count, 2], span[count, 3] = v, split, end, 1 - surface
                count += 1
            begin = end
    return count, surfaces


@kernel
def _ends(row: Numbers, ends: Numbers) -> np.uint64:
    """Columns after the last pixel of each span of equal triangle ids in a row; their count.

    Every column is written down, and by the next one again unless a span ends there: a processor that guesses where
    that is loses more than it takes to write.
    """
    last, count = np.uint64(row.shape[0] - 1), np.uint64(0)
    for u in range(last):
        after = u + np.uint64(1)
        ends[count] = np.int32(after)
        count += np.uint64(row[u] != row[after])
    ends[count] = np.int32(last) + np.int32(1)
    return count + np.uint64(1)


@kernel
def _background(v: int, begin: int, end: int, rays: Wide, terrain: bool) -> tuple[int, int]:
    """Whether a span of background begins with sky (0) or terrain (1), and where it changes to the other."""
    slope, rest = rays[2, 0], rays[2, 1] * v + rays[2, 2]
    surface = 1 if terrain and slope * begin + rest < 0.0 else 0
    last = 1 if terrain and slope * (end - 1) + rest < 0.0 else 0
    if surface == last:
        return surface, end
    split = min(max(int(np.ceil(-rest / slope)), begin + 1), end - 1)
    while split > begin + 1 and (slope * (split - 1) + rest < 0.0) == (last == 1):
        split -= 1
    while split < end - 1 and (slope * split + rest < 0.0) != (last == 1):
        split += 1
    return surface, split


_DEPTH, _WHITE, _COLOUR, _TERRAIN = layout.DEPTH, layout.WHITE, layout.COLOUR, layout.TERRAIN
_DRY = (1.5, 0.4, -0.3)  # how much more of each channel the large patches of dry grass change


@kernel
def shade_terrain(spans: Spans, count: int, lens: Lens, noise: Noise, work: Row, picture: Picture) -> None:
    """Shade the spans of terrain, and set their distances and instance ids."""
    span, surface, rays, member = spans.span, spans.surface, lens.rays, work.member
    texture, tint, radiance, response = work.texture, work.tint, picture.radiance, picture.response
    dry, drier, driest = np.float32(_DRY[0]), np.float32(_DRY[1]), np.float32(_DRY[2])
    columns = np.uint64(picture.distance.shape[1])
    members, number = next_coplanar_spans(_TERRAIN, spans, 0, count, lens.lens, work, picture)
    while members > 0:
        k, row = span[member[0], 3], float(span[member[0], 0])
        begin, end = span[member[0], 1], span[member[members - 1], 2]
        plane = surface[k, _DEPTH], surface[k, _DEPTH + 1], surface[k, _DEPTH + 2]
        set_texture(GRASS, plane, row, begin, end, lens, noise, work)
        v, white = np.uint64(span[member[0], 0]), surface[k, _WHITE]
        red, green, blue = surface[k, _COLOUR], surface[k, _COLOUR + 1], surface[k, _COLOUR + 2]
        r, g, b = np.float32(red * white), np.float32(green * white), np.float32(blue * white)
        # Seen and lit under the same angle to the ground.
        middle = 0.5 * (begin + end)
        rx = rays[0, 0] * middle + rays[0, 1] * row + rays[0, 2]
        ry = rays[1, 0] * middle + rays[1, 1] * row + rays[1, 2]
        rz = rays[2, 0] * middle + rays[2, 1] * row + rays[2, 2]
        answer = -rz / (math.pi * math.sqrt(rx * rx + ry * ry + rz * rz))
        red, green, blue = np.float32(answer * red), np.float32(answer * green), np.float32(answer * blue)
        for place in range(members):
            left, right = np.uint64(span[member[place], 1]), np.uint64(span[member[place], 2])
            line = first_of(v, np.uint64(0), columns)
            for u in range(left, right):
                at = line + THREE * u
                radiance[at] = r * (texture[u] + dry * tint[u])
                radiance[at + ONE] = g * (texture[u] + drier * tint[u])
                radiance[at + TWO] = b * (texture[u] + driest * tint[u])
            if len(response) > 0:
                for u in range(left, right):
                    at = line + THREE * u
                    response[at], response[at + ONE] = red * texture[u], green * texture[u]
                    response[at + TWO] = blue * texture[u]
        members, number = next_coplanar_spans(_TERRAIN, spans, number, count, lens.lens, work, picture)


_UNUSED = 2  # references to an array that only its list and the question itself hold
_COUNTS_REFERENCES = hasattr(sys, "getrefcount")
_MOST = 8  # arrays of a size that are kept
_NO_RESPONSE = np.empty(0, np.float32)


class Memory:
    """A pool of arrays: one is used again when no other reference to it or to a view of it exists.

    This relies on CPython's reference counts; on an implementation without them every array is new.
    """

    def __init__(self) -> None:
        self._arrays: dict[tuple[int, ...], list[NDArray[np.int32]]] = {}

    def empty(self, shape: tuple[int, ...], kind: type[np.float32] | type[np.int32]) -> NDArray[Any]:
        """Give an array with any contents."""
        arrays = self._arrays.get(shape)
        if arrays is None:
            # What is kept is for pictures of one size.
            if len(self._arrays) > _MOST:
                self._arrays.clear()
            arrays = self._arrays[shape] = []
        for number in range(len(arrays)) if _COUNTS_REFERENCES else ():
            if sys.getrefcount(arrays[number]) == _UNUSED:
                return arrays[number].view(kind)
        array = np.empty(shape, np.int32)
        if len(arrays) < _MOST:
            arrays.append(array)
        return array.view(kind)


class Shading:
    """Shades pictures of one scene in one light (`illuminance` [lx], `height` [m], `reflectance` (3,))."""

    def __init__(
        self,
        table: MeshTable,
        illuminance: float,
        height: float,
        reflectance: NDArray[np.float64],
        pavement: Pavement,
    ) -> None:
        meshes = Meshes(
            table.positions,
            table.normals,
            table.reflectance,
            table.surface,
            table.instance,
            table.road,
            table.faces,
            table.first_face,
        )
        white, zenith = _white_and_zenith(illuminance)
        light = Light(
            white,
            *EVEN_LIGHT,
            zenith=zenith,
            terrain=np.array((height, *reflectance)),
            lamp_masks=np.array([lighting_bits(surface) for surface in Surface], np.int32),
            lamp_radiance=np.array([lamp_radiance(surface) for surface in Surface]),
        )
        self._scene = ShadedScene(meshes, light, tiles(), asphalt(pavement))
        self._bands, self._memory = Bands(), Memory()
        # For each band.
        self._rows, self._spans = [memory_for_row(0), memory_for_row(0)], [_room(0, 0), _room(0, 0)]

    def set_daylight(self, illuminance: float, sides: SideLight = EVEN_LIGHT) -> None:
        """Shade by another daylight from now on (`illuminance` [lx])."""
        white, zenith = _white_and_zenith(illuminance)
        light = self._scene.light._replace(white=white, zenith=zenith, vertical=sides.vertical, below=sides.below)
        self._scene = self._scene._replace(light=light)

    def view(self, triangle_ids: NDArray[np.int32], drawing: Drawing, lens: Lens, *, lamplight: bool) -> View:
        """Shade what each pixel sees (`triangle_ids` (rows, cols) int32)."""
        rows, columns = triangle_ids.shape
        copies = Copies(
            drawing.mesh,
            drawing.record.view(np.float32).reshape(-1, 17),
            drawing.record.view(np.int32).reshape(-1, 17),
            drawing.first,
        )
        radiance = self._memory.empty((rows, columns, 3), np.float32)
        distance = self._memory.empty((rows, columns), np.float32)
        instance = self._memory.empty((rows, columns), np.int32)
        response = self._memory.empty((rows, columns, 3), np.float32) if lamplight else None
        picture = Picture(
            radiance.reshape(-1), distance, instance, _NO_RESPONSE if response is None else response.reshape(-1)
        )

        def shade(band: int, top: int, bottom: int) -> None:
            spans = self._room(band, (bottom - top) * columns, int(drawing.first[-1]))
            if len(self._rows[band].depth) != columns:
                self._rows[band] = memory_for_row(columns)
            shade_rows(triangle_ids, (top, bottom), self._scene, copies, lens, spans, self._rows[band], picture)

        self._bands.work(shade, rows, columns)
        return View(radiance, distance, instance, response)

    def _room(self, band: int, pixels: int, triangle_ids: int) -> Spans:
        """Memory for the spans of a band."""
        spans = self._spans[band]
        if 2 * pixels > len(spans.span) or triangle_ids > len(spans.surface_of_triangle):
            # Bands change, and so does what is seen.
            spans = self._spans[band] = _room(pixels + pixels // 4, triangle_ids + triangle_ids // 2)
        return spans


def _white_and_zenith(illuminance: float) -> tuple[float, NDArray[np.float64]]:
    """Luminances of a white surface and of the zenith by an illuminance [cd/m²]."""
    return illuminance / np.pi, zenith_luminance(illuminance) * np.array(SKY_TINT)


class ShadedScene(NamedTuple):
    """What stays the same from picture to picture."""

    meshes: Meshes  # All meshes
    light: Light  # Daylight and lamps
    noise: Noise  # Texture
    asphalt: Asphalt  # What roads are like


@kernel
def shade_rows(
    triangle_ids: Numbers,
    rows: tuple[int, int],
    scene: ShadedScene,
    copies: Copies,
    lens: Lens,
    spans: Spans,
    work: Row,
    picture: Picture,
) -> None:
    """Shade some rows of a picture (`triangle_ids` (rows, cols) int32)."""
    meshes, light, noise = scene.meshes, scene.light, scene.noise
    top, bottom = rows
    height = light.terrain[0]
    terrain = lens.eye[2] > height > -np.inf
    count, surfaces = find_spans(triangle_ids, top, bottom, copies, lens.rays, terrain, spans)
    set_background_surfaces(lens, light, spans)
    set_surfaces(meshes, copies, lens, light, len(picture.response) > 0, spans, surfaces)
    shade_objects(spans, count, lens.lens, picture)
    shade_road(spans, count, lens, noise, scene.asphalt, work, picture)
    shade_terrain(spans, count, lens, noise, work, picture)
    shade_sky(spans, count, lens.rays, light, picture)


def _room(pixels: int, triangle_ids: int) -> Spans:
    """Memory for a picture: at most every pixel is a span, and every triangle or pixel a surface."""
    surfaces = min(pixels, triangle_ids) + 2
    return Spans(
        # A span of background may be split at the horizon.
        span=np.empty((2 * pixels, 4), np.int32),
        surface_of_triangle=np.empty(triangle_ids, np.int32),
        triangle_id=np.empty(surfaces, np.int32),
        copy=np.empty(surfaces, np.int32),
        kind=np.empty(surfaces, np.int32),
        surface=np.empty((surfaces, layout.COLUMNS)),
    )
