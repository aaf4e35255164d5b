"""The agent advises the ego of a highway-env environment."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import gymnasium

from fogsim.errors import InputError
from fogsim.loop import ClosedLoop
from fogsim.scenario import Scenario, attached_scenario, build
from fogsim.traffic.highway import EGO, HighwayTraffic, is_highway_environment
from fogsim.values import Step
from fogsim_envs.advising import AdvisingEnv
from fogsim_envs.rewards import RewardWeights

CAMERA_PERIOD, DECISION_PERIOD = 0.1, 0.5
"""Time between frames and between decisions, as far as highway-env's step allows [s]."""

END_MARGIN = 5.0
"""The ego has arrived when it is this near to the end of its last lane [m]."""


class FogHighwayEnv(AdvisingEnv):
    """Advise a vehicle's speed and lamps in fog, in the traffic of highway-env.

    Spaces, reward, ``info`` and rendering are those of ``fogsim/FogAdvisory-v0``
    (`fogsim_envs.advisory.FogAdvisoryEnv`); highway-env has no signs, so ``signs_mask`` is 0. The ego keeps its lane
    and follows its leader by IDM; advice sets its target speed. Neither it nor the other drivers react to a leader
    that they cannot see in the fog.

    ### Start and end
    A reset of the highway-env environment. Terminated by a collision of the ego or at the end of its road; truncated
    after the environment's ``duration``, or 600 s where it has none.

    ### Arguments
    environment : id of a highway-env environment
    config : its configuration
    visibility : meteorological visibility of homogeneous fog [m]; ``inf`` for clear air
    overrides : ``key.path=value`` each, as after ``fogsim run --set`` (not those of ``traffic``);
    ``reset(options={"overrides": [...]})`` adds to them for one episode
    image_size, continuous, reward_weights, render_mode : as of ``fogsim/FogAdvisory-v0``

    ### Version history
    * v0: first version
    """

    def __init__(
        self,
        environment: str = "highway-v0",
        config: Mapping[str, Any] = MappingProxyType({}),
        visibility: float = 100.0,
        *,
        overrides: Sequence[str] = (),
        image_size: tuple[int, int] | None = (160, 120),
        continuous: bool = False,
        reward_weights: RewardWeights | None = None,
        render_mode: str | None = None,
    ) -> None:
        made: Any = gymnasium.make(environment).unwrapped
        if not is_highway_environment(made):
            raise InputError(f"environment must be an id of highway-env, such as 'highway-v0'; got {environment!r}")
        # Leaders across the joints of roads are seen too, unless the user says otherwise.
        made.configure({"neighbour_vehicles_connected_lanes": True, **config})
        settings = highway_config(made)

        def load(more: Sequence[str]) -> Scenario:
            return highway_scenario(settings, visibility, [*_clocks(settings), *more])

        def begin(scenario: Scenario, seed: int) -> tuple[ClosedLoop, Step]:
            loop = ClosedLoop(scenario, _traffic(made, scenario))
            try:
                return loop, loop.start(seed)
            except BaseException:
                loop.close()
                raise

        super().__init__(
            load,
            begin,
            overrides=overrides,
            image_size=image_size,
            continuous=continuous,
            reward_weights=reward_weights,
            render_mode=render_mode,
        )


def highway_config(environment: Any) -> Mapping[str, Any]:
    """Configuration of a highway-env environment without wrappers."""
    config: Mapping[str, Any] = environment.config
    return config


def highway_scenario(config: Mapping[str, Any], visibility: float, overrides: Sequence[str]) -> Scenario:
    """Scenario of a highway-env environment in homogeneous fog.

    Parameters
    ----------
    config : mapping
        The environment's configuration.
    visibility : float
        Meteorological visibility [m].
    overrides : sequence of str
        ``key.path=value`` each.

    Raises
    ------
    InputError
        If anything does not fit.
    """
    duration = [f"duration_s={float(config['duration'])!r}"] if "duration" in config else []
    fog = f"fog.visibility_m={visibility!r}"
    return attached_scenario(EGO, [*duration, fog, f"traffic.stop_before_end_m={END_MARGIN!r}", *overrides])


def _clocks(config: Mapping[str, Any]) -> list[str]:
    step = 1.0 / config["simulation_frequency"]
    camera = step * max(1, round(CAMERA_PERIOD / step))
    decision = camera * max(1, round(DECISION_PERIOD / camera))
    keys = ("traffic_step", "camera_period", "decision_period")
    return [f"clocks.{key}_s={time!r}" for key, time in zip(keys, (step, camera, decision), strict=True)]


def _traffic(environment: Any, scenario: Scenario) -> HighwayTraffic:
    written = scenario.traffic
    sight = build.driver_sight(scenario)
    return HighwayTraffic(environment, sight, written.reading_radius_m, written.advice_deceleration_mps2)
