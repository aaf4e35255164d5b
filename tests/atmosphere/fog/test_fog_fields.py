"""Layers, ground fog, patches, wind and change over time: extinction and optical depth."""

import dataclasses
import math

import numpy as np
import pytest

from fogsim.atmosphere import (
    FieldAccess,
    FogNow,
    distance_at_depth,
    extinction,
    field_at,
    optical_depth,
    optical_depth_along,
)
from fogsim.atmosphere.fog.medium import PATCH_CELLS, medium_of, patch_factors
from fogsim.atmosphere.fog.optical_depth_kernels import extinctions_on_ray
from fogsim.errors import InputError
from fogsim.values import FogBank, FogChange, FogField, FogPatches, FogShelter
from tests.atmosphere.fields import AIRLIGHT, BANK, PATCHES, UNEVEN, brute_force

GROUND_FOG = FogField(0.05, AIRLIGHT, scale_height=4.0)


def test_ground_fog_has_its_closed_form_and_is_not_surely_anywhere() -> None:
    # τ = k h (e^(−z₁/h) − e^(−z₂/h)) / sin γ
    start, end = np.array([5.0, 6.0, 1.2]), np.array([85.0, 6.0, 9.5])
    slope = (end[2] - start[2]) / np.linalg.norm(end - start)
    expected = 0.05 * 4.0 * (math.exp(-1.2 / 4.0) - math.exp(-9.5 / 4.0)) / slope
    assert optical_depth(GROUND_FOG, start, end) == pytest.approx(expected, rel=1e-6)
    level = np.array([85.0, 6.0, 1.2])
    assert optical_depth(GROUND_FOG, start, level) == pytest.approx(80.0 * 0.05 * math.exp(-0.3), rel=1e-6)
    assert optical_depth(GROUND_FOG, (0, 0, 0), (0, 0, 1e5)) == pytest.approx(0.05 * 4.0, rel=1e-6)
    assert FieldAccess(GROUND_FOG).minimum_extinction == 0.0
    assert FieldAccess(UNEVEN["lifted"]).minimum_extinction == 0.0


def test_a_soft_layer_weighs_as_much_as_a_sharp_one() -> None:
    soft = FogField(0.04, AIRLIGHT, base=10.0, base_edge=6.0, top=40.0, top_edge=20.0)
    assert optical_depth(soft, (0, 0, 0), (30, 0, 100)) == pytest.approx(0.04 * 30.0 * math.hypot(0.3, 1.0), rel=1e-9)
    assert extinction(soft, (0, 0, 6.9)) == 0.0
    assert extinction(soft, (0, 0, 10.0)) == pytest.approx(0.02)
    assert extinction(soft, (0, 0, 25.0)) == pytest.approx(0.04)
    assert extinction(soft, (0, 0, 50.1)) == 0.0


def test_optical_depth_against_brute_force() -> None:
    for name in UNEVEN:
        rng = np.random.default_rng(5)
        starts, ends = (rng.uniform((-100, -100, 0), (300, 200, 30), (8, 3)) for _ in range(2))
        slow = np.array([brute_force(UNEVEN[name], a, b, 50_000) for a, b in zip(starts, ends, strict=True)])
        assert np.allclose(optical_depth(UNEVEN[name], starts, ends), slow, rtol=2e-3, atol=1e-4)


def test_optical_depth_along_a_line_is_that_between_its_ends() -> None:
    for name in UNEVEN:
        start, direction = np.array([0.0, 5.0, 1.5]), np.array([0.8, 0.6, 0.0])
        distances = np.geomspace(1.0, 2000.0, 60)
        along = optical_depth_along(UNEVEN[name], start, direction, distances)
        between = optical_depth(UNEVEN[name], start, start + distances[:, None] * direction)
        assert np.allclose(along, between, rtol=5e-3, atol=1e-4)


def test_the_distance_at_a_depth_is_where_the_depth_along_the_line_comes_to_it() -> None:
    for name in UNEVEN:
        start, direction = np.array([0.0, 5.0, 1.5]), np.array([0.8, 0.592, 0.1])
        distances = np.geomspace(1.0, 500.0, 60)
        along = optical_depth_along(UNEVEN[name], start, direction, distances)
        for depth in (1e-3, 0.3 * along[-1], 0.99 * along[-1]):
            found = distance_at_depth(UNEVEN[name], start, direction, distances, float(depth))
            assert found == np.interp(depth, along, distances)
        assert distance_at_depth(UNEVEN[name], start, direction, distances, 1.01 * float(along[-1])) == math.inf


def test_a_whole_ray_has_the_extinction_of_its_places_one_by_one_digit_for_digit() -> None:
    """Parts of the fog that are the same at both ends of a ray are not looked at in between."""
    for name in UNEVEN:
        medium, at = medium_of(field_at(UNEVEN[name], 0.0)), np.geomspace(0.5, 400.0, 40)
        for direction in ((0.8, 0.6, 0.0), (0.6, 0.79, 0.12), (-0.8, 0.6, 0.0)):
            start, towards = np.array([0.0, 5.0, 1.5]), np.array(direction)
            whole, each = np.empty(len(at)), np.empty(len(at))
            extinctions_on_ray(start, towards, at, medium, whole)
            for i in range(len(at)):
                extinctions_on_ray(start, towards, at[i : i + 1], medium, each[i : i + 1])
            assert np.array_equal(whole, each)


def test_banks_alone_have_the_depth_of_banks_and_a_far_tunnel_digit_for_digit() -> None:
    """Where nothing else makes the fog uneven, the sum is taken by a shorter way."""
    banks = (
        FogBank((0.0, 0.0), (1.0, 0.0), 50.0, 160.0, 40.0, 0.05),
        FogBank((0.0, 0.0), (0.6, 0.8), 200.0, 230.0, 30.0, -0.001),
        FogBank((0.0, 0.0), (0.0, 1.0), 120.0, 180.0, 0.5, 0.02),
    )
    alone = FogField(0.003, (1000.0,) * 3, banks)
    rng = np.random.default_rng(8)
    starts, ends = (rng.uniform((-100, -100, 0), (300, 300, 30), (200, 3)) for _ in range(2))
    tunnel = FogShelter(((1e7, 1e7, 0.0), (1.1e7, 1.2e7, 0.0)), 5.0, 5.0, 50.0)
    beside_tunnel = optical_depth(dataclasses.replace(alone, shelters=(tunnel,)), starts, ends)
    assert np.array_equal(optical_depth(alone, starts, ends), beside_tunnel)
    under_top = dataclasses.replace(alone, base=-5.0, base_edge=2.0, top=50.0, top_edge=30.0)
    assert np.array_equal(optical_depth(under_top, starts, ends), beside_tunnel)
    under_low_top = dataclasses.replace(under_top, top=40.0)
    assert not np.array_equal(optical_depth(under_low_top, starts, ends), beside_tunnel)


def test_patches_keep_the_mean_and_have_their_strength_and_correlation() -> None:
    factors = patch_factors(0.8, 7).astype(np.float64)
    log = np.log(factors)
    assert factors.min() > 0
    assert factors.mean() == pytest.approx(1.0, abs=1e-5)
    assert log.std() == pytest.approx(0.8, rel=1e-3)
    shifted = np.roll(log, PATCH_CELLS, axis=2)
    # One correlation length away the correlation is 1/e, within what a finite sample can show.
    assert np.corrcoef(log.ravel(), shifted.ravel())[0, 1] == pytest.approx(math.exp(-1.0), abs=0.05)
    assert np.corrcoef(log.ravel(), np.roll(log, 3 * PATCH_CELLS, axis=1).ravel())[0, 1] == pytest.approx(0.0, abs=0.08)


def test_patches_differ_by_seed_repeat_with_it_and_are_even_without_strength() -> None:
    places = np.random.default_rng(0).uniform(0, 500, (50, 3))
    one, other = (extinction(FogField(0.01, AIRLIGHT, patches=FogPatches(40.0, 8.0, 0.8, s)), places) for s in (1, 2))
    again = extinction(FogField(0.01, AIRLIGHT, patches=FogPatches(40.0, 8.0, 0.8, 1)), places)
    assert np.array_equal(one, again)
    assert not np.allclose(one, other, rtol=0.1)
    field = FogField(0.01, AIRLIGHT, patches=FogPatches(40.0, 8.0, 0.0))
    assert optical_depth(field, (0, 0, 0), (300, 0, 5)) == pytest.approx(0.01 * math.hypot(300, 5))


def test_wind_carries_banks_and_patches() -> None:
    field = FogField(0.004, AIRLIGHT, (BANK,), patches=PATCHES, wind=(3.0, -2.0))
    places = np.random.default_rng(1).uniform((0, 0, 0), (400, 200, 20), (40, 3))
    drifted = places + 7.5 * np.array([3.0, -2.0, 0.0])
    assert np.allclose(extinction(field, drifted, time=7.5), extinction(field, places), rtol=1e-6)
    assert not np.allclose(extinction(field, places, time=7.5), extinction(field, places), rtol=0.05)


def test_fog_thickens_and_lifts_over_time() -> None:
    changes = (FogChange(10.0, 1.0, -2.0, 50.0), FogChange(30.0, 3.0, 8.0, 90.0))
    field = FogField(0.01, AIRLIGHT, base=-2.0, top=50.0, changes=changes)
    low, high = (0.0, 0.0, 1.0), (0.0, 0.0, 70.0)
    assert [float(extinction(field, low, time)) for time in (0.0, 10.0)] == pytest.approx([0.01, 0.01])
    assert float(extinction(field, low, 15.0)) == pytest.approx(0.015)
    assert float(extinction(field, low, 20.0)) == 0.0  # the base is at 3 m
    assert [float(extinction(field, high, time)) for time in (10.0, 25.0, 99.0)] == pytest.approx([0.0, 0.025, 0.03])
    assert field_at(GROUND_FOG, 12.0) is GROUND_FOG


def test_access_answers_for_its_time_and_bounds_all_times() -> None:
    changes = (FogChange(0.0, 1.0, -math.inf, 250.0), FogChange(60.0, 2.0, -math.inf, 250.0))
    access = FieldAccess(FogField(0.01, AIRLIGHT, (BANK,), top=250.0, patches=PATCHES, changes=changes))
    a, b = np.array([0.0, 0.0, 1.0]), np.array([90.0, 40.0, 1.0])
    assert access.at(60.0).optical_depth(a, b) == pytest.approx(2.0 * access.optical_depth(a, b))
    assert access.optical_depth(a, b, time=30.0) == pytest.approx(1.5 * access.optical_depth(a, b))
    places = np.random.default_rng(2).uniform((-500, -500, 0), (900, 900, 100), (2000, 3))
    for time in (0.0, 60.0):
        k = access.extinction(places, time)
        assert access.minimum_extinction <= k.min()
        assert k.max() <= access.maximum_extinction
    field = FogField(0.004, AIRLIGHT, (BANK,), patches=PATCHES, wind=(3.0, -2.0))
    now, a, b = FogNow(field), np.array([0.0, 0.0, 1.0]), np.array([90.0, 40.0, 1.0])
    for time in (0.0, 12.5):
        now.set_time(time)
        assert now.optical_depth(a, b) == optical_depth(field, a, b, time)
        assert now.extinction(b) == extinction(field, b, time)
    assert now.maximum_extinction == FieldAccess(field).maximum_extinction
    assert now.minimum_extinction == FieldAccess(field).minimum_extinction


def test_impossible_fields_are_refused() -> None:
    for make, told in [
        (lambda: FogBank((0.0, 0.0), (1.0, 0.0), 200.0, 100.0, 10.0, 0.01), "end beyond its start"),
        (lambda: FogBank((0.0, 0.0), (1.0, 0.0), 0.0, 100.0, 0.0, 0.01), "edge"),
        (lambda: FogPatches(0.0, 5.0, 0.5), "correlation_length"),
        (lambda: FogPatches(20.0, math.nan, 0.5), "correlation_height"),
        (lambda: FogPatches(20.0, 5.0, 2.5), "strength"),
        (lambda: FogField(-0.01, AIRLIGHT), "extinction"),
        (lambda: FogField(math.nan, AIRLIGHT), "extinction"),
        (lambda: FogField(0.01, (1.0, -1.0, 1.0)), "airlight"),
        (lambda: FogField(0.01, AIRLIGHT, scale_height=0.0), "scale height"),
        (lambda: FogField(0.01, AIRLIGHT, base=20.0, top=10.0), "above its base"),
        (lambda: FogField(0.01, AIRLIGHT, changes=(FogChange(5.0, 1.0, 0.0, 9.0),) * 2), "increase"),
    ]:
        with pytest.raises(InputError, match=told):
            make()
