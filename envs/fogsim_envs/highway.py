"""The agent advises the ego of a highway-env environment."""

import functools
import math
from collections.abc import Iterable, Mapping, Sequence
from numbers import Real
from types import MappingProxyType
from typing import Annotated, Any

import gymnasium

from fogsim.core.parameters import Range, checked_parameters, mismatch
from fogsim.errors import InputError, shown
from fogsim.scenario import Scenario, attached_scenario, build
from fogsim.scenario.loading import clock_settings
from fogsim.simulation.loop import ClosedLoop
from fogsim.traffic.highway import EGO, HighwayTraffic, OtherRoadsError, is_highway_environment
from fogsim.values import Command, Step
from fogsim_envs.advising import AdvisingEnv
from fogsim_envs.hosting import refuse_controller
from fogsim_envs.plain_arguments import takes_plain_data
from fogsim_envs.rewards import RewardWeights
from fogsim_envs.spaces import ImageSize

_CAMERA_PERIOD, _DECISION_PERIOD = 0.1, 0.5
"""Time between frames and between decisions, as far as highway-env's step allows [s]."""

Visibility = Annotated[float, Range(1.0, math.inf, "m")]
"""Meteorological visibility [m]."""

_END_MARGIN = 5.0
"""The ego has arrived when it is this near to the end of its last lane [m]."""


@takes_plain_data
@checked_parameters
class FogHighwayEnv(AdvisingEnv):
    """Advise a vehicle's speed and lamps in fog, in the traffic of highway-env.

    Spaces, reward, ``info`` and rendering are those of ``fogsim/FogAdvisory-v0``
    (`fogsim_envs.advisory.FogAdvisoryEnv`); highway-env has no signs, so ``signs_mask`` is 0. The ego keeps its lane
    and follows its leader by IDM; advice sets its target speed. Neither it nor the other drivers react to a leader
    that they cannot see in the fog; the others choose their speed in it and follow advice as the scenario's ``drivers``
    say, and do what its ``traffic.events`` script. Vehicles are called ``ego``, ``lead`` (ahead of the ego in its lane
    at the reset) and by kind and place in the environment's list, such as ``IDMVehicle 3``.

    ### Start and end
    A reset of the highway-env environment. Terminated by a collision of the ego or at the end of its road; truncated
    after the environment's ``duration``, or 600 s where it has none.

    ### Arguments
    environment : id of a highway-env environment
    config : its configuration
    visibility : meteorological visibility of homogeneous fog [m]; ``inf`` for clear air
    overrides : ``key.path=value`` each, as after ``fogsim run --set`` (of ``traffic`` not those that name files or the
    ego); ``reset(options={"overrides": [...]})`` adds to them for one episode
    image_size, continuous, reward_weights, render_mode : see ``fogsim/FogAdvisory-v0``

    ### Version history
    * v0: first version
    """

    def __init__(
        self,
        environment: str = "highway-v0",
        config: Mapping[str, Any] = MappingProxyType({}),
        visibility: Visibility = 100.0,
        *,
        overrides: Iterable[str] = (),
        image_size: ImageSize | None = (160, 120),
        continuous: bool = False,
        reward_weights: RewardWeights | None = None,
        render_mode: str | None = None,
    ) -> None:
        made = highway_environment(environment, config)
        settings = highway_config(made)

        super().__init__(
            functools.partial(highway_scenario, settings, visibility),
            functools.partial(_begun, made),
            overrides=overrides,
            image_size=image_size,
            continuous=continuous,
            reward_weights=reward_weights,
            render_mode=render_mode,
        )


def _begun(environment: Any, scenario: Scenario, seed: int) -> "tuple[HighwayLoop, Step]":
    loop = HighwayLoop(environment, scenario)
    try:
        return loop, loop.start(seed)
    except BaseException:
        loop.close()
        raise


class HighwayLoop:
    """A closed loop in an environment's traffic, built again where the environment builds other roads."""

    def __init__(self, environment: Any, scenario: Scenario) -> None:
        self._environment = environment
        self._scenario = scenario
        self._loop = self._built()

    def _built(self) -> ClosedLoop:
        refuse_controller(self._scenario)
        return ClosedLoop(self._scenario, _traffic(self._environment, self._scenario))

    def start(self, seed: int) -> Step:
        """Begin a run; see `ClosedLoop.start`."""
        try:
            return self._loop.start(seed)
        except OtherRoadsError:
            self._loop.close()
            self._loop = self._built()
            return self._loop.start(seed)

    def advance(self, command: Command, periods: int = 1) -> Step:
        """Move by some camera periods; see `ClosedLoop.advance`."""
        return self._loop.advance(command, periods)

    def close(self) -> None:
        """End the simulation; closing twice is allowed."""
        self._loop.close()


def highway_environment(environment: str, config: Mapping[str, Any]) -> Any:
    """Make a highway-env environment."""
    try:
        made: Any = gymnasium.make(environment).unwrapped
    except gymnasium.error.Error as error:
        raise InputError(f"environment must be an id of highway-env, such as 'highway-v0': {error}") from error
    if not is_highway_environment(made):
        raise InputError(f"environment must be an id of highway-env, such as 'highway-v0'; got {environment!r}")
    for name, value in config.items():
        if isinstance(value, Real) and not math.isfinite(value):
            raise InputError(f"config[{name!r}] must be a finite number, got {value!r}")
    # Leaders across the joints of roads are seen too, unless the user says otherwise.
    made.configure({"neighbour_vehicles_connected_lanes": True, **config})
    for name in ("simulation_frequency", "policy_frequency"):
        expected = mismatch(Annotated[float, Range(0.1, 1000.0, "Hz")], made.config[name])
        if expected is not None:
            raise InputError(f"config[{name!r}] must be {expected}, got {shown(made.config[name])}")
    return made


def highway_config(environment: Any) -> Mapping[str, Any]:
    """Configuration of a highway-env environment without wrappers."""
    config: Mapping[str, Any] = environment.config
    return config


def highway_scenario(config: Mapping[str, Any], visibility: float, overrides: Sequence[str]) -> Scenario:
    """Scenario of a highway-env environment in homogeneous fog of a visibility [m]; InputError if overrides misfit."""
    duration = [f"duration_s={float(config['duration'])!r}"] if "duration" in config else []
    fog = f"fog.visibility_m={float(visibility)!r}"
    margin = f"traffic.stop_before_end_m={_END_MARGIN!r}"
    scenario = attached_scenario(EGO, [*duration, fog, margin, *_clocks(config), *overrides])
    if scenario.road is not None:
        raise InputError("road: roads and vehicles are highway-env's own here; leave this key out")
    traffic = scenario.traffic
    foreign = [key for key in ("config", "net", "routes", "additional") if getattr(traffic, key)]
    if foreign or traffic.ego != EGO:
        key = foreign[0] if foreign else "ego"
        raise InputError(
            f"traffic.{key}: roads and vehicles are highway-env's own here, and the ego is called {EGO!r}; "
            f"leave this key out; got {getattr(traffic, key)!r}"
        )
    step, asked = 1.0 / config["simulation_frequency"], scenario.clocks.traffic_step_s
    if not math.isclose(asked, step):
        raise InputError(
            f"clocks.traffic_step_s: highway-env moves by 1 / simulation_frequency = {step:g} s, which its own config "
            f"sets; leave this key out; got {asked!r}"
        )
    return scenario


def _clocks(config: Mapping[str, Any]) -> list[str]:
    step = 1.0 / config["simulation_frequency"]
    camera = step * max(1, round(_CAMERA_PERIOD / step))
    return clock_settings(step, camera, camera * max(1, round(_DECISION_PERIOD / camera)))


def one_frame_clocks(config: Mapping[str, Any]) -> list[str]:
    """Overrides by which there is one frame a decision."""
    step = 1.0 / config["simulation_frequency"]
    decision = step * max(1, round(_DECISION_PERIOD / step))
    return clock_settings(step, decision, decision)


def _traffic(environment: Any, scenario: Scenario) -> HighwayTraffic:
    setup = build.traffic_setup(scenario)
    return HighwayTraffic(
        environment,
        setup.sight,
        setup.reading_radius,
        setup.advice_deceleration,
        setup.drivers,
        setup.events,
        setup.keep_lane,
        setup.after_collision,
    )
