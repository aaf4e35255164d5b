import math
from dataclasses import replace

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.estimators import FoggyRoad, extinction_bound
from fogsim.values import Camera, CameraPose
from fogsim.values.pinhole import ray_from_pixel

LN20 = math.log(20.0)
CAMERA = Camera(688, 515, 700.0, (343.5, 257.0), 1.3)
SMALL = Camera(160, 120, 150.0, (79.5, 55.0), 1.4, pitch=0.04)
VISIBILITIES = np.array([30, 50, 75, 100, 150, 200, 300, 400, 500, 800, 1000])
SCENE = FoggyRoad(extinction=LN20 / 100.0, airlight=200.0, road=60.0, noise=2.0)
PATCHES = {"patch_deviation": 0.03, "patch_length": 7.7}
TENTH = math.radians(0.1)


def relative_bounds(**options):
    """Bounds of the visibilities, in per cent."""
    fogs = [replace(SCENE, extinction=LN20 / visibility, **options) for visibility in VISIBILITIES]
    return np.array([100.0 * extinction_bound(CAMERA, fog) / fog.extinction for fog in fogs])


def test_noise_alone_allows_what_a_prototype_found():
    # Of a prototype with this camera, airlight and noise (1 or 2); its road's width and level were not written down.
    found = relative_bounds(lane_width=2.0, road=40.0)
    told = np.array([0.08, 0.07, 0.07, 0.08, 0.09, 0.10, 0.12, 0.14, 0.17, 0.23, 0.27])
    assert np.abs(np.log(found / told)).max() < math.log(1.45)
    assert np.abs(np.log(found / told))[VISIBILITIES >= 50].max() < math.log(1.2)
    assert VISIBILITIES[found.argmin()] <= 75
    assert (np.diff(found[VISIBILITIES >= 75]) > 0.0).all()


def test_patches_cost_the_same_share_in_every_fog():
    # The prototype had 2 to 2.9 % with patches up to 7.7 m long.
    found = relative_bounds(pitch_deviation=TENTH, **PATCHES)
    assert found.min() > 1.7
    assert found.max() < 2.9
    assert found.max() < 1.3 * found.min()


@pytest.mark.parametrize("patches", [{}, PATCHES])
def test_what_is_known_less_never_helps(patches):
    def bounds(name, values):
        return [extinction_bound(CAMERA, replace(SCENE, **{**patches, name: value})) for value in values]

    pitch = bounds("pitch_deviation", (0.0, 1e-6, 1e-4, 1e-3, 0.01, 0.2))
    assert np.diff(pitch).min() > 0.0
    assert pitch[1] == pytest.approx(pitch[0], rel=0.01)
    assert np.diff(bounds("noise", (0.5, 1.0, 2.0, 5.0))).min() > 0.0
    assert np.diff(bounds("road", (20.0, 60.0, 120.0, 180.0))).min() > 0.0
    assert np.diff(bounds("lanes", (1, 2, 3))).max() < 0.0


def test_patches_longer_than_the_road_are_its_level_and_shorter_than_a_row_are_none():
    even = extinction_bound(CAMERA, SCENE)
    for length, near in ((1000.0, 0.15), (0.01, 2.0)):
        patchy = extinction_bound(CAMERA, replace(SCENE, patch_deviation=0.002, patch_length=length))
        assert even < patchy < (1.0 + near) * even
    assert extinction_bound(CAMERA, replace(SCENE, patch_deviation=1e-6)) == pytest.approx(even, rel=1e-3)


def test_a_road_as_bright_as_the_airlight_tells_nothing():
    assert math.isinf(extinction_bound(CAMERA, replace(SCENE, road=SCENE.airlight)))
    assert math.isinf(extinction_bound(CAMERA, replace(SCENE, road=0.0, airlight=0.0, patch_deviation=0.03)))


def test_patches_of_a_road_as_bright_as_the_airlight_fade():
    same = replace(SCENE, road=SCENE.airlight, **PATCHES)
    assert extinction_bound(CAMERA, same) > 3.0 * extinction_bound(CAMERA, replace(SCENE, **PATCHES))


def test_a_picture_without_road_tells_nothing():
    upward = replace(CAMERA, pitch=-0.6)
    for patches in ({}, PATCHES):
        assert math.isinf(extinction_bound(upward, replace(SCENE, **patches)))


def test_a_picture_without_sky_tells_less():
    downward = replace(CAMERA, height=300, principal_point=(343.5, -1.0))
    with_sky = replace(CAMERA, height=400, principal_point=(343.5, 99.0))
    thin = replace(SCENE, extinction=LN20 / 500.0)
    assert extinction_bound(downward, thin) > 2.0 * extinction_bound(with_sky, thin)


def test_clear_air_has_a_bound():
    clear, hazy = (extinction_bound(CAMERA, replace(SCENE, extinction=k)) for k in (0.0, 1e-6))
    assert 0.0 < clear == pytest.approx(hazy, rel=0.01)


def row_levels(camera, k, airlight, road, pitch):
    """Rows' mean levels of road by rays in space, their pixels in a lane of 2.8 m, and where each begins and ends."""
    rows = np.arange(camera.height)
    rows = rows[rows >= camera.horizon_row + 1.0]
    turned = replace(camera, pitch=camera.pitch + pitch)
    matrix = ray_from_pixel(turned, CameraPose((0.0, 0.0, camera.mount_height), 0.0))

    def ground(v):
        rays = np.stack((np.full(len(v), camera.principal_point[0]), v, np.ones(len(v))), axis=1) @ matrix.T
        return camera.mount_height / -rays[:, 2:] * rays

    slant, near, far = np.linalg.norm(ground(rows), axis=1), ground(rows + 0.5)[:, 0], ground(rows - 0.5)[:, 0]
    depth = camera.mount_height / -(np.stack((0 * rows, rows, 0 * rows + 1), axis=1) @ matrix.T)[:, 2]
    kept = np.exp(-k * slant)
    pixels = np.minimum(2.8 * camera.focal_length / depth, camera.width)
    return airlight * (1.0 - kept) + road * kept, road * kept, pixels, near, far


def differences(function, at, steps):
    """Central differences of a function of parameters."""
    return [(function(*(at + step)) - function(*(at - step))) / (2.0 * step.sum()) for step in np.diag(steps)]


@pytest.mark.parametrize("deviation", [0.0, 0.05])
def test_patches_are_those_whose_edges_lie_anywhere(deviation):
    length, noise = 4.0, 2.0
    truth, steps = np.array([0.03, 200.0, 60.0, 0.0]), np.array([1e-6, 1e-2, 1e-2, 1e-6])
    *_, pixels, near, far = row_levels(SMALL, *truth)
    alike, phases = np.zeros((len(near), len(near))), 200
    for phase in np.arange(phases) / phases:
        edges = (np.arange(-1, math.ceil(far.max() / length) + 1) + phase) * length
        shown = np.minimum(far[:, None], edges[1:]) - np.maximum(near[:, None], edges[:-1])
        share = np.maximum(shown, 0.0) / (far - near)[:, None]
        alike += share @ share.T / phases

    def mean(*values):
        return row_levels(SMALL, *values)[0]

    def covariance(*values):
        own = row_levels(SMALL, *values)[1]
        return np.diag(noise**2 / pixels) + deviation**2 * np.outer(own, own) * alike

    weights = np.linalg.inv(covariance(*truth))
    slopes = np.array(differences(mean, truth, steps))
    fading = [weights @ change for change in differences(covariance, truth, steps)]
    information = slopes @ weights @ slopes.T + [[0.5 * np.trace(a @ b) for b in fading] for a in fading]
    information[1, 1] += SMALL.width * np.count_nonzero(np.arange(120) <= SMALL.horizon_row - 1.0) / noise**2
    information[3, 3] += TENTH**-2
    scene = FoggyRoad(
        extinction=0.03,
        airlight=200.0,
        road=60.0,
        noise=noise,
        pitch_deviation=TENTH,
        patch_deviation=deviation,
        patch_length=length,
    )
    assert extinction_bound(SMALL, scene) == pytest.approx(np.linalg.inv(information)[0, 0] ** 0.5, rel=2e-3)


def test_what_no_road_can_be_is_refused():
    below = dict.fromkeys(("noise", "lane_width", "patch_length"), 0.0) | {"extinction": -0.01, "pitch_deviation": -1.0}
    other = {"airlight": math.nan, "road": math.inf, "lanes": 1.5, "patch_deviation": 3.0}
    for name, value in (below | other).items():
        with pytest.raises(InputError, match=f"FoggyRoad: {name} must be a (whole )?number .*, got {value}"):
            replace(SCENE, **{name: value})
