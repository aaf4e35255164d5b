"""What is known of each triangle that is seen: its plane, its light and its answer to lamplight."""

import math

import numpy as np

from fogsim.jit import kernel
from fogsim.render.drawing import NEAR
from fogsim.render.lens import Lens
from fogsim.render.shading import layout
from fogsim.render.shading.layout import Copies, Light, Meshes, Runs
from fogsim.values.scene import Surface

_ROAD, _PAINT, _SHEETING = int(Surface.ROAD), int(Surface.PAINT), int(Surface.SHEETING)
_PERIOD = 18.0  # of dashed lines [m]
_PER_PI = 1.0 / math.pi

INSTANCE, LEAST, MOST, DEPTH = layout.INSTANCE, layout.LEAST, layout.MOST, layout.DEPTH
LIGHT, RESPONSE, LOW, HIGH = layout.LIGHT, layout.RESPONSE, layout.LOW, layout.HIGH
RESPONSE_LOW, RESPONSE_HIGH = layout.RESPONSE_LOW, layout.RESPONSE_HIGH
ALONG, ACROSS, WHITE = layout.ALONG, layout.ACROSS, layout.WHITE
HALF_WIDTH, LINES, COLOUR = layout.HALF_WIDTH, layout.LINES, layout.COLOUR
OBJECT, ROAD, TERRAIN = layout.OBJECT, layout.ROAD, layout.TERRAIN

Vector = tuple[float, float, float]


@kernel
def light_share(x: float, y: float, z: float) -> float:
    """What reaches a surface with that unit normal of the overcast sky's light and, from below, of the ground's.

    A little more comes from one side so that shapes read. A level surface gets exactly 1.
    """
    return 0.5 + 0.5 * z + 0.06 * (1.0 - z) + 0.07 * (0.5 * x - 0.86 * y)


@kernel
def retroreflection(distance: float) -> float:
    """Coefficient of retroreflection of white sheeting toward the driver of the lamps [cd/(lx·m²)].

    That of EN 12899-1 class RA2 at an entrance angle of 5°: 250, 180 and 5 at 12′, 20′ and 2° between lamp and eye,
    interpolated between the logarithms [M: from memory], for an eye 0.75 m above the lamp [M].
    """
    angle = math.log(min(max(math.degrees(0.75 / distance), 0.2), 2.0))
    middle = math.log(1.0 / 3.0)
    if angle < middle:
        share = (angle - math.log(0.2)) / (middle - math.log(0.2))
        return math.exp(math.log(250.0) + share * math.log(180.0 / 250.0))
    return math.exp(math.log(180.0) + (angle - middle) / (math.log(2.0) - middle) * math.log(5.0 / 180.0))


@kernel
def _inverse_square(x: float, y: float, z: float) -> float:
    return 1.0 / (x * x + y * y + z * z)


@kernel
def know_background(lens: Lens, light: Light, runs: Runs) -> None:
    """Set what is known of sky and terrain."""
    kind, surface, height = runs.kind, runs.surface, lens.eye[2] - light.terrain[0]
    kind[0], surface[0, INSTANCE] = layout.SKY, 0
    kind[1], surface[1, INSTANCE], surface[1, WHITE] = TERRAIN, 1, light.white
    surface[1, LEAST], surface[1, MOST] = 0.0, np.inf
    for column in range(3):
        surface[1, DEPTH + column] = -lens.rays[2, column] / height
        surface[1, COLOUR + column] = light.terrain[1 + column]


@kernel
def know(  # noqa: C901, PLR0912, PLR0915 - one loop: handing arrays to functions costs more than a surface's work
    meshes: Meshes, copies: Copies, lens: Lens, light: Light, lamplight: bool, runs: Runs, count: int
) -> None:
    """Set what is known of the surfaces from number 2 to `count`."""
    positions, normals, colours, surface_of = meshes.positions, meshes.normals, meshes.reflectance, meshes.surface
    faces, first_face, roads, vertex_instance = meshes.faces, meshes.first_face, meshes.road, meshes.instance
    record, integers, mesh, first, axes = copies.record, copies.integers, copies.mesh, copies.first, lens.axes
    slot_of, copy_of, kinds, known = runs.slot, runs.copy, runs.kind, runs.surface
    focal, u0, v0 = lens.lens[0], lens.lens[1], lens.lens[2]
    masks, lamps = light.lamp_masks, light.lamp_radiance
    corner, plane, offset = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    lit, answer = np.empty((3, 3)), np.empty((3, 3))
    for number in range(2, count):
        copy = copy_of[number]
        face = first_face[mesh[copy]] + slot_of[number] - first[copy]
        kind = surface_of[faces[face, 0]]
        for i in range(3):
            x, y, z = positions[faces[face, i], 0], positions[faces[face, i], 1], positions[faces[face, i], 2]
            for row in range(3):
                k = 4 * row
                offset[i, row] = np.float64(record[copy, k]) * x + np.float64(record[copy, k + 1]) * y
                offset[i, row] += np.float64(record[copy, k + 2]) * z + np.float64(record[copy, k + 3])
            for row in range(3):
                corner[i, row] = axes[row, 0] * offset[i, 0] + axes[row, 1] * offset[i, 1] + axes[row, 2] * offset[i, 2]
        # Rows of the inverse of the matrix of corners, as planes over column, row and 1.
        for i in range(3):
            p, q = (i + 1) % 3, (i + 2) % 3
            for axis in range(3):
                b, c = (axis + 1) % 3, (axis + 2) % 3
                plane[i, axis] = corner[p, b] * corner[q, c] - corner[p, c] * corner[q, b]
        determinant = corner[0, 0] * plane[0, 0] + corner[0, 1] * plane[0, 1] + corner[0, 2] * plane[0, 2]
        low, high = min(corner[0, 2], corner[1, 2], corner[2, 2]), max(corner[0, 2], corner[1, 2], corner[2, 2])
        scale = 1.0 / determinant if abs(determinant) > 1e-12 else 0.0
        per_focal = scale / focal
        for i in range(3):
            plane[i, 0] *= per_focal
            plane[i, 1] *= per_focal
            plane[i, 2] = plane[i, 2] * scale - plane[i, 0] * u0 - plane[i, 1] * v0
            if scale == 0.0:  # seen edge on: its middle stands for all of it
                plane[i, 2] = 1.0 / (3.0 * max(0.5 * (low + high), NEAR))
        known[number, LEAST], known[number, MOST] = 1.0 / max(high, NEAR), 1.0 / max(low, NEAR)
        for axis in range(3):
            known[number, DEPTH + axis] = plane[0, axis] + plane[1, axis] + plane[2, axis]
        own = integers[copy, 16]
        known[number, INSTANCE] = own if own != 0 else vertex_instance[faces[face, 0]]

        # Normals turn with the transform, and against the lengths of its columns.
        xx, xy, xz = float(record[copy, 0]), float(record[copy, 4]), float(record[copy, 8])
        yx, yy, yz = float(record[copy, 1]), float(record[copy, 5]), float(record[copy, 9])
        zx, zy, zz = float(record[copy, 2]), float(record[copy, 6]), float(record[copy, 10])
        per_x, per_y, per_z = _inverse_square(xx, xy, xz), _inverse_square(yx, yy, yz), _inverse_square(zx, zy, zz)
        shining = masks[kind] < 0 or (integers[copy, 15] & masks[kind]) != 0
        most = -1.0
        for i in range(3):
            vertex = faces[face, i]
            a, b, c = normals[vertex, 0] * per_x, normals[vertex, 1] * per_y, normals[vertex, 2] * per_z
            nx, ny, nz = xx * a + yx * b + zx * c, xy * a + yy * b + zy * c, xz * a + yz * b + zz * c
            per_length = 1.0 / math.sqrt(nx * nx + ny * ny + nz * nz)
            nx, ny, nz = nx * per_length, ny * per_length, nz * per_length
            white = light.white * light_share(nx, ny, nz)
            # Times the distance, by which each pixel divides; over a flat triangle the product is the same everywhere.
            cosine = 0.0
            if lamplight:
                ox, oy, oz = offset[i, 0], offset[i, 1], offset[i, 2]
                cosine = -(nx * ox + ny * oy + nz * oz)
                most = max(most, cosine)
            share = cosine * _PER_PI
            for channel in range(3):
                reflectance = record[copy, 12 + channel] if kind == _PAINT else colours[vertex, channel]
                lit[i, channel] = reflectance * white + (lamps[kind, channel] if shining else 0.0)
                answer[i, channel] = reflectance * share
            if kind == _ROAD and i == 0:
                known[number, WHITE] = white
        if kind == _ROAD:
            kinds[number] = ROAD
            i, j, k = faces[face, 0], faces[face, 1], faces[face, 2]
            start = _PERIOD * math.floor(roads[i, 0] / _PERIOD)
            for axis in range(3):
                known[number, ALONG + axis] = (
                    (roads[i, 0] - start) * plane[0, axis]
                    + (roads[j, 0] - start) * plane[1, axis]
                    + (roads[k, 0] - start) * plane[2, axis]
                )
                known[number, ACROSS + axis] = (
                    roads[i, 1] * plane[0, axis] + roads[j, 1] * plane[1, axis] + roads[k, 1] * plane[2, axis]
                )
                known[number, COLOUR + axis] = (colours[i, axis] + colours[j, axis] + colours[k, axis]) / 3.0
            known[number, HALF_WIDTH], known[number, LINES] = roads[i, 2], roads[i, 3]
            continue
        if lamplight and kind == _SHEETING and most > 0.0:
            middle = math.sqrt(offset[0, 0] ** 2 + offset[0, 1] ** 2 + offset[0, 2] ** 2)
            # A lamp's light is spread over the sheeting's tilted face; beyond that, R falls like the cosine cubed [M].
            strength = retroreflection(middle) * most * most / (middle * 0.66)
            for i in range(3):
                for channel in range(3):
                    answer[i, channel] = strength * min(colours[faces[face, i], channel], np.float32(0.66))
        elif lamplight:
            # Of what is seen from behind, as of leaves, the other side is lit.
            side = 1.0 if most > 0.0 else -1.0
            for i in range(3):
                for channel in range(3):
                    answer[i, channel] = max(side * answer[i, channel], 0.0)
        kinds[number] = OBJECT
        for channel in range(3):
            a, b, c = lit[0, channel], lit[1, channel], lit[2, channel]
            known[number, LOW + channel], known[number, HIGH + channel] = min(a, b, c), max(a, b, c)
            for axis in range(3):
                known[number, LIGHT + 3 * channel + axis] = a * plane[0, axis] + b * plane[1, axis] + c * plane[2, axis]
            if lamplight:
                a, b, c = answer[0, channel], answer[1, channel], answer[2, channel]
                known[number, RESPONSE_LOW + channel] = min(a, b, c)
                known[number, RESPONSE_HIGH + channel] = max(a, b, c)
                for axis in range(3):
                    known[number, RESPONSE + 3 * channel + axis] = (
                        a * plane[0, axis] + b * plane[1, axis] + c * plane[2, axis]
                    )
