"""Radiance of asphalt with its wheel tracks and painted lines."""

import math

import numpy as np

from fogsim.core.jit import kernel
from fogsim.render.projection import Lens
from fogsim.render.shading import layout
from fogsim.render.shading.ground_spans import next_coplanar_spans
from fogsim.render.shading.layout import ONE, THREE, TWO, Array, Picture, Spans, Wide, first_of
from fogsim.render.shading.lines import LINE_WIDTH, columns_near, dashed_share
from fogsim.render.shading.pavement import Asphalt, mean_of_stretches, reflectance_at
from fogsim.render.shading.texture import ASPHALT, Noise, Row, set_texture
from fogsim.render.vectors import Vector

_DEPTH, _ALONG, _ACROSS, _WHITE = layout.DEPTH, layout.ALONG, layout.ACROSS, layout.WHITE
_HALF_WIDTH, _LINES, _COLOUR, _ROAD = layout.HALF_WIDTH, layout.LINES, layout.COLOUR, layout.ROAD
_START = layout.START

LINE_REFLECTANCE = 0.6
"""Reflectance of painted lines."""

_TRACK, _TRACK_WIDTH = 0.85, 0.28  # wheel tracks next to a lane's middle [m]
_PIECE = 64  # pixels of a row over which the reflectance by angle, and that along the road, are linear

_ROAD_RESPONSE = 0.0125
"""Coefficient of retroreflected luminance of dry asphalt [cd/m² per lx] (middle of gallen2014's range)."""

_LINE_RESPONSE = 0.15
"""That of its painted lines; dry ones have 0.1 … 0.3."""


@kernel
def shade_road(
    spans: Spans, count: int, lens: Lens, noise: Noise, asphalt: Asphalt, work: Row, picture: Picture
) -> None:
    """Shade the spans of road, and set their distances and instance ids."""
    span, surface, member = spans.span, spans.surface, work.member
    members, number = next_coplanar_spans(_ROAD, spans, 0, count, lens.lens, work, picture)
    while members > 0:
        k, row = span[member[0], 3], float(span[member[0], 0])
        begin, end = span[member[0], 1], span[member[members - 1], 2]
        plane = surface[k, _DEPTH], surface[k, _DEPTH + 1], surface[k, _DEPTH + 2]
        set_texture(ASPHALT, plane, row, begin, end, lens, noise, work)
        _set_share(plane, row, begin, end, lens.lens, asphalt, work)
        _pave(members, spans, asphalt, work, picture)
        _paint(members, spans, work, picture)
        members, number = next_coplanar_spans(_ROAD, spans, number, count, lens.lens, work, picture)


@kernel
def _set_share(plane: Vector, row: float, begin: int, end: int, lens: Wide, asphalt: Asphalt, work: Row) -> None:
    """Set, in place of tint, the reflectance over that of dry asphalt seen from above, by the angle of each pixel."""
    (slope, drop, rest), share = plane, work.tint
    focal, u0, v0 = lens[0], lens[1], lens[2]
    # 1/z over x, y and 1 of a ray, which is as long as 1 over the eye's distance from the plane.
    a, b, c = slope * focal, drop * focal, slope * u0 + drop * v0 + rest
    height, y = 1.0 / math.sqrt(a * a + b * b + c * c), (row - v0) / focal
    node = begin // _PIECE * _PIECE
    here = _reflectance_along(asphalt.by_sine, a, b * y + c, (node - u0) / focal, y, height)
    while node < end:
        there = _reflectance_along(asphalt.by_sine, a, b * y + c, (node + _PIECE - u0) / focal, y, height)
        level, change = np.float32(here), np.float32((there - here) / _PIECE)
        for u in range(np.uint64(max(begin, node)), np.uint64(min(node + _PIECE, end))):
            share[u] = level + change * np.float32(np.int32(u) - np.int32(node))
        here, node = there, node + _PIECE


@kernel
def _reflectance_along(by_sine: Wide, a: float, rest: float, x: float, y: float, height: float) -> float:
    """Reflectance where a ray (x, y, 1) meets the plane on which 1/z is a x and a rest."""
    return reflectance_at(by_sine, height * (a * x + rest) / math.sqrt(1.0 + x * x + y * y))


@kernel
def _pave(members: int, spans: Spans, asphalt: Asphalt, work: Row, picture: Picture) -> None:
    """Asphalt of the members of a row of spans, darker where wheels roll."""
    span, surface, depth, texture, member = spans.span, spans.surface, work.depth, work.texture, work.member
    share, radiance, response = work.tint, picture.radiance, picture.response
    one, track, columns = np.float32(1.0), np.float32(_TRACK), np.uint64(picture.distance.shape[1])
    for place in range(members):
        number = member[place]
        k, v, row = span[number, 3], np.uint64(span[number, 0]), float(span[number, 0])
        begin, size = np.uint64(span[number, 1]), np.uint64(span[number, 2] - span[number, 1])
        zx, zy = surface[k, _DEPTH], surface[k, _DEPTH + 1]
        tx, ty = surface[k, _ACROSS], surface[k, _ACROSS + 1]
        base = tx * span[number, 1] + ty * row + surface[k, _ACROSS + 2]
        middle = size // np.uint64(2)
        z = np.float64(depth[begin + middle])
        across = (base + tx * float(middle)) * z
        spread = abs(z * (tx - across * zx)) + abs(z * (ty - across * zy))
        width = np.float32(1.0 / (_TRACK_WIDTH + 0.5 * spread))
        darker = np.float32(asphalt.tracks * _TRACK_WIDTH) * width
        rest, slope, white = np.float32(base), np.float32(tx), surface[k, _WHITE]
        red, green, blue = surface[k, _COLOUR], surface[k, _COLOUR + 1], surface[k, _COLOUR + 2]
        r, g, b = np.float32(red * white), np.float32(green * white), np.float32(blue * white)
        for i in range(size):
            column = begin + i
            off = (abs((rest + slope * np.float32(np.int32(i))) * depth[column]) - track) * width
            off = one + off * off
            texture[column] -= darker / (off * off)
        if asphalt.repairs > 0.0:
            _mend(surface, k, row, int(span[number, 1]), int(span[number, 2]), asphalt, share)
        # A loop of its own, since each alone spans in vector registers.
        line = first_of(v, np.uint64(0), columns)
        for u in range(begin, np.uint64(span[number, 2])):
            seen, at = texture[u] * share[u], line + THREE * u
            radiance[at], radiance[at + ONE], radiance[at + TWO] = r * seen, g * seen, b * seen
        if len(response) > 0:
            per_mean = 3.0 * _ROAD_RESPONSE / max(red + green + blue, 3e-6)
            r, g, b = np.float32(red * per_mean), np.float32(green * per_mean), np.float32(blue * per_mean)
            for u in range(begin, np.uint64(span[number, 2])):
                seen, at = texture[u], line + THREE * u
                response[at], response[at + ONE], response[at + TWO] = r * seen, g * seen, b * seen


@kernel
def _mend(surface: Wide, k: int, row: float, begin: int, end: int, asphalt: Asphalt, share: Array) -> None:
    """Let a span's reflectance be that of older and newer asphalt along the road."""
    zx, zy = surface[k, _DEPTH], surface[k, _DEPTH + 1]
    sx, sy = surface[k, _ALONG], surface[k, _ALONG + 1]
    rest, base = zy * row + surface[k, _DEPTH + 2], sy * row + surface[k, _ALONG + 2]
    here, first = np.float32(1.0), begin
    # From one node to the next; the first one only begins.
    for node in range(begin // _PIECE * _PIECE, end + _PIECE, _PIECE):
        z = 1.0 / max(zx * node + rest, 1e-9)
        along = (sx * node + base) * z
        extent = z * max(abs(sx - along * zx), abs(sy - along * zy))
        mean = mean_of_stretches(asphalt.stretches, surface[k, _START] + along, extent)
        there = np.float32(max(1.0 + asphalt.repairs * mean, 0.2))
        change = (there - here) / np.float32(_PIECE)
        for u in range(np.uint64(first), np.uint64(min(max(node, first), end))):
            share[u] *= there - change * np.float32(np.int32(node) - np.int32(u))
        here, first = there, max(node, first)


@kernel
def _paint(members: int, spans: Spans, work: Row, picture: Picture) -> None:
    """Lines on the members of a row of spans, where they come near one."""
    span, surface, depth, texture, member = spans.span, spans.surface, work.depth, work.texture, work.member
    radiance, response, one = picture.radiance, picture.response, np.float32(1.0)
    lamplight, paint_response = len(response) > 0, np.float32(_LINE_RESPONSE)
    columns = np.uint64(picture.distance.shape[1])
    for place in range(members):
        number = member[place]
        k, v, row = span[number, 3], np.uint64(span[number, 0]), float(span[number, 0])
        codes, half_lane = int(surface[k, _LINES]), surface[k, _HALF_WIDTH]
        if codes == 0:
            continue
        begin, size = span[number, 1], span[number, 2] - span[number, 1]
        zx, zy = surface[k, _DEPTH], surface[k, _DEPTH + 1]
        sx, sy = surface[k, _ALONG], surface[k, _ALONG + 1]
        tx, ty = surface[k, _ACROSS], surface[k, _ACROSS + 1]
        s_base = sx * begin + sy * row + surface[k, _ALONG + 2]
        t_base = tx * begin + ty * row + surface[k, _ACROSS + 2]
        base = zx * begin + zy * row + surface[k, _DEPTH + 2]
        paint = np.float32(surface[k, _WHITE] * LINE_REFLECTANCE)
        for edge in range(2):
            code, line = (codes // 3, half_lane) if edge == 0 else (codes % 3, -half_lane)
            if code == 0:
                continue
            # All over z: how far the line is, and the extents across it of the line itself and of a pixel's footprint.
            away, change = t_base - line * base, tx - line * zx
            footprint = max(abs(change) + abs(ty - line * zy), 1e-9)
            per_footprint = 1.0 / footprint
            first, after = columns_near(
                away, change, 0.5 * (LINE_WIDTH * max(base, base + zx * size) + footprint), size
            )
            for i in range(np.uint64(first), np.uint64(after)):
                u, step = np.uint64(begin) + i, float(i)
                width = LINE_WIDTH * (base + zx * step)
                covered = 0.5 * (width + footprint) - abs(away + change * step)
                share = min(max(covered, 0.0), width, footprint) * per_footprint
                if code == 2:
                    far = np.float64(depth[u])
                    s = (s_base + sx * step) * far
                    share *= dashed_share(s, far * (abs(sx - s * zx) + abs(sy - s * zy)))
                # Paint is worn where the asphalt below is coarse.
                worn, part = one + np.float32(0.5) * (texture[u] - one), np.float32(share)
                pixel = first_of(v, u, columns)
                for at in range(pixel, pixel + THREE):
                    asphalt = radiance[at]
                    radiance[at] = asphalt + part * (paint * worn - asphalt)
                    if lamplight:
                        asphalt = response[at]
                        response[at] = asphalt + part * (paint_response * worn - asphalt)
