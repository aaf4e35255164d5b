"""Daylight that changes while a run lasts, into the night: pictures without a jump, and what is refused."""

from collections.abc import Callable, Iterator

import numpy as np
import pytest

import fogsim
from fogsim.simulation.ego.daylight import Ramp, in_daylight
from fogsim.values import Lamp
from tests.test_grades import placed

DUSK = "timeline=[{when: time >= 1 s, do: {light: {illuminance: 0.05 lx, over: 60 s, course: factors}}}]"
LIT = Lamp.POSITION | Lamp.LOW_BEAM
Picture = Callable[[float], np.ndarray]


def pictures(*settings: str) -> Iterator[Picture]:
    """What the camera of one scenario gets by an illuminance [lx]."""
    view_renderer, state, pose = placed(0.0, settings, LIT)
    clear = view_renderer.fog

    def picture(illuminance: float) -> np.ndarray:
        view_renderer.enter_fog(in_daylight(clear, illuminance))
        _, radiance = view_renderer.render(state, 0, pose, 0.0, None, illuminance)
        return radiance.copy()

    yield picture
    view_renderer.close()


@pytest.fixture(scope="module")
def at_dusk() -> Iterator[Picture]:
    yield from pictures("light.illuminance_lx=10000", DUSK)


def test_frames_go_on_across_the_limit_of_day_and_night(at_dusk: Picture) -> None:
    above, below = at_dusk(1000.0), at_dusk(999.9)
    np.testing.assert_allclose(below, above, rtol=1e-3)
    assert below.mean() < above.mean()


def test_the_night_that_falls_is_the_night_that_was_there(at_dusk: Picture) -> None:
    (night,) = (picture(0.05) for picture in pictures("light.illuminance_lx=0.05"))
    np.testing.assert_array_equal(at_dusk(0.05), night)


def test_daylight_and_lamplight_add(at_dusk: Picture) -> None:
    """Daylight is proportional to the illuminance, and lamps burn alike at any."""
    dim, twice, dark = (at_dusk(lux).astype(np.float64) for lux in (10.0, 20.0, 0.0))
    np.testing.assert_allclose(twice - dim, dim - dark, rtol=1e-3, atol=1e-3)
    assert dark.max() > 10.0


def test_by_day_alone_no_lamps_are_drawn() -> None:
    brighter = "timeline=[{when: time >= 1 s, do: {light: {illuminance: 20000 lx}}}]"
    (day,) = (picture(20_000.0) for picture in pictures("light.illuminance_lx=10000", brighter))
    (same,) = (picture(20_000.0) for picture in pictures("light.illuminance_lx=20000"))
    np.testing.assert_array_equal(day, same)


def test_dusk_takes_the_same_factor_each_second() -> None:
    dusk = Ramp(10_000.0).turned(1.0, 0.01, 60.0, by_factors=True)
    assert [dusk.at(time) for time in (0.0, 1.0, 31.0, 61.0, 90.0)] == pytest.approx([1e4, 1e4, 10.0, 0.01, 0.01])
    assert Ramp(0.0).turned(0.0, 10.0, 10.0, by_factors=True).at(5.0) == 5.0  # no factor leads away from nothing


def test_what_cannot_be_drawn_is_refused() -> None:
    for settings, told in [
        (["renderer=reference"], "the renderer reference knows no lamplight"),
        (["light.illuminance_lx=0"], "goes on from the light that there is, and light.illuminance_lx is 0"),
        (["timeline.0.do.light.illuminance_lx=0"], "no factor leads to illuminance_lx: 0"),
    ]:
        dusk = DUSK.replace("illuminance: 0.05 lx", "illuminance_lx: 0.05")
        with pytest.raises(fogsim.InputError, match=told):
            fogsim.load_scenario("motorway_fog_bank", [dusk, *settings])


@pytest.mark.nightly
@pytest.mark.parametrize(("visibility", "seed"), [(80.0, 2), (40.0, 1), (150.0, 1)])
def test_the_belief_stays_honest_while_night_falls_on_front_fog_lamps(visibility: float, seed: int) -> None:
    lit = "{method: fog_lamp_rules, informed_by: truth, parameters: {front_fog_below: 1e5, rear_fog_below: 0}}"
    night_falls = "timeline=[{when: time > 2 s, do: {light: {illuminance: 0.05 lx, over: 16 s, course: factors}}}]"
    settings = ["expect={}", "duration=22 s", "light.illuminance=3000 lx", "sut.estimators=[joint_road, night_road]"]
    settings += [f"fog.visibility={visibility} m", f"sut.lighting={lit}", night_falls]
    scenario = fogsim.load_scenario("rural_night_alone", settings)
    beliefs = [step.belief for step in fogsim.run(scenario, seed=seed)]
    held = [one.visibility_quantile(0.05) <= visibility <= one.visibility_quantile(0.95) for one in beliefs]
    assert np.mean(held) >= 0.95


def test_at_dusk_a_crest_is_no_fog() -> None:
    """Beyond a crest what is seen below the horizon is air, as in fog much denser than this."""
    settings = [
        "expect={}",
        "duration=6 s",
        "light.illuminance=30 lx",
        "fog.visibility=300 m",
        "clocks.camera_period=0.4 s",
    ]
    settings += ["actors.ego.position=280 m", "sut.estimators=[night_road]", "sut.lighting=low_beam"]
    steps = list(fogsim.run(fogsim.load_scenario("rural_night_alone", settings), seed=1))
    intervals = [step.estimates[0].visibility_interval for step in steps]
    assert np.mean([low <= 300.0 <= high for low, high in intervals]) >= 0.9
    assert np.mean([step.estimates[0].valid for step in steps]) >= 0.5
