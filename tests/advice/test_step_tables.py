import math

import numpy as np
import pytest

from fogsim.advice import ADVISERS, StepTable
from fogsim.core.kinematics import stopping_sight_distance
from fogsim.errors import InputError
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values import Belief, SpeedAdvice

LIMIT = 130 / 3.6
MPH = 0.44704


def certain_of(visibility: float) -> Belief:
    """All but certain of one visibility."""
    cells = np.linspace(math.log(3e-4), math.log(0.3), 2401)
    weight = np.exp(-0.5 * ((cells - math.log(OPTICAL_DEPTH_AT_VISIBILITY / visibility)) / 0.005) ** 2)
    return Belief(cells, weight / weight.sum())


def test_published_steps() -> None:
    for name, visibility, expected in [
        ("netherlands_a16", 145.0, math.inf),
        ("netherlands_a16", 130.0, 80 / 3.6),
        ("netherlands_a16", 60.0, 60 / 3.6),
        ("alabama_i10", 280.0, math.inf),
        ("alabama_i10", 250.0, 65 * MPH),
        ("alabama_i10", 150.0, 55 * MPH),
        ("alabama_i10", 100.0, 45 * MPH),
        ("alabama_i10", 70.0, 35 * MPH),
        ("alabama_i10", 40.0, 20 / 3.6),
        ("tennessee_i75", 300.0, 50 * MPH),
        ("tennessee_i75", 100.0, 35 * MPH),
        ("china_article_81", 210.0, math.inf),
        ("china_article_81", 150.0, 60 / 3.6),
        ("china_article_81", 70.0, 40 / 3.6),
        ("china_article_81", 40.0, 20 / 3.6),
        ("france_r413_4", 49.0, 50 / 3.6),
        ("germany_stvo_3", 51.0, math.inf),
        ("virginia_i77", 205.0, math.inf),
        ("virginia_i77", 20.0, 30 * MPH),
    ]:
        assert ADVISERS[name]().advise(certain_of(visibility), LIMIT, 0.0, SpeedAdvice()).speed == pytest.approx(
            expected
        )


def test_virginia_lets_everybody_stop_within_sight() -> None:
    for visibility in [80.0, 110.0, 160.0, 190.0]:
        speed = ADVISERS["virginia_i77"]().advise(certain_of(visibility), LIMIT, 0.0, SpeedAdvice()).speed
        assert stopping_sight_distance(speed, 2.5, 3.4) < visibility
        assert speed / (5 * MPH) == pytest.approx(round(speed / (5 * MPH)))


def test_a_step_rises_only_after_the_hold_and_never_above_the_limit() -> None:
    table = StepTable((70.0, 140.0), (60 / 3.6, 80 / 3.6), hold=60.0)
    slow = table.advise(certain_of(50.0), LIMIT, 0.0, SpeedAdvice())
    waiting = table.advise(certain_of(100.0), LIMIT, 10.0, slow)
    assert waiting == SpeedAdvice(60 / 3.6, raise_since=10.0)
    assert table.advise(certain_of(100.0), LIMIT, 69.0, waiting).speed == 60 / 3.6
    assert table.advise(certain_of(100.0), LIMIT, 70.0, waiting).speed == 80 / 3.6
    assert table.advise(certain_of(100.0), 70 / 3.6, 0.0, SpeedAdvice()).speed == math.inf


def test_a_belief_that_says_nothing_changes_no_step() -> None:
    cells = np.linspace(math.log(3e-4), math.log(0.3), 241)
    ignorant = Belief(cells, np.full(241, 1 / 241))
    for name in ("netherlands_a16", "virginia_i77"):
        for speed in (50 / 3.6, math.inf):
            assert ADVISERS[name]().advise(ignorant, LIMIT, 0.0, SpeedAdvice(speed)).speed == speed


def test_bad_tables_are_refused() -> None:
    for visibilities, speeds, said in [
        ((140.0, 70.0), (10.0, 20.0), "visibilities must be in ascending order, got"),
        ((70.0, 140.0), (20.0, 10.0), "speeds must be in ascending order"),
        ((70.0,), (10.0, 20.0), "a speed for each visibility, got 1 visibilities and 2 speeds"),
        ((), (), "visibilities must be a list, each a number 1 … 10000 m, got"),
        ((0.0,), (10.0,), "visibilities must be a list, each"),
        ((math.inf,), (10.0,), "visibilities must be a list, each"),
        ("70", (10.0,), "visibilities must be a list, each"),
        (("70",), (10.0,), "visibilities must be a list, each"),
    ]:
        with pytest.raises(InputError, match=said):
            StepTable(visibilities, speeds)


def test_wet_roads_and_slopes_lower_the_sight_distance_advice() -> None:
    def advised(**parameters: float) -> float:
        return (
            ADVISERS["stopping_sight_distance"](rounding=0.01, **parameters)
            .advise(certain_of(100.0), LIMIT, 0.0, SpeedAdvice())
            .speed
        )

    assert advised(friction=0.3) < advised(grade=-0.03) < advised() < advised(grade=0.05)
    assert advised(friction=0.9) == advised()
    # Where nothing can be stopped on, the least advice is left.
    assert advised(friction=0.05, grade=-0.2) == pytest.approx(20 / 3.6)
