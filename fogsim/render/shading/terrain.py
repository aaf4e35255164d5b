"""Radiance of grassland."""

import math

import numpy as np

from fogsim.jit import kernel
from fogsim.render.lens import Lens
from fogsim.render.shading import layout
from fogsim.render.shading.ground_spans import next_stretch
from fogsim.render.shading.layout import Picture, Runs
from fogsim.render.shading.noise import Noise
from fogsim.render.shading.texture import GRASS, Row, weave

DEPTH, WHITE, COLOUR, TERRAIN = layout.DEPTH, layout.WHITE, layout.COLOUR, layout.TERRAIN
_DRY = (1.5, 0.4, -0.3)  # how much more of each channel the large patches of dry grass change


@kernel
def shade_terrain(runs: Runs, count: int, lens: Lens, noise: Noise, work: Row, picture: Picture) -> None:
    """Shade the runs of terrain, and set their distances and instance ids (parameters as for `shade_road`)."""
    run, known, rays, member = runs.run, runs.surface, lens.rays, work.member
    texture, tint, radiance, response = work.texture, work.tint, picture.radiance, picture.response
    dry, drier, driest = np.float32(_DRY[0]), np.float32(_DRY[1]), np.float32(_DRY[2])
    members, number = next_stretch(TERRAIN, runs, 0, count, lens.lens, work, picture)
    while members > 0:
        k, row = run[member[0], 3], float(run[member[0], 0])
        begin, end = run[member[0], 1], run[member[members - 1], 2]
        weave(GRASS, known[k, DEPTH], known[k, DEPTH + 1], known[k, DEPTH + 2], row, begin, end, lens, noise, work)
        v, white = np.uint64(run[member[0], 0]), known[k, WHITE]
        red, green, blue = known[k, COLOUR], known[k, COLOUR + 1], known[k, COLOUR + 2]
        r, g, b = np.float32(red * white), np.float32(green * white), np.float32(blue * white)
        # Seen and lit under the same angle to the ground.
        middle = 0.5 * (begin + end)
        rx = rays[0, 0] * middle + rays[0, 1] * row + rays[0, 2]
        ry = rays[1, 0] * middle + rays[1, 1] * row + rays[1, 2]
        rz = rays[2, 0] * middle + rays[2, 1] * row + rays[2, 2]
        answer = -rz / (math.pi * math.sqrt(rx * rx + ry * ry + rz * rz))
        red, green, blue = np.float32(answer * red), np.float32(answer * green), np.float32(answer * blue)
        for place in range(members):
            left, right = np.uint64(run[member[place], 1]), np.uint64(run[member[place], 2])
            for u in range(left, right):
                radiance[v, u, 0] = r * (texture[u] + dry * tint[u])
                radiance[v, u, 1] = g * (texture[u] + drier * tint[u])
                radiance[v, u, 2] = b * (texture[u] + driest * tint[u])
            if len(response) > 0:
                for u in range(left, right):
                    response[v, u, 0], response[v, u, 1] = red * texture[u], green * texture[u]
                    response[v, u, 2] = blue * texture[u]
        members, number = next_stretch(TERRAIN, runs, number, count, lens.lens, work, picture)
