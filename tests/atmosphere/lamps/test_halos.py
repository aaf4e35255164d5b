"""Lamps of others drawn: their glow where the model has it, and no light lost or doubled."""

import dataclasses
import math

import numpy as np
import pytest

from fogsim.atmosphere.lamps.glow import glow
from fogsim.atmosphere.lamps.halos import Halos
from fogsim.atmosphere.lamps.phase_function import Droplets
from fogsim.values import Camera, CameraPose
from tests.atmosphere.night_scene import empty_view, fog, lamps, rays

CAMERA = Camera(640, 480, 576.9, (319.5, 239.5), 1.5, 0.0)
POSE = CameraPose((0.0, 0.0, 1.5), 0.0)


def drawn(field, sources, view=None, camera=CAMERA):
    seen = view or empty_view(camera)
    out = np.zeros_like(seen.radiance)
    Halos(Droplets.HEAVY_RADIATION).add(out, seen, camera, POSE, field, sources)
    return out


def angles(place, camera=CAMERA):
    towards = np.array(place) - np.array(POSE.position)
    return np.arccos(np.clip(rays(camera, POSE) @ (towards / np.linalg.norm(towards)), -1.0, 1.0))


def test_glow_is_the_model_all_over_the_image():
    for visibility, place in [(30, (25.0, -3.0, 8.0)), (100, (40.0, 0.0, 1.5)), (500, (100.0, 20.0, 1.0))]:
        field, angle = fog(visibility), angles(place)
        far = math.dist(place, POSE.position)
        ours = drawn(field, lamps(place))[..., 1]
        some = np.zeros(angle.shape, bool)
        some[::7, ::7] = True
        some &= angle > math.radians(0.4)
        expected = 100.0 / far**2 * glow(field.extinction * far, angle[some], Droplets.HEAVY_RADIATION)
        ratio = ours[some] / expected
        assert np.median(ratio) == pytest.approx(1.0, abs=0.02)
        assert ratio.min() > 0.8
        assert ratio.max() < 1.1


def test_glow_has_no_edges_and_the_colour_of_its_lamp():
    ours = drawn(fog(100), lamps((30.0, 0.0, 1.5), area=0.02))[240, 330:, 1]
    steps = ours[1:] / ours[:-1]
    assert steps.max() <= 1.0
    assert steps.min() > 0.8
    assert np.abs(np.diff(steps)).max() < 0.04
    ours = drawn(fog(100), lamps((40.0, 0.0, 1.5), colour=(2.0, 0.5, 0.25)))[240, ::40]
    assert ours[:, 0] == pytest.approx(4 * ours[:, 1], rel=1e-4)
    assert ours[:, 2] == pytest.approx(0.5 * ours[:, 1], rel=1e-4)


@pytest.mark.parametrize("colour", [(1.0, 1.0, 1.0), (1.0 / 0.2126, 0.0, 0.0)])
def test_surfaces_cut_the_glow_behind_them(colour):
    lamp = lamps((40.0, 0.0, 1.5), colour=colour)
    wall = empty_view(CAMERA, 10.0)
    wall.distance[235:245, 315:325] = np.inf  # a window through which the lamp is seen
    near = drawn(fog(100), lamp, wall)[240, 360]
    open_ = drawn(fog(100), lamp, empty_view(CAMERA))[240, 360]
    assert near == pytest.approx(0.25 * open_, rel=0.01, abs=1e-9)


def flux(image, place):
    """Illuminance at the camera of all that is within 0.3° of a place [lx]."""
    v, u = np.mgrid[: CAMERA.height, : CAMERA.width]
    cosine = 1 / np.sqrt(1 + ((u - 319.5) ** 2 + (v - 239.5) ** 2) / 576.9**2)
    return float(np.sum(image[..., 1] * cosine**3 * (angles(place) < math.radians(0.3))) / 576.9**2)


@pytest.mark.parametrize("place", [(200.0, 0.1, 1.6), (200.0, 0.27, 1.5), (150.0, 50.0, 20.0)])
def test_tiny_lamps_are_never_lost_between_pixels(place):
    far = math.dist(place, POSE.position)
    assert flux(drawn(fog(math.inf), lamps(place)), place) == pytest.approx(100.0 / far**2, rel=0.01)


def test_direct_light_is_attenuated():
    place = (200.0, 0.1, 1.6)
    thin = fog(300)
    view = empty_view(CAMERA)
    view.radiance[239, 319] = 1e9
    lost = drawn(thin, lamps(place)) - drawn(thin, lamps(place), view)
    assert flux(lost, place) == pytest.approx(100.0 / 200.0**2 * math.exp(-thin.extinction * 200.0), rel=0.01)


def test_what_the_renderer_drew_is_not_added_again():
    place, far = (200.0, 0.0, 1.5), 200.0
    view = empty_view(CAMERA)
    whole = 100.0 / far**2 * 576.9**2
    view.radiance[239, 319] = 0.75 * whole
    assert flux(drawn(fog(math.inf), lamps(place), view), place) == pytest.approx(0.25 * 100.0 / far**2, rel=0.01)
    # Two lamps close together share it.
    left, right = (200.0, 0.2, 1.5), (200.0, -0.2, 1.5)
    view.radiance[239, 319] = whole
    assert flux(drawn(fog(math.inf), lamps(left, right), view), (200.0, 0.0, 1.5)) == pytest.approx(0.0025, rel=0.02)
    # Nor is the background of a tiny lamp its light.
    dusk = dataclasses.replace(empty_view(CAMERA), radiance=np.full((480, 640, 3), 30.0, np.float32))
    assert flux(drawn(fog(math.inf), lamps(place), dusk), place) == pytest.approx(100.0 / 200.0**2, rel=0.01)


def test_a_lamp_smaller_than_its_pixel_is_dimmed_to_its_intensity_and_darkens_no_paint_around_it():
    place, view = (200.0, 0.0, 1.5), empty_view(CAMERA)
    view.radiance[239, 319] = 3.0 * 100.0 / 200.0**2 * 576.9**2
    # What shines at another distance is another lamp.
    for there, shown in ((200.0, 1.0), (150.0, 3.0)):
        view.distance[239, 319] = there
        out = view.radiance.copy()
        Halos().add(out, view, CAMERA, POSE, fog(math.inf), lamps(place))
        assert flux(out, place) == pytest.approx(shown * 100.0 / 200.0**2, rel=0.01)
    view = empty_view(CAMERA, 200.0)
    view.radiance[:] = 1000.0
    view.radiance[230:250, 310:330] = 2000.0
    out = view.radiance.copy()
    Halos().add(out, view, CAMERA, POSE, fog(math.inf), lamps((200.0, 0.0, 1.5)))
    assert (out >= view.radiance).all()


def test_lamps_behind_something_do_not_shine_through():
    view = empty_view(CAMERA, np.inf)
    view.distance[160:320, 240:400] = 15.0
    hidden = drawn(fog(100), lamps((30.0, 0.0, 1.5)), view)[240, :, 1]
    open_ = drawn(fog(100), lamps((30.0, 0.0, 1.5)))[240, :, 1]
    # No spot on what hides the lamp, but a glow in the fog about it.
    assert hidden[320] < 3.0 * hidden[290]
    assert hidden[320] < 1e-3 * open_[320]
    assert hidden[410] > 0.3 * open_[410]


def test_lamps_of_a_far_vehicle_glow_as_one():
    left, right = (150.0, 0.6, 1.5), (150.0, -0.6, 1.5)
    both = drawn(fog(100), lamps(left, right))
    apart = drawn(fog(100), lamps(left)) + drawn(fog(100), lamps(right))
    # For pictures, pytest.approx takes seconds.
    np.testing.assert_allclose(both, apart, rtol=0.04)


def test_lamps_behind_something_or_the_camera_large_or_dark_are_not_drawn():
    assert drawn(fog(math.inf), lamps((200.0, 0.0, 1.5)), empty_view(CAMERA, 50.0)).max() == 0.0
    assert drawn(fog(math.inf), lamps((20.0, 0.0, 1.5), area=0.02)).max() == 0.0
    assert drawn(fog(100), lamps((-20.0, 0.0, 1.5))).max() == 0.0
    assert drawn(fog(100), lamps((20.0, 0.0, 1.5), intensity=0.0)).max() == 0.0
    assert drawn(fog(100), lamps()).max() == 0.0
    bright, faint = (20.0, 2.0, 1.5), (300.0, -40.0, 1.5)
    view = dataclasses.replace(empty_view(CAMERA), radiance=np.full((480, 640, 3), 50.0, np.float32))
    out = view.radiance.copy()
    Halos(Droplets.HEAVY_RADIATION).add(out, view, CAMERA, POSE, fog(100), lamps(faint, intensity=0.05))
    assert np.array_equal(out, view.radiance)
    assert drawn(fog(100), lamps(faint, intensity=0.05)).max() > 0.0
    assert drawn(fog(100), lamps(bright)).max() > 0.0


def test_lamps_fade_smoothly_as_they_pass_the_camera():
    light = [drawn(fog(100), lamps((x, 3.0, 1.5)))[240, 0, 1] for x in np.linspace(1.0, 0.0, 21)]
    assert light[-1] < 1e-3 * light[0]
    assert np.abs(np.diff(light)).max() < 0.25 * light[0]
