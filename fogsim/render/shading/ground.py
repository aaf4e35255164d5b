"""Radiance of asphalt with its painted lines, and of grassland."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel
from fogsim.render.lens import Lens
from fogsim.render.shading import layout
from fogsim.render.shading.layout import Array, Picture, Runs
from fogsim.render.shading.lines import columns_between, line_share, reach_of
from fogsim.render.shading.noise import GRAIN, PER_CELL, SMOOTH, Noise

KIND, INSTANCE, LEAST, MOST, DEPTH = layout.KIND, layout.INSTANCE, layout.LEAST, layout.MOST, layout.DEPTH
ALONG, ACROSS, WHITE = layout.ALONG, layout.ACROSS, layout.WHITE
HALF_WIDTH, LINES, COLOUR = layout.HALF_WIDTH, layout.LINES, layout.COLOUR
ROAD, TERRAIN = layout.ROAD, layout.TERRAIN

_CHUNK, _PIECE = 128, 32  # pixels of a row that share a footprint, and over which large patches are linear
_LINE_REFLECTANCE = 0.6

ROAD_RESPONSE = 0.0125
"""Coefficient of retroreflected luminance of dry asphalt [cd/m² per lx] (middle of gallen2014's range)."""

LINE_RESPONSE = 0.15
"""That of its painted lines; dry ones have 0.1 … 0.3."""

# Sides of the squares of noise [m] and deviations of reflectance: grain, mottling, patches and large patches.
_ASPHALT_SIDES, _ASPHALT = (0.01, 0.25, 3.0, 12.0), (0.12, 0.025, 0.012, 0.02)
_GRASS_SIDES, _GRASS = (0.08, 0.7, 5.0, 31.0), (0.10, 0.06, 0.06, 0.03)
_FAR = float(1 << 20)  # a multiple of the sides of tiles, so that places are not negative
_DRY = (1.5, 0.4, -0.3)  # how much more of each channel the large patches of dry grass change
_FAINTEST = 0.002  # deviation below which grain is left out


class Bench(NamedTuple):
    """Memory for one chunk: depths, texture, and places on the ground.

    Attributes
    ----------
    depth, texture, tint : (_CHUNK,) float32
        Depths [m], factors of reflectance, and the share of them that the largest patches have.
    place : (_CHUNK,) uint32
        Places in a tile of noise.
    """

    depth: Array
    texture: Array
    tint: Array
    place: NDArray[np.uint32]


def bench() -> Bench:
    """Make memory for one chunk."""
    depth, texture, tint = np.empty((3, _CHUNK), np.float32)
    return Bench(depth, texture, tint, np.empty(_CHUNK, np.uint32))


@kernel
def _faded(deviation: float, side: float, wide: float, long: float) -> float:
    """Deviation that is left of independent squares' once averaged over a footprint [m]."""
    return deviation / math.sqrt(max(wide / side, 1.0) * max(long / side, 1.0))


@kernel
def _doubled(side: float, narrow: float) -> float:
    """Side doubled until it is about the narrow side of a footprint or more."""
    while side * math.sqrt(2.0) < narrow:
        side *= 2.0
    return side


@kernel
def _smooth_at(tile: Array, x: float, y: float, side: float) -> float:
    """Smooth noise with cells of a side [m], between its numbers too."""
    x, y = x * (PER_CELL / side), y * (PER_CELL / side)
    left, top = math.floor(x), math.floor(y)
    a, b, mask = x - left, y - top, SMOOTH - 1
    i, j = int(left) & mask, int(top) & mask
    k, m = (i + 1) & mask, (j + 1) & mask
    upper = tile[j * SMOOTH + i] * (1.0 - a) + tile[j * SMOOTH + k] * a
    lower = tile[m * SMOOTH + i] * (1.0 - a) + tile[m * SMOOTH + k] * a
    return float(upper * (1.0 - b) + lower * b)


@kernel
def _scale(side: float, count: int, narrow: float, x: float, y: float) -> tuple[float, float, float]:
    """Size of a number of a tile on the ground [m], and where on a tile of so many numbers the camera is."""
    scale = _doubled(side, narrow)
    period = scale * count
    return scale, (x - period * math.floor(x / period)) / scale, (y - period * math.floor(y / period)) / scale


@kernel
def shade_ground(  # noqa: C901, PLR0912, PLR0915 - one loop: handing arrays to functions costs more than a run's work
    runs: Runs, count: int, lens: Lens, noise: Noise, work: Bench, picture: Picture
) -> None:
    """Shade the runs of road and terrain, and set their distances and instance ids.

    Parameters
    ----------
    runs : Runs
        The runs and what is known of their surfaces.
    count : int
        Number of runs.
    lens : Lens
        Where the camera is.
    noise : Noise
        Texture.
    work : Bench
        Memory.
    picture : Picture
        Is filled where these runs are.
    """
    run, known, rays, eye = runs.run, runs.surface, lens.rays, lens.eye
    radiance, distance, instance, response = picture.radiance, picture.distance, picture.instance, picture.response
    depths, texture, tint, places, grain, smooth = (
        work.depth,
        work.texture,
        work.tint,
        work.place,
        noise.grain,
        noise.smooth,
    )
    lamplight, one = len(response) > 0, np.float32(1.0)
    focal, u0, v0 = lens.lens[0], lens.lens[1], lens.lens[2]
    per_focal = np.float32(1.0 / focal)
    last_kind, last_row, last_wide, last_long = -1.0, -1.0, 0.0, 0.0
    strength_1, strength_2, strength_3, strength_4 = 0.0, 0.0, 0.0, 0.0
    scale_1, x_1, y_1, scale_2, x_2, y_2 = 1.0, 0.0, 0.0, 1.0, 0.0, 0.0
    for number in range(count):
        k = run[number, 3]
        kind = known[k, KIND]
        if kind not in (ROAD, TERRAIN):
            continue
        v, end, row, name = (
            np.uint64(run[number, 0]),
            run[number, 2],
            float(run[number, 0]),
            np.int32(known[k, INSTANCE]),
        )
        sides, deviations = (_ASPHALT_SIDES, _ASPHALT) if kind == ROAD else (_GRASS_SIDES, _GRASS)
        zx, zy = known[k, DEPTH], known[k, DEPTH + 1]
        least, most, slope = np.float32(known[k, LEAST]), np.float32(known[k, MOST]), np.float32(zx)
        white = known[k, WHITE]
        patches, large = 0.0, 0.0
        begin = run[number, 1]
        while begin < end:
            # Chunks begin at the same columns whatever is seen, so that texture does not depend on where a run begins.
            chunk = begin // _CHUNK * _CHUNK
            size = min(end, chunk + _CHUNK) - begin
            length = np.uint64(size)
            base = zx * begin + zy * row + known[k, DEPTH + 2]
            # Distances.
            rest = np.float32(base)
            x, y = np.float32((begin - u0) / focal), np.float32((row - v0) / focal)
            square = one + y * y
            for i in range(length):
                step = np.float32(np.int32(i))
                across = x + per_focal * step
                z = one / min(max(rest + slope * step, least), most)
                depths[i] = z
                distance[v, np.uint64(begin) + i] = z * np.sqrt(square + across * across)
                instance[v, np.uint64(begin) + i] = name
            # The footprint of the pixel in the middle, from the derivatives of its place on the ground.
            half = chunk + 0.5 * _CHUNK - begin
            z = 1.0 / max(base + zx * half, 0.5 * base, 1e-9)
            rx = rays[0, 0] * (begin + half) + rays[0, 1] * row + rays[0, 2]
            ry = rays[1, 0] * (begin + half) + rays[1, 1] * row + rays[1, 2]
            ux, uy = z * (rays[0, 0] - rx * zx * z), z * (rays[1, 0] - ry * zx * z)
            vx, vy = z * (rays[0, 1] - rx * zy * z), z * (rays[1, 1] - ry * zy * z)
            wide, long = math.sqrt(ux * ux + uy * uy), math.sqrt(vx * vx + vy * vy)
            near = abs(wide - last_wide) <= 1e-4 * wide and abs(long - last_long) <= 1e-4 * long
            # What is kept from one row to the next would depend on where a band of rows begins.
            if kind != last_kind or row != last_row or not near:
                last_kind, last_row, last_wide, last_long = kind, row, wide, long
                strength_1 = _faded(deviations[0], sides[0], wide, long)
                strength_2 = _faded(deviations[1], sides[1], wide, long)
                strength_3 = _faded(deviations[2], sides[2], wide, long)
                strength_4 = _faded(deviations[3], sides[3], wide, long)
                # Squares are as large as the narrow side of a pixel, so that every pixel has its own.
                narrow = min(wide, long)
                scale_1, x_1, y_1 = _scale(0.5 * sides[0], GRAIN, narrow, eye[0], eye[1])
                scale_2, x_2, y_2 = _scale(sides[1] / PER_CELL, SMOOTH, narrow / PER_CELL, eye[0], eye[1])
            # Large patches, linear from one end of a piece to the other.
            px, py = eye[0] + rx * z - half * ux, eye[1] + ry * z - half * uy
            first = begin
            while first < begin + size:
                node = first // _PIECE * _PIECE
                last = min(node + _PIECE, begin + size)
                if first == begin:
                    ax, ay = px + (node - begin) * ux, py + (node - begin) * uy
                    patches, large = _smooth_at(smooth, ax, ay, sides[2]), _smooth_at(smooth, ax, ay, sides[3])
                ax, ay = px + (node + _PIECE - begin) * ux, py + (node + _PIECE - begin) * uy
                next_patches, next_large = _smooth_at(smooth, ax, ay, sides[2]), _smooth_at(smooth, ax, ay, sides[3])
                tint_change = strength_4 * (next_large - large) / _PIECE
                change = tint_change + strength_3 * (next_patches - patches) / _PIECE
                level = np.float32(1.0 + strength_3 * patches + strength_4 * large + change * (first - node))
                tint_level = np.float32(strength_4 * large + tint_change * (first - node))
                step_level, tint_step, start = np.float32(change), np.float32(tint_change), np.uint64(first - begin)
                patches, large = next_patches, next_large
                for i in range(np.uint64(last - first)):
                    step = np.float32(np.int32(i))
                    texture[start + i] = level + step_level * step
                    tint[start + i] = tint_level + tint_step * step
                first = last
            # Grain and mottling.
            gx, gy = np.float32(rays[0, 0] * begin + rays[0, 1] * row + rays[0, 2]), np.float32(rays[0, 0])
            hx, hy = np.float32(rays[1, 0] * begin + rays[1, 1] * row + rays[1, 2]), np.float32(rays[1, 0])
            if strength_1 > _FAINTEST:
                ox, oy = np.float32(x_1 + _FAR), np.float32(y_1 + _FAR)
                per_scale, amount = np.float32(1.0 / scale_1), np.float32(strength_1)
                for i in range(length):
                    step = np.float32(np.int32(i))
                    z32 = depths[i] * per_scale
                    a = np.int32(ox + (gx + gy * step) * z32) & (GRAIN - 1)
                    b = np.int32(oy + (hx + hy * step) * z32) & (GRAIN - 1)
                    places[i] = np.uint32(b * GRAIN + a)
                for i in range(length):
                    texture[i] += amount * grain[places[i]]
            if strength_2 > _FAINTEST:
                ox, oy = np.float32(x_2 + _FAR), np.float32(y_2 + _FAR)
                per_scale, amount = np.float32(1.0 / scale_2), np.float32(strength_2)
                for i in range(length):
                    step = np.float32(np.int32(i))
                    z32 = depths[i] * per_scale
                    a = np.int32(ox + (gx + gy * step) * z32) & (SMOOTH - 1)
                    b = np.int32(oy + (hx + hy * step) * z32) & (SMOOTH - 1)
                    places[i] = np.uint32(b * SMOOTH + a)
                for i in range(length):
                    texture[i] += amount * smooth[places[i]]
            if kind == TERRAIN:
                red, green, blue = known[k, COLOUR], known[k, COLOUR + 1], known[k, COLOUR + 2]
                red, green, blue = np.float32(red * white), np.float32(green * white), np.float32(blue * white)
                dry, drier, driest = np.float32(_DRY[0]), np.float32(_DRY[1]), np.float32(_DRY[2])
                for i in range(length):
                    u = np.uint64(begin) + i
                    radiance[v, u, 0] = red * (texture[i] + dry * tint[i])
                    radiance[v, u, 1] = green * (texture[i] + drier * tint[i])
                    radiance[v, u, 2] = blue * (texture[i] + driest * tint[i])
                if lamplight:
                    # Seen and lit under the same angle to the ground.
                    rz = rays[2, 0] * (begin + half) + rays[2, 1] * row + rays[2, 2]
                    sine = -rz / math.sqrt(rx * rx + ry * ry + rz * rz)
                    answer = np.float32(sine / math.pi / max(white, 1e-30))
                    if white == 0.0:
                        red, green, blue = known[k, COLOUR], known[k, COLOUR + 1], known[k, COLOUR + 2]
                        answer = np.float32(sine / math.pi)
                    for i in range(length):
                        u = np.uint64(begin) + i
                        response[v, u, 0] = answer * np.float32(red) * texture[i]
                        response[v, u, 1] = answer * np.float32(green) * texture[i]
                        response[v, u, 2] = answer * np.float32(blue) * texture[i]
                begin += size
                continue
            # Wheel tracks, and the place and extents of pixels on the lane.
            sx, sy = known[k, ALONG], known[k, ALONG + 1]
            tx, ty = known[k, ACROSS], known[k, ACROSS + 1]
            s_base = sx * begin + sy * row + known[k, ALONG + 2]
            t_base = tx * begin + ty * row + known[k, ACROSS + 2]
            t_middle = (t_base + tx * half) * z
            spread = abs(z * (tx - t_middle * zx)) + abs(z * (ty - t_middle * zy))
            width = np.float32(1.0 / (0.28 + 0.5 * spread))
            depth_of_track = np.float32(0.035 * 0.28) * width
            t_rest, t_slope, track = np.float32(t_base), np.float32(tx), np.float32(0.85)
            for i in range(length):
                left = (t_rest + t_slope * np.float32(np.int32(i))) * depths[i]
                off = (abs(left) - track) * width
                off = one + off * off
                texture[i] -= depth_of_track / (off * off)
            red, green, blue = known[k, COLOUR], known[k, COLOUR + 1], known[k, COLOUR + 2]
            mean = (red + green + blue) / 3.0
            r32, g32, b32 = np.float32(red * white), np.float32(green * white), np.float32(blue * white)
            for i in range(length):
                u = np.uint64(begin) + i
                radiance[v, u, 0], radiance[v, u, 1] = r32 * texture[i], g32 * texture[i]
                radiance[v, u, 2] = b32 * texture[i]
            if lamplight:
                per_mean = ROAD_RESPONSE / max(mean, 1e-6)
                r32, g32, b32 = np.float32(red * per_mean), np.float32(green * per_mean), np.float32(blue * per_mean)
                for i in range(length):
                    u = np.uint64(begin) + i
                    response[v, u, 0], response[v, u, 1] = r32 * texture[i], g32 * texture[i]
                    response[v, u, 2] = b32 * texture[i]
            # Lines, where the chunk comes near one.
            codes, half_lane = int(known[k, LINES]), known[k, HALF_WIDTH]
            deepest = np.float64(max(depths[0], depths[length - np.uint64(1)]))
            for edge in range(2):
                code, line = (codes // 3, half_lane) if edge == 0 else (codes % 3, -half_lane)
                if code == 0:
                    continue
                reach = reach_of(deepest * (abs(tx - line * zx) + abs(ty - line * zy)), deepest * (abs(zx) + abs(zy)))
                painted, after = columns_between(t_base, tx, base, zx, line - reach, line + reach, size)
                paint, paint_response = np.float32(white * _LINE_REFLECTANCE), np.float32(LINE_RESPONSE)
                for i in range(np.uint64(painted), np.uint64(after)):
                    u, place, far = np.uint64(begin) + i, float(i), np.float64(depths[i])
                    t, s = (t_base + tx * place) * far, (s_base + sx * place) * far
                    across_px = max(abs(far * (tx - t * zx)) + abs(far * (ty - t * zy)), 1e-4)
                    along_px = max(abs(far * (sx - s * zx)) + abs(far * (sy - s * zy)), 1e-4)
                    share = np.float32(line_share(code, line, s, t, along_px, across_px))
                    if share > 0.0:
                        # Paint is worn where the asphalt below is coarse.
                        worn = one + np.float32(0.5) * (texture[i] - one)
                        for channel in range(np.uint64(3)):
                            asphalt = radiance[v, u, channel]
                            radiance[v, u, channel] = asphalt + share * (paint * worn - asphalt)
                            if lamplight:
                                asphalt = response[v, u, channel]
                                response[v, u, channel] = asphalt + share * (paint_response * worn - asphalt)
            begin += size
