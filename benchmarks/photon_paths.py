"""Paths of photons through fog: kernels that count where they go, for `monte_carlo.py`."""

import math

import numpy as np
from numba import njit

STEP = math.radians(0.02)
"""Between two angles of a table of scattering [rad]."""

LAMP_SIZES = (0.06, 0.3)
SMOOTHING = math.radians(1.5)


def likely_cosines(phase):
    """Cosines of equally likely scattering angles."""
    angle = np.arange(len(phase)) * STEP
    density = phase * np.sin(angle)
    share = np.concatenate(([0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))))
    return np.cos(np.interp((np.arange(200_000) + 0.5) / 200_000, share / share[-1], angle))


def without_peak(phase):
    """Phase function whose forward peak is flat within `SMOOTHING`, with the same light in it."""
    angle = np.arange(len(phase)) * STEP
    inside = angle < SMOOTHING
    weight = np.sin(angle[inside])
    smooth = phase.copy()
    smooth[inside] = np.sum(phase[inside] * weight) / np.sum(weight)
    return smooth


@njit(cache=False)
def turned(x, y, z, cosine, azimuth):
    """A direction turned by an angle, at an azimuth about itself."""
    sine = math.sqrt(max(0.0, 1.0 - cosine * cosine))
    a, b = sine * math.cos(azimuth), sine * math.sin(azimuth)
    flat = math.hypot(x, y)
    if flat < 1e-9:
        return a, b, math.copysign(1.0, z) * cosine
    return cosine * x + (a * x * z - b * y) / flat, cosine * y + (a * y * z + b * x) / flat, cosine * z - a * flat


@njit(cache=False)
def count_crossings(along, square, length, once, depths, edges, total, single):
    """Count a flight where it crosses spheres; `along` is the place projected on it, `square` its squared radius."""
    for j in range(len(depths)):
        inside = along * along - square + depths[j] ** 2
        if inside <= 0:
            continue
        for sign in (-1.0, 1.0):
            t = -along + sign * math.sqrt(inside)
            if 0 < t <= length:
                cosine = (along + t) / depths[j]
                b = np.searchsorted(edges, math.acos(min(1.0, max(-1.0, cosine)))) - 1
                if b >= 0:
                    # Light that crosses at a slant passes less of the sphere's area.
                    total[j, b] += 1.0 / max(abs(cosine), 0.02)
                    if once:
                        single[j, b] += 1.0 / max(abs(cosine), 0.02)


@njit(cache=False)
def halo(photons, rng, cosines, depths, edges, end):
    """Radiance scattered (at all, and once) about an isotropic point source in endless fog, times R² / I.

    Photons leave the source; each crossing of a sphere counts in the bin of its angle to the radius.
    """
    total = np.zeros((len(depths), len(edges) - 1))
    single = np.zeros_like(total)
    for _ in range(photons):
        x = y = z = 0.0
        dz, azimuth = 2.0 * rng.random() - 1.0, 2 * math.pi * rng.random()
        flat = math.sqrt(1.0 - dz * dz)
        dx, dy = flat * math.cos(azimuth), flat * math.sin(azimuth)
        order = 0
        while x * x + y * y + z * z < end * end:
            length = -math.log(1.0 - rng.random())
            if order > 0:
                along, square = x * dx + y * dy + z * dz, x * x + y * y + z * z
                count_crossings(along, square, length, order == 1, depths, edges, total, single)
            x, y, z = x + length * dx, y + length * dy, z + length * dz
            cosine = cosines[int(rng.random() * len(cosines))]
            dx, dy, dz = turned(dx, dy, dz, cosine, 2 * math.pi * rng.random())
            order += 1
    for b in range(len(edges) - 1):
        solid = 2 * math.pi * (math.cos(edges[b]) - math.cos(edges[b + 1]))
        total[:, b] /= solid * photons
        single[:, b] /= solid * photons
    return total, single


@njit(cache=False)
def shone(table, step, azimuth, elevation, aside, across, up, out):
    """Intensities that a lamp shines in directions about that to the eye: its share along it, to its right and up."""
    cosine, sine = math.cos(elevation), math.sin(elevation)
    for n in range(len(out)):
        # The direction is turned about the way to the eye, to where the line of sight passes the lamp.
        turn = across * math.cos(out[n]) - up * math.sin(out[n])
        rise = across * math.sin(out[n]) + up * math.cos(out[n])
        level, z = aside * cosine - rise * sine, aside * sine + rise * cosine
        right = math.atan2(turn, level) + azimuth
        right = (right + math.pi) % (2.0 * math.pi)
        row = int((math.asin(min(1.0, max(-1.0, z))) + 0.5 * math.pi) / step + 0.5)
        out[n] = table[row, int(right / step + 0.5)]


@njit(cache=False)
def left_at(nx, ny, nz, dx, dy, dz, sx, sy, sz):
    """How light left a lamp that now arrives at an eye: along the way to the eye, toward the line of sight, and aside.

    Directions: the eye as the lamp sees it, the flight that ends in the eye, and that with which the light left.
    """
    along = nx * dx + ny * dy + nz * dz
    # Across the way to the eye, where the line of sight passes the lamp: against the flight.
    qx, qy, qz = along * nx - dx, along * ny - dy, along * nz - dz
    sine = math.sqrt(qx * qx + qy * qy + qz * qz)
    qx, qy, qz = qx / sine, qy / sine, qz / sine
    px, py, pz = ny * qz - nz * qy, nz * qx - nx * qz, nx * qy - ny * qx
    return sx * nx + sy * ny + sz * nz, sx * qx + sy * qy + sz * qz, sx * px + sy * py + sz * pz


@njit(cache=False)
def origins(photons, rng, cosines, depths, angles, emitted, turns, end):
    """How the scattered light that an eye sees about a lamp had left the lamp: weights, not normalized.

    By depth, angle of the line of sight off the lamp, angle between the direction in which the light left and the way
    to the eye, and the turn of the former about the latter from the side on which the line of sight passes, 0 ... pi.
    """
    out = np.zeros((len(depths), len(angles) - 1, len(emitted) - 1, len(turns) - 1))
    for _ in range(photons):
        x = y = z = 0.0
        sz, azimuth = 2.0 * rng.random() - 1.0, 2 * math.pi * rng.random()
        flat = math.sqrt(1.0 - sz * sz)
        sx, sy = flat * math.cos(azimuth), flat * math.sin(azimuth)
        dx, dy, dz = sx, sy, sz
        order = 0
        while x * x + y * y + z * z < end * end:
            length = -math.log(1.0 - rng.random())
            along, square = x * dx + y * dy + z * dz, x * x + y * y + z * z
            for j in range(len(depths)):
                inside = along * along - square + depths[j] ** 2
                if order == 0 or inside <= 0:
                    continue
                for sign in (-1.0, 1.0):
                    t, r = -along + sign * math.sqrt(inside), depths[j]
                    if not 0 < t <= length:
                        continue
                    cosine = min(1.0, max(-1.0, (along + t) / r))
                    b = np.searchsorted(angles, math.acos(cosine)) - 1
                    if not 0 <= b < out.shape[1]:
                        continue
                    ahead, a, c = left_at((x + t * dx) / r, (y + t * dy) / r, (z + t * dz) / r, dx, dy, dz, sx, sy, sz)
                    k = np.searchsorted(emitted, math.acos(min(1.0, max(-1.0, ahead)))) - 1
                    m = np.searchsorted(turns, abs(math.atan2(c, a))) - 1
                    out[j, b, max(k, 0), max(m, 0)] += 1.0 / max(abs(cosine), 0.02)
            x, y, z = x + length * dx, y + length * dy, z + length * dz
            cosine = cosines[int(rng.random() * len(cosines))]
            dx, dy, dz = turned(dx, dy, dz, cosine, 2 * math.pi * rng.random())
            order += 1
    return out


@njit(cache=False)
def lobe_halo(photons, rng, cosines, depths, edges, end, step, tables, eyes, sides):
    """Radiance scattered about lamps that shine unevenly, times R² [cd], by depth, bin, lamp and side.

    Photons leave in all directions alike, and remember theirs: whoever sees one arrive knows where, as seen from the
    lamp, it left, and so what any lamp, turned to the eye anyhow, would have given it. Each counts with its mirror
    image too.
    """
    total = np.zeros((len(depths), len(edges), len(tables), len(sides)))
    places = np.empty(len(sides))
    for _ in range(photons):
        x = y = z = 0.0
        sz, azimuth = 2.0 * rng.random() - 1.0, 2 * math.pi * rng.random()
        flat = math.sqrt(1.0 - sz * sz)
        sx, sy = flat * math.cos(azimuth), flat * math.sin(azimuth)
        dx, dy, dz = sx, sy, sz
        order = 0
        while x * x + y * y + z * z < end * end:
            length = -math.log(1.0 - rng.random())
            along, square = x * dx + y * dy + z * dz, x * x + y * y + z * z
            for j in range(len(depths)):
                inside = along * along - square + depths[j] ** 2
                # Lines of sight within 90° of the lamp see light that leaves the sphere.
                t = -along + math.sqrt(max(inside, 0.0))
                if order == 0 or inside <= 0 or not 0 < t <= length:
                    continue
                cosine = (along + t) / depths[j]
                angle = math.acos(min(1.0, cosine))
                for b in range(len(edges)):
                    if not edges[b, 0] <= angle < edges[b, 1]:
                        continue
                    r = depths[j]
                    ahead, a, c = left_at((x + t * dx) / r, (y + t * dy) / r, (z + t * dz) / r, dx, dy, dz, sx, sy, sz)
                    for i in range(len(tables)):
                        for mirror in (-1.0, 1.0):
                            places[:] = sides
                            shone(tables[i], step, eyes[i, 0], eyes[i, 1], ahead, a, mirror * c, places)
                            total[j, b, i] += 0.5 * places / cosine
            x, y, z = x + length * dx, y + length * dy, z + length * dz
            cosine = cosines[int(rng.random() * len(cosines))]
            dx, dy, dz = turned(dx, dy, dz, cosine, 2 * math.pi * rng.random())
            order += 1
    for b in range(len(edges)):
        total[:, b] /= 2 * math.pi * (math.cos(edges[b, 0]) - math.cos(edges[b, 1])) * photons
    return total


@njit(cache=False)
def scattered_back(x, y, z, dx, dy, dz, k, phase, step, beam, lamps, lamp_size):
    """Light of the lamps that droplets at a place scatter back along a path [cd/m² per optical depth]."""
    total = 0.0
    for i in range(len(lamps)):
        lx, ly, lz = x - lamps[i, 0], y - lamps[i, 1], z - lamps[i, 2]
        if lx <= 0:
            continue
        square = lx * lx + ly * ly + lz * lz
        s = math.sqrt(square)
        h = (math.atan2(-ly, lx) / math.pi + 0.5) * (beam.shape[1] - 1)
        v = (math.asin(lz / s) / math.pi + 0.5) * (beam.shape[0] - 1)
        cosine = -(lx * dx + ly * dy + lz * dz) / s
        scattered = phase[int(math.acos(min(1.0, max(-1.0, cosine))) / step + 0.5)]
        total += scattered * beam[int(v), int(h)] / (square + lamp_size * lamp_size) * math.exp(-k * s)
    return total


@njit(cache=False)
def veil(paths, rng, k, towards, reach, phases, cosines, step, beam, lamps, ground, lamp_sizes):
    """Radiance of lit fog in one direction, of light scattered once and of all [cd/m²], with standard errors.

    Paths lead from the eye to the lamps. Where light is scattered again the phase function's forward peak is flattened
    and lamps are larger, so that rare paths that pass close to one do not rule; the road is black.
    """
    near = 0.3
    span = math.log(reach / near)
    sums = np.zeros(4)
    for _ in range(paths):
        r = near * math.exp(span * rng.random())
        weight = k * math.exp(-k * r) * r * span
        dx, dy, dz = towards[0], towards[1], towards[2]
        x, y, z = r * dx, r * dy, r * dz
        once = weight * scattered_back(x, y, z, dx, dy, dz, k, phases[0], step, beam, lamps, lamp_sizes[0])
        again = 0.0
        while k * math.sqrt(x * x + y * y + z * z) < 25.0:
            cosine = cosines[int(rng.random() * len(cosines))]
            dx, dy, dz = turned(dx, dy, dz, cosine, 2 * math.pi * rng.random())
            length = -math.log(1.0 - rng.random()) / k
            if z + length * dz < ground:
                break
            x, y, z = x + length * dx, y + length * dy, z + length * dz
            again += scattered_back(x, y, z, dx, dy, dz, k, phases[1], step, beam, lamps, lamp_sizes[1])
        every = once + weight * again
        sums += np.array([once, once * once, every, every * every])
    means = sums / paths
    errors = np.sqrt(np.maximum(means[1::2] - means[::2] ** 2, 0.0) / paths)
    return means[0], errors[0], means[2], errors[1]


@njit(cache=False)
def shone_down(x, y, z, k, beam, lamps):
    """Illuminance by which lamps light the road at a place, were the fog to scatter nothing into their beams [lx]."""
    total = 0.0
    for i in range(len(lamps)):
        lx, ly, lz = x - lamps[i, 0], y - lamps[i, 1], z - lamps[i, 2]
        if lx <= 0:
            continue
        square = lx * lx + ly * ly + lz * lz
        s = math.sqrt(square)
        h = (math.atan2(-ly, lx) / math.pi + 0.5) * (beam.shape[1] - 1)
        v = (math.asin(lz / s) / math.pi + 0.5) * (beam.shape[0] - 1)
        total += beam[int(v), int(h)] * -lz / (s * square) * math.exp(-k * s)
    return total


@njit(cache=False)
def road_light(paths, rng, k, towards, reach, phases, cosines, step, beam, lamps, ground, albedo):
    """Radiance of the sky by light that a Lambertian road has returned, and its standard error [cd/m^2]; see `veil`."""
    near, sums = 0.3, np.zeros(2)
    span = math.log(reach / near)
    for _ in range(paths):
        r = near * math.exp(span * rng.random())
        weight = k * math.exp(-k * r) * r * span
        dx, dy, dz = towards[0], towards[1], towards[2]
        x, y, z = r * dx, r * dy, r * dz
        light, returned = 0.0, 1.0
        while k * math.sqrt(x * x + y * y + z * z) < 20.0 and returned > 1e-3:
            cosine = cosines[int(rng.random() * len(cosines))]
            dx, dy, dz = turned(dx, dy, dz, cosine, 2 * math.pi * rng.random())
            length = -math.log(1.0 - rng.random()) / k
            if z + length * dz < ground:
                t = (ground - z) / dz
                x, y, z = x + t * dx, y + t * dy, ground
                returned *= albedo
                light += returned * shone_down(x, y, z, k, beam, lamps) / math.pi
                up, azimuth = rng.random(), 2 * math.pi * rng.random()
                dx, dy, dz = math.sqrt(up) * math.cos(azimuth), math.sqrt(up) * math.sin(azimuth), math.sqrt(1.0 - up)
                length = -math.log(1.0 - rng.random()) / k
            x, y, z = x + length * dx, y + length * dy, z + length * dz
            if returned < 1.0:
                light += returned * scattered_back(x, y, z, dx, dy, dz, k, phases[1], step, beam, lamps, LAMP_SIZES[1])
        sums += np.array([weight * light, (weight * light) ** 2])
    mean = sums[0] / paths
    return mean, math.sqrt(max(sums[1] / paths - mean * mean, 0.0) / paths)


@njit(cache=False)
def from_layer(paths, rng, cosines, thickness, height, sine):
    """Where the light comes from that arrives at a place in a plane layer of fog, traced backward from there.

    Lengths are optical depths, heights those above the ground; `sine` is that of the elevation of the line of sight,
    above 1 for the light that falls on a horizontal surface, facing upward. Returns the share of the ground's light and
    of that of an overcast sky whose luminance goes as (1 + 2 sin) / 3 [both relative to a luminance of 1: the ground's,
    and that of a white horizontal surface under that sky], and the standard errors of both.
    """
    ground = sky = squares = 0.0
    for _ in range(paths):
        up = math.sqrt(rng.random()) if sine > 1.0 else sine
        x, y, z = math.sqrt(max(0.0, 1.0 - up * up)), 0.0, up
        place = height
        while True:
            place -= math.log(1.0 - rng.random()) * z
            if place <= 0.0:
                ground += 1.0
                break
            if place >= thickness:
                light = 3.0 / 7.0 * (1.0 + 2.0 * z)
                sky += light
                squares += light * light
                break
            cosine = cosines[int(rng.random() * len(cosines))]
            x, y, z = turned(x, y, z, cosine, 2.0 * math.pi * rng.random())
    ground, sky, squares = ground / paths, sky / paths, squares / paths
    return ground, sky, math.sqrt(ground * (1.0 - ground) / paths), math.sqrt(max(squares - sky * sky, 0.0) / paths)


@njit(cache=False)
def between_trees(paths, rng, cosines, k, top, eye, albedo, sine, trees, clouds):  # noqa: C901, PLR0912, PLR0915
    """Light that a line of sight along a road gathers between two rows of black trees, under a sky of patches.

    Traced backward, in metres, and relative to the luminance of a white surface under the open, even sky without fog.
    `sine` is that of the line's elevation, above 1 for all light that falls on the road. `trees`: distance of both rows
    from the line of sight and their height [m]. `clouds`: side of square patches of the sky [m], by how much one is
    brighter than the mean and the next darker [-], and 1 where the eye is under the middle of a bright one, −1 of a
    dark one. Returns the mean and its standard error; what is behind the fog does not count.
    """
    beside, high = trees
    size, strength, bright = clouds
    total = squares = 0.0
    for _ in range(paths):
        up = math.sqrt(rng.random()) if sine > 1.0 else sine
        turn = 2.0 * math.pi * rng.random() if sine > 1.0 else 0.0
        flat = math.sqrt(max(0.0, 1.0 - up * up))
        dx, dy, dz = flat * math.cos(turn), flat * math.sin(turn), up
        x, y, z, weight, behind = 0.0, 0.0, 0.0 if sine > 1.0 else eye, 1.0, sine <= 1.0
        while True:
            length = -math.log(1.0 - rng.random()) / k
            if dz < 0.0:
                length = min(length, -z / dz)
            elif dz > 0.0:
                length = min(length, (top - z) / dz)
            onward = (x + length * dx, y + length * dy, z + length * dz)
            if abs(onward[1]) > beside and abs(y) <= beside:
                at = z + dz * (math.copysign(beside, dy) - y) / dy
                if at < high:
                    weight = 0.0
                    break
            elif abs(y) > beside and (abs(onward[1]) < beside or onward[1] * y < 0.0):
                at = z + dz * (math.copysign(beside, y) - y) / dy
                if at < high:
                    weight = 0.0
                    break
            x, y, z = onward
            if z >= top - 1e-9:
                weight *= 0.0 if behind else 3.0 / 7.0 * (1.0 + 2.0 * dz)
                if strength > 0.0:
                    sign = math.cos(math.pi * x / size) * math.cos(math.pi * y / size)
                    weight *= 1.0 + bright * math.copysign(strength, sign)
                break
            if z <= 1e-9:
                if behind:
                    weight = 0.0
                    break
                weight, z = weight * albedo, 0.0
                if rng.random() >= weight:
                    weight = 0.0
                    break
                weight = 1.0
                dz, turn = math.sqrt(rng.random()), 2.0 * math.pi * rng.random()
                flat = math.sqrt(max(0.0, 1.0 - dz * dz))
                dx, dy = flat * math.cos(turn), flat * math.sin(turn)
                continue
            behind = False
            cosine = cosines[int(rng.random() * len(cosines))]
            dx, dy, dz = turned(dx, dy, dz, cosine, 2.0 * math.pi * rng.random())
        total += weight
        squares += weight * weight
    mean = total / paths
    return mean, math.sqrt(max(squares / paths - mean * mean, 0.0) / paths)
