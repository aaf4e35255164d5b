import math
from dataclasses import replace

import pytest

from fogsim.estimators.signs.regions import GATE, PoseDeviation, project_sightings
from fogsim.values import Camera, SignSighting

CAMERA = Camera(1400, 600, 1100.0, (700.0, 280.0), 1.3)
SIGN = SignSighting("s", "speed_limit", 22.2, 48.0, -5.0, 0.9, 2.3)
EXACT = PoseDeviation(0.0, 0.0, 0.0, 0.0)


def test_a_sign_is_where_a_pinhole_shows_it() -> None:
    (seen,) = project_sightings([SIGN], CAMERA, 2.0)
    assert seen.u == pytest.approx(700.0 + 1100.0 * 5.0 / 50.0)
    assert seen.v == pytest.approx(280.0 - 1100.0 * 1.0 / 50.0)
    assert seen.radius == pytest.approx(1100.0 * 0.45 / 50.0)
    assert seen.distance == pytest.approx(math.sqrt(50.0**2 + 5.0**2 + 1.0))
    assert seen.expected


def test_a_sign_at_the_cameras_height_is_on_the_horizon_whatever_pitch_and_roll() -> None:
    pitched = replace(CAMERA, pitch=math.radians(3.0))
    (seen,) = project_sightings([replace(SIGN, height=1.3, lateral=0.0, distance=1e3, diameter=9.0)], pitched, 0.0)
    assert seen.v == pytest.approx(pitched.horizon_row)
    rolled = replace(CAMERA, roll=math.radians(10.0))
    (level,), (turned,) = (project_sightings([SIGN], camera, 2.0) for camera in (CAMERA, rolled))
    assert turned.v > level.v  # the right side is turned down
    assert math.dist((turned.u, turned.v), (700, 280)) == pytest.approx(math.dist((level.u, level.v), (700, 280)))


def test_regions_are_as_large_as_the_pose_is_unsure() -> None:
    (near,), (far,) = (project_sightings([replace(SIGN, distance=d)], CAMERA, 2.0) for d in (18.0, 98.0))
    assert near.deviation_u == pytest.approx(math.hypot(27.5, 0.25 * 27.5, 3.84), rel=1e-3)
    assert far.deviation_u == pytest.approx(math.hypot(5.5, 0.05 * 5.5, 3.84), rel=1e-3)
    assert far.region.half_width == pytest.approx(GATE * far.deviation_u)
    (exact,) = project_sightings([SIGN], CAMERA, 2.0, EXACT)
    assert (exact.deviation_u, exact.deviation_v) == (0.0, 0.0)


@pytest.mark.parametrize(
    "other",
    [
        {"distance": -5.0},
        {"distance": math.nan},
        {"lateral": 45.0},
        {"height": -60.0},
        {"diameter": 0.0},
        {"distance": 400.0},
    ],
)
def test_what_the_picture_cannot_show_is_not_looked_for(other: dict[str, float]) -> None:
    assert project_sightings([replace(SIGN, **other)], CAMERA, 2.0) == ()


def test_a_sign_at_the_border_is_looked_for_but_not_expected() -> None:
    (seen,) = project_sightings([replace(SIGN, lateral=-31.8)], CAMERA, 2.0)
    assert not seen.expected
