"""Radiance of what has no texture."""

import numpy as np

from fogsim.jit import kernel
from fogsim.render.shading import layout
from fogsim.render.shading.layout import Light, Picture, Runs, Wide

KIND, INSTANCE, LEAST, MOST, DEPTH = layout.KIND, layout.INSTANCE, layout.LEAST, layout.MOST, layout.DEPTH
LIGHT, RESPONSE, LOW, HIGH = layout.LIGHT, layout.RESPONSE, layout.LOW, layout.HIGH
RESPONSE_LOW, RESPONSE_HIGH = layout.RESPONSE_LOW, layout.RESPONSE_HIGH
OBJECT, PLAIN = layout.OBJECT, layout.PLAIN


@kernel
def shade_objects(  # noqa: C901 - one loop: handing arrays to functions costs more than a run's work
    runs: Runs, count: int, lens: Wide, picture: Picture
) -> None:
    """Shade the runs of triangles without texture, and set their distances and instance ids.

    Parameters
    ----------
    runs : Runs
        The runs and what is known of their surfaces.
    count : int
        Number of runs.
    lens : (3,) float64
        See `Lens`.
    picture : Picture
        Is filled where these runs are.
    """
    run, known = runs.run, runs.surface
    radiance, distance, instance, response = picture.radiance, picture.distance, picture.instance, picture.response
    lamplight, depths = len(response) > 0, np.empty(distance.shape[1], np.float32)
    per_focal, one = np.float32(1.0 / lens[0]), np.float32(1.0)
    for number in range(count):
        k = run[number, 3]
        kind = known[k, KIND]
        if kind not in (OBJECT, PLAIN):
            continue
        v, begin, end = np.uint64(run[number, 0]), run[number, 1], run[number, 2]
        row, name = float(run[number, 0]), np.int32(known[k, INSTANCE])
        least, most = np.float32(known[k, LEAST]), np.float32(known[k, MOST])
        slope = np.float32(known[k, DEPTH])
        rest = np.float32(known[k, DEPTH] * begin + known[k, DEPTH + 1] * row + known[k, DEPTH + 2])
        x, y = np.float32((begin - lens[1]) / lens[0]), np.float32((row - lens[2]) / lens[0])
        square = one + y * y
        length = np.uint64(end - begin)
        for i in range(length):
            step = np.float32(np.int32(i))
            across, z = x + per_focal * step, one / min(max(rest + slope * step, least), most)
            depths[i] = z
            distance[v, np.uint64(begin) + i] = np.sqrt(square + across * across) * z
        for u in range(np.uint64(begin), np.uint64(end)):
            instance[v, u] = name
        if kind == PLAIN:
            red, green, blue = np.float32(known[k, LOW]), np.float32(known[k, LOW + 1]), np.float32(known[k, LOW + 2])
            for u in range(np.uint64(begin), np.uint64(end)):
                radiance[v, u, 0], radiance[v, u, 1], radiance[v, u, 2] = red, green, blue
            continue
        for channel in range(np.uint64(3)):
            c = int(channel)
            a = np.float32(known[k, LIGHT + 3 * c])
            b = known[k, LIGHT + 3 * c] * begin + known[k, LIGHT + 3 * c + 1] * row
            b = np.float32(b + known[k, LIGHT + 3 * c + 2])
            low, high = np.float32(known[k, LOW + c]), np.float32(known[k, HIGH + c])
            for i in range(length):
                value = (b + a * np.float32(np.int32(i))) * depths[i]
                radiance[v, np.uint64(begin) + i, channel] = min(max(value, low), high)
            if lamplight:
                a = np.float32(known[k, RESPONSE + 3 * c])
                b = known[k, RESPONSE + 3 * c] * begin + known[k, RESPONSE + 3 * c + 1] * row
                b = np.float32(b + known[k, RESPONSE + 3 * c + 2])
                low, high = np.float32(known[k, RESPONSE_LOW + c]), np.float32(known[k, RESPONSE_HIGH + c])
                for i in range(length):
                    answer = min(max((b + a * np.float32(np.int32(i))) * depths[i], low), high)
                    response[v, np.uint64(begin) + i, channel] = answer / distance[v, np.uint64(begin) + i]


@kernel
def shade_sky(runs: Runs, count: int, rays: Wide, light: Light, picture: Picture) -> None:
    """Shade the runs of sky: the CIE standard overcast sky, L(θ) = L_z (1 + 2 sin θ) / 3."""
    run = runs.run
    radiance, distance, instance, response = picture.radiance, picture.distance, picture.instance, picture.response
    shares = np.empty(distance.shape[1], np.float32)
    lamplight, nothing, far = len(response) > 0, np.float32(0.0), np.float32(np.inf)
    red, green, blue = np.float32(light.zenith[0]), np.float32(light.zenith[1]), np.float32(light.zenith[2])
    third, two_thirds = np.float32(1.0 / 3.0), np.float32(2.0 / 3.0)
    dx, dy, dz = np.float32(rays[0, 0]), np.float32(rays[1, 0]), np.float32(rays[2, 0])
    for number in range(count):
        if run[number, 3] != 0:
            continue
        v, begin, end = np.uint64(run[number, 0]), run[number, 1], run[number, 2]
        row = float(run[number, 0])
        x = np.float32(rays[0, 0] * begin + rays[0, 1] * row + rays[0, 2])
        y = np.float32(rays[1, 0] * begin + rays[1, 1] * row + rays[1, 2])
        z = np.float32(rays[2, 0] * begin + rays[2, 1] * row + rays[2, 2])
        # Loops apart, since each alone runs in vector registers.
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
