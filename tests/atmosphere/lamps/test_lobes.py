"""Glow of lamps that do not shine alike in all directions: photons, single scattering, and what is drawn."""

import math

import numpy as np
import pytest

from fogsim.atmosphere.lamps.halo_lamps import SIDES
from fogsim.atmosphere.lamps.halos import Halos
from fogsim.atmosphere.lamps.lobes import light_origins, lobe_glow, mean_intensity
from fogsim.atmosphere.lamps.phase_function import Droplets, phase_function
from fogsim.lighting.beams import high_beam, low_beam
from fogsim.scene.lamps import STREET_LOBE
from fogsim.values import Beam, Camera, CameraPose, LampLobes, LightSources
from tests.atmosphere.night_scene import empty_view, fog, rays
from tests.atmosphere.tables import read_table

PHOTONS = read_table("monte_carlo_lobes.csv")
AZIMUTH, ELEVATION = np.linspace(-math.pi, math.pi, 241), np.linspace(-0.5 * math.pi, 0.5 * math.pi, 121)
FACING = np.maximum(np.cos(ELEVATION)[:, None] * np.cos(AZIMUTH), 0.0)


def bell(aside, above):
    shape = np.exp(-0.5 * ((np.degrees(AZIMUTH) / aside) ** 2 + (np.degrees(ELEVATION)[:, None] / above) ** 2))
    return Beam(AZIMUTH, ELEVATION, 1e3 * np.where(FACING > 1e-9, shape, 0.0))


LAMPS = {  # as of `lobe_sources` of the benchmark: lamp, its unit in the table, and where the eye is
    "cosine": (Beam(AZIMUTH, ELEVATION, 1e3 * FACING**4), 1e3, (0.0, 0.0)),
    "wide": (bell(15.0, 8.0), 1e3, (0.0, 0.0)),
    "wide_below": (bell(15.0, 8.0), 1e3, (5.0, 5.0)),
    "narrow": (bell(10.0, 5.0), 1e3, (0.0, 0.0)),
    "low_beam": (low_beam(), 1.0, (-4.0, 0.7)),
    "low_beam_near": (low_beam(), 1.0, (-12.0, 2.5)),
    "high_beam": (high_beam(), 1.0, (-4.0, 0.7)),
    "street_lamp": (STREET_LOBE, 1.0, (0.0, -15.0)),
}


def over_photons(name):
    """Glow of a lamp over that of photons: optical depths by angles up to 43° by four sides, of all fogs."""
    beam, unit, eye = LAMPS[name]
    ratios = []
    for droplets in np.unique(PHOTONS["fog"]):
        for depth in np.unique(PHOTONS["optical_depth"]):
            some = PHOTONS[(PHOTONS["fog"] == droplets) & (PHOTONS["optical_depth"] == depth)]
            some = some[(some["lamp"] == name) & (some["angle"] < 45.0)]
            photons = np.stack([some[side] for side in ("right", "up", "left", "down")], axis=1)
            angle, toward = np.radians(some["angle"]), (math.radians(eye[0]), math.radians(eye[1]))
            ratios.append(lobe_glow(depth, angle, beam, toward, Droplets(droplets))[:, ::2] / (unit * photons))
    return np.array(ratios)


def test_glow_is_that_of_photons_within_a_quarter():
    for name, share, worst in [
        *[(name, 1.0, 1.15) for name in ("cosine", "wide", "wide_below", "narrow", "street_lamp")],
        ("low_beam", 0.97, 1.35),
        ("low_beam_near", 0.88, 1.55),
        ("high_beam", 0.99, 1.25),
    ]:
        deviation = np.abs(np.log(over_photons(name)))
        assert np.mean(deviation < math.log(1.25)) >= share
        assert deviation.max() < math.log(worst)


def test_light_scattered_once_left_at_the_angle_between():
    """In thin fog, the mean of the intensity over where light left is that of single scattering."""
    phase, beam = phase_function(Droplets.HEAVY_ADVECTION), LAMPS["cosine"][0]
    depth = math.exp(light_origins(Droplets.HEAVY_ADVECTION).log_depth[0])
    angle = light_origins(Droplets.HEAVY_ADVECTION).angle[2:8]
    scattering = angle[:, None] + (math.pi - angle[:, None]) * ((np.arange(4000) + 0.5) / 4000) ** 3
    path = depth * (np.sin(angle[:, None]) + np.sin(scattering - angle[:, None])) / np.sin(scattering)
    weight = phase(scattering) * np.exp(-path) * ((np.arange(4000) + 0.5) / 4000) ** 2
    shone = np.maximum(np.cos(scattering - angle[:, None]), 0.0) ** 4
    once = np.sum(weight * shone, axis=1) / weight.sum(axis=1)
    every = mean_intensity(beam, np.zeros(1), np.zeros(1), Droplets.HEAVY_ADVECTION)[0, 0, 2:8, 0] / 1e3
    every /= light_origins(Droplets.HEAVY_ADVECTION).excess[0, 2:8]
    assert (once > every).all()
    assert every == pytest.approx(once, rel=0.16)


CAMERA = Camera(320, 240, 288.4, (159.5, 119.5), 1.5, 0.0)
POSE = CameraPose((0.0, 0.0, 1.5), 0.0)


def drawn(beam, place, forward, visibility=100.0):
    lobes = LampLobes((beam,), np.zeros(1, np.int64), np.ones(1), np.array([forward], dtype=float))
    sources = LightSources(np.array([place]), np.array([1.0]), np.ones((1, 3)), np.full(1, 1e-4), lobes)
    out = np.zeros((240, 320, 3), np.float32)
    Halos(Droplets.HEAVY_RADIATION).add(out, empty_view(CAMERA), CAMERA, POSE, fog(visibility), sources)
    return out[..., 1]


def test_each_side_of_a_lamp_is_drawn_as_it_glows():
    beam, place = LAMPS["low_beam"][0], (40.0, 0.0, 1.2)
    image, field = drawn(beam, place, (-1.0, 0.0, 0.0)), fog(100.0)
    towards = (np.array(place) - POSE.position) / math.dist(place, POSE.position)
    angle = np.arccos(np.clip(rays(CAMERA, POSE) @ towards, -1.0, 1.0))
    far = math.dist(place, POSE.position)
    eye = (0.0, math.asin(-towards[2]))
    # The lamp sees the image's left on its right.
    for side, pixel in ((0, (120, 30)), (2, (20, 159)), (4, (120, 290)), (6, (230, 159))):
        glow = lobe_glow(field.extinction * far, [angle[pixel]], beam, eye, Droplets.HEAVY_RADIATION)[0, side]
        assert image[pixel] == pytest.approx(glow / far**2, rel=0.12)


def test_the_side_to_which_a_lamp_shines_is_the_brighter_one_or_all_are_alike():
    right = Beam(np.radians([-10.0, 0.0, 10.0]), np.radians([-10.0, 10.0]), np.array([[1.0, 1.0, 1000.0]] * 2))
    oncoming = drawn(right, (40.0, 0.0, 1.5), (-1.0, 0.0, 0.0))
    ahead = drawn(right, (40.0, 0.0, 1.5), (1.0, 0.0, 0.0))
    assert oncoming[120, 60] > 2.0 * oncoming[120, 260]
    assert ahead[120, 260] > 1.2 * ahead[120, 60]
    even = Beam(np.array([-math.pi, math.pi]), np.array([-0.5, 0.5]) * math.pi, np.full((2, 2), 3.0))
    mean = mean_intensity(even, np.array([0.3]), np.array([-0.2]), Droplets.HEAVY_RADIATION)
    assert mean.shape[3] == SIDES
    assert np.ptp(mean, axis=3).max() < 1e-9
    assert mean[0, ..., 0] == pytest.approx(3.0 * light_origins(Droplets.HEAVY_RADIATION).excess)
