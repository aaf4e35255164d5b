"""Message signs as agents: PettingZoo's contract, what a sign observes, and a reward that no queue escapes."""

import math
import pickle
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from pettingzoo.test import parallel_api_test, parallel_seed_test

from fogsim.core.registry import make
from fogsim.errors import InputError
from fogsim.metrics import DEFAULT_STANDARD
from fogsim.values import Collision, Command, RoadSection, Stretch, TrafficState, TrafficStep, Truth
from fogsim_envs import evaluate
from fogsim_envs.corridor import CorridorWeights, FogCorridorEnv, parallel_env
from fogsim_envs.corridor.baselines import DARK, SIGN_BASELINES
from fogsim_envs.corridor.loops import InductionLoops, LoopReading
from fogsim_envs.corridor.observation import CORRIDOR_FEATURES, RoadKnowledge, loop_places, sign_observation
from fogsim_envs.corridor.rewards import CorridorReward, lost_share, overdriven
from fogsim_envs.infos import numbers_of
from fogsim_envs.task import FogDistribution
from tests.helpers.vehicles import vehicles

SHORT = ("road.length_m=1200", "duration_s=90", "drivers.signs.at_m=[300, 800]")
FOG = FogDistribution(ahead=(100.0, 400.0), reach=600.0)
ROUTE = np.array([[0.0, 0.0, 0.0], [1000.0, 0.0, 0.0]])


@pytest.fixture
def signs() -> Iterator[FogCorridorEnv]:
    made = parallel_env(overrides=SHORT, fog_distribution=FOG)
    yield made
    made.close()


def _traffic(places: list[float], speeds: list[float], lane: str = "road_0", free: float = 30.0) -> TrafficState:
    return vehicles(places, speed=speeds, size=(4.5, 1.8, 1.5), lane=lane, free_speed=np.full(len(places), free))


def _step(traffic: TrafficState, extinction: float = 0.0, waiting: int = 0, hits: int = 0) -> TrafficStep:
    seen = np.full(len(traffic.ids), extinction)
    return TrafficStep(
        index=1,
        time=1.0,
        traffic=traffic,
        collisions=(Collision(1.0, "v0", "v1", 5.0),) * hits,
        truth=Truth(extinction, extinction, vehicle_extinctions=seen),
        command=Command(),
        ending=None,
        waiting=waiting,
    )


def test_pettingzoos_checks_find_nothing(signs: FogCorridorEnv) -> None:
    parallel_api_test(signs, num_cycles=5)


def test_a_seed_gives_the_same_here_and_in_a_child_process() -> None:
    parallel_seed_test(lambda: parallel_env(overrides=SHORT, fog_distribution=FOG), num_cycles=2)


def test_an_episode_comes_again_with_its_traffic(signs: FogCorridorEnv) -> None:
    _, infos = signs.reset(seed=1)
    drawn = signs.drawn
    for _ in range(2):
        again = signs.reset(options={"episode": drawn})[1]
        assert signs.drawn == drawn
        assert again == infos


def test_copies_draw_different_episodes() -> None:
    fresh = parallel_env(overrides=SHORT, fog_distribution=FOG)
    drawn = []
    for copy in (pickle.loads(pickle.dumps(fresh)) for _ in range(2)):  # noqa: S301 - our own
        copy.reset()
        drawn.append(copy.drawn)
        copy.close()
    assert drawn[0] != drawn[1]


def test_a_sign_shows_what_its_agent_chose_and_all_are_paid_the_same(signs: FogCorridorEnv) -> None:
    signs.reset(seed=1, options={"visibility": 60.0})
    observed, rewards, _, _, infos = signs.step({"sign_0": 1, "sign_1": 5})
    shown = {name: CORRIDOR_FEATURES.index(name) for name in CORRIDOR_FEATURES if name.startswith("shown")}
    first, second = observed["sign_0"], observed["sign_1"]
    assert first[shown["shown_speed"]] == pytest.approx(60 / 3.6 / 50)
    assert second[shown["shown_speed_upstream"]] == first[shown["shown_speed"]]
    assert first[shown["shown_speed_downstream"]] == second[shown["shown_speed"]] == 1.0
    assert np.array_equal(signs.state(), np.concatenate([first, second]))
    terms = numbers_of(infos["sign_0"], "reward_terms")
    assert rewards["sign_0"] == rewards["sign_1"] == pytest.approx(sum(terms.values()))
    heard = signs._step.traffic.advised_speed
    assert np.isclose(heard[np.isfinite(heard)], 60 / 3.6).all()
    assert np.isfinite(heard).any()


@pytest.mark.parametrize(
    ("actions", "message"),
    [
        ({"sign_0": 1}, "one for each of sign_0, sign_1"),
        ({"sign_0": 1, "sign_1": 6}, "sign_1"),
        ({"sign_0": 1, "sign_1": math.nan}, "finite"),
    ],
)
def test_actions_that_are_none_are_refused(signs: FogCorridorEnv, actions: dict[str, Any], message: str) -> None:
    signs.agents = list(signs.possible_agents)
    with pytest.raises(InputError, match=message):
        signs.step(actions)


def test_what_does_not_fit_is_refused(signs: FogCorridorEnv) -> None:
    with pytest.raises(InputError, match="visibilty"):
        signs.reset(options={"visibilty": 60.0})
    with pytest.raises(InputError, match="driver"):
        signs.reset(options={"driver": "unaffected"})
    with pytest.raises(InputError, match="has 1 signs"):
        signs.reset(options={"overrides": ["drivers.signs.at_m=[300]"]})
    with pytest.raises(InputError, match=r"drivers\.advised: signs"):
        parallel_env(overrides=("drivers.advised=equipped", "drivers.equipped_share=0.5"))
    with pytest.raises(InputError, match=r"over within its first decision period.* \(time, after 20 s\)"):
        signs.reset(options={"overrides": ["duration_s=20"]})
    with pytest.raises(ResetNeeded):
        signs.step({})


def test_policies_of_signs_are_evaluated(signs: FogCorridorEnv) -> None:
    asked: list[float] = []

    def spy(observation: Any, info: dict[str, Any]) -> int:
        asked.append(info["built_in_advice_mps"])
        return DARK

    found = evaluate(spy, signs, seeds=[3, 4])
    dark = evaluate("none", signs, seeds=[3, 4])
    assert [one.value for one in found.episodes] == [one.value for one in dark.episodes]
    # Two signs in two periods of half a minute after the first, in which the loops count.
    assert len(asked) == 2 * 2 * 2
    assert [one.steps for one in found.episodes] == [2, 2]
    assert found.mean == pytest.approx(np.mean([sum(one.terms.values()) for one in found.episodes]))
    assert {one.ending for one in found.episodes} == {"time"}
    with pytest.raises(InputError, match="did you mean 'rule'"):
        evaluate("rules", signs, seeds=[0])


@pytest.mark.parametrize(
    ("name", "advised", "level"),
    [("none", 20.0, 5), ("fixed", math.inf, 1), ("rule", 75.0 / 3.6, 1), ("rule", 5.0, 0), ("rule", math.inf, 5)],
)
def test_baselines_of_a_sign(name: str, advised: float, level: int) -> None:
    assert make(SIGN_BASELINES, name, spaces.Discrete(6))(None, {"built_in_advice_mps": advised}) == level


def test_chance_comes_again() -> None:
    policy = make(SIGN_BASELINES, "random", spaces.Discrete(6))
    policy.reset(4)
    first = [int(policy(None, {})) for _ in range(20)]
    policy.reset(4)
    assert first == [int(policy(None, {})) for _ in range(20)]
    assert set(first) <= set(range(6))
    assert len(set(first)) > 3


def test_loops_count_who_passes_on_their_road_and_begin_anew() -> None:
    loops = InductionLoops([100.0, 500.0], ROUTE, ["road"])
    loops.count(_traffic([90.0, 490.0], [20.0, 30.0]), 1.0)
    loops.count(_traffic([110.0, 520.0], [20.0, 30.0]), 1.0)
    assert loops.read() == (LoopReading(1800.0, 20.0), LoopReading(1800.0, 30.0))
    loops.count(_traffic([130.0, 95.0, 550.0], [20.0, 20.0, 30.0], lane="other_0"), 1.0)
    assert loops.read() == (LoopReading(0.0, None), LoopReading(0.0, None))


def test_loops_lie_halfway_between_signs() -> None:
    assert loop_places((500.0, 1500.0), 2000.0) == (250.0, 1000.0, 1750.0)


def test_a_sign_observes_its_own_loops_and_meter() -> None:
    readings = (LoopReading(1000.0, 25.0), LoopReading(0.0, None), LoopReading(500.0, 10.0))
    known = RoadKnowledge(readings, (100.0, 10_000.0), (math.inf, 20.0), lanes=2, time_left=0.5)
    sections = [RoadSection(Stretch(start, start + 500.0), 0.03, 30.0) for start in (500.0, 1000.0)]
    first, second = (sign_observation(number, known, sections[number], 2000.0) for number in (0, 1))
    assert first == pytest.approx([0.2, 0.5, 1, 0, 0, 0, 0.5, 1, 1, 0.4, 0.6, 0.25, 0.5])
    assert second == pytest.approx([0, 0, 0, 0.1, 0.2, 1, 1, 0.4, 1, 1, 0.6, 0.5, 0.5])


def test_who_stands_or_waits_outside_pays_as_much() -> None:
    standing = _step(_traffic([100.0, 200.0], [0.0, 30.0]))
    outside = _step(_traffic([200.0], [30.0]), waiting=1)
    assert lost_share(standing) == lost_share(outside) == 1.0
    assert lost_share(_step(_traffic([], []), waiting=2)) == 2.0
    assert lost_share(_step(_traffic([0.0], [40.0]))) == 0.0


def test_driving_faster_than_one_sees_is_what_costs_in_fog() -> None:
    fast, slow = _traffic([0.0], [30.0]), _traffic([0.0], [10.0])
    dense = 3.0 / 60.0
    assert overdriven(_step(fast, dense), DEFAULT_STANDARD) > 15.0
    assert overdriven(_step(slow, dense), DEFAULT_STANDARD) == 0.0
    assert overdriven(_step(fast), DEFAULT_STANDARD) == 0.0


def test_the_reward_is_the_weighted_sum_of_a_period() -> None:
    reward = CorridorReward(CorridorWeights(delay=1.0, overdriving=0.0, conflict=3.0, collision=10.0))
    # The follower is 4.5 m behind the leader's rear, 3 m/s faster: 1.5 s, half of the standard's 3 s.
    reward.add(_step(_traffic([91.0, 100.0], [28.0, 25.0], free=28.0), hits=1), 2.0)
    terms = reward.terms()
    assert terms["delay"] == pytest.approx(-2.0 * (1.0 - 25.0 / 28.0) / 60.0)
    assert terms["conflict"] == pytest.approx(-3.0)
    assert terms["collision"] == -10.0
    assert terms["overdriving"] == 0.0
