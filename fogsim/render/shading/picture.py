"""The shading of a whole picture."""

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import Bands, kernel
from fogsim.render.drawing import Drawing, MeshTable
from fogsim.render.lens import Lens, lens_of
from fogsim.render.photometry import SKY_TINT, lamp_radiance, lighting_bits, zenith_luminance
from fogsim.render.shading import layout
from fogsim.render.shading.layout import Copies, Light, Meshes, Numbers, Picture, Runs
from fogsim.render.shading.memory import Memory
from fogsim.render.shading.noise import Noise, tiles
from fogsim.render.shading.objects import shade_objects, shade_sky
from fogsim.render.shading.pixel_spans import find_runs
from fogsim.render.shading.road import shade_road
from fogsim.render.shading.surfaces import know, know_background
from fogsim.render.shading.terrain import shade_terrain
from fogsim.render.shading.texture import Row, memory_for_row
from fogsim.values.camera import Camera, CameraPose
from fogsim.values.image import View
from fogsim.values.scene import Surface


class Shading:
    """Shades pictures of one scene in one light.

    Parameters
    ----------
    table : MeshTable
        All meshes.
    illuminance : float
        Horizontal illuminance E of the overcast sky [lx].
    height : float
        Height of the terrain's plane [m], −inf where there is no terrain.
    reflectance : (3,) float64
        Reflectance of the terrain.
    """

    def __init__(self, table: MeshTable, illuminance: float, height: float, reflectance: NDArray[np.float64]) -> None:
        self._meshes = Meshes(
            table.positions,
            table.normals,
            table.reflectance,
            table.surface,
            table.instance,
            table.road,
            table.faces,
            table.first_face,
        )
        self._light = Light(
            white=illuminance / np.pi,
            zenith=zenith_luminance(illuminance) * np.array(SKY_TINT),
            terrain=np.array((height, *reflectance)),
            lamp_masks=np.array([lighting_bits(surface) for surface in Surface], np.int32),
            lamp_radiance=np.array([lamp_radiance(surface) for surface in Surface]),
        )
        self._noise, self._bands, self._memory = tiles(), Bands(), Memory()
        # For each band.
        self._rows, self._runs = [memory_for_row(0), memory_for_row(0)], [_room(0, 0), _room(0, 0)]

    def view(
        self, slots: NDArray[np.int32], drawing: Drawing, camera: Camera, pose: CameraPose, lamplight: bool
    ) -> View:
        """Shade what each pixel sees.

        Parameters
        ----------
        slots : (rows, cols) int32
            What a `Rasteriser` found.
        drawing, camera, pose
            What it was given.
        lamplight : bool
            Whether the answer to lamplight is wanted.
        """
        rows, columns = slots.shape
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
            runs = self._room(band, (bottom - top) * columns, int(drawing.first[-1]))
            if len(self._rows[band].depth) != columns:
                self._rows[band] = memory_for_row(columns)
            shade_rows(
                slots,
                top,
                bottom,
                self._meshes,
                copies,
                lens,
                self._light,
                self._noise,
                runs,
                self._rows[band],
                picture,
            )

        self._bands.work(shade, rows, columns)
        response = picture.response if lamplight else None
        return View(picture.radiance, picture.distance, picture.instance, response)

    def _room(self, band: int, pixels: int, slots: int) -> Runs:
        """Memory for the runs of a band."""
        runs = self._runs[band]
        if 2 * pixels > len(runs.run) or slots > len(runs.surface_of_slot):
            # Bands change, and so does what is seen.
            runs = self._runs[band] = _room(pixels + pixels // 4, slots + slots // 2)
        return runs


@kernel
def shade_rows(
    slots: Numbers,
    top: int,
    bottom: int,
    meshes: Meshes,
    copies: Copies,
    lens: Lens,
    light: Light,
    noise: Noise,
    runs: Runs,
    work: Row,
    picture: Picture,
) -> None:
    """Shade the rows of a picture from `top` to the one before `bottom`."""
    height = light.terrain[0]
    terrain = lens.eye[2] > height > -np.inf
    count, surfaces = find_runs(slots, top, bottom, copies, lens.rays, terrain, runs)
    know_background(lens, light, runs)
    know(meshes, copies, lens, light, len(picture.response) > 0, runs, surfaces)
    shade_objects(runs, count, lens.lens, picture)
    shade_road(runs, count, lens, noise, work, picture)
    shade_terrain(runs, count, lens, noise, work, picture)
    shade_sky(runs, count, lens.rays, light, picture)


def _room(pixels: int, slots: int) -> Runs:
    """Memory for a picture: at most every pixel is a run, and every slot or pixel a surface."""
    surfaces = min(pixels, slots) + 2
    return Runs(
        # A run of background may be split at the horizon.
        run=np.empty((2 * pixels, 4), np.int32),
        surface_of_slot=np.empty(slots, np.int32),
        slot=np.empty(surfaces, np.int32),
        copy=np.empty(surfaces, np.int32),
        kind=np.empty(surfaces, np.int32),
        surface=np.empty((surfaces, layout.COLUMNS)),
    )
