"""Radiance of what has no texture."""

import numpy as np

from fogsim.core.jit import kernel
from fogsim.render.shading import layout
from fogsim.render.shading.layout import Light, Picture, Spans, Wide

_INSTANCE, _LEAST, _MOST, _DEPTH = layout.INSTANCE, layout.LEAST, layout.MOST, layout.DEPTH
LIGHT, _RESPONSE, LOW, HIGH = layout.LIGHT, layout.RESPONSE, layout.LOW, layout.HIGH
_RESPONSE_LOW, _RESPONSE_HIGH = layout.RESPONSE_LOW, layout.RESPONSE_HIGH
_OBJECT = layout.OBJECT


@kernel
def shade_objects(spans: Spans, count: int, lens: Wide, picture: Picture) -> None:
    """Shade the spans of triangles without texture, and set their distances and instance ids (`lens` (3,))."""
    span, kinds, surface = spans.span, spans.kind, spans.surface
    radiance, distance, instance, response = picture.radiance, picture.distance, picture.instance, picture.response
    lamplight, depths = len(response) > 0, np.empty(distance.shape[1], np.float32)
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
        for i in range(length):
            step, z, u = np.float32(np.int32(i)), depths[i], np.uint64(begin) + i
            radiance[v, u, 0] = min(max((red + red_step * step) * z, red_low), red_high)
            radiance[v, u, 1] = min(max((green + green_step * step) * z, green_low), green_high)
            radiance[v, u, 2] = min(max((blue + blue_step * step) * z, blue_low), blue_high)
        if lamplight:
            red, red_step = _along(surface, k, _RESPONSE, begin, row)
            green, green_step = _along(surface, k, _RESPONSE + 3, begin, row)
            blue, blue_step = _along(surface, k, _RESPONSE + 6, begin, row)
            red_low, green_low, blue_low = _numbers(surface, k, _RESPONSE_LOW)
            red_high, green_high, blue_high = _numbers(surface, k, _RESPONSE_HIGH)
            for i in range(length):
                step, z, u = np.float32(np.int32(i)), depths[i], np.uint64(begin) + i
                far = distance[v, u]
                response[v, u, 0] = min(max((red + red_step * step) * z, red_low), red_high) / far
                response[v, u, 1] = min(max((green + green_step * step) * z, green_low), green_high) / far
                response[v, u, 2] = min(max((blue + blue_step * step) * z, blue_low), blue_high) / far


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
    shares = np.empty(distance.shape[1], np.float32)
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
        for i in range(np.uint64(end - begin)):
            place, share = np.uint64(begin) + i, shares[i]
            radiance[v, place, 0], radiance[v, place, 1], radiance[v, place, 2] = (
                red * share,
                green * share,
                blue * share,
            )
        for u in range(np.uint64(begin), np.uint64(end)):
            distance[v, u] = far
        for u in range(np.uint64(begin), np.uint64(end)):
            instance[v, u] = 0
        if lamplight:
            for u in range(np.uint64(begin), np.uint64(end)):
                response[v, u, 0], response[v, u, 1], response[v, u, 2] = nothing, nothing, nothing
