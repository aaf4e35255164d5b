"""What a driver can see: check values of Allard's and Koschmieder's laws, their limits, and dusk between them."""

import math

import numpy as np
import pytest

from fogsim.traffic.drivers.adaptation import DAY_EYE_THRESHOLD, HEAD_LAMP_LUMINANCE, adaptation, airlight_luminance
from fogsim.traffic.drivers.lamp_intensity import BRIGHTEST
from fogsim.traffic.drivers.sight import DriverSight, inherent_contrast
from fogsim.units import extinction_from_visibility

DAY, NIGHT, DARK = DriverSight(10_000.0), DriverSight(0.01), DriverSight(0.0)
DARK_THRESHOLD = adaptation(0.0).eye_threshold
ILLUMINANCES = np.geomspace(0.01, 1e5, 281)
UNLIT, LIT = (0.9, 0.0, 1.0), (0.9, 8.0, 1.0)
"""Contrast, intensity of the lamps and share of the own head lamps."""


def reach(sight: DriverSight, visibility: float, what: tuple[float, ...], glare: float = 0.0) -> float:
    """Farthest distance at which something is seen [m]."""
    near, far = 0.1, 1e4
    while far - near > 1e-4:
        middle = 0.5 * (near + far)
        seen = sight.depth_limit(middle, *what, glare) >= extinction_from_visibility(visibility) * middle
        near, far = (middle, far) if seen else (near, middle)
    return near


def test_lamps_at_v_100_and_a_threshold_of_one_microlux() -> None:
    """Allard, E = I e^(−kd) / d² = 10⁻⁶ lx at V_met = 100 m: published check values, for as many times the light."""
    for intensity, metres in [(4, 166.0), (10, 188.0), (60, 234.0), (150, 258.0), (300, 276.0)]:
        as_bright = intensity * DARK_THRESHOLD / 1e-6
        assert reach(DARK, 100.0, (1.0, as_bright, 0.0)) == pytest.approx(metres, abs=0.6)


def test_by_day_a_black_vehicle_is_seen_up_to_the_meteorological_visibility() -> None:
    """But for what the own head lamps light of the fog, 0.2 % of the airlight at 1000 lx."""
    for illuminance in [1000.0, 1e4, 1e5]:
        for visibility in [40.0, 100.0, 300.0]:
            by_head_lamps = math.log1p(HEAD_LAMP_LUMINANCE / airlight_luminance(illuminance)) / math.log(20.0)
            assert by_head_lamps < 1e-3
            lost = visibility * (1.0 - by_head_lamps)
            assert reach(DriverSight(illuminance), visibility, (1.0, 0.0, 0.0)) == pytest.approx(lost, rel=1e-5)


def test_before_darker_airlight_paint_stands_out_less() -> None:
    over_snow = DriverSight(10_000.0, airlight_share=0.868)
    white, black = (inherent_contrast((paint,) * 3) for paint in (0.85, 0.0))
    assert white == pytest.approx(1.0 - 0.85 / 3.0 / 0.406)
    assert black == 1.0
    assert reach(DAY, 100.0, (white, 0.0, 1.0)) == pytest.approx(
        100.0 * (1.0 + math.log(white) / math.log(20.0)), rel=1e-3
    )
    assert DAY.sure_distance(0.03) < over_snow.sure_distance(0.03)
    assert DAY.sure_distance(0.03) <= reach(DAY, 100.0, (inherent_contrast((1.0,) * 3), 0.0, 0.0))


def test_in_clear_air_by_day_everything_is_seen_and_at_night_what_the_headlamps_reach() -> None:
    assert DAY.depth_limit(1e6, 0.3, 0.0, 0.0) > 0.0
    assert reach(DARK, math.inf, (1.0, 0.0, 1.0)) == pytest.approx(55.0, abs=1e-3)
    assert reach(DriverSight(0.0, headlamp_reach=80.0), math.inf, (1.0, 0.0, 1.0)) == pytest.approx(80.0, abs=1e-3)
    assert reach(DARK, math.inf, (1.0, 0.0, 0.25)) == pytest.approx(27.5, abs=1e-3)
    assert DARK.depth_limit(1.0, 1.0, 0.0, 0.0) == -math.inf  # without any light


@pytest.mark.parametrize("visibility", [30.0, 100.0])
def test_at_night_the_light_of_the_own_head_lamps_goes_through_the_fog_twice(visibility: float) -> None:
    farthest = reach(DARK, visibility, (1.0, 0.0, 1.0))
    assert (55.0 / farthest) ** 2 * math.exp(-2.0 * extinction_from_visibility(visibility) * farthest) == pytest.approx(
        1.0, rel=1e-4
    )


def test_the_limit_is_where_shares_of_the_threshold_add_up_to_one() -> None:
    """A x + B x² = 1, the shares taken one by one: each alone is a limit of its own."""
    sight, contrast, tail, distance = DriverSight(0.3), 0.9, 8.0, 60.0
    body, lamp = sight.depth_limit(distance, contrast, 0.0, 0.0), sight.depth_limit(distance, 0.0, tail, 0.0)
    own = sight.depth_limit(distance, 0.0, 0.0, 1.0)
    together = sight.depth_limit(distance, contrast, tail, 1.0)
    shares = math.exp(body - together) + math.exp(lamp - together) + math.exp(2.0 * (own - together))
    assert shares == pytest.approx(1.0)
    assert together > max(body, lamp, own)


def test_dusk_is_continuous() -> None:
    """Between illuminances 6 % apart the distance of first sight changes by at most 5 %, and nowhere by a jump."""
    for what in [UNLIT, LIT, (0.5, 200.0, 0.0)]:
        for visibility in [30.0, 400.0]:
            distances = np.array([reach(DriverSight(lux), visibility, what) for lux in ILLUMINANCES])
            assert np.abs(np.diff(np.log(distances))).max() < 0.05
            steepest = int(np.abs(np.diff(np.log(distances))).argmax())
            fine = np.geomspace(*ILLUMINANCES[steepest : steepest + 2], 101)
            steps = np.abs(np.diff(np.log([reach(DriverSight(lux), visibility, what) for lux in fine])))
            assert steps.max() < 2.0 * steps.mean()


@pytest.mark.parametrize("visibility", [30.0, 120.0, 400.0])
def test_an_unlit_body_is_seen_the_farther_the_more_light_there_is_and_lamps_the_less_far(visibility: float) -> None:
    body, lamp = ([reach(DriverSight(e), visibility, w) for e in ILLUMINANCES] for w in (UNLIT, (0.0, 8.0, 0.0)))
    assert np.all(np.diff(body) > -1e-3)
    assert body[-1] > 1.5 * body[0]
    assert np.all(np.diff(lamp) < 1e-3)
    assert lamp[-1] < 0.9 * lamp[0]


def test_the_limit_falls_with_distance_and_so_does_sight_with_extinction() -> None:
    for what in [UNLIT, LIT]:
        for illuminance in [0.01, 1.0, 10.0, 1000.0]:
            sight = DriverSight(illuminance)
            limits = [sight.depth_limit(d, *what) for d in np.geomspace(0.1, 1e5, 200)]
            assert np.all(np.diff(limits) <= 0.0)
            reaches = [reach(sight, v, what) for v in (20.0, 40.0, 80.0, 160.0, 1000.0)]
            assert reaches == sorted(reaches)


def test_bounds_hold_and_are_close() -> None:
    assert DAY.sure_distance(0.0) == DAY.hidden_distance(0.0) == math.inf
    assert NIGHT.sure_distance(0.0) < 1.0
    assert NIGHT.hidden_distance(0.0) > math.sqrt(BRIGHTEST / 1.1e-5)
    assert NIGHT.hidden_distance(0.02, brightest=600.0) > NIGHT.hidden_distance(0.02)
    for visibility in [30.0, 300.0]:
        for illuminance in [0.01, 1.0, 9.9, 10_000.0]:
            sight, k = DriverSight(illuminance), extinction_from_visibility(visibility)
            sure, hidden = sight.sure_distance(k), sight.hidden_distance(k)
            assert 0.0 <= reach(sight, visibility, LIT) - sight.seen_distance(k, *LIT) <= 0.011
            white = inherent_contrast((1.0, 1.0, 1.0))
            assert sure == pytest.approx(reach(sight, visibility, (white, 0.0, 0.0)), abs=0.11)
            assert hidden == pytest.approx(reach(sight, visibility, (1.0, BRIGHTEST, 1.0)), abs=0.02)
            for distance in np.linspace(0.1, sure, 50) if sure else ():
                assert k * distance <= sight.depth_limit(distance, white, 0.0, 0.0)
            for distance in np.geomspace(hidden, 10.0 * hidden, 50):
                assert k * distance > sight.depth_limit(distance, 1.0, BRIGHTEST)


def test_glare_raises_both_thresholds() -> None:
    """A veil of glare counts like so much more light that the eye is adapted to, as Adrian's equations have it."""
    dazzled = adaptation(0.0, glare=1.0)
    assert dazzled.eye_threshold == pytest.approx(adaptation(1.0 * math.pi / 0.406).eye_threshold)
    assert dazzled.eye_threshold > 2.0 * DARK_THRESHOLD
    assert reach(NIGHT, 400.0, UNLIT, glare=1.0) < 0.85 * reach(NIGHT, 400.0, UNLIT)
    assert reach(NIGHT, 400.0, LIT, glare=1.0) < 0.95 * reach(NIGHT, 400.0, LIT)
    assert reach(DAY, 400.0, LIT, glare=1.0) == pytest.approx(reach(DAY, 400.0, LIT), rel=1e-3)
    assert adaptation(1e5, glare=10.0).eye_threshold == DAY_EYE_THRESHOLD
