"""Lamps of others as the camera sees them in fog: their glow, and their direct light where a renderer loses it."""

import math
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.fog.medium import is_uniform_below
from fogsim.atmosphere.fog.optical_depth import optical_depth
from fogsim.atmosphere.lamps.glow import FOLD_CHORD, glow_table
from fogsim.atmosphere.lamps.halo_kernels import (
    add_direct_light,
    add_glow_cores,
    add_middle_glows,
    add_upsampled,
    add_wide_glows,
    divide_by_luminance,
    mean_luminance,
    upsample_grid,
)
from fogsim.atmosphere.lamps.halo_lamps import (
    COLUMNS,
    CORE_SIZE,
    DEPTH,
    RANGE,
    SIDES,
    WIDE_FOLD,
    WIDE_SIZE,
    GlowLines,
    LampLight,
    core_profiles,
    merge_lamps,
    profile_tables,
    project_lamps,
    select_lamps,
)
from fogsim.atmosphere.lamps.lobe_kernels import (
    Angles,
    LampShapes,
    LobeTables,
    mean_light,
    set_glow_light,
)
from fogsim.atmosphere.lamps.lobes import (
    AZIMUTH_FOLD,
    AZIMUTHS,
    ELEVATION_FOLD,
    ELEVATIONS,
    light_origins,
    mean_intensity,
    table_directions,
)
from fogsim.atmosphere.lamps.phase_function import Droplets
from fogsim.core.jit import Bands
from fogsim.values import Beam, Camera, CameraPose, FogField, LampLobes, LightSources, View
from fogsim.values.pinhole import camera_axes


class LobeMemory:
    """Light that the glows of lamps are made of.

    It remembers mean intensities by kind of lamp and direction to the eye.
    """

    def __init__(self, droplets: Droplets) -> None:
        self._droplets, self._kinds = droplets, list[Beam]()
        self._azimuth, self._elevation = table_directions()
        origins = light_origins(droplets)
        size = (AZIMUTHS, ELEVATIONS, len(origins.log_depth), len(origins.angle) * SIDES)
        self._tables = LobeTables(np.empty((0, *size), np.float32), AZIMUTH_FOLD, ELEVATION_FOLD, origins.log_depth)
        self._known = np.zeros((0, AZIMUTHS, ELEVATIONS), np.bool_)

    def light(
        self, lamps: NDArray[np.float64], chosen: NDArray[np.int64], eye: NDArray[np.float64], sources: LightSources
    ) -> NDArray[np.float32]:
        """Light of each lamp's glow, by angle and side: the illuminance of a lamp alike in all directions [lx].

        Returns over the angles of `light_origins`. Takes `chosen` (n,) int64, `eye` (3,) [m].
        """
        shapes = self._shapes(sources, chosen)
        position = np.ascontiguousarray(sources.position)
        unknown = np.zeros(self._known.shape, np.bool_)
        light = np.empty((len(lamps), self._tables.values.shape[-1]), np.float32)
        here = (lamps, chosen, eye, position, sources.intensity, shapes, self._tables)
        if set_glow_light(*here, self._known, unknown, light):
            self._learn(unknown)
            set_glow_light(*here, self._known, unknown, light)
        return light

    def _shapes(self, sources: LightSources, chosen: NDArray[np.int64]) -> LampShapes:
        lobes = sources.lobes or LampLobes.alike(len(sources.intensity))
        numbers = np.full(len(lobes.kinds) + 1, -1, np.int64)
        for kind in sorted(set(lobes.kind[chosen].tolist())):
            if kind >= 0:
                numbers[kind] = self._number(lobes.kinds[kind])
        return LampShapes(numbers[lobes.kind], lobes.scale, lobes.forward)

    def _number(self, lobe: Beam) -> int:
        for number, known in enumerate(self._kinds):
            if known is lobe:
                return number
        self._kinds.append(lobe)
        values, empty = self._tables.values, np.zeros((1, *self._tables.values.shape[1:]), np.float32)
        self._tables = self._tables._replace(values=np.concatenate((values, empty)))
        self._known = np.concatenate((self._known, np.zeros((1, *self._known.shape[1:]), np.bool_)))
        return len(self._kinds) - 1

    def _learn(self, unknown: NDArray[np.bool_]) -> None:
        for number, a, b in np.argwhere(unknown).tolist():
            way = float(self._azimuth[a, b]), float(self._elevation[a, b])
            self._tables.values[number, a, b] = _mean_toward(self._kinds[number], *way, self._droplets)
        self._known |= unknown


@lru_cache(4096)
def _mean_toward(lobe: Beam, azimuth: float, elevation: float, droplets: Droplets) -> NDArray[np.float32]:
    """Mean intensities that a lamp sends into its glow (depths, angles · sides), the same in every scene."""
    mean = mean_intensity(lobe, np.array([azimuth]), np.array([elevation]), droplets)[0]
    return np.asarray(mean.reshape(len(mean), -1), np.float32)


_COARSE_PIXELS = 8
"""Pixels between two of the coarse image; it has 40 … 80 cells across, and the coarsest half as many."""

FARTHEST = 16.0
"""Optical depth at which a lamp has faded from sight; it begins to fade at three quarters of that [-]."""

_SMALL = 2.25
"""Lamps that cover fewer pixels than this are completed [px²]."""

_FAINTEST = 1e-5
"""What is fainter than this share of the image's mean is not drawn: a hundredth of what 8 bits and noise can show."""

_SHINING, _STANDS_OUT = 500.0, 4.0
"""Least luminance of a lamp [cd/m²], also as a multiple of the image's mean [-]: by day, white paint is bright too."""

_SOFT_CELLS = 1.4
_REACH_CELLS = 4.0
_SAME_CORE = 1.0  # lamps nearer to each other are drawn as one [px]
_SAME_GLOW = 0.5  # the same for glows without their cores, in cells
_DEPTHS = 96


@dataclass(frozen=True, slots=True)
class _Plan:
    """What the halos in a camera's images have in common."""

    # (3,): Width and height of a cell of the coarse image [px], and the reach of what the coarsest lacks, in cells
    cell: NDArray[np.float64]
    # shape, half_shape: rows and columns of the coarse and the coarsest image
    shape: tuple[int, int]
    half_shape: tuple[int, int]
    # directions, half_directions (3, m): their directions in the camera's axes
    directions: NDArray[np.float32]
    half_directions: NDArray[np.float32]
    # soft, reach: radius within which glow is flat on the coarse image, and that of what the coarsest lacks [rad]
    soft: float
    reach: float
    # wide, middle (depths, entries): profiles on the coarsest image, and of what is missing there
    wide: NDArray[np.float32]
    middle: NDArray[np.float32]
    # wide_angles, middle_angles, core_angles: of the entries of these profiles, and of the cores
    wide_angles: Angles
    middle_angles: Angles
    core_angles: Angles


class Halos:
    """Draws lamps of other vehicles and of streets in fog."""

    def __init__(self, droplets: Droplets = Droplets.MODERATE_RADIATION) -> None:
        self._droplets, self._bands = Droplets(droplets), Bands()
        self._plans: dict[Camera, _Plan] = {}

    @cached_property
    def _lobes(self) -> LobeMemory:
        return LobeMemory(self._droplets)

    def prepare(self, camera: Camera) -> None:
        """Compute beforehand what depends on camera and droplets alone."""
        self._plan(camera)

    def add(
        self,
        luminance: NDArray[np.float32],
        view: View,
        camera: Camera,
        pose: CameraPose,
        fog: FogField,
        sources: LightSources,
    ) -> None:
        """Add glow and lost direct light of lamps to an image (`luminance` (rows, cols, 3) [cd/m²])."""
        distance = np.ascontiguousarray(view.distance, dtype=np.float32)
        lamps, chosen = _lamps_in_view(camera, pose, fog, sources, distance)
        if not len(lamps):
            return
        rows, columns = distance.shape
        image = luminance.reshape(rows, 3 * columns)
        mean = mean_luminance(image, 16)
        faintest, bright = _FAINTEST * mean, max(_SHINING, _STANDS_OUT * mean)
        if np.any(lamps[:, DEPTH] > 0):
            light = self._lobes.light(lamps, chosen, np.array(pose.position, dtype=np.float64), sources)
            above = np.ascontiguousarray(camera_axes(camera, pose)[:, 2])
            self._add_glow(image, distance, camera, above, lamps, light, faintest)
        drawn = np.ascontiguousarray(view.radiance, dtype=np.float32).reshape(rows, 3 * columns)
        add_direct_light(lamps, camera.focal_length, _SMALL, faintest, bright, drawn, distance, image)

    def _add_glow(
        self,
        image: NDArray[np.float32],
        distance: NDArray[np.float32],
        camera: Camera,
        above: NDArray[np.float64],
        lamps: NDArray[np.float64],
        light: NDArray[np.float32],
        faintest: float,
    ) -> None:
        plan, glow = self._plan(camera), _glow_lines(self._droplets)
        lamps, light = _merged(lamps, light, _SAME_CORE)
        glows, shone = _merged(lamps, light, _SAME_GLOW * float(plan.cell[0]))
        coarsest = np.zeros((4, *plan.half_shape), np.float32)
        coarse, middle = np.empty((4, *plan.shape), np.float32), np.empty((len(glows), CORE_SIZE), np.float32)
        wide = (plan.wide, glow.log_depth, plan.wide_angles, faintest, coarsest.reshape(4, -1))
        add_wide_glows(plan.half_directions, above, glows, shone, *wide)
        upsample_grid(coarsest, coarse)
        mean_light(shone, SIDES, plan.middle_angles, middle)
        near = (glows, middle, plan.middle, glow.log_depth, faintest, coarse)
        add_middle_glows(plan.directions, plan.cell, plan.reach, *near)
        flat = coarse.reshape(4, -1)
        divide_by_luminance(flat)

        def add(_: int, top: int, bottom: int) -> None:
            add_upsampled(flat, plan.shape[1], distance, top, bottom, image)

        self._bands.work(add, *distance.shape)
        core, bright = np.empty((len(lamps), CORE_SIZE), np.float32), np.empty(len(lamps), np.bool_)
        core_light = np.empty_like(core)
        mean_light(light, SIDES, plan.core_angles, core_light)
        pixel, reach = 1.0 / camera.focal_length, _REACH_CELLS * float(plan.cell[0])
        core_profiles(lamps, core_light, glow, plan.soft, reach, pixel, faintest, core, bright)
        add_glow_cores(lamps, bright, reach, core, distance, image)

    def _plan(self, camera: Camera) -> _Plan:
        if camera not in self._plans:
            self._plans = {camera: _plan(camera, self._droplets)}
        return self._plans[camera]


@cache
def _glow_lines(droplets: Droplets) -> GlowLines:
    """Glow at optical depths in steps so fine that it is linear between them."""
    table = glow_table(droplets)
    log_depth = np.linspace(table.log_depth[0], table.log_depth[-1], _DEPTHS)
    columns = [np.interp(log_depth, table.log_depth, column) for column in table.log_glow.T]
    values = np.ascontiguousarray(np.exp(np.stack(columns, axis=1) + log_depth[:, None]))
    return GlowLines(values, log_depth, FOLD_CHORD)


def _merged(
    lamps: NDArray[np.float64], light: NDArray[np.float32], apart: float
) -> tuple[NDArray[np.float64], NDArray[np.float32]]:
    fused, fused_light = np.empty_like(lamps), np.empty_like(light)
    count = merge_lamps(lamps, light, apart, fused, fused_light)
    return fused[:count], fused_light[:count]


def _lamps_in_view(
    camera: Camera, pose: CameraPose, fog: FogField, sources: LightSources, distance: NDArray[np.float32]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Table of the lamps that shine toward the camera from before it, and their numbers."""
    eye, axes = np.array(pose.position, dtype=np.float64), camera_axes(camera, pose)
    count = len(sources.intensity)
    lamps, chosen = np.empty((count, COLUMNS)), np.empty(count, np.int64)
    position, lens = np.ascontiguousarray(sources.position), np.array((camera.focal_length, *camera.principal_point))
    chosen = chosen[: project_lamps(position, sources.intensity, eye, axes, lens, lamps, chosen)]
    places = position[chosen]
    if len(places) and is_uniform_below(fog, max(pose.position[2], float(places[:, 2].max()))):
        depth = fog.extinction * lamps[: len(chosen), RANGE]
    else:
        depth = optical_depth(fog, eye, places)
    light = LampLight(sources.intensity, sources.colour, sources.area)
    count = select_lamps(light, chosen, depth, FARTHEST, camera.focal_length, distance, lamps)
    return lamps[:count], chosen[:count]


def _plan(camera: Camera, droplets: Droplets) -> _Plan:
    cells = min(max(round(camera.width / _COARSE_PIXELS), 40), 80) // 2
    rows = max(1, math.ceil(cells * camera.height / camera.width))
    angle = camera.width / (2 * cells) / camera.focal_length
    wide, middle = np.empty((_DEPTHS, WIDE_SIZE), np.float32), np.empty((_DEPTHS, CORE_SIZE), np.float32)
    soft, reach = _SOFT_CELLS * angle, 2.0 * _REACH_CELLS * angle
    profile_tables(_glow_lines(droplets), soft, 2.0 * soft, reach, wide, middle)
    folded = np.minimum(np.arange(WIDE_SIZE) / (WIDE_SIZE - 1.0), 0.995)
    even, core = np.arange(CORE_SIZE) / (CORE_SIZE - 1.0), _REACH_CELLS * camera.width / (2 * cells)
    origins = light_origins(droplets).angle
    shape, half_shape = (2 * rows + 1, 2 * cells + 1), (rows + 1, cells + 1)
    return _Plan(
        cell=np.array(((camera.width - 1) / (2 * cells), (camera.height - 1) / (2 * rows), 2.0 * _REACH_CELLS)),
        shape=shape,
        half_shape=half_shape,
        directions=_directions(camera, shape),
        half_directions=_directions(camera, half_shape),
        soft=soft,
        reach=reach,
        wide=wide,
        middle=middle,
        wide_angles=_angles(2.0 * np.arcsin(np.minimum(np.sqrt(WIDE_FOLD * folded / (1.0 - folded)) / 2, 1)), origins),
        middle_angles=_angles(reach * even, origins),
        core_angles=_angles(core / camera.focal_length * even, origins),
    )


def _angles(angle: NDArray[np.float64], known: NDArray[np.float64]) -> Angles:
    """Where angles lie among those that are known, in their logarithm."""
    place = np.interp(np.log(np.maximum(angle, 1e-6)), np.log(known), np.arange(len(known)))
    entry = np.minimum(place.astype(np.int64), len(known) - 2)
    return Angles(entry, (place - entry).astype(np.float32))


def _directions(camera: Camera, shape: tuple[int, int]) -> NDArray[np.float32]:
    """Unit vectors in the camera's axes (3, rows · cols), from corner to corner of the image."""
    u0, v0 = camera.principal_point
    right = (np.linspace(0, camera.width - 1, shape[1]) - u0) / camera.focal_length
    down = (np.linspace(0, camera.height - 1, shape[0]) - v0) / camera.focal_length
    plane = np.broadcast_arrays(right, down[:, None], np.ones((1, 1)))
    rays = np.stack([part.reshape(-1) for part in plane])
    return np.ascontiguousarray(rays / np.linalg.norm(rays, axis=0), dtype=np.float32)
