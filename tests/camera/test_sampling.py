import numpy as np
import pytest

from fogsim.camera import averaged, middle_samples, supersampled
from fogsim.values import Camera, CameraPose, View
from fogsim.values.pinhole import ray_from_pixel

CAMERA = Camera(16, 12, 15.0, (7.3, 5.9), mount_height=1.4, pitch=0.03, roll=0.1)
POSE = CameraPose((1.0, 2.0, 1.4), heading=0.4)


@pytest.mark.parametrize("side", [1, 2, 3])
def test_the_samples_of_a_pixel_surround_its_centre_and_are_averaged(side: int) -> None:
    """The mean of the samples' rays is the ray of the pixel, exactly, since rays are linear in pixels."""
    fine = supersampled(CAMERA, side)
    assert (fine.width, fine.height) == (side * 16, side * 12)
    own, drawn = ray_from_pixel(CAMERA, POSE), ray_from_pixel(fine, POSE)
    for u, v in ((0, 0), (15, 11), (4, 9)):
        block = [(side * u + i, side * v + j, 1) for i in range(side) for j in range(side)]
        assert np.mean([drawn @ pixel for pixel in block], axis=0) == pytest.approx(own @ (u, v, 1), abs=1e-12)
    assert (fine.horizon_row + 0.5) / side - 0.5 == pytest.approx(CAMERA.horizon_row)
    light = np.random.default_rng(0).uniform(0, 3000, (side * 7, side * 9, 3)).astype(np.float32)
    expected = light.reshape(7, side, 9, side, 3).mean(axis=(1, 3))
    assert averaged(light, side) == pytest.approx(expected, rel=1e-5)
    # One sample a pixel is the picture itself.
    assert (averaged(light, side) is light) == (fine == CAMERA) == (side == 1)


@pytest.mark.parametrize("response", [True, False])
def test_distances_and_ids_are_chosen_and_never_mixed(response: bool) -> None:
    distance = np.arange(36, dtype=np.float32).reshape(6, 6)
    light = np.repeat(distance[..., None], 3, axis=2)
    view = View(light, distance, distance.astype(np.int32), light if response else None)
    middle = middle_samples(view, 3)
    assert np.array_equal(middle.distance, [[7, 10], [25, 28]])
    assert np.array_equal(middle.instance, [[7, 10], [25, 28]])
    assert np.array_equal(middle.radiance[..., 1], [[7, 10], [25, 28]])
    assert (middle.lamp_response is not None) == response
    assert middle_samples(view, 1) is view
