"""A camera in fog for any highway-env environment; the agent goes on driving by that environment's own actions."""

import math
from collections.abc import Iterable, Mapping
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.utils import RecordConstructorArgs

from fogsim.core.parameters import checked_parameters
from fogsim.core.randomness import Seed, spawn_streams
from fogsim.errors import InputError
from fogsim.scenario import Scenario, build
from fogsim.scenario.loading import clock_settings
from fogsim.simulation.ego.equipment import EgoEquipment
from fogsim.simulation.loop import DriversFog
from fogsim.simulation.run_config import RunConfig
from fogsim.traffic.highway import (
    Fleet,
    RouteProgress,
    control_drivers,
    is_highway_environment,
    read_snapshot,
    road_network,
    same_roads,
)
from fogsim.traffic.setup import UNTOUCHED
from fogsim.values import Command, FogField, RoadNetwork, SignMap, Step
from fogsim_envs.highway import Visibility, highway_config, highway_scenario
from fogsim_envs.spaces import LAMP_MODES, ImageSize, observation_space, observe

__all__ = ["FogCameraWrapper"]

_COMMAND = Command(lamps=LAMP_MODES[0])


def _frequencies(config: Mapping[str, Any]) -> tuple[float, float]:
    """How often an environment of this configuration moves and takes an action [Hz]."""
    return float(config["simulation_frequency"]), float(config["policy_frequency"])


def _scenario(config: Mapping[str, Any], visibility: float, overrides: Iterable[str]) -> Scenario:
    """Scenario whose camera takes a frame at the end of each of the environment's steps."""
    simulation, policy = _frequencies(config)
    step = 1.0 / simulation
    period = step * max(1.0, simulation // policy)
    plain = {**config, "simulation_frequency": simulation, "policy_frequency": policy}
    scenario = highway_scenario(plain, visibility, [*clock_settings(step, period, period), *overrides])
    build.check_frames(scenario, "FogCameraWrapper")
    if not math.isclose(scenario.clocks.camera_period_s, period):
        raise InputError(
            f"clocks.camera_period_s: there is a frame at the end of each step of the environment, {period:g} s by its "
            f"config; leave this key out; got {scenario.clocks.camera_period_s!r}"
        )
    return scenario


@checked_parameters
class FogCameraWrapper(gymnasium.Wrapper[dict[str, Any], Any, Any, Any], RecordConstructorArgs):
    """Add a fogged camera frame and its fog estimate to the observation of a highway-env environment.

    The observation becomes a ``Dict``: ``camera``, the frame (rows, cols, 3) at the end of the step; ``state``, as in
    ``fogsim/FogAdvisory-v0`` (no advice is in force); ``highway``, the environment's own observation, which knows of no
    fog. ``info["truth"]`` holds the fog as it is. Actions, rewards, endings and rendering stay the environment's.

    Parameters
    ----------
    env : gymnasium.Env
        A highway-env environment with one controlled vehicle, wrapped or not; wrappers inside this one must leave
        roads and vehicles alone.
    visibility : float
        Meteorological visibility of homogeneous fog [m]; ``inf`` for clear air.
    overrides : sequence of str
        ``key.path=value`` each, as after ``fogsim run --set``, of the camera, light, sensors, estimators, drivers and
        ``traffic.events``, which play whatever `drivers` is.
    image_size : tuple of int
        Width and height of the camera [px].
    drivers : bool
        Whether the environment's own drivers see only what the fog lets them see, and choose their speeds in it.

    Raises
    ------
    InputError
        If it is no environment of highway-env, or a setting does not fit.
    """

    def __init__(
        self,
        env: gymnasium.Env[Any, Any],
        *,
        visibility: Visibility = 100.0,
        overrides: Iterable[str] = (),
        image_size: ImageSize = (160, 120),
        drivers: bool = True,
    ) -> None:
        overrides = tuple(overrides)
        RecordConstructorArgs.__init__(
            self, visibility=visibility, overrides=overrides, image_size=image_size, drivers=drivers
        )
        super().__init__(env)
        if not is_highway_environment(env.unwrapped):
            raise InputError(f"FogCameraWrapper: expected an environment of highway-env, got {env!r}")
        size = (f"camera.width={image_size[0]}", f"camera.height={image_size[1]}")
        self._visibility, self._overrides = visibility, (*size, *overrides)
        self._frequencies, self._config = self._configured()
        self._drivers = drivers
        self._equipment = EgoEquipment(self._config)
        self._network: RoadNetwork | None = None
        self._progress: RouteProgress | None = None
        self._drivers_fog = DriversFog()
        self._fleet: Fleet | None = None
        self._step: Step | None = None
        # The noise of the sensors draws on numbers of its own: the environment runs as it would without the camera.
        self._noise = np.random.default_rng()
        self._own_space = observation_space(self._config.camera.on())
        self._describe_observation()

    def _describe_observation(self) -> None:
        """Set the space of the observation; a reset may have changed the environment's part of it."""
        own = self._own_space
        self.observation_space = spaces.Dict(
            {"camera": own["camera"], "state": own["state"], "highway": self.env.observation_space}
        )

    def _configured(self) -> tuple[tuple[float, float], RunConfig]:
        """The environment's frequencies, and what rides in its vehicle by them."""
        config = highway_config(self.env.unwrapped)
        return _frequencies(config), _scenario(config, self._visibility, self._overrides).run_config()

    @checked_parameters
    def reset(
        self, *, seed: Seed | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Reset the environment and put the camera into its controlled vehicle.

        Parameters
        ----------
        seed : int or None
            Seed of the environment and of the sensors' noise; None goes on with the numbers of before.
        options : dict or None
            Of the environment.
        """
        # None until there is a frame, so that an interrupted episode does not go on.
        self._fleet = None
        observation, info = self.env.reset(seed=None if seed is None else int(seed), options=options)
        if seed is not None:
            self._noise = np.random.default_rng(seed)
        if _frequencies(highway_config(self.env.unwrapped)) != self._frequencies:
            # The options have changed the environment's configuration.
            self._frequencies, self._config = self._configured()
            self._equipment.close()
            self._equipment = EgoEquipment(self._config)
        self._describe_observation()
        environment: Any = self.env.unwrapped
        fleet = Fleet(environment, environment.vehicle)
        fleet.ego_lamps = _COMMAND.lamps
        network = road_network(environment.road, environment.vehicle)
        if self._network is not None and not same_roads(self._network, network):
            self._equipment.close()
            self._equipment = EgoEquipment(self._config)
        self._network, self._progress = network, RouteProgress(network.route)
        streams = spawn_streams(int(self._noise.integers(2**31)))
        fog = self._equipment.start_run(streams, lambda: (network, SignMap()))
        self._drivers_fog = self._take_over_drivers(fog, fleet, streams.traffic_seed)
        self._step = None
        framed = self._with_frame(observation, fleet, self._progress)
        self._fleet = fleet
        return framed, self._with_truth(info)

    def _take_over_drivers(self, fog: FogField, fleet: Fleet, seed: int) -> DriversFog:
        """Play the script, and put the fog about the environment's drivers if it concerns them."""
        setup, drivers_fog = self._config.traffic, DriversFog()
        manners = setup.drivers if self._drivers else UNTOUCHED
        control = control_drivers(fleet, manners, setup.events, seed, setup.advice_deceleration, setup.sight)
        if self._drivers:
            drivers_fog.enter(fog, control)
        return drivers_fog

    def step(self, action: Any) -> tuple[dict[str, Any], Any, bool, bool, dict[str, Any]]:
        """Let the environment make its step, then draw the frame at its end.

        Parameters
        ----------
        action : object
            Of the environment's own action space.
        """
        fleet, self._fleet = self._fleet, None
        if fleet is None or self._progress is None:
            raise gymnasium.error.ResetNeeded("call reset() before step()")
        self._drivers_fog.set_time(fleet.time)
        observation, reward, terminated, truncated, info = self.env.step(action)
        framed = self._with_frame(observation, fleet, self._progress)
        self._fleet = fleet
        return framed, reward, terminated, truncated, self._with_truth(info)

    def _with_frame(self, observation: Any, fleet: Fleet, progress: RouteProgress) -> dict[str, Any]:
        """Observation with the frame of now; with the last one if the vehicle is no longer there."""
        snapshot = read_snapshot(fleet, progress, (), self._config.traffic.reading_radius)
        if snapshot is not None:
            index = 0 if self._step is None else self._step.index + 1
            sent = self._equipment.look_from_roadside(fleet.time, snapshot.state)
            self._step = self._equipment.complete_step(index, fleet.time, snapshot, _COMMAND, None, sent)
        if self._step is None:
            raise gymnasium.error.ResetNeeded("the controlled vehicle is not on the road: call reset()")
        own = observe(self._step)
        return {"camera": own["camera"], "state": own["state"], "highway": observation}

    def _with_truth(self, info: dict[str, Any]) -> dict[str, Any]:
        truth = None if self._step is None else self._step.truth
        if truth is None:
            return info
        return {**info, "truth": {"extinction_per_m": truth.extinction, "visibility_m": truth.visibility}}

    def close(self) -> None:
        """Close the environment and free the renderer; closing twice is allowed."""
        self._equipment.close()
        self._fleet, self._network, self._progress, self._step = None, None, None, None
        super().close()
