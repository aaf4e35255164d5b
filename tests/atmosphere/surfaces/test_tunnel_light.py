"""Light in a tunnel: what of the sky gets in by the geometry of the portal, and the lamps' beyond."""

import numpy as np
import pytest

from fogsim.atmosphere import TunnelLight
from fogsim.atmosphere.surfaces.tunnel_light import LAMPS_ON_ROAD, daylight_share, sky_share
from fogsim.values import Camera, CameraPose, View
from fogsim.values.obstruction import Tunnel

HALF_WIDTH, HEIGHT, SKY = 5.0, 5.0, 20_000.0
TUNNEL = Tunnel(np.array([[100.0, 0.0, 0.0], [500.0, 0.0, 0.0]]), HALF_WIDTH, HEIGHT)
CAMERA = Camera(64, 48, 60.0, (31.5, 23.5), 1.4)


def test_the_skys_share_is_the_integral_over_the_portal() -> None:
    for distance in [0.5, 3.0, 10.0, 40.0]:
        n = 400
        across = (np.arange(2 * n) + 0.5) / n * HALF_WIDTH - HALF_WIDTH
        up = (np.arange(n) + 0.5) / n * HEIGHT
        y, z = np.meshgrid(across, up)
        squared = distance**2 + y**2 + z**2
        # cos of the angle at the road times cos of that at the portal, over π r².
        integrand = z * distance / (np.pi * squared**2)
        integral = float(integrand.sum()) * (HALF_WIDTH / n) * (HEIGHT / n)
        assert sky_share(distance, HALF_WIDTH, HEIGHT) == pytest.approx(integral, rel=2e-3)
    assert sky_share(0.0, HALF_WIDTH, HEIGHT) == 0.5
    assert sky_share(1e-6, HALF_WIDTH, HEIGHT) == pytest.approx(0.5, abs=1e-5)
    # A portal without end hides, or shows, half of the sky.
    assert sky_share(1.0, 1e9, 1e9) == pytest.approx(0.5)
    far = 2.0 * HALF_WIDTH * HEIGHT**2 / (2.0 * np.pi * 300.0**3)
    assert sky_share(300.0, HALF_WIDTH, HEIGHT) == pytest.approx(far, rel=0.01)
    assert daylight_share(-1e-6, 400.0, HALF_WIDTH, HEIGHT) == pytest.approx(0.5, abs=1e-4)
    assert daylight_share(-40.0, 400.0, HALF_WIDTH, HEIGHT) > 0.999
    for place in (-12.0, 3.0, 150.0):
        one, other = (daylight_share(at, 400.0, HALF_WIDTH, HEIGHT) for at in (place, 400.0 - place))
        assert one == pytest.approx(other)


def lit(x: float, distance: float, own: float = 0.0, sky: float = SKY) -> np.ndarray:
    """What a camera at x sees ahead of white surfaces at a distance."""
    white = np.full((48, 64, 3), sky / np.pi + own, np.float32)
    view = View(white, np.full((48, 64), distance, np.float32), np.zeros((48, 64), np.int32))
    light = TunnelLight((TUNNEL,), sky)
    seen = light.on(view, np.full((48, 64, 3), own, np.float32), CAMERA, CameraPose((x, 0.0, 1.4), 0.0))
    assert np.all(view.radiance == white)
    return seen.radiance[..., 1]


def test_inside_lamps_alone_light_what_is_far_from_the_portals_and_shine_in_a_row_under_the_ceiling() -> None:
    deep = lit(250.0, 10.0)[24, 32]
    assert deep == pytest.approx(LAMPS_ON_ROAD / np.pi, rel=0.01)
    # Twice the sky's light outside is none of the lamps' business.
    assert lit(250.0, 10.0, sky=2 * SKY)[24, 32] == pytest.approx(deep, rel=0.01)
    assert lit(250.0, 10.0, own=300.0)[24, 32] == pytest.approx(300.0 + deep, rel=0.01)
    # A ray that rises by (23.5 − 7) / 60 comes to the ceiling after 13.6 m.
    ceiling = lit(250.0, 13.6)[7]
    assert 0.2 < np.median(ceiling[20:44]) / (LAMPS_ON_ROAD / np.pi) < 0.3
    shining = [lit(float(x), 13.6)[7, 32] for x in range(200, 216)]
    assert max(shining) > 1e4
    assert min(shining) < 100.0


def test_outside_beside_and_far_away_nothing_changes() -> None:
    assert np.all(lit(0.0, 50.0) == np.float32(SKY / np.pi))
    endless = lit(250.0, np.inf)
    assert np.all(endless == np.float32(SKY / np.pi))
    assert lit(250.0, 40.0)[24, 0] == np.float32(SKY / np.pi)  # 21 m to the left, outside its walls
    light = TunnelLight((TUNNEL,), SKY)
    assert light.is_seen_by(CameraPose((0.0, 0.0, 1.4), 0.0))
    assert not light.is_seen_by(CameraPose((5000.0, 0.0, 1.4), 0.0))
    assert not TunnelLight((), SKY).is_seen_by(CameraPose((0.0, 0.0, 1.4), 0.0))
