"""Each triangle that is seen: its plane, its light and its answer to lamplight."""

import math

import numpy as np

from fogsim.core.jit import kernel
from fogsim.render.drawing import NEAR
from fogsim.render.projection import Lens
from fogsim.render.shading import layout
from fogsim.render.shading.layout import (
    ONE,
    THREE,
    TWO,
    Array,
    Copies,
    Light,
    Meshes,
    Picture,
    Spans,
    Wide,
    first_of,
)
from fogsim.render.shading.lines import PERIOD
from fogsim.render.vectors import Triple, Vector, columns_times, cross, dot, plus, row, rows_times, scaled, unit
from fogsim.values.fog import EVEN_LIGHT
from fogsim.values.light import DARK_SHIFT, MIDDLE, NEVER_APART, Side
from fogsim.values.scene import Surface

_LEFT, _RIGHT, _MIDDLE = DARK_SHIFT[Side.LEFT], DARK_SHIFT[Side.RIGHT], DARK_SHIFT[Side.MIDDLE]
_SOME_DARK = 1 << _LEFT
_STOP = int(Surface.LAMP_STOP)
_ROAD, _PAINT, _SHEETING = int(Surface.ROAD), int(Surface.PAINT), int(Surface.SHEETING)
_PER_PI = 1.0 / math.pi
_WHITE_SHEETING = 0.66  # its reflectance

_INSTANCE, _LEAST, _MOST, _DEPTH = layout.INSTANCE, layout.LEAST, layout.MOST, layout.DEPTH
LIGHT, _RESPONSE, LOW, HIGH = layout.LIGHT, layout.RESPONSE, layout.LOW, layout.HIGH
_RESPONSE_LOW, _RESPONSE_HIGH = layout.RESPONSE_LOW, layout.RESPONSE_HIGH
_ALONG, _ACROSS, _WHITE = layout.ALONG, layout.ACROSS, layout.WHITE
_HALF_WIDTH, _LINES, _COLOUR, _START = layout.HALF_WIDTH, layout.LINES, layout.COLOUR, layout.START
_OBJECT, ROAD, _TERRAIN = layout.OBJECT, layout.ROAD, layout.TERRAIN


@kernel
def shade_objects(spans: Spans, count: int, lens: Wide, picture: Picture) -> None:
    """Shade the spans of triangles without texture, and set their distances and instance ids (`lens` (3,))."""
    span, kinds, surface = spans.span, spans.kind, spans.surface
    radiance, distance, instance, response = picture.radiance, picture.distance, picture.instance, picture.response
    lamplight, columns = len(response) > 0, np.uint64(distance.shape[1])
    depths = np.empty(columns, np.float32)
    per_focal, one = np.float32(1.0 / lens[0]), np.float32(1.0)
    for number in range(count):
        k = span[number, 3]
        if kinds[k] != _OBJECT:
            continue
        v, begin, end = np.uint64(span[number, 0]), span[number, 1], span[number, 2]
        row, name = float(span[number, 0]), np.int32(surface[k, _INSTANCE])
        least, most = np.float32(surface[k, _LEAST]), np.float32(surface[k, _MOST])
        slope = np.float32(surface[k, _DEPTH])
        rest = np.float32(surface[k, _DEPTH] * begin + surface[k, _DEPTH + 1] * row + surface[k, _DEPTH + 2])
        x, y = np.float32((begin - lens[1]) / lens[0]), np.float32((row - lens[2]) / lens[0])
        square = one + y * y
        length = np.uint64(end - begin)
        # Few loops, since most spans are of few pixels, and to guess where each ends costs more than the rest.
        for i in range(length):
            step, u = np.float32(np.int32(i)), np.uint64(begin) + i
            across, z = x + per_focal * step, one / min(max(rest + slope * step, least), most)
            depths[i] = z
            distance[v, u] = np.sqrt(square + across * across) * z
            instance[v, u] = name
        red, red_step = _along(surface, k, LIGHT, begin, row)
        green, green_step = _along(surface, k, LIGHT + 3, begin, row)
        blue, blue_step = _along(surface, k, LIGHT + 6, begin, row)
        red_low, green_low, blue_low = _numbers(surface, k, LOW)
        red_high, green_high, blue_high = _numbers(surface, k, HIGH)
        place = first_of(v, np.uint64(begin), columns)
        for i in range(length):
            step, z, at = np.float32(np.int32(i)), depths[i], place + THREE * i
            radiance[at] = min(max((red + red_step * step) * z, red_low), red_high)
            radiance[at + ONE] = min(max((green + green_step * step) * z, green_low), green_high)
            radiance[at + TWO] = min(max((blue + blue_step * step) * z, blue_low), blue_high)
        if lamplight:
            red, red_step = _along(surface, k, _RESPONSE, begin, row)
            green, green_step = _along(surface, k, _RESPONSE + 3, begin, row)
            blue, blue_step = _along(surface, k, _RESPONSE + 6, begin, row)
            red_low, green_low, blue_low = _numbers(surface, k, _RESPONSE_LOW)
            red_high, green_high, blue_high = _numbers(surface, k, _RESPONSE_HIGH)
            for i in range(length):
                step, z, at = np.float32(np.int32(i)), depths[i], place + THREE * i
                far = distance[v, np.uint64(begin) + i]
                response[at] = min(max((red + red_step * step) * z, red_low), red_high) / far
                response[at + ONE] = min(max((green + green_step * step) * z, green_low), green_high) / far
                response[at + TWO] = min(max((blue + blue_step * step) * z, blue_low), blue_high) / far


@kernel
def _along(surface: Wide, number: int, plane: int, begin: int, row: float) -> tuple[np.float32, np.float32]:
    """A plane at the first pixel of a span, and its change from one pixel to the next."""
    slope = surface[number, plane]
    return np.float32(slope * begin + surface[number, plane + 1] * row + surface[number, plane + 2]), np.float32(slope)


@kernel
def _numbers(surface: Wide, number: int, first: int) -> tuple[np.float32, np.float32, np.float32]:
    """Three numbers of a surface."""
    return (
        np.float32(surface[number, first]),
        np.float32(surface[number, first + 1]),
        np.float32(surface[number, first + 2]),
    )


@kernel
def shade_sky(spans: Spans, count: int, rays: Wide, light: Light, picture: Picture) -> None:
    """Shade the spans of sky: the CIE standard overcast sky, L(θ) = L_z (1 + 2 sin θ) / 3 (`rays` (3, 3))."""
    span = spans.span
    radiance, distance, instance, response = picture.radiance, picture.distance, picture.instance, picture.response
    columns = np.uint64(distance.shape[1])
    shares = np.empty(columns, np.float32)
    lamplight, nothing, far = len(response) > 0, np.float32(0.0), np.float32(np.inf)
    red, green, blue = np.float32(light.zenith[0]), np.float32(light.zenith[1]), np.float32(light.zenith[2])
    third, two_thirds = np.float32(1.0 / 3.0), np.float32(2.0 / 3.0)
    dx, dy, dz = np.float32(rays[0, 0]), np.float32(rays[1, 0]), np.float32(rays[2, 0])
    for number in range(count):
        if span[number, 3] != 0:
            continue
        v, begin, end = np.uint64(span[number, 0]), span[number, 1], span[number, 2]
        row = float(span[number, 0])
        x = np.float32(rays[0, 0] * begin + rays[0, 1] * row + rays[0, 2])
        y = np.float32(rays[1, 0] * begin + rays[1, 1] * row + rays[1, 2])
        z = np.float32(rays[2, 0] * begin + rays[2, 1] * row + rays[2, 2])
        # Loops apart, since each alone spans in vector registers.
        for i in range(np.uint64(end - begin)):
            step = np.float32(np.int32(i))
            a, b, c = x + dx * step, y + dy * step, z + dz * step
            shares[i] = third + two_thirds * max(c / np.sqrt(a * a + b * b + c * c), nothing)
        place = first_of(v, np.uint64(begin), columns)
        for i in range(np.uint64(end - begin)):
            at, share = place + THREE * i, shares[i]
            radiance[at], radiance[at + ONE], radiance[at + TWO] = red * share, green * share, blue * share
        for u in range(np.uint64(begin), np.uint64(end)):
            distance[v, u] = far
        for u in range(np.uint64(begin), np.uint64(end)):
            instance[v, u] = 0
        if lamplight:
            for i in range(THREE * np.uint64(end - begin)):
                response[place + i] = nothing


@kernel
def light_share(
    x: float, y: float, z: float, vertical: float = EVEN_LIGHT.vertical, below: float = EVEN_LIGHT.below
) -> float:
    """What reaches a surface with that unit normal of the overcast sky's light and, from below, of the ground's.

    A little more comes from one side so that shapes read. A level surface gets 1.
    """
    by_height = vertical + (0.5 * (1.0 - below) + (0.5 * (1.0 + below) - vertical) * z) * z
    return by_height + 0.07 * (0.5 * x - 0.86 * y)


@kernel
def retroreflection(distance: float) -> float:
    """Coefficient of retroreflection of white sheeting toward the driver of the lamps [cd/(lx·m²)].

    That of EN 12899-1 class RA2 at an entrance angle of 5°: 250, 180 and 5 at 12′, 20′ and 2° between lamp and eye,
    interpolated between the logarithms [M: from memory], for an eye 0.75 m above the lamp [M].

    Takes `distance` [m].
    """
    angle = math.log(min(max(math.degrees(0.75 / distance), 0.2), 2.0))
    middle = math.log(1.0 / 3.0)
    if angle < middle:
        share = (angle - math.log(0.2)) / (middle - math.log(0.2))
        return math.exp(math.log(250.0) + share * math.log(180.0 / 250.0))
    return math.exp(math.log(180.0) + (angle - middle) / (math.log(2.0) - middle) * math.log(5.0 / 180.0))


@kernel
def set_background_surfaces(lens: Lens, light: Light, spans: Spans) -> None:
    """Set the numbers of sky and terrain."""
    kind, surface, height = spans.kind, spans.surface, lens.eye[2] - light.terrain[0]
    kind[0], surface[0, _INSTANCE] = layout.SKY, 0
    kind[1], surface[1, _INSTANCE], surface[1, _WHITE] = _TERRAIN, 1, light.white
    surface[1, _LEAST], surface[1, _MOST] = 0.0, np.inf
    for column in range(3):
        surface[1, _DEPTH + column] = -lens.rays[2, column] / height
        surface[1, _COLOUR + column] = light.terrain[1 + column]


@kernel
def set_surfaces(
    meshes: Meshes, copies: Copies, lens: Lens, light: Light, lamplight: bool, spans: Spans, count: int
) -> None:
    """Set the numbers of the surfaces from number 2 to `count`."""
    surface_of, faces, first_face, vertex_instance = meshes.surface, meshes.faces, meshes.first_face, meshes.instance
    positions, normals, colours = meshes.positions, meshes.normals, meshes.reflectance
    integers, record, mesh, first = copies.integers, copies.record, copies.mesh, copies.first
    triangle_of, copy_of, kinds, surface = spans.triangle_id, spans.copy, spans.kind, spans.surface
    masks, lamps = light.lamp_masks, light.lamp_radiance
    axes = row(lens.axes, 0), row(lens.axes, 1), row(lens.axes, 2)
    pinhole = lens.lens[0], lens.lens[1], lens.lens[2]
    for number in range(2, count):
        copy = copy_of[number]
        face = first_face[mesh[copy]] + triangle_of[number] - first[copy]
        i, j, k = faces[face, 0], faces[face, 1], faces[face, 2]
        kind, own = surface_of[i], integers[copy, 16]
        surface[number, _INSTANCE] = own if own != 0 else vertex_instance[i]
        turn = _column(record, copy, 0), _column(record, copy, 1), _column(record, copy, 2)
        place = _column(record, copy, 3)
        p, q, r = (
            plus(columns_times(turn, row(positions, i)), place),
            plus(columns_times(turn, row(positions, j)), place),
            plus(columns_times(turn, row(positions, k)), place),
        )
        planes = _set_depth(surface, number, (rows_times(axes, p), rows_times(axes, q), rows_times(axes, r)), pinhole)
        # Normals turn with the transform, and against the lengths of its columns.
        straight = (
            scaled(turn[0], 1.0 / dot(turn[0], turn[0])),
            scaled(turn[1], 1.0 / dot(turn[1], turn[1])),
            scaled(turn[2], 1.0 / dot(turn[2], turn[2])),
        )
        a = unit(columns_times(straight, row(normals, i)))
        if kind == _ROAD:
            kinds[number] = ROAD
            surface[number, _WHITE] = light.white * light_share(a[0], a[1], a[2], light.vertical, light.below)
            _set_lane(surface, number, meshes.road, colours, (i, j, k), planes)
            continue
        kinds[number] = _OBJECT
        b = unit(columns_times(straight, row(normals, j)))
        c = unit(columns_times(straight, row(normals, k)))
        paint = record[copy, 12], record[copy, 13], record[copy, 14]
        tints = (
            paint if kind == _PAINT else row(colours, i),
            paint if kind == _PAINT else row(colours, j),
            paint if kind == _PAINT else row(colours, k),
        )
        lit = integers[copy, 15] & masks[kind]
        if lit > 0 and integers[copy, 15] >= _SOME_DARK:
            lit &= ~(integers[copy, 15] >> _dark_shift(positions[i, 1] + positions[j, 1] + positions[k, 1], kind))
        shining = masks[kind] < 0 or lit != 0
        glow = row(lamps, kind) if shining else (0.0, 0.0, 0.0)
        white = (
            light.white * light_share(a[0], a[1], a[2], light.vertical, light.below),
            light.white * light_share(b[0], b[1], b[2], light.vertical, light.below),
            light.white * light_share(c[0], c[1], c[2], light.vertical, light.below),
        )
        _set_colours(surface, number, (LIGHT, LOW, HIGH), tints, white, glow, planes)
        if lamplight:
            # Times the distance, by which each pixel divides; over a flat triangle the product is the same everywhere.
            facing = -dot(a, p), -dot(b, q), -dot(c, r)
            _set_lamp_response(surface, number, kind == _SHEETING, p, tints, facing, planes)


@kernel
def _dark_shift(across: float, kind: int) -> int:
    """Shift for the lamps on the side of a body on which a triangle is, from three times how far left it is."""
    if abs(across) >= 3.0 * MIDDLE:
        return _LEFT if across > 0.0 else _RIGHT
    return _MIDDLE if kind == _STOP else NEVER_APART


@kernel
def _set_depth(surface: Wide, number: int, corners: Triple, pinhole: Vector) -> Triple:
    """Set the depth of a triangle from its corners in camera axes [m].

    Returns what interpolates over it: for each corner a plane over column, row and 1 of its share over z [1/m].
    """
    p, q, r = corners
    focal, u0, v0 = pinhole
    # Rows of the inverse of the matrix of corners.
    a, b, c = cross(q, r), cross(r, p), cross(p, q)
    determinant = dot(p, a)
    low, high = min(p[2], q[2], r[2]), max(p[2], q[2], r[2])
    scale = 1.0 / determinant if abs(determinant) > 1e-12 else 0.0
    # Of one that is seen edge on, its middle stands for all of it.
    edge_on = 1.0 / (3.0 * max(0.5 * (low + high), NEAR)) if scale == 0.0 else 0.0
    planes = (
        _over_pixels(a, scale, focal, u0, v0, edge_on),
        _over_pixels(b, scale, focal, u0, v0, edge_on),
        _over_pixels(c, scale, focal, u0, v0, edge_on),
    )
    surface[number, _LEAST], surface[number, _MOST] = 1.0 / max(high, NEAR), 1.0 / max(low, NEAR)
    _blend(surface, number, _DEPTH, (1.0, 1.0, 1.0), planes)
    return planes


@kernel
def _over_pixels(plane: Vector, scale: float, focal: float, u0: float, v0: float, edge_on: float) -> Vector:
    """Plane over column, row and 1 of one over viewing rays."""
    x, y = plane[0] * scale / focal, plane[1] * scale / focal
    return x, y, plane[2] * scale - x * u0 - y * v0 + edge_on


@kernel
def _set_lane(
    surface: Wide, number: int, road: Array, colours: Array, corners: tuple[int, int, int], planes: Triple
) -> None:
    """Set where a triangle lies on its lane, the lane's lines and its mean reflectance."""
    i, j, k = corners
    start = PERIOD * math.floor(road[i, 0] / PERIOD)
    _blend(surface, number, _ALONG, (road[i, 0] - start, road[j, 0] - start, road[k, 0] - start), planes)
    _blend(surface, number, _ACROSS, (road[i, 1], road[j, 1], road[k, 1]), planes)
    for channel in range(3):
        surface[number, _COLOUR + channel] = (colours[i, channel] + colours[j, channel] + colours[k, channel]) / 3.0
    surface[number, _HALF_WIDTH], surface[number, _LINES] = road[i, 2], road[i, 3]
    surface[number, _START] = start


@kernel
def _set_lamp_response(
    surface: Wide, number: int, sheeting: bool, middle: Vector, tints: Triple, facing: Vector, planes: Triple
) -> None:
    """Set what a triangle returns of lamplight, times distance; `facing` is that times the cosines to its normals."""
    most = max(facing[0], facing[1], facing[2])
    if sheeting and most > 0.0:
        far = math.sqrt(dot(middle, middle))
        # A lamp's light is spread over the sheeting's tilted face; beyond that, R falls like the cosine cubed [M].
        strength = retroreflection(far) * most * most / (far * _WHITE_SHEETING)
        share = strength, strength, strength
        tints = _capped(tints[0]), _capped(tints[1]), _capped(tints[2])
    else:
        # Of what is seen from behind, as of leaves, the other side is lit.
        side = _PER_PI if most > 0.0 else -_PER_PI
        share = max(side * facing[0], 0.0), max(side * facing[1], 0.0), max(side * facing[2], 0.0)
    _set_colours(surface, number, (_RESPONSE, _RESPONSE_LOW, _RESPONSE_HIGH), tints, share, (0.0, 0.0, 0.0), planes)


@kernel
def _capped(tint: Vector) -> Vector:
    """Reflectance of sheeting, which is no whiter than white sheeting."""
    return min(tint[0], _WHITE_SHEETING), min(tint[1], _WHITE_SHEETING), min(tint[2], _WHITE_SHEETING)


@kernel
def _set_colours(
    surface: Wide,
    number: int,
    columns: tuple[int, int, int],
    tints: Triple,
    white: Vector,
    glow: Vector,
    planes: Triple,
) -> None:
    """Set planes and extremes of each channel, from the corners' reflectances, what white ones return, and a glow."""
    first, low, high = columns
    for channel in range(3):
        a = tints[0][channel] * white[0] + glow[channel]
        b = tints[1][channel] * white[1] + glow[channel]
        c = tints[2][channel] * white[2] + glow[channel]
        surface[number, low + channel], surface[number, high + channel] = min(a, b, c), max(a, b, c)
        _blend(surface, number, first + 3 * channel, (a, b, c), planes)


@kernel
def _blend(surface: Wide, number: int, first: int, values: Vector, planes: Triple) -> None:
    """Set a plane that has given values times z⁻¹ at the corners."""
    a, b, c = values
    for axis in range(3):
        surface[number, first + axis] = a * planes[0][axis] + b * planes[1][axis] + c * planes[2][axis]


@kernel
def _column(record: Array, copy: int, column: int) -> Vector:
    """Column of a copy's transform."""
    return float(record[copy, column]), float(record[copy, 4 + column]), float(record[copy, 8 + column])
