"""Radiance of grassland."""

import math

import numpy as np

from fogsim.core.jit import kernel
from fogsim.render.lens import Lens
from fogsim.render.shading import layout
from fogsim.render.shading.ground_spans import next_coplanar_spans
from fogsim.render.shading.layout import Picture, Spans
from fogsim.render.shading.noise import Noise
from fogsim.render.shading.texture import GRASS, Row, set_texture

DEPTH, WHITE, COLOUR, TERRAIN = layout.DEPTH, layout.WHITE, layout.COLOUR, layout.TERRAIN
_DRY = (1.5, 0.4, -0.3)  # how much more of each channel the large patches of dry grass change


@kernel
def shade_terrain(spans: Spans, count: int, lens: Lens, noise: Noise, work: Row, picture: Picture) -> None:
    """Shade the spans of terrain, and set their distances and instance ids."""
    span, surface, rays, member = spans.span, spans.surface, lens.rays, work.member
    texture, tint, radiance, response = work.texture, work.tint, picture.radiance, picture.response
    dry, drier, driest = np.float32(_DRY[0]), np.float32(_DRY[1]), np.float32(_DRY[2])
    members, number = next_coplanar_spans(TERRAIN, spans, 0, count, lens.lens, work, picture)
    while members > 0:
        k, row = span[member[0], 3], float(span[member[0], 0])
        begin, end = span[member[0], 1], span[member[members - 1], 2]
        plane = surface[k, DEPTH], surface[k, DEPTH + 1], surface[k, DEPTH + 2]
        set_texture(GRASS, plane, row, begin, end, lens, noise, work)
        v, white = np.uint64(span[member[0], 0]), surface[k, WHITE]
        red, green, blue = surface[k, COLOUR], surface[k, COLOUR + 1], surface[k, COLOUR + 2]
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
            for u in range(left, right):
                radiance[v, u, 0] = r * (texture[u] + dry * tint[u])
                radiance[v, u, 1] = g * (texture[u] + drier * tint[u])
                radiance[v, u, 2] = b * (texture[u] + driest * tint[u])
            if len(response) > 0:
                for u in range(left, right):
                    response[v, u, 0], response[v, u, 1] = red * texture[u], green * texture[u]
                    response[v, u, 2] = blue * texture[u]
        members, number = next_coplanar_spans(TERRAIN, spans, number, count, lens.lens, work, picture)
