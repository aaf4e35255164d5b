"""How far one sees by own lamps: the scenario of gallen2014 section II, and what glare does to it."""

import math

import numpy as np
import pytest

from fogsim.atmosphere.visibility.night_visibility import FogKind, Pavement, high_beam_veil, visibility_distance
from fogsim.errors import InputError
from fogsim.lighting.beams import high_beam, low_beam, scaled_beam
from fogsim.values import Beam
from fogsim.values.eye import veiling_luminance

CLEAR = math.inf
PAVEMENT = Pavement()


def even_pair(candela):
    """A pair of lamps that shines the same everywhere."""
    return Beam(np.array([-1.5, 1.5]), np.array([-1.5, 1.5]), np.full((2, 2), candela / 2.0))


def crossing(difference, low, high):
    """Where a difference turns positive, by bisection on a logarithmic scale."""
    for _ in range(40):
        middle = math.sqrt(low * high)
        low, high = (low, middle) if difference(middle) > 0 else (middle, high)
    return high


def equal_to_clear_low(high, low, kind, pavement=PAVEMENT):
    """Visibility at which high beams in fog show as far as low beams in clear air (eq. 12)."""
    far = visibility_distance(low, CLEAR, pavement=pavement)
    return crossing(lambda v: visibility_distance(high, v, kind, pavement=pavement) - far, 20, 5000)


def equal_in_fog(high, low, kind, share, pavement=PAVEMENT):
    """Visibility at which high and low beams show equally far (eq. 11)."""

    def difference(v):
        by_low = visibility_distance(low, v, kind, veil_share=share, pavement=pavement)
        return visibility_distance(high, v, kind, pavement=pavement) - by_low

    return crossing(difference, 20, 5000)


@pytest.mark.parametrize(
    ("kind", "veils"),
    [
        (FogKind.RADIATION, (2.557, 1.757, 0.986, 0.525, 0.358, 0.219)),
        (FogKind.ADVECTION, (0.890, 0.589, 0.319, 0.166, 0.112, 0.068)),
    ],
)
def test_veil_of_high_beams(kind, veils):
    ours = [high_beam_veil(v, kind) for v in (30, 50, 100, 200, 300, 500)]
    assert ours == pytest.approx(veils, rel=5e-3)
    assert high_beam_veil(CLEAR, kind) == 0.0


def test_clear_air_by_even_light():
    for kilocandela, distances in [
        (20, (50.5, 45.0, 39.0)),
        (40, (59.8, 53.0, 46.0)),
        (80, (69.8, 62.0, 53.5)),
        (160, (81.0, 71.5, 62.2)),
    ]:
        for road, distance in zip((0.010, 0.0125, 0.015), distances, strict=True):
            seen = visibility_distance(even_pair(1000 * kilocandela), CLEAR, pavement=Pavement(road))
            assert seen == pytest.approx(distance, rel=0.01)


@pytest.mark.parametrize(("road", "high", "low"), [(0.010, 64.6, 55.3), (0.0125, 57.6, 48.8), (0.015, 50.6, 41.5)])
def test_clear_air_by_median_beams(road, high, low):
    assert visibility_distance(high_beam(), CLEAR, pavement=Pavement(road)) == pytest.approx(high, rel=0.005)
    assert visibility_distance(low_beam(), CLEAR, pavement=Pavement(road)) == pytest.approx(low, rel=0.005)


def test_high_beams_in_fog():
    for kind, road, in_fog, in_thick_fog in [
        (FogKind.RADIATION, 0.010, 37.1, 21.8),
        (FogKind.RADIATION, 0.0125, 34.6, 20.7),
        (FogKind.ADVECTION, 0.0125, 40.0, 25.0),
        (FogKind.ADVECTION, 0.015, 36.7, 23.7),
    ]:
        for visibility, distance in ((300, in_fog), (100, in_thick_fog)):
            seen = visibility_distance(high_beam(), visibility, kind, pavement=Pavement(road))
            assert seen == pytest.approx(distance, rel=0.01)


@pytest.mark.parametrize(
    ("road", "eleven", "twelve"),
    [(0.010, (142, 76), (407, 266)), (0.0125, (132.6, 69.9), (349.1, 229.9)), (0.015, (125, 63), (339, 222))],
)
def test_limits_of_the_paper_lie_between_its_two_fogs(road, eleven, twelve):
    low, pavement = scaled_beam(low_beam(), 0.30), Pavement(road)
    for kind, equal, far in zip(FogKind, eleven, twelve, strict=True):
        assert equal_in_fog(high_beam(), low, kind, 0.10, pavement) == pytest.approx(equal, rel=0.05)
        assert equal_to_clear_low(high_beam(), low, kind, pavement) == pytest.approx(far, rel=0.05)


def test_full_us_low_beams_do_not_give_the_300_m():
    assert equal_to_clear_low(high_beam(), low_beam(), FogKind.RADIATION) == pytest.approx(1195, rel=0.05)
    assert equal_to_clear_low(high_beam(), low_beam(), FogKind.ADVECTION) == pytest.approx(722, rel=0.05)


@pytest.mark.parametrize(("strength", "limit"), [(1.0, (181, 5)), (0.5, (34, 5)), (0.25, (20, 1))])
def test_one_veil_for_both_beams_does_not_give_the_100_m(strength, limit):
    equal = equal_in_fog(high_beam(), scaled_beam(low_beam(), strength), FogKind.RADIATION, 1.0)
    assert equal == pytest.approx(limit[0], abs=limit[1])


def test_oncoming_lamps_shorten_sight_and_nothing_is_seen_without_light():
    # A pair of low beams of 500 cd each, 60 m ahead, 3.5 m aside: E = 2 · 500 / 60² at the eye, 3.3° off the road.
    glare = float(veiling_luminance(2 * 500 / 60**2, math.atan2(3.5, 60)))
    blinded = visibility_distance(low_beam(), 300, veil_share=0.1, glare=glare)
    assert blinded < 0.95 * visibility_distance(low_beam(), 300, veil_share=0.1)
    assert visibility_distance(scaled_beam(low_beam(), 0.0), CLEAR) == 0.0


def test_impossible_arguments_are_refused():
    for call, message in [
        (lambda: visibility_distance(low_beam(), 0.0), "meteorological visibility"),
        (lambda: visibility_distance(low_beam(), math.nan), "meteorological visibility"),
        (lambda: visibility_distance(low_beam(), 100, veil_share=-1), "veil_share"),
        (lambda: visibility_distance(low_beam(), 100, level=0), "level must be positive"),
        (lambda: veiling_luminance(-1.0, 0.1), "illuminance"),
        (lambda: veiling_luminance(1.0, -0.1), "angle of a glare source"),
        (lambda: veiling_luminance(1.0, 0.1, age=0), "age must be positive"),
    ]:
        with pytest.raises(InputError, match=message):
            call()
