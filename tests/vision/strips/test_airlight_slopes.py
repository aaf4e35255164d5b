"""Airlight that darkens toward the road: its table is that of the atmosphere, and strips drawn with it come back."""

import math
from dataclasses import replace

import numpy as np
import pytest

from fogsim.atmosphere import Droplets
from fogsim.atmosphere.fog.layer_airlight import slant_airlight, slant_share
from fogsim.values import FogField
from fogsim.vision.lines.horizon import calibrated_horizon
from fogsim.vision.strips.airlight_slopes import (
    DROPLET_CHANCES,
    LASTS,
    MOST,
    MOST_CLOUD,
    OTHER_ROAD,
    OVEREXPOSURE,
    SKY_DEVIATION,
    DropletMemory,
    darkening_of_bins,
    darkening_priors,
    joint_prior,
    row_airlight,
    slope_table,
)
from fogsim.vision.strips.joint_fit import fit_jointly
from fogsim.vision.strips.joint_kernels import DEPTH_STEP, FIRST_DEPTH, JointPrior
from fogsim.vision.strips.sky import Sky
from fogsim.vision.strips.strip_curves import StripCurves
from tests.vision.strips.koschmieder_strips import AIRLIGHT, CAMERA, GEOMETRY, NOISE, PRIOR, curves, transmittance

HEIGHTS = (0.01, 0.19)
KINDS = (Droplets.MODERATE_RADIATION, Droplets.HEAVY_RADIATION, Droplets.HEAVY_ADVECTION)


def darkened(grazing: np.ndarray, prior: JointPrior) -> tuple[np.ndarray, np.ndarray]:
    return darkening_of_bins(grazing, GEOMETRY.below, prior, slope_table().angle, slope_table().below)


def darkness(albedo, level):
    """By how much the airlight over land darkens where over black land the level one is so much of E / π."""
    return (1.0 - albedo) * (1.0 - level) / (level + albedo * (1.0 - level))


def around(extinction, albedo, droplets):
    field = FogField(extinction, (1.0,) * 3, top=7.5 / extinction, ground_albedo=albedo)
    return slant_airlight(field, CAMERA.mount_height, droplets)


def shares(angles, extinction, albedo, droplets=Droplets.MODERATE_RADIATION):
    """Airlight at angles above the horizon over the level one: to the sky and to the road."""
    sine = np.sin(angles)
    to_road = CAMERA.mount_height / np.maximum(-sine, 1e-9)
    lost = np.where(sine < 0.0, 1.0 - np.exp(-extinction * to_road), 1.0)
    found = around(extinction, albedo, droplets)
    return slant_share(found, sine, lost) / slant_share(found, np.zeros(1), np.ones(1))[0]


def sky(extinction, albedo, luminance=AIRLIGHT, droplets=Droplets.MODERATE_RADIATION):
    """A sky that brightens as that layer has it, seen between two heights."""
    height = np.linspace(*HEIGHTS, 24)
    bend, slope, level = np.polyfit(height, luminance * shares(height, extinction, albedo, droplets), 2)
    slope += bend * sum(HEIGHTS)
    return Sky(level, 0.5, 0.5, 1.0, 0.0, 0.0, 0.0, 0.02, 0.01, slope, 0.03 * luminance, HEIGHTS)


def strips(extinction, albedo, seed=0, droplets=Droplets.MODERATE_RADIATION):
    """Curves before airlight that darkens toward the road."""
    even = curves(extinction, seed)
    share = shares(-GEOMETRY.grazing, extinction, albedo, droplets)
    missing = AIRLIGHT * (1.0 - share) * (1.0 - transmittance(extinction))
    return StripCurves(even.luminance - missing, np.full(missing.shape, NOISE**2), np.full(missing.shape, 2.0))


def test_levels_of_the_kernels_are_those_of_the_table():
    table = slope_table()
    assert table.depth[0] == pytest.approx(FIRST_DEPTH)
    assert np.diff(np.log(table.depth)) == pytest.approx(DEPTH_STEP)
    assert len(table.below) == len(DROPLET_CHANCES) == len(KINDS)
    assert sum(DROPLET_CHANCES) == pytest.approx(1.0)
    assert (np.diff(table.angle) > 0).all()


@pytest.mark.parametrize(
    ("kind", "albedo", "visibility"),
    [(0, 0.05, 50.0), (1, 0.2, 100.0), (2, 0.8, 300.0), (0, 0.8, 100.0), (1, 0.05, 300.0), (2, 0.2, 50.0)],
)
def test_the_table_is_that_of_the_atmosphere_whatever_the_albedo(visibility, albedo, kind):
    k, droplets = math.log(20.0) / visibility, KINDS[kind]
    angles = np.array([0.005, 0.02, 0.06, 0.15])
    black = around(k, 0.0, droplets)
    level = 0.34 * slant_share(black, np.zeros(1), np.ones(1))[0]
    factor, table = darkness(albedo, level), slope_table()
    at = np.interp(math.log(k * CAMERA.mount_height), np.log(table.depth), np.arange(table.depth.size))
    for rows, sign in ((table.below[kind], -1.0), (table.above[kind], 1.0)):
        low, on = int(at), at - int(at)
        shape = np.interp(angles, table.angle, rows[low] * (1.0 - on) + rows[low + 1] * on)
        assert 1.0 + sign * factor * shape == pytest.approx(shares(sign * angles, k, albedo, droplets), abs=0.03)


@pytest.mark.parametrize(("albedo", "visibility"), [(0.05, 50.0), (0.2, 120.0), (0.6, 300.0), (0.05, 300.0)])
def test_strips_over_dark_land_come_back_and_even_airlight_reads_them_too_long(visibility, albedo):
    k = math.log(20.0) / visibility
    priors = (PRIOR, *darkening_priors(PRIOR, sky(k, albedo)))
    assert len(priors) == 4
    fits = [fit_jointly(strips(k, albedo, seed), GEOMETRY, priors) for seed in range(6)]
    off = np.array([(fit.extinction - k) / fit.extinction_deviation for fit in fits])
    assert np.sqrt((off**2).mean()) < 2.0
    assert np.median([fit.extinction for fit in fits]) == pytest.approx(k, rel=0.08)
    evens = [fit_jointly(strips(k, albedo, seed), GEOMETRY, (PRIOR,)) for seed in range(6)]
    assert np.median([fit.extinction for fit in evens]) < (0.96 if albedo < 0.5 else 0.99) * k
    assert np.median([fit.darkening_chance for fit in fits]) > 0.9
    assert {fit.darkening_chance for fit in evens} == {0.0}


@pytest.mark.parametrize("kind", [0, 2])
def test_strips_tell_droplets_apart_over_many_pictures(kind):
    k = 0.03
    priors = (PRIOR, *darkening_priors(PRIOR, sky(k, 0.1, droplets=KINDS[kind])))
    told = [fit_jointly(strips(k, 0.1, seed, KINDS[kind]), GEOMETRY, priors).droplets for seed in range(8)]
    assert all(len(one) == 3 and max(one) == 0.0 for one in told)
    assert np.argmax(np.median(told, axis=0)) == kind
    assert fit_jointly(strips(k, 0.1), GEOMETRY, (PRIOR,)).droplets == ()


def test_even_airlight_under_a_sky_that_brightens_is_told_by_the_road():
    """As an overcast sky does above thin fog: the road fades as Koschmieder's law has it."""
    bright = sky(0.01, 0.1)
    priors = (PRIOR._replace(airlight=bright.luminance, below=10.0, above=10.0), *darkening_priors(PRIOR, bright))
    for visibility in (60.0, 150.0):
        fits = [fit_jointly(curves(3.0 / visibility, seed), GEOMETRY, priors) for seed in range(4)]
        assert np.median([fit.extinction for fit in fits]) == pytest.approx(3.0 / visibility, rel=0.04)
        assert max(fit.darkening_chance for fit in fits) < 0.5


def test_under_an_even_or_clipped_sky_the_airlight_counts_as_even():
    bright = sky(0.03, 0.1)
    flat = Sky(200.0, 1.0, 1.0, 1.0, 0.0, 0.0, slope=4.0, slope_deviation=5.0, heights=HEIGHTS)
    unsure = Sky(200.0, 1.0, 1.0, 1.0, 0.0, 0.0, slope=100.0, slope_deviation=80.0, heights=HEIGHTS)
    clipped = Sky(200.0, 1.0, 1.0, 1.0, 0.5, 0.5, slope=bright.slope, slope_deviation=5.0, heights=HEIGHTS)
    for one in (flat, unsure, clipped, Sky(200.0, 1.0, 1.0, 1.0, 0.0, 0.0)):
        assert darkening_priors(PRIOR, one) == ()
        assert row_airlight(one, CAMERA) is None
    darker, by_row = darkened(GEOMETRY.grazing, PRIOR)
    assert darker.shape == by_row.shape == (0, GEOMETRY.below.size)


@pytest.mark.parametrize("albedo", [0.1, 0.4, 0.8])
def test_rows_have_the_airlight_of_the_layer_within_its_deviation(albedo):
    k = 0.03
    found = row_airlight(sky(k, albedo), CAMERA)
    rows = np.array([-40, -10, -3, 3, 10, 40, 120]) + round(CAMERA.horizon_row)
    angle = np.arctan((CAMERA.horizon_row - rows) / CAMERA.focal_length)
    assert found.level == pytest.approx(AIRLIGHT, rel=0.02)
    assert np.abs(found.share[rows] - shares(angle, k, albedo)).max() < 0.06
    assert (np.abs(found.share[rows] - shares(angle, k, albedo)) < 2.5 * found.deviation[rows] + 0.01).all()
    assert (np.diff(found.share) <= 1e-12).all()


@pytest.mark.parametrize("k", [0.01, 0.06, 0.5])
def test_rows_are_closer_with_the_extinction_that_is_known(k):
    angle = np.arctan((CAMERA.horizon_row - np.arange(CAMERA.height)) / CAMERA.focal_length)
    truth = shares(angle, k, 0.05)
    usual, known = (row_airlight(sky(k, 0.05), CAMERA, one).share for one in (0.03, k))
    assert np.abs(known - truth).max() < 0.8 * np.abs(usual - truth).max()


def test_derivative_by_row_is_that_of_the_table():
    prior = darkening_priors(PRIOR, sky(0.03, 0.1))[0]
    darker, by_row = darkened(GEOMETRY.grazing, prior)
    moved, _ = darkened(GEOMETRY.grazing * (GEOMETRY.below - 0.01) / GEOMETRY.below, prior)
    close = np.isclose(moved - darker, 0.01 * by_row, atol=2e-6)
    # But where a bin lies on one of the table's angles.
    assert close.mean() > 0.95


HORIZON = calibrated_horizon(CAMERA, np.radians(0.1))
SKY = Sky(200.0, 1.5, 3.0, 1.0, 0.0, 0.0, 0.4, 0.05)


def clipped(saturated, share=0.5, luminance=254.0):
    return joint_prior(SKY._replace(luminance=luminance, saturated=saturated, clipped=share), CAMERA, HORIZON)


def test_an_open_sky_is_the_airlight_within_its_deviation():
    prior = joint_prior(SKY, CAMERA, HORIZON)
    assert prior.airlight == SKY.luminance
    assert prior.below == pytest.approx(np.hypot(SKY_DEVIATION * 200.0, 1.5))
    assert prior.above == pytest.approx(np.hypot(SKY_DEVIATION * 200.0, 3.0))
    assert (prior.shift, prior.shift_deviation) == (0.0, HORIZON.standard_deviation)
    assert (prior.vignetting, prior.vignetting_deviation) == (0.4, 0.05)
    assert joint_prior(SKY, CAMERA, replace(HORIZON, row=HORIZON.row + 1.7)).shift == pytest.approx(1.7)
    cloud = [joint_prior(SKY._replace(unevenness=uneven), CAMERA, HORIZON).cloud for uneven in (0.0, 0.015, 0.025, 0.5)]
    assert cloud[:2] == [0.0, 0.0]
    assert 0.0 < cloud[2] < cloud[3] == MOST_CLOUD


def test_a_wholly_saturated_sky_may_be_much_brighter_and_half_saturated_it_is_half_a_level_below_the_end():
    prior = clipped(1.0)
    assert prior.airlight >= 255.0
    assert prior.above == pytest.approx(OVEREXPOSURE * 255.0)
    assert prior.below < 3.0
    # Where but one colour is clipped, the others still show how bright it is.
    assert clipped(0.0).above < 0.5 * prior.above
    assert clipped(0.5).airlight == pytest.approx(254.5)
    brightness = [clipped(share).airlight for share in (0.1, 0.3, 0.5, 0.9, 0.97)]
    assert brightness == sorted(brightness)


LARGE = (-2.0, -1.0, 0.0)
"""What a picture says of droplets that are large."""


def learnt(*pictures, speed=20.0, period=1.0):
    """Chances after pictures."""
    memory = DropletMemory()
    for number, picture in enumerate(pictures):
        memory.learn(picture, number * period, speed)
    return memory.chances


def test_a_picture_counts_by_the_road_in_it_that_is_new():
    standing = learnt(*[LARGE] * 50, speed=0.0)
    assert standing == pytest.approx(DROPLET_CHANCES)
    far = learnt(LARGE, LARGE, speed=2.0 * OTHER_ROAD)
    expected = np.array(DROPLET_CHANCES) * np.exp(LARGE)
    assert far == pytest.approx(expected / expected.sum(), rel=0.2)
    # As often as one likes: the way decides.
    often, seldom = learnt(*[LARGE] * 101, period=0.05), learnt(*[LARGE] * 6, period=1.0)
    assert often == pytest.approx(seldom, abs=0.02)
    assert DropletMemory().chances == pytest.approx(DROPLET_CHANCES)
    assert learnt((), (), ()) == pytest.approx(DROPLET_CHANCES)
    assert learnt(*[(0.0, 0.0, 0.0)] * 5) == pytest.approx(DROPLET_CHANCES)


def test_over_a_way_pictures_overrule_what_is_usual_one_alone_cannot_and_all_is_forgotten():
    assert learnt(*[LARGE] * 12)[2] > 0.9
    alone = learnt(LARGE, (0.0, -50.0, -90.0), speed=2.0 * OTHER_ROAD)
    assert alone[1] / alone[0] >= DROPLET_CHANCES[1] / DROPLET_CHANCES[0] * np.exp(-MOST) * 0.9
    memory = DropletMemory()
    for number in range(20):
        memory.learn(LARGE, float(number), 20.0)
    memory.learn((0.0, 0.0, 0.0), 20.0 + 10.0 * LASTS / 20.0, 20.0)
    assert memory.chances == pytest.approx(DROPLET_CHANCES, abs=0.01)
