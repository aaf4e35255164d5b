"""The shading of a whole picture."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import Bands, kernel
from fogsim.render.drawing import Drawing, MeshTable
from fogsim.render.lens import Lens, lens_of
from fogsim.render.photometry import SKY_TINT, lamp_radiance, lighting_bits, zenith_luminance
from fogsim.render.shading import layout
from fogsim.render.shading.layout import Copies, Light, Meshes, Numbers, Picture, Spans
from fogsim.render.shading.memory import Memory
from fogsim.render.shading.noise import Noise, tiles
from fogsim.render.shading.objects import shade_objects, shade_sky
from fogsim.render.shading.pavement import Asphalt, asphalt
from fogsim.render.shading.pixel_spans import find_spans
from fogsim.render.shading.road import shade_road
from fogsim.render.shading.surfaces import set_background_surfaces, set_surfaces
from fogsim.render.shading.terrain import shade_terrain
from fogsim.render.shading.texture import Row, memory_for_row
from fogsim.values.camera import Camera, CameraPose
from fogsim.values.fog import EVEN_LIGHT, SideLight
from fogsim.values.image import View
from fogsim.values.scene import Pavement, Surface


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

    def view(
        self, triangle_ids: NDArray[np.int32], drawing: Drawing, camera: Camera, pose: CameraPose, lamplight: bool
    ) -> View:
        """Shade what each pixel sees (`triangle_ids` (rows, cols) int32)."""
        rows, columns = triangle_ids.shape
        copies = Copies(
            drawing.mesh,
            drawing.record.view(np.float32).reshape(-1, 17),
            drawing.record.view(np.int32).reshape(-1, 17),
            drawing.first,
        )
        picture = Picture(
            self._memory.empty((rows, columns, 3), np.float32),
            self._memory.empty((rows, columns), np.float32),
            self._memory.empty((rows, columns), np.int32),
            self._memory.empty((rows, columns, 3) if lamplight else (0, 0, 3), np.float32),
        )
        lens = lens_of(camera, pose)

        def shade(band: int, top: int, bottom: int) -> None:
            spans = self._room(band, (bottom - top) * columns, int(drawing.first[-1]))
            if len(self._rows[band].depth) != columns:
                self._rows[band] = memory_for_row(columns)
            shade_rows(triangle_ids, (top, bottom), self._scene, copies, lens, spans, self._rows[band], picture)

        self._bands.work(shade, rows, columns)
        response = picture.response if lamplight else None
        return View(picture.radiance, picture.distance, picture.instance, response)

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
