"""The blur of forward scattering by day, and the true transmittance that it does not touch."""

import dataclasses

import numpy as np

from fogsim.atmosphere import Air
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, CameraPose, FogField, View

CAMERA = Camera(320, 240, 300.0, (160, 120), 1.38)
POSE = CameraPose((0.0, 0.0, 1.38), 0.0)
EVEN = FogField(extinction_from_visibility(100.0), (3000.0, 3000.0, 3000.0))
BLURRED = dataclasses.replace(EVEN, forward_scatter=0.3)


def step_edge(distance: float) -> View:
    radiance = np.zeros((240, 320, 3), np.float32)
    radiance[:, 160:] = 1000.0
    return View(radiance, np.full((240, 320), distance, np.float32), np.zeros((240, 320), np.int32))


def test_an_edge_in_fog_is_softer_by_a_blur_of_its_width_and_transmission_knows_none() -> None:
    view = step_edge(60.0)
    sharp, soft = (Air(field).radiance(view, CAMERA, POSE)[120, :, 1] for field in (EVEN, BLURRED))
    assert np.allclose(soft[[5, 100, 220, 315]], sharp[[5, 100, 220, 315]], rtol=1e-5)
    transmittance = np.exp(-EVEN.extinction * 60.0)
    # Directly at the edge the blur is half of the bright side.
    lost = 0.3 * (1 - transmittance) * 0.5 * 1000.0 * transmittance
    assert np.isclose(sharp[160] - soft[160], lost, rtol=0.1)
    assert np.isclose(soft[159] - sharp[159], lost, rtol=0.1)
    assert np.all(np.diff(soft) >= -1e-2)
    dark_side = (soft - sharp)[:160][::-1]
    # A Gaussian's tail falls to Q(1) / Q(0) = 0.317 at one standard deviation, 1° or 5.24 px here.
    assert np.isclose(np.interp(5.24 - 0.5, np.arange(160), dark_side) / (2 * dark_side[0]) * 2, 0.317, atol=0.05)
    assert np.allclose(Air(BLURRED).transmittance(view, CAMERA, POSE), np.exp(-EVEN.extinction * 60.0), atol=1e-6)
    assert np.all(Air(dataclasses.replace(EVEN, extinction=0.0)).transmittance(view, CAMERA, POSE) == 1.0)
    view = step_edge(0.0)
    assert np.allclose(Air(BLURRED).radiance(view, CAMERA, POSE), view.radiance)


def test_what_is_as_bright_as_the_airlight_stays_so_and_fog_beside_something_dark_is_darker() -> None:
    distance = np.full((240, 320), np.inf, np.float32)
    distance[:, 160:] = 60.0
    ids = np.zeros((240, 320), np.int32)
    bright = View(np.full((240, 320, 3), 3000.0, np.float32), distance, ids)
    assert np.allclose(Air(BLURRED).radiance(bright, CAMERA, POSE), 3000.0, rtol=1e-5)
    dark = dataclasses.replace(
        bright, radiance=np.where(np.isinf(distance), 3000.0, 0.0)[..., None].repeat(3, 2).astype(np.float32)
    )
    row = Air(BLURRED).radiance(dark, CAMERA, POSE)[120, :, 1]
    assert row[159] < row[150] < 3000.0 <= row[100] + 1e-2
