"""The agent advises the ego's speed and chooses its lamps, in another fog, traffic and light each episode."""

import dataclasses
import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from fogsim.core.parameters import checked_parameters
from fogsim.core.randomness import Seed
from fogsim.errors import InputError, UnknownNameError
from fogsim.metrics import RunMetrics
from fogsim.scenario import Scenario, build
from fogsim.simulation.advised_driving import AdvisedDriving, spread_advice
from fogsim.simulation.ego.view_rendering import prepare_lamplight
from fogsim.traffic import SPEED_CHOICES
from fogsim.traffic.drivers.speed_choice import checked_choice, speed_share
from fogsim.values import Collision, Command, Ending, SpeedAdvice, Step
from fogsim_envs.actions import checked_action, checked_options
from fogsim_envs.hosting import (
    TIMEOUT,
    Simulation,
    Timeout,
    begin,
    checked_timeout,
    needs_completion,
    refuse_copies,
    restart,
)
from fogsim_envs.infos import flat_numbers
from fogsim_envs.plain_arguments import takes_plain_data
from fogsim_envs.rendering import RENDER_MODES, StepRenderer, render_modes
from fogsim_envs.rewards import WeightsOf, advice_standard
from fogsim_envs.spaces import ACTION_LEVELS, ImageSize, action_space, command_of
from fogsim_envs.task.episodes import FogDistribution, ScenarioDistribution
from fogsim_envs.task.observation import first_valid_estimate, leading_estimate, task_observation, task_space
from fogsim_envs.task.rewards import TaskWeights, Way, fault, strikes, task_terms, time_to_collision, unseen_share
from fogsim_envs.task.sampling import (
    MOTORWAY,
    MOTORWAY_2,
    MOTORWAY_DEFAULTS,
    AnyScenario,
    EpisodeChoice,
    EpisodeSource,
)


class _OwnDriver:
    """A driver who goes by the advice, or by an own choice of speed where that is lower."""

    def __init__(self, choice: str) -> None:
        self._choice = checked_choice(choice, SPEED_CHOICES[choice]())

    def follow(self, command: Command, step: Step) -> Command:
        """Command that the vehicle gets."""
        if command.control is not None:
            return command
        visibility = step.truth.visibility_ahead
        free = step.traffic.free_speed
        in_clear_air = float(free[step.ego]) if len(free) else step.speed_limit
        own = min(self._choice(visibility), speed_share(self._choice, visibility) * in_clear_air)
        if own >= min(command.advice.speed, in_clear_air) or not math.isfinite(own):
            return command
        return dataclasses.replace(command, advice=SpeedAdvice(own))


@takes_plain_data
@checked_parameters
class FogAdvisoryV1Env(gymnasium.Env[Any, Any]):
    """Advise a vehicle's speed and lamps in fog that only its camera can judge, another one each episode.

    One step is one decision period of the scenario (0.5 s); a frame is drawn and judged in each.

    ### Action
    ``MultiDiscrete([13, 3])``, or with ``continuous=True`` ``Box(-1, 1, (2,))``, or for DQN with ``discrete=True``
    ``Discrete(39)``, which is 3 · speed level + lamps

    | entry | discrete | continuous |
    |---|---|---|
    | advised speed | level i is 20 + 10 i km/h; level 12 is no advice | −1 … 1 is 20 … 130 km/h; 1 is no advice |
    | lamps | 0 low beam, 1 and front fog, 2 and rear fog | thirds of −1 … 1 |

    ### Observation
    With ``observation="dict"`` what the vehicle itself has; with "state" or "camera" that entry alone.
    "dict+sign_map" has the map's picture too, ``sign_map`` (`fogsim.Observation.sign_map`, uint8 (rows, cols, 3));
    "camera+sign_map" is the frame with a fourth channel: how near the signs of the map are

    | key | space | meaning |
    |---|---|---|
    | camera | uint8 (rows, cols, 3) | the latest frame |
    | signs | float32 (32,) in −1 … 1 | 8 signs by the map: distance / 250 m, lateral / 25 m, value / 50 m/s, size / 2 |
    | signs_mask | 0 or 1 (8,) | which rows of ``signs`` are filled |
    | state | float32 (22,) in −1 … 1 | see below |

    ``state``: own speed / 25 m/s − 1; speed limit, too; distance to go / 2.5 km − 1; time left / 300 s − 1; number
    of the own lane from the right / 5; number of lanes / 5; lead present; lead distance / 100 m − 1; relative speed of
    the lead / 25 m/s; estimate valid; log10 of the estimated visibility / 100 m; relative deviation of the estimate;
    believed visibility on the same scale: 5, 25, 50, 75, 95 % quantiles; deviation of ln k; advised speed asked for
    / 25 m/s − 1 (1 for none); front fog lamps lit; rear fog lamp lit; log10 of the light sensor's illuminance,
    0.1 lx at −1, 100,000 lx at 1. All are clipped to −1 … 1.

    ### Reward
    Sum of the terms in ``info["reward_terms"]``, in points (`fogsim_envs.task.TaskWeights`): progress, time, arrival,
    overdriving, conflict, discomfort, collision, rear_fog_lamp, front_fog_lamp. A drive at the limit all the way with
    nothing amiss is worth 40. ``info["cost"]`` is 1 for a collision in which the ego strikes somebody plus the share of
    the stopping sight distance beyond sight, for constrained learning.

    ### Episodes
    Fog, light, traffic, what a lead vehicle does, how fast the ego's own driver goes without advice, and the errors of
    the assumed calibration are drawn at each reset (`FogDistribution`, `ScenarioDistribution`);
    ``info["drawn"]`` has them, and ``reset(options={"episode": info["drawn"]})`` repeats the episode. ``split``
    "test" draws from other random numbers than "train", whatever the seeds.

    ### Start and end
    The ego is on a road that is full of traffic. Terminated by a collision of the ego, by its arrival or if it leaves
    the network; truncated after the scenario's duration.

    ### Arguments
    scenario : name in the catalogue, file, `fogsim.Scenario`, or a function that makes one with overrides; None for the
        default task's motorway
    scenario_distribution : `ScenarioDistribution`, or a sequence of scenarios to draw from; None with
        a scenario is that scenario alone
    fog_distribution : `FogDistribution`; None with a scenario, or several to draw from, is that scenario's own fog
    split : "train" or "test"
    observation : "dict", "state", "camera", "camera+sign_map" or "dict+sign_map"
    overrides : ``key.path=value`` each, as after ``fogsim run --set``
    image_size : (width, height) of the camera; None keeps the scenario's
    continuous, discrete : which action space
    reward_weights : `TaskWeights`
    render_mode : None, "rgb_array" (the camera frame next to a panel with estimate, truth, advice, speed and lamps), or
    "human" (that in a window, each step as long as it takes)
    flat_info : whether ``info`` is a flat dictionary of numbers, ``truth/visibility_m`` for example; ``ending``,
    ``warning`` and ``fault`` are then numbers, 0 for none, and ``drawn`` is left out
    metrics : whether ``info["metrics"]`` of an episode's last step has the metrics of a study by their names, NaN
    where one is undefined and at all earlier steps; takes 0.1 ms a step
    timeout : how long a child process that runs the simulation may give no sign of life [s]; ``inf`` for ever

    ### Version history
    * v1: other fog, light, traffic and drivers in each episode; a reward that time and arrival count in; state with
      speed limit, way and time left, lanes and the belief's quantiles; a hit from behind is not the agent's
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 2}  # noqa: RUF012 - Gymnasium's own way
    reward_weights = WeightsOf(TaskWeights)
    _default_motorway, _defaults = MOTORWAY, MOTORWAY_DEFAULTS
    _observed_estimate = staticmethod(leading_estimate)

    def __init__(
        self,
        scenario: AnyScenario | None = None,
        *,
        scenario_distribution: ScenarioDistribution | Sequence[AnyScenario] | None = None,
        fog_distribution: FogDistribution | None = None,
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
        checked_timeout(timeout)
        if render_mode is not None and render_mode not in self.metadata["render_modes"]:
            raise UnknownNameError("render_mode", render_mode, self.metadata["render_modes"])
        self._timeout = timeout
        size = () if image_size is None else (f"camera.width={image_size[0]}", f"camera.height={image_size[1]}")
        every = (*size, *overrides)
        self._source = EpisodeSource(
            scenario, scenario_distribution, fog_distribution, every, split, self._default_motorway, self._defaults
        )
        self._mode, self._continuous, self._is_flat = observation, continuous, flat_info
        self._is_measured, self._measured = metrics, RunMetrics()
        self.reward_weights = reward_weights
        self._renderer = self._make_renderer(render_mode)
        self.render_mode = render_mode
        self._simulation: Simulation | None = None
        self._running: Scenario | None = None
        self._step: Step | None = None
        first = self._source.first_scenario()
        self._check(first)
        self._camera = build.camera_config(first).on()
        if self._source.may_be_dark and first.renderer != "none":
            # Once a process; else the first night's reset would take half a second longer than others.
            prepare_lamplight(first.run_config())
        self.observation_space = task_space(observation, self._camera)
        if continuous and discrete:
            raise InputError("continuous and discrete: expected one of them at most")
        self._levels = self._action_levels()
        self.action_space = (
            spaces.Discrete(math.prod(self._levels)) if discrete else action_space(continuous, self._levels)
        )
        modes = [mode for mode in self.metadata["render_modes"] if mode in render_modes()]
        self.metadata = {"render_modes": modes, "render_fps": 1 / first.clocks.decision_period_s}

    @needs_completion
    @checked_parameters
    def reset(self, *, seed: Seed | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode.

        Parameters
        ----------
        seed : int
            Seed of this and the following episodes; None goes on with the numbers of before.
        options : dict or None
            What of the episode is not to be drawn: ``visibility`` where the fog is densest [m], ``scenario`` (which is
            run as it is, instead of the motorway), further ``overrides`` (list of ``key.path=value``), ``driver`` of
            the ego, or a whole ``episode`` as in ``info["drawn"]``.

        Raises
        ------
        InputError
            If an option is unknown or does not fit.
        """
        choice = checked_options(EpisodeChoice, options)
        super().reset(seed=None if seed is None else int(seed))
        run_seed, drawn = self._source.draw(self.np_random, choice)
        scenario = drawn.scenario
        self._check_camera(scenario)
        self._step = None
        self._step = self._completed(self._begin(scenario, run_seed))
        self._episode, self._driver = drawn.episode, _OwnDriver(drawn.episode.driver)
        self._advice, self._frames = build.advice_config(scenario), build.periods(scenario).decision_frames
        self._adviser = AdvisedDriving(self._advice, self._frames)
        self._standard = advice_standard(scenario)
        if self._is_measured:
            self._measured = RunMetrics()
            self._measured.update(self._step)
            self._unmeasured = dict.fromkeys(self._metrics(), math.nan)
        self._way_end = self._arrival(self._step, scenario)
        length = max(self._way_end - self._step.route_position, 1.0)
        self._way = Way(length, max(_limit(self._step), 1.0), scenario.duration_s)
        self._own = self._built_in = Command()
        self._renderer.begin_episode()
        self._show()
        return self._observe(), self._info(dict.fromkeys(TaskWeights.__dataclass_fields__, 0.0))

    def __getstate__(self) -> dict[str, Any]:
        """What pickle and copy take; a running simulation cannot be copied."""
        refuse_copies(hasattr(self, "_adviser"))
        return self.__dict__

    def _make_renderer(self, render_mode: str | None) -> StepRenderer:
        return StepRenderer(render_mode, type(self).__name__)

    def _check(self, scenario: Scenario) -> None:
        """Refuse a scenario that this environment cannot run."""
        build.check_frames(scenario, "the agent")

    def _check_camera(self, scenario: Scenario) -> None:
        self._check(scenario)
        camera = build.camera_config(scenario).on()
        ours = (self._camera.width, self._camera.height, self._camera.bits)
        if (camera.width, camera.height, camera.bits) != ours:
            raise InputError(
                f"{scenario.name}: expected a camera of width, height and bits {ours}, for which the observation space "
                f"was made, got {(camera.width, camera.height, camera.bits)}: give all scenarios one image_size"
            )

    def _arrival(self, step: Step, scenario: Scenario) -> float:
        """Position along the route at which the ego arrives [m]."""
        return _route_length(step) - scenario.traffic.stop_before_end_m

    def _begin(self, scenario: Scenario, seed: int) -> Step:
        if self._simulation is None:
            self._simulation, step = begin(scenario, seed, self._timeout)
        elif scenario == self._running:
            step = self._simulation.start(seed)
        else:
            before, self._simulation = self._simulation, None
            self._simulation, step = restart(before, scenario, seed, self._timeout)
        self._running = scenario
        return step

    @needs_completion
    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Let an action be in force for one decision period.

        Parameters
        ----------
        action : array_like of two numbers
            A member of the action space.

        Raises
        ------
        gymnasium.error.ResetNeeded
            If the episode is over or none has begun.
        InputError
            If the action is no member of the action space.
        """
        if self._simulation is None or self._step is None or self._step.ending is not None:
            raise gymnasium.error.ResetNeeded("the episode is over or none has begun: call reset() before step()")
        name = type(self).__name__ if self.spec is None else self.spec.id
        given = checked_action(action, self.action_space, name)
        if isinstance(self.action_space, spaces.Discrete):
            given = np.array(np.unravel_index(int(given - self.action_space.start), self._levels))
        chosen = self._commanded(given)
        self._own = replace(chosen, warning=self._built_in.warning)
        # None until the next step is complete, so that an interrupted episode does not go on.
        before, self._step = self._step, None
        self._step = self._drive(before)
        self._show()
        terms = task_terms(before, self._step, self._way, self.reward_weights, self._standard)
        truncated = self._step.ending is Ending.TIME
        terminated = self._step.ending is not None and not truncated
        return self._observe(), float(sum(terms.values())), terminated, truncated, self._info(terms)

    def _action_levels(self) -> tuple[int, int]:
        """Levels of the two entries of an action."""
        return ACTION_LEVELS

    def _commanded(self, action: NDArray[Any]) -> Command:
        """The command of two levels, or of two numbers."""
        return command_of(action, self._continuous)

    def _completed(self, step: Step) -> Step:
        """A step with all that an agent gets to know about it; here it has that from the loop."""
        return step

    def _drive(self, before: Step) -> Step:
        """The last step of a decision period, which begins after one, with all its collisions."""
        step, simulation = before, self._simulation
        if simulation is None:
            raise gymnasium.error.ResetNeeded("call reset() before step()")
        collisions: tuple[Collision, ...] = ()
        for _ in range(self._frames):
            asked = spread_advice(self._own, self._advice, before.truth.sections)
            step = self._completed(simulation.advance(self._driver.follow(asked, step)))
            if self._is_measured:
                # What the ego's own driver chooses is no advice.
                self._measured.update(replace(step, command=asked))
            collisions += step.collisions
            if step.ending is not None:
                break
        return replace(step, collisions=collisions)

    def _observe(self) -> Any:
        step, estimate = self._current, self._observed_estimate(self._current.estimates)
        return task_observation(step, estimate, self._mode, self._own, self._way.duration, self._way_end)

    @property
    def _current(self) -> Step:
        if self._step is None:
            raise gymnasium.error.ResetNeeded("call reset() first")
        return self._step

    def _info(self, terms: dict[str, float]) -> dict[str, Any]:
        """More than the observation, of the same tree at each step; agents must not use ``truth``."""
        step = self._current
        low, median, high = step.belief.visibility_quantiles((0.05, 0.5, 0.95))
        # What the built-in adviser would say here: it remembers what it said itself, not what the agent did.
        self._built_in = self._adviser.decide(step, self._built_in)
        info = {
            "time_s": step.time,
            "route_position_m": step.route_position,
            "speed_mps": float(step.traffic.speed[step.ego]),
            "speed_limit_mps": step.speed_limit,
            "time_to_collision_s": time_to_collision(step),
            "collisions": len(step.collisions),
            "fault": fault(step),
            "ending": "" if step.ending is None else step.ending.value,
            "built_in_advice_mps": self._built_in.advice.speed,
            "built_in_lamps": int(self._built_in.lamps),
            "warning": "" if self._built_in.warning is None else self._built_in.warning.value,
            "belief": {
                "visibility_m": median,
                "visibility_low_m": low,
                "visibility_high_m": high,
            },
            "cost": float(strikes(step)) + unseen_share(step, self._standard),
            "unplayed": "\n".join(step.unplayed.lines),
            "truth": {
                "extinction_per_m": step.truth.extinction,
                "visibility_m": step.truth.visibility,
                "visibility_ahead_m": step.truth.visibility_ahead,
            },
            "reward_terms": terms,
        }
        if self._is_measured:
            info["metrics"] = self._unmeasured.copy() if step.ending is None else self._metrics()
        return flat_numbers(info) if self._is_flat else {**info, "drawn": self._episode.as_info()}

    def _metrics(self) -> dict[str, float]:
        """Metrics of the episode so far, NaN where one is undefined."""
        found = self._measured.summary().flat()
        return {key: math.nan if one is None else float(one) for key, one in found.items() if key != "ending"}

    def render(self) -> NDArray[np.uint8] | None:
        """Draw the latest camera frame and its panel; with a window, each step is drawn as it is made."""
        return self._renderer.render(self._current)

    def _show(self) -> None:
        self._renderer.show(self._current, self.metadata["render_fps"])

    def close(self) -> None:
        """End the simulation and close the window; closing twice is allowed."""
        self._renderer.close()
        if self._simulation is not None:
            self._simulation.close()
        self._simulation, self._step, self._running = None, None, None


class FogAdvisoryV2Env(FogAdvisoryV1Env):
    """Advise a vehicle's speed and lamps in fog that only its camera can judge, by day and by night.

    As `FogAdvisoryV1Env`, but for its default task: estimators for day and night (joint_road, night_road and
    lead_contrast) instead of negru2013, which is silent by night; signs every 500 m; a radar that sees 20° wide and a
    position that errs by 1 m. In ``state``, the estimate is that of the first of them that answers.

    ### Version history
    * v2: as above
    """

    _default_motorway = MOTORWAY_2
    _observed_estimate = staticmethod(first_valid_estimate)


def _limit(step: Step) -> float:
    """Speed limit where the ego is [m/s]; off the lanes, the speed that it drives there by itself."""
    free = step.traffic.free_speed
    return float(free[step.ego]) if math.isinf(step.speed_limit) and len(free) else step.speed_limit


def _route_length(step: Step) -> float:
    route = step.truth.route
    if route is None:
        return math.inf
    return float(np.linalg.norm(np.diff(route, axis=0), axis=1).sum())
