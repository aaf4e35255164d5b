"""Warnings of the driver: when each is given, for how long, and which comes first."""

import dataclasses
import math

import numpy as np

from fogsim.advice.warning import choose_warning, is_fog_in_the_way
from fogsim.core.kinematics import stopping_sight_distance
from fogsim.units import extinction_from_visibility
from fogsim.values import Belief, Command, DenserFog, DriverWarning, FogProfile, Observation
from fogsim.values.belief import certain_belief

SPEED = 30.0
NEEDED = stopping_sight_distance(SPEED, 2.5, 3.4)
CLEAR = certain_belief(1e-5)
NOTHING = dataclasses.replace(CLEAR, age=math.inf)
FOG, SEE, CAMERA = DriverWarning.FOG_AHEAD, DriverWarning.CANNOT_SEE, DriverWarning.CAMERA_DEGRADED
PERIOD = 0.5


def fog(visibility: float) -> Belief:
    return certain_belief(extinction_from_visibility(visibility))


def announced(visibility: float) -> Belief:
    return dataclasses.replace(CLEAR, denser=DenserFog(200.0, 10.0, extinction_from_visibility(visibility)))


def profile(distance: float, visibility: float, deviation: float = 0.1) -> Belief:
    places = np.array([-100.0, 0.0, distance - 1.0, distance, distance + 500.0])
    logarithms = np.log([1e-4, 1e-4, 1e-4, *[extinction_from_visibility(visibility)] * 2])
    return dataclasses.replace(CLEAR, profile=FogProfile(places, logarithms, np.full(5, deviation)))


def warnings(*seen: tuple[Belief, str], speed: float = SPEED) -> list[DriverWarning | None]:
    """Warnings after decisions, by what is believed and what troubles the camera at each."""
    command, given = Command(), []
    image = np.zeros((4, 4), np.uint8)
    for number, (belief, trouble) in enumerate(seen):
        observation = Observation(image, speed, camera_trouble=trouble)
        warning, memory = choose_warning(belief, observation, number * PERIOD, command)
        command = Command(warning=warning, warning_memory=memory)
        given.append(warning)
    return given


def test_fog_is_warned_of_where_one_cannot_stop_in_sight_and_that_is_known():
    for belief, warns in [
        (CLEAR, False),
        (fog(0.98 * NEEDED), True),
        (fog(1.02 * NEEDED), False),
        (announced(2.9 * NEEDED), True),
        (announced(3.1 * NEEDED), False),
        (profile(9.0 * SPEED, 0.9 * NEEDED), True),
        (profile(9.0 * SPEED, 1.1 * NEEDED), False),
        (profile(11.0 * SPEED, 0.9 * NEEDED), False),
        (profile(9.0 * SPEED, 0.9 * NEEDED, deviation=0.8), False),
        (dataclasses.replace(fog(0.5 * NEEDED), age=61.0), False),
        (dataclasses.replace(profile(9.0 * SPEED, 0.5 * NEEDED), age=61.0), False),
    ]:
        assert is_fog_in_the_way(belief, SPEED) is warns


def test_slow_enough_nobody_is_warned():
    assert not is_fog_in_the_way(fog(30.0), 5.0)
    assert not is_fog_in_the_way(announced(30.0), 0.0)


def test_fog_is_warned_of_at_once_and_for_five_seconds_more():
    given = warnings((CLEAR, ""), (fog(60.0), ""), *[(CLEAR, "")] * 11)
    assert given == [None, *[FOG] * 10, None, None]


def test_a_visibility_that_halves_is_warned_of_where_it_is_little():
    def falls(first: float, last: float, seconds: float) -> bool:
        fading = first * (last / first) ** np.linspace(0.0, 1.0, round(seconds / PERIOD) + 1)
        return FOG in warnings(*((fog(visibility), "") for visibility in fading))

    assert falls(1000.0, 1.9 * NEEDED, 2.0)
    assert not falls(1000.0, 2.1 * NEEDED, 2.0)
    assert not falls(3.0 * NEEDED, 1.9 * NEEDED, 2.0)
    # Over half a minute the driver sees it come.
    assert not falls(1000.0, 1.9 * NEEDED, 30.0)
    # Air that is clear at any rate does not halve.
    assert not falls(10_000.0, 1000.0, 1.0)


def test_a_belief_that_knows_nothing_is_warned_of_after_three_seconds():
    assert warnings(*[(NOTHING, "")] * 8) == [*[None] * 6, SEE, SEE]
    # What is known in between counts from the beginning again.
    assert set(warnings(*[(NOTHING, "")] * 5, (CLEAR, ""), *[(NOTHING, "")] * 6)) == {None}
    assert warnings(*[(NOTHING, "")] * 7, *[(CLEAR, "")] * 5)[6:] == [SEE, SEE, SEE, SEE, None, None]


def test_a_lost_frame_is_no_degraded_camera_but_three_are():
    assert set(warnings((CLEAR, "lost"), (CLEAR, "lost"), (CLEAR, ""), (CLEAR, "lost"))) == {None}
    assert warnings(*[(CLEAR, "lost")] * 3, *[(CLEAR, "")] * 4) == [None, None, CAMERA, CAMERA, CAMERA, CAMERA, None]


def test_the_camera_comes_first_then_fog_then_ignorance():
    uninformed = dataclasses.replace(announced(60.0), age=math.inf)
    assert warnings(*[(uninformed, "frozen")] * 8)[-1] is CAMERA
    assert warnings(*[(uninformed, "")] * 8)[-1] is FOG
    # The camera is well again, and so is the sight: what was covered does not come back.
    given = warnings(*[(fog(60.0), "frozen")] * 3, *[(CLEAR, "")] * 5)
    assert given == [FOG, FOG, CAMERA, CAMERA, CAMERA, CAMERA, None, None]
