"""One agent a message sign along a road in fog: what each shows, for everyone's safety and time."""

import functools
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from fogsim.core.parameters import checked_parameters
from fogsim.core.randomness import Seed
from fogsim.errors import InputError, MissingDependencyError
from fogsim.scenario import Scenario, build, load_scenario, override
from fogsim.simulation.road_advice import RoadAdvice, stretch_advices
from fogsim.simulation.road_sections import road_sections, stations
from fogsim.traffic.road.configuration import configured_files
from fogsim.traffic.road.network import read_net, route_axis
from fogsim.values import Command, Display, Ending, TrafficStep
from fogsim.values.road import LaneKind
from fogsim_envs.actions import checked_action, checked_options
from fogsim_envs.corridor.loops import InductionLoops
from fogsim_envs.corridor.observation import (
    SHOWN_SPEEDS,
    RoadKnowledge,
    corridor_space,
    loop_places,
    measured_visibilities,
    sign_observation,
)
from fogsim_envs.corridor.rewards import CorridorReward, CorridorWeights
from fogsim_envs.hosting import TIMEOUT, Timeout, TrafficSimulation, begin_traffic, checked_timeout, refuse_copies
from fogsim_envs.infos import flat_numbers
from fogsim_envs.rewards import WeightsOf, advice_standard
from fogsim_envs.task.episodes import FogDistribution
from fogsim_envs.task.sampling import Defaults, EpisodeChoice, EpisodeSource


class _SignedRoad(NamedTuple):
    """A road with message signs."""

    starts: tuple[float, ...]  # Places of the signs along the road [m]
    axis: NDArray[np.float64]  # (m, 3): Polyline along it [m]
    length: float  # Its length [m]
    lanes: int  # Lanes for vehicles where it begins


def _signed_road(scenario: Scenario) -> _SignedRoad:
    """The road along which a scenario without an ego has its signs."""
    if scenario.traffic.has_ego or scenario.drivers.advised != "signs":
        raise InputError(
            "FogCorridor: expected a scenario with traffic.ego: none and drivers.advised: signs, got "
            f"traffic.ego: {scenario.traffic.ego} and drivers.advised: {scenario.drivers.advised}"
        )
    setup = build.traffic_setup(scenario)
    net = setup.net if setup.config is None else configured_files(setup.config)[0]
    if net is None:
        raise InputError("FogCorridor: expected a scenario with a road network, got none")
    roads = read_net(net)
    axis, _ = route_axis(roads, scenario.traffic.along)
    length = float(stations(axis)[-1])
    starts = tuple(section.start for section in road_sections(build.sections_config(scenario), length))
    if not starts:
        raise InputError(f"FogCorridor: no sign of drivers.signs stands on the road of {length:.0f} m")
    lanes = sum(roads.lanes[place].kind is LaneKind.CARRIAGEWAY for place in roads.edges[scenario.traffic.along[0]])
    return _SignedRoad(starts, axis, length, max(lanes, 1))


try:
    from pettingzoo import ParallelEnv
except ImportError as error:  # pragma: no cover - the tests have it
    raise MissingDependencyError(f"FogCorridor needs PettingZoo ({error}): pip install 'fogsim[rl]'") from error

_MOTORWAY = Path(__file__).with_name("motorway.yaml")
"""The road of the default task."""

_CORRIDOR_FOG = FogDistribution(ahead=(500.0, 2500.0), reach=4000.0)
"""Fog anywhere along the default road."""

_DEMANDS = (600.0, 1200.0, 1800.0, 2400.0)
"""Demand of the default task, each as likely [1/h]."""


@checked_parameters
class FogCorridorEnv(ParallelEnv):  # type: ignore[misc]  # PettingZoo is not typed
    """Show speeds on the message signs of a motorway in fog, a sign an agent; a ``pettingzoo.ParallelEnv``.

    One step is one decision period of the scenario (30 s). Agents are ``sign_0``, ``sign_1``, … in the direction of
    travel. Drivers read a sign in passing, keep it to the next one, and follow it as ``drivers.compliance`` says.

    ### Action
    ``Discrete(6)``: 40, 60, 80, 100, 120 km/h, or none.

    ### Observation
    float32 (13,) in 0 … 1, of the decision period that is over:

    | entries | meaning | scale |
    |---|---|---|
    | 0, 1, 2 | loop halfway to the sign before: flow; mean speed; anybody passed | / 2500 /h and lane; / 50 m/s; 0, 1 |
    | 3, 4, 5 | loop halfway to the next sign, too | |
    | 6 | visibility meter at the sign: up to 2 km, 10 % deviation | logarithmic, 1 m … 10 km to 0 … 1 |
    | 7, 8, 9 | speed shown so far by this sign, the one before, the next | / 50 m/s; 1 for none |
    | 10, 11, 12 | speed limit; place along the road; time left | / 50 m/s; share; share |

    ``state()`` is all of them one after another.

    ### Reward
    The same to all: the sum of ``reward_terms/…`` in ``infos[agent]``, in points (`CorridorWeights`): delay,
    overdriving, conflict, collision, of all vehicles. Vehicles that wait to enter the road pay their delay there,
    so a queue wins nothing.

    ### Episodes
    Fog and demand are drawn at each reset; ``options`` of `reset` fix ``visibility``, ``scenario``, ``overrides`` or a
    whole ``episode``, as in `fogsim_envs.task.FogAdvisoryV1Env`. Vehicles are on the road from the beginning; the signs
    are dark for the first period, in which the loops count. Truncated after the scenario's duration.

    ### Arguments
    scenario : name, file, or `fogsim.Scenario` with ``traffic.ego: none`` and ``drivers.advised: signs``; None for the
    default task's motorway
    fog_distribution : `FogDistribution`; None with a scenario is that scenario's own fog
    split : "train" or "test"
    overrides : ``key.path=value`` each, as after ``fogsim run --set``
    reward_weights : `CorridorWeights`
    timeout : how long a child process that runs the simulation may give no sign of life [s]; ``inf`` for ever

    ### Version history
    * v1: first version
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - PettingZoo's own way
        "name": "fogsim/FogCorridor-v1",
        "render_modes": [],
        "is_parallelizable": True,
    }
    render_mode = None
    reward_weights = WeightsOf(CorridorWeights)

    def __init__(
        self,
        scenario: str | Path | Scenario | None = None,
        *,
        fog_distribution: FogDistribution | None = None,
        split: str = "train",
        overrides: Iterable[str] = (),
        reward_weights: CorridorWeights | None = None,
        timeout: Timeout = TIMEOUT,
    ) -> None:
        checked_timeout(timeout)
        self._timeout, self.reward_weights = timeout, reward_weights
        own = _default_scenarios() if scenario is None else ()
        self._source = EpisodeSource(
            scenario, None, fog_distribution, tuple(overrides), split, own, Defaults(_CORRIDOR_FOG)
        )
        self._road = _signed_road(self._source.first_scenario())
        self.possible_agents = [f"sign_{number}" for number in range(len(self._road.starts))]
        self.agents: list[str] = []
        self._observation_spaces = {agent: corridor_space() for agent in self.possible_agents}
        self._action_spaces = {agent: spaces.Discrete(len(SHOWN_SPEEDS)) for agent in self.possible_agents}
        size = len(self.possible_agents) * int(np.prod(corridor_space().shape))
        self.state_space = spaces.Box(0.0, 1.0, (size,), np.float32)
        self.drawn: dict[str, Any] = {}
        """What was drawn for the episode; as option ``episode`` of `reset` it repeats it."""
        self._rng: np.random.Generator | None = None
        self._simulation: TrafficSimulation | None = None
        self._observed: dict[str, NDArray[np.float32]] = {}

    def __getstate__(self) -> dict[str, Any]:
        """What pickle and copy take; a running simulation cannot be copied."""
        refuse_copies(hasattr(self, "_rule"))
        return self.__dict__

    def observation_space(self, agent: str) -> spaces.Box:
        """Space of what an agent observes, always the same object.

        Parameters
        ----------
        agent : str
            One of `possible_agents`.
        """
        return self._observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Discrete:
        """Space of what an agent may do, always the same object.

        Parameters
        ----------
        agent : str
            One of `possible_agents`.
        """
        return self._action_spaces[agent]

    @checked_parameters
    def reset(
        self, seed: Seed | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[dict[str, NDArray[np.float32]], dict[str, dict[str, Any]]]:
        """Begin an episode.

        Parameters
        ----------
        seed : int or None
            Seed of this and the following episodes; None goes on with the numbers of before.
        options : mapping or None
            What of the episode is not to be drawn. The key ``options`` is passed over: PettingZoo's own checks give it.

        Raises
        ------
        InputError
            If an option is unknown or does not fit, or the scenario has another number of signs or is over at once.
        """
        known = {name: value for name, value in (options or {}).items() if name != "options"}
        if "driver" in known:
            raise InputError("options['driver']: is the ego's, and the road has none; it is drivers.speed_choice here")
        choice = checked_options(EpisodeChoice, known)
        # Drawn only here, so that unpickled copies differ.
        rng = self._rng if seed is None and self._rng is not None else np.random.default_rng(seed)
        run_seed, drawn = self._source.draw(rng, choice)
        scenario = drawn.scenario
        self._road, self._rng, self.agents = self._checked_road(scenario), rng, []
        self._simulation, self._step = begin_traffic(self._simulation, scenario, run_seed, self._timeout)
        self._loops = InductionLoops(
            loop_places(self._road.starts, self._road.length), self._road.axis, scenario.traffic.along
        )
        self._meters = np.random.default_rng((3, run_seed))
        self._rule = RoadAdvice(build.advice_config(scenario))
        self._frames = build.periods(scenario).decision_frames
        self._standard, self._duration = advice_standard(scenario), scenario.duration_s
        self._shown = (math.inf,) * len(self.possible_agents)
        self._move()
        if self._step.ending is not None:
            raise InputError(
                "reset(): the scenario is over within its first decision period, in which the signs are dark "
                f"({self._step.ending.value}, after {self._step.time:g} s); give it a longer duration_s"
            )
        self.drawn = drawn.episode.as_info()
        begun = self._observe(), self._infos(dict.fromkeys(CorridorWeights.__dataclass_fields__, 0.0))
        self.agents = list(self.possible_agents)
        return begun

    def _checked_road(self, scenario: Scenario) -> _SignedRoad:
        road = _signed_road(scenario)
        if len(road.starts) != len(self.possible_agents):
            raise InputError(
                f"reset(): the scenario has {len(road.starts)} signs, and the environment was made with "
                f"{len(self.possible_agents)}"
            )
        return road

    @checked_parameters
    def step(
        self, actions: Mapping[str, Any]
    ) -> tuple[
        dict[str, NDArray[np.float32]],
        dict[str, float],
        dict[str, bool],
        dict[str, bool],
        dict[str, dict[str, Any]],
    ]:
        """Let the signs show something for a decision period.

        Parameters
        ----------
        actions : mapping from str to int
            A level of each agent.

        Raises
        ------
        InputError
            If an agent's action is missing, or no member of its space.
        gymnasium.error.ResetNeeded
            If the episode is over or none has begun.
        """
        if not self.agents:
            raise gymnasium.error.ResetNeeded("the episode is over or none has begun: call reset() before step()")
        if set(actions) != set(self.agents):
            raise InputError(
                f"actions: expected one for each of {', '.join(self.agents)}, got {', '.join(map(str, actions))}"
            )
        levels = [int(checked_action(actions[agent], self._action_spaces[agent], agent)) for agent in self.agents]
        self._shown = tuple(SHOWN_SPEEDS[level] for level in levels)
        # None until the step is complete, so that an interrupted episode does not go on.
        all_agents, self.agents = self.agents, []
        terms = self._move()
        observed, infos = self._observe(), self._infos(terms)
        ending = self._step.ending
        truncated = ending is Ending.TIME
        if ending is None:
            self.agents = all_agents
        return (
            observed,
            dict.fromkeys(all_agents, float(sum(terms.values()))),
            dict.fromkeys(all_agents, ending is not None and not truncated),
            dict.fromkeys(all_agents, truncated),
            infos,
        )

    def _move(self) -> dict[str, float]:
        """Move by a decision period with what is shown; the terms of its reward."""
        if self._simulation is None:
            raise gymnasium.error.ResetNeeded("call reset() before step()")
        sections = tuple(section.stretch for section in self._step.truth.sections)
        command = Command(stretches=stretch_advices(sections, self._shown, Display.MESSAGE_SIGN))
        reward = CorridorReward(self.reward_weights, self._standard)
        for _ in range(self._frames):
            if self._step.ending is not None:
                break
            before = self._step.time
            self._step, _ = self._simulation.advance(command)
            elapsed = self._step.time - before
            self._loops.count(self._step.traffic, elapsed)
            reward.add(self._step, elapsed)
        self._collisions = reward.collisions
        return reward.terms()

    def _observe(self) -> dict[str, NDArray[np.float32]]:
        sections = self._step.truth.sections
        known = RoadKnowledge(
            self._loops.read(),
            measured_visibilities(sections, self._meters),
            self._shown,
            self._road.lanes,
            max(1.0 - self._step.time / self._duration, 0.0),
        )
        self._observed = {
            agent: sign_observation(number, known, sections[number], self._road.length)
            for number, agent in enumerate(self.possible_agents)
        }
        return {agent: observed.copy() for agent, observed in self._observed.items()}

    def state(self) -> NDArray[np.float32]:
        """What all signs observe, one after another: for critics who know everything that is known.

        Raises
        ------
        gymnasium.error.ResetNeeded
            If no episode has begun.
        """
        if not self._observed:
            raise gymnasium.error.ResetNeeded("call reset() first")
        return np.concatenate([self._observed[agent] for agent in self.possible_agents])

    def _infos(self, terms: dict[str, float]) -> dict[str, dict[str, Any]]:
        """Numbers beyond the observations, in the same keys at each step; agents must not use ``truth``."""
        step = self._step
        advised = _by_start(self._rule, step)
        common = {
            "reward_terms": terms,
            "time_s": step.time,
            "vehicles": len(step.traffic.ids),
            "waiting": step.waiting,
            "collisions": self._collisions,
            "ending": "" if step.ending is None else step.ending.value,
        }
        return {
            agent: flat_numbers(
                {
                    **common,
                    "built_in_advice_mps": advised.get(section.stretch.start, math.inf),
                    "truth": {"extinction_per_m": section.extinction},
                }
            )
            for agent, section in zip(self.possible_agents, step.truth.sections, strict=True)
        }

    def close(self) -> None:
        """End the simulation; closing twice is allowed."""
        if self._simulation is not None:
            self._simulation.close()
        self._simulation, self.agents = None, []


def parallel_env(**kwargs: Any) -> FogCorridorEnv:
    """Make the environment; see `FogCorridorEnv` for arguments.

    Parameters
    ----------
    **kwargs
        Arguments of `FogCorridorEnv`.
    """
    return FogCorridorEnv(**kwargs)


def _by_start(rule: RoadAdvice, step: TrafficStep) -> dict[float, float]:
    """What the scenario's adviser would show, by the place of the sign [m/s]."""
    told = rule.advise_traffic(step)
    return {one.stretch.start: one.speed for one in told}


@functools.cache
def _default_scenarios() -> tuple[Scenario, ...]:
    base = load_scenario(_MOTORWAY)
    return tuple(override(base, [f"demand.same_way_vph={demand!r}"]) for demand in _DEMANDS)
