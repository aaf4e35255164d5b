"""The per-pixel loop of Koschmieder's law."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel


@kernel
def _window_integral(station: float, middle: float, edge: float) -> float:
    t = min(max((station - middle) / edge + 0.5, 0.0), 1.0)
    return edge * t * t * t * (1.0 - 0.5 * t) + max(station - (middle + 0.5 * edge), 0.0)


@kernel
def _window(station: float, middle: float, edge: float) -> float:
    t = min(max((station - middle) / edge + 0.5, 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t)


@kernel
def fog_pixels(
    radiance: NDArray[np.float32],
    distance: NDArray[np.float32],
    ray_map: NDArray[np.float64],
    eye_height: float,
    top: float,
    base_extinction: float,
    banks: NDArray[np.float64],
    airlight: NDArray[np.float64],
    out: NDArray[np.float32],
) -> None:
    """L = L0 e^(−τ) + L∞ (1 − e^(−τ)) for every pixel, τ exact through layers and banks.

    `ray_map` (3, 3) takes (u, v, 1) to a ray in the world (not normalised). `banks` (n, 7) holds for each bank the
    station of the eye, the axis (x, y), start, end, edge and extra extinction.
    """
    rows, columns = distance.shape
    for v in range(rows):
        for u in range(columns):
            x = ray_map[0, 0] * u + ray_map[0, 1] * v + ray_map[0, 2]
            y = ray_map[1, 0] * u + ray_map[1, 1] * v + ray_map[1, 2]
            z = ray_map[2, 0] * u + ray_map[2, 1] * v + ray_map[2, 2]
            norm = 1.0 / math.sqrt(x * x + y * y + z * z)
            length = float(distance[v, u])
            if z > 0.0 and eye_height + length * z * norm > top:
                length = (top - eye_height) / (z * norm)
            if math.isinf(length):
                # An endless path through fog shows nothing but airlight; through clear air, everything.
                length = 1e7
            depth = base_extinction * length
            for b in range(banks.shape[0]):
                rate = (x * banks[b, 1] + y * banks[b, 2]) * norm
                start, end, edge = banks[b, 3], banks[b, 4], banks[b, 5]
                near = banks[b, 0]
                far = near + rate * length
                if abs(far - near) < 1e-3:
                    share = _window(near, start, edge) - _window(near, end, edge)
                else:
                    share = (
                        _window_integral(far, start, edge)
                        - _window_integral(near, start, edge)
                        - _window_integral(far, end, edge)
                        + _window_integral(near, end, edge)
                    ) / (far - near)
                depth += banks[b, 6] * share * length
            transmission = math.exp(-depth)
            for c in range(3):
                out[v, u, c] = radiance[v, u, c] * transmission + airlight[c] * (1.0 - transmission)
