"""The task of `fogsim_envs.task.advisory` on the roads and in the traffic of highway-env."""

import dataclasses
import functools
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Any

import numpy as np

from fogsim.core.parameters import NUMBER, checked_parameters
from fogsim.core.randomness import Seed
from fogsim.errors import InputError
from fogsim.scenario import Scenario
from fogsim.traffic.highway import LEAD
from fogsim.values import Ending, Step
from fogsim_envs.highway import (
    HighwayLoop,
    highway_config,
    highway_environment,
    highway_scenario,
    one_frame_clocks,
)
from fogsim_envs.hosting import TIMEOUT, Timeout
from fogsim_envs.plain_arguments import takes_plain_data
from fogsim_envs.spaces import ImageSize
from fogsim_envs.task.advisory import FogAdvisoryV1Env
from fogsim_envs.task.episodes import Episode, FogDistribution, ScenarioDistribution
from fogsim_envs.task.rewards import TaskWeights

_HIGHWAY_FOG = FogDistribution(ahead=(100.0, 500.0), reach=1000.0, bank_length=(300.0, 800.0))
"""Banks that begin on the first kilometre of the way."""

_WAY = 1500.0
"""Way that the ego has to go [m]."""

_DURATION = 150.0
"""Longest time that it has for it, where the configuration sets none [s]."""

_DRAWN = ("light.", "camera.told.")


class HighwayDistribution(ScenarioDistribution):
    """Which light, driver and errors of the assumed calibration there may be, and whether the leader brakes.

    Roads and traffic are highway-env's; of ``scripts``, "braking_lead" is the one that can be played there.
    """

    def draw(self, rng: np.random.Generator) -> Episode:
        """An episode but for its fog; see `ScenarioDistribution.draw`."""
        drawn = super().draw(rng)
        settings = tuple(one for one in drawn.settings if one.startswith(_DRAWN))
        begin, deceleration, hold = rng.uniform(3.0, 25.0), rng.uniform(3.0, 6.0), rng.uniform(5.0, 20.0)
        if drawn.script != "braking_lead":
            return Episode(settings, drawn.driver, drawn.light, "free")
        brake = {
            "kind": "brake",
            "vehicle": LEAD,
            "at_time_s": begin,
            "to_speed_kmh": 0.0,
            "deceleration_mps2": deceleration,
            "hold_s": hold,
        }
        return Episode((*settings, f"traffic.events={json.dumps([brake])}"), drawn.driver, drawn.light, drawn.script)


def _scenario(settings: Mapping[str, Any], more: Sequence[str]) -> Scenario:
    return highway_scenario(settings, math.inf, [*one_frame_clocks(settings), *more])


@takes_plain_data
@checked_parameters
class FogHighwayV1Env(FogAdvisoryV1Env):
    """Advise a vehicle's speed and lamps in fog, in the traffic of highway-env, in another fog each episode.

    Action, observation, reward and ``info`` are those of ``fogsim/FogAdvisory-v1`` (`FogAdvisoryV1Env`); highway-env
    has no signs, so ``signs_mask`` is 0. The ego keeps its lane and follows its leader by IDM; advice sets its target
    speed. Others choose their speed in fog and follow leaders that they see, as in ``fogsim/FogHighway-v0``. One step
    has one frame and is about 0.5 s, in whole steps of highway-env: 0.4 s in ``highway-fast-v0``.

    ### Episodes
    Fog, light, whether the leader brakes to a standstill for a while, the ego's own driver and the calibration's
    errors are drawn at each reset (`FogDistribution`, `HighwayDistribution`), traffic by highway-env from the same
    seed. ``split`` "test" draws from other random numbers than "train".

    ### Start and end
    A reset of the highway-env environment. Terminated by a collision of the ego, by its arrival after ``way`` metres or
    at the end of its road; truncated after the environment's ``duration``.

    ### Arguments
    environment : id of a highway-env environment; in ``highway-v0`` a step takes nine times as long
    config : its configuration; ``duration`` is 150 s where it is not among it
    way : how far the ego has to go [m]; less where the road ends before
    scenario_distribution : `HighwayDistribution`
    fog_distribution, split, observation, overrides, image_size, continuous, discrete, reward_weights, render_mode,
    flat_info, metrics, timeout : as in `FogAdvisoryV1Env`; of ``traffic`` no overrides that name files or the ego

    ### Version history
    * v1: another fog, light and driver in each episode; the task's reward, in which time and arrival count
    * v0: homogeneous fog (`fogsim_envs.highway.FogHighwayEnv`)
    """

    def __init__(
        self,
        environment: str = "highway-fast-v0",
        config: Mapping[str, Any] | None = None,
        *,
        way: Annotated[float, NUMBER] = _WAY,
        scenario_distribution: HighwayDistribution | None = None,
        fog_distribution: FogDistribution = _HIGHWAY_FOG,
        split: str = "train",
        observation: str = "dict",
        overrides: Iterable[str] = (),
        image_size: ImageSize | None = (160, 120),
        continuous: bool = False,
        discrete: bool = False,
        reward_weights: TaskWeights | None = None,
        render_mode: str | None = None,
        flat_info: bool = False,
        metrics: bool = False,
        timeout: Timeout = TIMEOUT,
    ) -> None:
        if not way > 0.0:
            raise InputError(f"way: expected more than 0 m, got {way!r}")
        self._way_length = way
        self._environment = highway_environment(environment, {"duration": _DURATION, **(config or {})})
        settings = highway_config(self._environment)
        super().__init__(
            functools.partial(_scenario, settings),
            scenario_distribution=scenario_distribution or HighwayDistribution(),
            fog_distribution=fog_distribution,
            split=split,
            observation=observation,
            overrides=overrides,
            image_size=image_size,
            continuous=continuous,
            discrete=discrete,
            reward_weights=reward_weights,
            render_mode=render_mode,
            flat_info=flat_info,
            metrics=metrics,
            timeout=timeout,
        )

    @checked_parameters
    def reset(self, *, seed: Seed | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode; see `FogAdvisoryV1Env.reset`, but for ``scenario``, which there is none to choose from."""
        if options and "scenario" in options:
            given = options["scenario"]
            raise InputError(f"options['scenario']: roads and traffic are highway-env's own here; got {given!r}")
        return super().reset(seed=seed, options=options)

    def _arrival(self, step: Step, scenario: Scenario) -> float:
        return min(step.route_position + self._way_length, super()._arrival(step, scenario))

    def _begin(self, scenario: Scenario, seed: int) -> Step:
        self._way_end = math.inf
        if self._simulation is None or scenario != self._running:
            if self._simulation is not None:
                self._simulation.close()
                self._simulation = None
            self._simulation = HighwayLoop(self._environment, scenario)
        self._running = scenario
        return self._simulation.start(seed)

    def _completed(self, step: Step) -> Step:
        if step.ending is None and step.route_position >= self._way_end:
            return dataclasses.replace(step, ending=Ending.ARRIVED)
        return step
