"""The glow about a lamp: closed form of single scattering, Narasimhan & Nayar's series, and photons."""

import math

import numpy as np
import pytest

from fogsim.atmosphere.lamps.glow import forward_share, glow, glow_table, mean_cosine, narasimhan_nayar, scattered_once
from fogsim.atmosphere.lamps.phase_function import Droplets, PhaseFunction, phase_function
from tests.atmosphere.tables import read_table

ISOTROPIC = PhaseFunction(np.array([0.0, math.pi]), np.full(2, 1.0 / (4.0 * math.pi)))
PHOTONS = read_table("monte_carlo_halo.csv")


def sun_f(u, v):
    """F(u, v) = ∫₀ᵛ e^(−u tan ξ) dξ of Sun et al. (2005)."""
    xi = (np.arange(200_000) + 0.5) / 200_000 * v
    return float(np.mean(np.exp(-u * np.tan(xi))) * v)


def sun_airlight(angle, source, end, k):
    """Airlight of an isotropic source of 1 cd (Sun, Ramamoorthi, Narasimhan & Nayar 2005)."""
    across = k * source * math.sin(angle)
    far = math.pi / 4 + 0.5 * math.atan((end - source * math.cos(angle)) / (source * math.sin(angle)))
    before = k * math.exp(-k * source * math.cos(angle)) / (2 * math.pi * source * math.sin(angle))
    return before * (sun_f(across, far) - sun_f(across, angle / 2))


def test_single_scattering_is_the_closed_form_which_gives_its_published_values():
    assert sun_f(1.0, 1.0) == pytest.approx(0.5868308521, rel=1e-8)
    assert sun_airlight(math.radians(5), 40, 100, 0.03) == pytest.approx(5.133759843568e-4, rel=1e-6)
    assert sun_airlight(math.radians(30), 10, 50, 0.03) == pytest.approx(6.989348914e-4, rel=1e-6)
    for source, k in [(40.0, 0.03), (10.0, 0.03), (5.0, 0.006)]:
        for angle in [1, 5, 30, 90, 150]:
            gamma = math.radians(angle)
            ours = float(scattered_once(k * source, gamma, ISOTROPIC)) / source**2
            assert ours == pytest.approx(sun_airlight(gamma, source, 1e6, k), rel=2e-3)


def test_narasimhan_and_nayar():
    for depth, q, values in [
        (1.2, 0.9, (6.10985, 5.84564, 4.00039, 2.00198, 0.61352)),
        (2.0, 0.9, (2.93164, 2.91467, 2.68153, 1.97041, 0.81384)),
        (4.0, 0.9, (2.20833, 2.20266, 2.11946, 1.79495, 0.94928)),
        (4.0, 0.75, (2.04334, 2.03918, 1.97757, 1.72677, 0.98925)),
    ]:
        assert narasimhan_nayar(depth, np.radians([0, 5, 20, 45, 90]), q) == pytest.approx(values, abs=6e-6)
    with pytest.raises(ValueError, match=r"above 1, got 0\.9"):
        narasimhan_nayar(0.9, 0.1)


def test_photons_scattered_once_are_single_scattering():
    for droplets in Droplets:
        rows = PHOTONS[(PHOTONS["fog"] == droplets) & (PHOTONS["optical_depth"] <= 1.0) & (PHOTONS["angle"] < 20)]
        ours = scattered_once(rows["optical_depth"], np.radians(rows["angle"]), phase_function(droplets))
        # Bins are means, and few photons fall into the narrow ones.
        assert np.median(ours / rows["single"]) == pytest.approx(1.0, abs=0.03)
        assert ours == pytest.approx(rows["single"], rel=0.2)


def test_glow_is_that_of_photons():
    for deepest, typical, worst in [(1.0, 0.17, 0.4), (2.0, 0.17, 0.4), (4.0, 0.21, 0.7)]:
        for droplets in Droplets:
            rows = PHOTONS[(PHOTONS["fog"] == droplets) & (PHOTONS["optical_depth"] <= deepest)]
            rows = rows[rows["angle"] < 70]
            ours = glow(rows["optical_depth"], np.radians(rows["angle"]), droplets)
            deviation = np.log(ours / rows["all"])
            assert math.sqrt(np.mean(deviation**2)) < typical
            assert np.abs(deviation).max() < worst


def test_glow_of_near_lamps_is_single_scattering():
    depth, angle = 1e-3, np.radians([1.0, 5.0, 20.0])
    single = scattered_once(depth, angle, phase_function(Droplets.HEAVY_RADIATION))
    assert glow(depth, angle, Droplets.HEAVY_RADIATION) == pytest.approx(single, rel=0.01)


def test_forward_share_grows_with_droplets():
    small, large = (forward_share(phase_function(d)) for d in (Droplets.MODERATE_RADIATION, Droplets.HEAVY_ADVECTION))
    assert small == pytest.approx(0.05, abs=0.02)
    assert large == pytest.approx(0.40, abs=0.02)
    assert mean_cosine(phase_function(Droplets.HEAVY_ADVECTION)) == pytest.approx(0.872, abs=2e-3)
    assert mean_cosine(ISOTROPIC) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("droplets", Droplets)
def test_table_has_no_holes(droplets):
    table = glow_table(droplets)
    assert np.all(np.isfinite(table.log_glow))
    # Per optical depth the glow falls with it, but for the little that light scattered twice adds far from the lamp.
    assert np.all(np.diff(table.log_glow[:, :120], axis=0) < 0.05)
    assert np.all(np.diff(table.log_glow, axis=0)[-10:] < 0)
