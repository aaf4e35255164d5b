"""The shading of a whole picture."""

import numpy as np
from numpy.typing import NDArray

from fogsim.render.drawing import Drawing, MeshTable
from fogsim.render.lens import Lens, lens_of
from fogsim.render.photometry import SKY_TINT, lamp_radiance, lighting_bits, zenith_luminance
from fogsim.render.shading import layout
from fogsim.render.shading.ground import bench, shade_ground
from fogsim.render.shading.layout import Copies, Light, Meshes, Picture, Runs
from fogsim.render.shading.noise import tiles
from fogsim.render.shading.objects import shade_objects, shade_sky
from fogsim.render.shading.runs import find_runs
from fogsim.render.shading.surfaces import know, know_background
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
        self._noise, self._bench = tiles(), bench()
        self._runs = _room(0, 0)

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
        if len(self._runs.run) < slots.size or len(self._runs.surface_of_slot) < drawing.first[-1]:
            self._runs = _room(slots.size, int(drawing.first[-1]))
        copies = Copies(
            drawing.mesh,
            drawing.record.view(np.float32).reshape(-1, 17),
            drawing.record.view(np.int32).reshape(-1, 17),
            drawing.first,
        )
        picture = Picture(
            np.empty((rows, columns, 3), np.float32),
            np.empty((rows, columns), np.float32),
            np.empty((rows, columns), np.int32),
            np.empty((rows, columns, 3) if lamplight else (0, 0, 3), np.float32),
        )
        self._shade(slots, copies, lens_of(camera, pose), lamplight, picture)
        response = picture.response if lamplight else None
        return View(picture.radiance, picture.distance, picture.instance, response)

    def _shade(self, slots: NDArray[np.int32], copies: Copies, lens: Lens, lamplight: bool, picture: Picture) -> None:
        runs = self._runs
        terrain = bool(lens.eye[2] > self._light.terrain[0] > -np.inf)
        count, surfaces = find_runs(slots, copies, lens.rays, terrain, runs)
        know_background(lens, self._light, runs)
        know(self._meshes, copies, lens, self._light, lamplight, runs, surfaces)
        shade_objects(runs, count, lens.lens, picture)
        shade_ground(runs, count, lens, self._noise, self._bench, picture)
        shade_sky(runs, count, lens.rays, self._light, picture)


def _room(pixels: int, slots: int) -> Runs:
    """Memory for a picture: at most every pixel is a run, and every slot or pixel a surface."""
    slots = slots + slots // 2
    surfaces = min(pixels, slots) + 2
    return Runs(
        # A run of background may be split at the horizon.
        run=np.empty((2 * pixels, 4), np.int32),
        surface_of_slot=np.empty(slots, np.int32),
        slot=np.empty(surfaces, np.int32),
        copy=np.empty(surfaces, np.int32),
        surface=np.empty((surfaces, layout.COLUMNS)),
    )
