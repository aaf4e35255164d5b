"""Phase functions of fog droplets by Mie theory (Bohren & Huffman 1983): writes the table that the air reads.

    python benchmarks/mie_phase.py fogsim/atmosphere/data/phase_functions.csv

Droplets: the four fogs of Shettle & Fenn (1979), n(r) = c r^a e^(−d r); refractive index 1.333, wavelength 0.55 µm.
"""

import argparse
import math
from pathlib import Path

import numpy as np
from numba import njit

FOGS = {
    "heavy_advection": (3.0, 0.3),
    "moderate_advection": (3.0, 0.375),
    "heavy_radiation": (6.0, 1.5),
    "moderate_radiation": (6.0, 3.0),
}
WAVELENGTH = 0.55
INDEX = 1.333


@njit(cache=False)
def mie(x, m, cosines):
    """Extinction efficiency and |S1|² + |S2|² at angles, of a sphere of size parameter x."""
    terms = int(x + 4.05 * x ** (1.0 / 3.0) + 8)
    start = int(max(terms, m * x)) + 16
    log_derivative = np.zeros(start + 1)
    for n in range(start, 0, -1):
        log_derivative[n - 1] = n / (m * x) - 1.0 / (log_derivative[n] + n / (m * x))
    s1 = np.zeros(len(cosines), dtype=np.complex128)
    s2 = np.zeros(len(cosines), dtype=np.complex128)
    pi0, pi1 = np.zeros(len(cosines)), np.ones(len(cosines))
    psi0, psi1, chi0, chi1 = math.cos(x), math.sin(x), -math.sin(x), math.cos(x)
    xi1 = complex(psi1, -chi1)
    extinction = 0.0
    for n in range(1, terms + 1):
        psi = (2 * n - 1) * psi1 / x - psi0
        chi = (2 * n - 1) * chi1 / x - chi0
        xi = complex(psi, -chi)
        d = log_derivative[n]
        a = ((d / m + n / x) * psi - psi1) / ((d / m + n / x) * xi - xi1)
        b = ((m * d + n / x) * psi - psi1) / ((m * d + n / x) * xi - xi1)
        extinction += (2 * n + 1) * (a + b).real
        factor = (2.0 * n + 1.0) / (n * (n + 1.0))
        for i in range(len(cosines)):
            tau = n * cosines[i] * pi1[i] - (n + 1) * pi0[i]
            s1[i] += factor * (a * pi1[i] + b * tau)
            s2[i] += factor * (a * tau + b * pi1[i])
            following = ((2 * n + 1) * cosines[i] * pi1[i] - (n + 1) * pi0[i]) / n
            pi0[i], pi1[i] = pi1[i], following
        psi0, psi1, chi0, chi1 = psi1, psi, chi1, chi
        xi1 = complex(psi1, -chi1)
    intensity = np.abs(s1) ** 2 + np.abs(s2) ** 2
    return 2.0 / (x * x) * extinction, intensity


def angles():
    """Degrees, dense where phase functions are steep: at the diffraction peak and at the glory."""
    forward = np.concatenate(([0.0], np.geomspace(0.05, 30.0, 110)))
    middle = np.arange(31.0, 170.0, 1.0)
    back = 180.0 - np.geomspace(10.0, 0.2, 30)
    return np.concatenate((forward, middle, back, [180.0]))


def phase_function(a, d, degrees):
    """Phase function of a droplet distribution [1/sr]."""
    radii = np.linspace(0.05, (a + 22.0) / d, 1500)
    weight = radii**a * np.exp(-d * radii)
    cosines = np.cos(np.radians(degrees))
    total, extinction = np.zeros(len(degrees)), 0.0
    for radius, share in zip(radii, weight, strict=True):
        x = 2 * math.pi * radius / WAVELENGTH
        efficiency, intensity = mie(x, INDEX, cosines)
        total += share * intensity
        extinction += share * efficiency * x * x
    # Without absorption scattering is extinction: p = Σ n (|S1|² + |S2|²) / (2 π Σ n Q x²)
    return total / (2.0 * math.pi * extinction)


def main():
    """Write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    path = parser.parse_args().out
    degrees = angles()
    columns = [phase_function(a, d, degrees) for a, d in FOGS.values()]
    with path.open("w", encoding="utf-8") as file:
        file.write("# Phase functions of fog droplets [1/sr], integral over the sphere 1; angle [degrees].\n")
        file.write("# Droplets: Shettle & Fenn (1979), AFGL-TR-79-0214; Mie theory for m = 1.333 at 0.55 um.\n")
        file.write("# Command: python benchmarks/mie_phase.py fogsim/atmosphere/data/phase_functions.csv\n")
        file.write("angle," + ",".join(FOGS) + "\n")
        for row in zip(degrees, *columns, strict=True):
            file.write(",".join(f"{value:.6g}" for value in row) + "\n")


if __name__ == "__main__":
    main()
