"""FogSim's scenes as pyrender's: meshes with materials, the camera and lamps as nodes."""

import math
import os
import sys
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import matrix_product
from fogsim.errors import MissingDependencyError
from fogsim.render.drawing import NEAR
from fogsim.render.photometry import lamp_radiance, lighting_bits, zenith_luminance
from fogsim.render.shading.lines import DASH, LINE_WIDTH, PERIOD
from fogsim.render.shading.road import LINE_REFLECTANCE
from fogsim.render.shading.surfaces import light_share
from fogsim.values.camera import Camera, CameraPose
from fogsim.values.light import HeadLamp, Lights, dark_shift
from fogsim.values.pinhole import camera_axes
from fogsim.values.scene import Batch, Mesh, Scene, Surface

if TYPE_CHECKING:
    import pyrender

Corners = NDArray[np.float64]

_REFLECTANCE, _ALONG, _ACROSS, _HALF_WIDTH, _LINES = slice(6, 9), 9, 10, 11, 12  # columns of a corner


def _painted_road(road: Mesh) -> Mesh:
    """Cut painted lines out of a road, so that they are triangles with a reflectance of their own.

    Returns the same surface; no triangles share vertices.
    """
    columns = (road.positions, road.normals, road.reflectance, road.road)
    rest = np.concatenate(columns, axis=1).astype(np.float64)[road.faces]
    finished: list[Corners] = []
    for sign in (1.0, -1.0):
        codes = rest[:, 0, _LINES].astype(np.int64)
        code = codes // 3 if sign > 0.0 else codes % 3
        without, lined = rest[code == 0], rest[code > 0]
        beside = sign * lined[..., _ACROSS] - lined[..., _HALF_WIDTH]
        inner = _part_above(lined, -beside - 0.5 * LINE_WIDTH)
        strip = _part_above(lined, beside + 0.5 * LINE_WIDTH)
        beside = sign * strip[..., _ACROSS] - strip[..., _HALF_WIDTH]
        outer, strip = _part_above(strip, beside - 0.5 * LINE_WIDTH), _part_above(strip, 0.5 * LINE_WIDTH - beside)
        codes = strip[:, 0, _LINES].astype(np.int64)
        dashed = (codes // 3 if sign > 0.0 else codes % 3) == 2
        dashes, gaps = _dashes(strip[dashed])
        for paint in (strip[~dashed], dashes):
            paint[..., _REFLECTANCE] = LINE_REFLECTANCE
            finished.append(paint)
        rest = np.concatenate([without, inner, outer, gaps])
    corners = np.concatenate([rest, *finished]).reshape(-1, 13)
    count = len(corners)
    return Mesh(
        positions=corners[:, :3].astype(np.float32),
        normals=corners[:, 3:6].astype(np.float32),
        reflectance=corners[:, _REFLECTANCE].astype(np.float32),
        surface=np.full(count, road.surface[0] if len(road.surface) else 0, np.int32),
        road=corners[:, _ALONG:].astype(np.float32),
        instance=np.full(count, road.instance[0] if len(road.instance) else 0, np.int32),
        faces=np.arange(count, dtype=np.uint32).reshape(-1, 3),
    )


def _dashes(strip: Corners) -> tuple[Corners, Corners]:
    """Painted and unpainted parts of a dashed strip."""
    empty = strip[:0]
    if not len(strip):
        return empty, empty
    dashes, gaps = [empty], [empty]
    first = np.floor(strip[..., _ALONG].min(axis=1) / PERIOD)
    periods = np.floor(strip[..., _ALONG].max(axis=1) / PERIOD) - first
    for number in range(int(periods.max()) + 1):
        some, start = strip[periods >= number], PERIOD * (first + number)[periods >= number]
        for pieces, begin, end in ((dashes, 0.0, DASH), (gaps, DASH, PERIOD)):
            # Cut both ends at once: the place along the line stays a column of the pieces.
            kept, where = _part_above_with(some, some[..., _ALONG] - (start + begin)[:, None], start)
            pieces.append(_part_above(kept, (where + end)[:, None] - kept[..., _ALONG]))
    return np.concatenate(dashes), np.concatenate(gaps)


def _part_above(corners: Corners, value: NDArray[np.float64]) -> Corners:
    """The part of triangles (m, 3, k) where a value that is given at their corners (m, 3) is not negative."""
    return _part_above_with(corners, value, np.zeros(len(corners)))[0]


def _part_above_with(
    corners: Corners, value: NDArray[np.float64], mark: NDArray[np.float64]
) -> tuple[Corners, NDArray[np.float64]]:
    """As `_part_above`, and for each piece the mark (m,) of the triangle that it is part of."""
    inside = value >= 0.0
    count = inside.sum(axis=1)
    whole = count == 3
    parts, marks = [corners[whole]], [mark[whole]]
    for number in (1, 2):
        cut = count == number
        # The corner that is alone on its side comes first.
        alone = np.argmax(inside[cut] if number == 1 else ~inside[cut], axis=1)
        order = (alone[:, None] + np.arange(3)) % 3
        at = np.take_along_axis(value[cut], order, axis=1)
        a, b, c = np.take_along_axis(corners[cut], order[..., None], axis=1).transpose(1, 0, 2)
        ab = a + (at[:, 0] / (at[:, 0] - at[:, 1]))[:, None] * (b - a)
        ac = a + (at[:, 0] / (at[:, 0] - at[:, 2]))[:, None] * (c - a)
        pieces = [(a, ab, ac)] if number == 1 else [(ab, b, c), (ab, c, ac)]
        parts += [np.stack(piece, axis=1) for piece in pieces]
        marks += [mark[cut]] * len(pieces)
    return np.concatenate(parts), np.concatenate(marks)


GAMMA = 2.2
"""Power by which pyrender encodes linear colours."""

_CAMERA = Camera(1280, 720, 1154.0, (639.5, 359.5), 1.38)
_DARKEST_WHITE = 5.0  # luminance that is drawn as white where there is little daylight or none [cd/m²]
_FAR = 1e5  # depth beyond which nothing is seen, which is beyond the terrain [m]


class Part(NamedTuple):
    """A node of meshes that show the same thing."""

    node: "pyrender.Node"  # The node
    instance: int  # Instance id of what it shows
    radiance: NDArray[np.float64] | None  # (3,): Of a lit lamp, its radiance per channel [cd/m²]
    is_asphalt: bool = False  # Whether it is road without paint


def to_pyrender(
    scene: Scene,
    pose: CameraPose,
    lights: Lights | None = None,
    *,
    vehicles: Sequence[Batch] = (),
    camera: Camera | None = None,
    illuminance: float = 1e4,
) -> "pyrender.Scene":
    """Make pyrender's scene of one of FogSim's, to draw with pyrender's own renderers or to look at in its viewer.

    Vertices have FogSim's daylight in their colours (reflectance times what reaches them of an overcast sky, which
    pyrender's lights cannot do), and the ambient light is its strength; lines on roads are triangles. There is no fog.
    Of lamps, pyrender lets the four nearest of a kind light each node.

    Returns with linear luminance 1 for that of a white surface in daylight, E/π, or for 5 cd/m² if that is more. Takes
    `illuminance` [lx].
    """
    library = load_pyrender()
    white = max(illuminance / math.pi, _DARKEST_WHITE)
    result = empty_scene(library, illuminance, white)
    for part in still_parts(library, scene, white):
        result.add_node(part.node)
    for part in copied_parts(library, scene, vehicles, white, "vehicle"):
        result.add_node(part.node)
    result.main_camera_node = result.add(pinhole(library, camera or _CAMERA), "camera", camera_matrix(camera, pose))
    for name, lamp, matrix in _lamps(library, lights or Lights.none(), pose, white):
        result.add(lamp, name, matrix)
    return result


def load_pyrender() -> Any:
    """Import pyrender, for drawing off-screen where there is no display and nothing else is asked for."""
    if "OpenGL" not in sys.modules and not os.environ.get("DISPLAY") and sys.platform.startswith("linux"):
        from fogsim.render.opengl.context import choose_platform  # noqa: PLC0415 - only where it is needed

        choose_platform()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # pyrender and pyglet are old; their deprecations are not the user's
            import pyrender  # noqa: PLC0415
    except Exception as error:  # whatever it is: a missing library shows as ImportError, OSError or AttributeError
        raise MissingDependencyError(
            f"pyrender could not be loaded ({type(error).__name__}: {error}); pip install pyrender==0.1.45, and on "
            "Debian or Ubuntu: sudo apt-get install libegl1 libegl-mesa0 libgl1 libgl1-mesa-dri"
        ) from error
    return pyrender


def empty_scene(library: Any, illuminance: float, white: float) -> Any:
    """A scene with nothing but daylight: ambient light, and the sky just above the horizon as its background.

    Takes `illuminance` [lx], `white` [cd/m²].
    """
    sky = min(zenith_luminance(illuminance) / 3.0 / white, 1.0) ** (1.0 / GAMMA)
    ambient = illuminance / math.pi / white
    return library.Scene(bg_color=(sky, sky, sky, 1.0), ambient_light=np.full(3, ambient))


def pinhole(library: Any, camera: Camera) -> Any:
    """Pyrender's camera, whose pixel centres lie at halves and not at integers."""
    (u0, v0), focal = camera.principal_point, camera.focal_length
    return library.IntrinsicsCamera(focal, focal, u0 + 0.5, v0 + 0.5, znear=NEAR, zfar=_FAR)


def camera_matrix(camera: Camera | None, pose: CameraPose) -> NDArray[np.float64]:
    """From axes right, up and back of a camera to the world.

    Returns the matrix (4, 4).
    """
    right, down, forward = camera_axes(camera or _CAMERA, pose)
    return _matrix((right, -down, -forward), pose.position)


def still_parts(library: Any, scene: Scene, white: float) -> Iterator[Part]:
    """Nodes of what stands still (`white` [cd/m²])."""
    ground = scene.ground
    kinds = np.column_stack((ground.instance, ground.surface))[ground.faces[:, 0]]
    for instance, surface in np.unique(kinds, axis=0).tolist():
        mesh = replace(ground, faces=ground.faces[np.all(kinds == (instance, surface), axis=1)])
        if surface == Surface.ROAD:
            mesh = _painted_road(mesh)
            paint = np.all(mesh.reflectance[mesh.faces[:, 0]] == np.float32(LINE_REFLECTANCE), axis=1)
            lines = _mesh(library, replace(mesh, faces=mesh.faces[paint]), np.eye(4)[None], mesh.reflectance)
            yield Part(library.Node("ground paint", mesh=lines), instance, None)
            mesh = replace(mesh, faces=mesh.faces[~paint])
        if surface == Surface.TERRAIN:
            mesh = _tiled(mesh, _middle(scene))
        made = _mesh(library, mesh, np.eye(4)[None], mesh.reflectance)
        if surface == Surface.TERRAIN:
            made._bounds = np.zeros((2, 3)) + np.append(_middle(scene), 0.0)
        node = library.Node(f"ground {Surface(surface).name.lower()}", mesh=made)
        yield Part(node, instance, None, surface == Surface.ROAD)
    yield from copied_parts(library, scene, scene.scenery, white, "scenery")


def _middle(scene: Scene) -> NDArray[np.float64]:
    """Middle (2,) of what is not terrain [m]; the origin if there is nothing else."""
    used = scene.ground.faces[scene.ground.surface[scene.ground.faces[:, 0]] != int(Surface.TERRAIN)]
    if not len(used):
        return np.zeros(2)
    return np.asarray(scene.ground.positions[used.ravel(), :2].mean(axis=0), np.float64)


def _tiled(terrain: Mesh, middle: NDArray[np.float64]) -> Mesh:
    """Level terrain as squares that are small about the middle of a scene.

    Over triangles of many kilometres, depths would have errors of decimetres.
    """
    height = float(terrain.positions[terrain.faces[0, 0], 2])
    steps = np.concatenate((np.arange(0.0, 6e3, 200.0), np.geomspace(6e3, 4e4, 12)))
    line = np.concatenate((-steps[:0:-1], steps))
    x, y = np.meshgrid(middle[0] + line, middle[1] + line)
    n = len(line)
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.stack((corner, corner + 1, corner + n, corner + 1, corner + n + 1, corner + n), axis=1).reshape(-1, 3)
    vertex = np.full(n * n, terrain.faces[0, 0])
    return replace(
        terrain,
        positions=np.column_stack((x.ravel(), y.ravel(), np.full(n * n, height))).astype(np.float32),
        normals=terrain.normals[vertex],
        reflectance=terrain.reflectance[vertex],
        faces=faces.astype(np.uint32),
    )


def copied_parts(library: Any, scene: Scene, batches: Sequence[Batch], white: float, name: str) -> Iterator[Part]:
    """Nodes of copies of shapes: one for the copies that look alike, and one more for each kind of lamp that is lit.

    Takes `white` [cd/m²].
    """
    for batch in batches:
        looks = np.column_stack((batch.instance, batch.lamps, batch.paint))
        _, look = np.unique(looks, axis=0, return_inverse=True)
        for number in range(int(look.max(initial=-1)) + 1):
            own = look.ravel() == number
            yield from _copies(library, scene.shapes[batch.shape], batch, own, white, f"{name} {batch.shape}")


def _copies(library: Any, shape: Mesh, batch: Batch, own: NDArray[np.bool_], white: float, name: str) -> Iterator[Part]:
    """Nodes of those copies of a batch that look alike."""
    transforms = batch.transforms[own].astype(np.float64)
    first = int(np.argmax(own))
    paint, lamps, instance = batch.paint[first], int(batch.lamps[first]), int(batch.instance[first])
    painted = shape.surface == int(Surface.PAINT)
    reflectance = np.where(painted[:, None], paint, shape.reflectance)
    surface = shape.surface[shape.faces[:, 0]]
    shining = _shining(shape, surface, lamps)
    if white > lamp_radiance(Surface.DIODES_WHITE).max():  # by day, diodes of signs are seen by what they reflect
        shining &= surface < int(Surface.DIODES_WHITE)
    instance = instance or int(shape.instance[0])
    for kind in (None, *np.unique(surface[shining]).tolist()):
        chosen = ~shining if kind is None else shining & (surface == kind)
        if not chosen.any():
            continue
        mesh = replace(shape, faces=shape.faces[chosen])
        radiance = None if kind is None else lamp_radiance(Surface(kind))
        emitted = None if radiance is None else np.minimum(radiance / white, 1.0)
        made = _mesh(library, mesh, transforms, reflectance, emitted)
        title = f"{name} {instance}" + ("" if kind is None else f" {Surface(kind).name.lower()}")
        yield Part(library.Node(title, mesh=made), instance, radiance)


def _shining(shape: Mesh, surface: NDArray[np.int32], lamps: int) -> NDArray[np.bool_]:
    """Triangles of lamps that are lit."""
    across = shape.positions[shape.faces][:, :, 1].mean(axis=1)
    bits = np.array([lighting_bits(Surface(kind)) for kind in range(len(Surface))])[surface]
    is_stop = surface == int(Surface.LAMP_STOP)
    dark = np.array([lamps >> dark_shift(y, stop) for y, stop in zip(across.tolist(), is_stop.tolist(), strict=True)])
    return np.asarray((bits < 0) | (bits & lamps & ~dark != 0))


def _mesh(
    library: Any,
    mesh: Mesh,
    transforms: NDArray[np.float64],
    reflectance: NDArray[np.float32],
    emitted: NDArray[np.float64] | None = None,
) -> Any:
    """Pyrender's mesh of copies of one, lit as the first of them stands."""
    used, faces = np.unique(mesh.faces, return_inverse=True)
    upper = transforms[0, :3, :3]
    normals = matrix_product(mesh.normals[used], (upper / (upper * upper).sum(axis=0)).T)
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-9)[:, None]
    colours = np.ones((len(used), 4))
    emission = (0.0, 0.0, 0.0)
    if emitted is None:
        shares: Any = light_share(*normals.T)  # the kernel takes arrays as well
        colours[:, :3] = reflectance[used] * shares[:, None]
    else:
        emission = tuple(np.sqrt(emitted).tolist())  # pyrender's shader squares it
    material = library.MetallicRoughnessMaterial(
        baseColorFactor=(1.0, 1.0, 1.0, 1.0) if emitted is None else (0.0, 0.0, 0.0, 1.0),
        emissiveFactor=emission,
        metallicFactor=0.0,
        roughnessFactor=1.0,
    )
    positions, faces = mesh.positions[used], faces.reshape(-1, 3)
    primitive = library.Primitive(
        positions=positions,
        normals=mesh.normals[used],
        color_0=colours.astype(np.float32),
        # Both sides are seen, and pyrender's segmentation leaves out triangles' backs, whatever the material says.
        indices=np.concatenate([faces, faces[:, ::-1]]),
        material=material,
        poses=transforms,
    )
    made = library.Mesh([primitive])
    # pyrender would work these out by a name that numpy 2 does not have, and without the turns of copies.
    low, high = positions.min(axis=0), positions.max(axis=0)
    corners = np.array(
        [(x, y, z, 1.0) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    )
    places = np.einsum("nij,kj->nki", transforms[:, :3], corners).reshape(-1, 3)
    made._bounds = np.array((places.min(axis=0), places.max(axis=0)))
    return made


def _lamps(
    library: Any, lights: Lights, pose: CameraPose, white: float
) -> Iterator[tuple[str, Any, NDArray[np.float64]]]:
    """Name, light and matrix of each lamp."""
    forward, left = _vehicle_axes(pose)
    for number, lamp in enumerate(lights.own):
        x, y, z = lamp.offset
        place = np.array(pose.position) + x * forward + y * left + (0.0, 0.0, z)
        matrix = _pointing(_beam_axis(lamp, forward, left), place)
        yield f"own lamp {number}", _spot(library, lamp, white), matrix
    others = lights.others
    for number, (place, candela, colour) in enumerate(
        zip(others.position, others.intensity, others.colour, strict=True)
    ):
        made = library.PointLight(color=_clipped(colour), intensity=candela / white)
        yield f"lamp {number}", made, _matrix(np.eye(3), place)
    streets = lights.streets
    if streets is None:
        return
    for number, place in enumerate(streets.position):
        made = library.SpotLight(
            color=_clipped(streets.colour),
            intensity=float(streets.intensity.max()) / white,
            innerConeAngle=math.radians(60.0),
            outerConeAngle=math.radians(85.0),
        )
        yield f"street lamp {number}", made, _pointing(np.array((0.0, 0.0, -1.0)), place)


def _vehicle_axes(pose: CameraPose) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Forward and left of a vehicle."""
    east, north, rise = math.cos(pose.heading), math.sin(pose.heading), math.tan(pose.grade)
    forward = np.array((east, north, rise))
    return forward / math.hypot(*forward), np.array((-north, east, 0.0))


def _beam_axis(lamp: HeadLamp, forward: NDArray[np.float64], left: NDArray[np.float64]) -> NDArray[np.float64]:
    """Direction in which a head lamp shines most."""
    beam = lamp.beam
    row, column = np.unravel_index(int(np.argmax(beam.intensity)), beam.intensity.shape)
    azimuth, elevation = beam.azimuth[column], beam.elevation[row]
    ahead = math.cos(azimuth) * forward - math.sin(azimuth) * left
    return np.asarray(math.cos(elevation) * ahead + math.sin(elevation) * np.array((0.0, 0.0, 1.0)))


def _spot(library: Any, lamp: HeadLamp, white: float) -> Any:
    """A cone for a beam: as wide as the beam is where it has half its intensity and a tenth."""
    beam = lamp.beam
    peak = float(beam.intensity.max())
    across = beam.intensity.max(axis=0)

    def width(share: float) -> float:
        return float(np.ptp(beam.azimuth[across >= share * peak])) / 2.0

    inner = max(width(0.5), math.radians(1.0))
    return library.SpotLight(
        color=_clipped(lamp.colour),
        intensity=peak / white,
        innerConeAngle=min(inner, math.radians(80.0)),
        outerConeAngle=min(max(width(0.1), 1.2 * inner), math.radians(85.0)),
    )


def _clipped(colour: Any) -> NDArray[np.float64]:
    """A light's colour as pyrender takes it: none of its channels more than 1."""
    return np.clip(np.asarray(colour, np.float64), 0.0, 1.0)


def _pointing(axis: NDArray[np.float64], place: Any) -> NDArray[np.float64]:
    """Matrix of a light at a place that shines along an axis."""
    back = -axis / math.hypot(*axis)
    side = np.cross((0.0, 1.0, 0.0) if abs(back[2]) > 0.9 else (0.0, 0.0, 1.0), back)
    side /= math.hypot(*side)
    return _matrix((side, np.cross(back, side), back), place)


def _matrix(axes: Any, place: Any) -> NDArray[np.float64]:
    """Transform with those columns and that origin."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = np.array(axes).T, place
    return matrix
