"""Fog from the glow about the tail lamps ahead, in pictures of red lamps that no renderer drew."""

import dataclasses
import math

import numpy as np
import pytest

from fogsim.atmosphere.lamps.halo_lamps import SIDES
from fogsim.atmosphere.lamps.lobes import lobe_glow
from fogsim.atmosphere.lamps.phase_function import Droplets
from fogsim.estimators.night.glow_fit import EXTINCTIONS, likelihood
from fogsim.estimators.night.night_glow import NightGlow
from fogsim.estimators.night.tail_glow import DEPTHS
from fogsim.estimators.night.tail_lamps import TailLamps, find_tail_lamps
from fogsim.scene.lamps import SIGNAL_LOBES
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, Frame, Lamp, LeadMeasurement, Observation, Response
from fogsim.values.camera_response import respond
from fogsim.values.luminous_intensity import SignalLobe

CAMERA = Camera(320, 240, 288.0, (159.5, 119.5), 1.4, pitch=0.03, response=Response.SRGB)
LOW = Lamp.POSITION | Lamp.LOW_BEAM
FULL = 4.0  # luminance that fills a pixel [cd/m²]
ROAD = 1.6


SIGNAL = SIGNAL_LOBES[SignalLobe.SIGNAL]


def tail_glow(depth, angle):
    return lobe_glow(depth, angle, SIGNAL, (0.0, 0.0), Droplets.MODERATE_ADVECTION)


def picture(distance, visibility, intensity=110.0, seed=0):
    """Two red lamps before the dark, a lit road, and a white veil over all."""
    k = extinction_from_visibility(visibility)
    v, u = np.mgrid[: CAMERA.height, : CAMERA.width].astype(float)
    scale = CAMERA.focal_length / distance
    row = CAMERA.horizon_row + 0.5 * scale
    red = np.zeros(v.shape)
    for side in (-0.62, 0.62):
        apart = np.hypot(u - CAMERA.principal_point[0] - side * scale, v - row)
        angle = np.maximum(apart, 0.3) / CAMERA.focal_length
        known = np.geomspace(1e-4, 1.5, 60)
        about = np.log(tail_glow(k * distance, known) / SIGNAL.intensity.max())
        turn = np.arctan2(row - v, CAMERA.principal_point[0] + side * scale - u) / (2.0 * math.pi) * SIDES % SIDES
        for number in range(SIDES):
            apart_by = np.abs((turn - number + SIDES / 2) % SIDES - SIDES / 2)
            on_side = np.exp(np.interp(np.log(angle), np.log(known), about[:, number]))
            red += intensity / distance**2 * on_side * np.maximum(1.0 - apart_by, 0.0)
        red += np.where(apart < max(0.06 * scale, 1.0), 900.0 * math.exp(-k * distance), 0.0)
    white = np.where(v > CAMERA.horizon_row, ROAD, 0.08)
    light = np.stack((white + 4.25 * red, white + 0.13 * red, white + 0.06 * red), axis=2)
    light += np.random.default_rng(seed).normal(0.0, 0.02, light.shape)
    return (255.0 * respond(np.clip(light / FULL, 0.0, 1.0), CAMERA.response)).round().astype(np.uint8)


def approach(visibility, distances, **drawn):
    """Estimates on the way toward the vehicle ahead."""
    estimator = NightGlow(CAMERA)
    for number, distance in enumerate(distances):
        frame = Frame(0.5 * number, picture(distance, visibility, seed=number, **drawn), CAMERA)
        yield estimator.update(observation(frame, distance))


def observation(frame, distance):
    return Observation(frame, 20.0, LeadMeasurement(distance - 1.7, 0.0), camera_setback=1.7, lamps=LOW)


@pytest.mark.parametrize("visibility", [45.0, 90.0])
def test_the_glow_at_several_ranges_tells_dense_fog(visibility: float) -> None:
    *_, last = approach(visibility, np.geomspace(50.0, 24.0, 6))
    assert last.valid, last.diagnostics
    low, high = last.visibility_interval
    assert low < visibility < high < 5.0 * low
    assert last.diagnostics["looks"] > 4


def test_what_two_ranges_say_is_bounds_that_hold() -> None:
    one, two = approach(200.0, (30.0, 26.0))
    assert not one.valid
    assert one.bounds is None
    assert not two.valid
    assert "ranges that differ more" in two.diagnostics["reason"]
    assert two.bounds.least < extinction_from_visibility(200.0) < two.bounds.most


def test_brighter_lamps_are_other_lamps() -> None:
    estimator = NightGlow(CAMERA)
    for number, (distance, intensity) in enumerate(((30.0, 110.0), (27.0, 110.0), (24.0, 300.0))):
        frame = Frame(0.5 * number, picture(distance, 80.0, intensity=intensity), CAMERA)
        told = estimator.update(observation(frame, distance))
        assert told.diagnostics["looks"] == (1, 2, 1)[number]


def test_why_nothing_can_be_told() -> None:
    estimator, seen = NightGlow(CAMERA), observation(picture(30.0, 100.0), 30.0)

    def reason(changed: Observation) -> str:
        return str(estimator.update(changed).diagnostics["reason"])

    assert "no range" in reason(dataclasses.replace(seen, lead=None))
    assert "grey" in reason(dataclasses.replace(seen, frame=picture(30.0, 100.0)[:, :, 0].copy()))
    assert "120 m" in reason(dataclasses.replace(seen, lead=LeadMeasurement(400.0, 0.0)))
    assert "daylight" in reason(dataclasses.replace(seen, frame=np.full((240, 320, 3), 200, np.uint8)))
    assert "shows no lamp" in reason(dataclasses.replace(seen, frame=np.full((240, 320, 3), 20, np.uint8)))
    assert "too little red light" in reason(dataclasses.replace(seen, frame=picture(30.0, 1e6)))
    # Lamps whose light lies 5° beside them.
    beside = np.maximum(np.minimum(np.roll(picture(30.0, 100.0), 25, axis=1), 195), picture(30.0, 1e6))
    assert "evenly" in reason(dataclasses.replace(seen, frame=beside))


def test_tail_lamps_are_found_as_a_pair_or_as_one_blot() -> None:
    apart = find_tail_lamps(picture(25.0, 1e6), CAMERA, 25.0)
    assert isinstance(apart, TailLamps)
    assert apart.u == pytest.approx(159.5, abs=0.7)
    assert apart.half_spacing == pytest.approx(0.62 * CAMERA.focal_length / 25.0, rel=0.1)
    blot = find_tail_lamps(picture(60.0, 60.0, intensity=1000.0), CAMERA, 60.0)
    assert isinstance(blot, TailLamps)
    assert blot.u == pytest.approx(159.5, abs=1.0)
    assert find_tail_lamps(picture(25.0, 1e6), dataclasses.replace(CAMERA, pitch=1.2), 25.0) == (
        "the vehicle ahead is not in the picture"
    )


def test_without_evidence_every_fog_is_as_likely() -> None:
    estimator = NightGlow(CAMERA)
    estimator.update(observation(picture(30.0, 80.0), 30.0))
    (look,) = estimator._looks
    blind = dataclasses.replace(look, noise=np.where(np.isfinite(look.noise), 50.0, np.inf))
    share, misfit = likelihood((blind,), usual=50.0)
    assert share.sum() == pytest.approx(1.0)
    seen = DEPTHS[-1] >= EXTINCTIONS * 30.0
    assert share == pytest.approx(np.where(seen, 1.0 / seen.sum(), 0.0), rel=0.1)
    assert misfit < 0.1
