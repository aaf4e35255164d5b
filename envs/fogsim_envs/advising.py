"""What environments have in common in which the agent advises the ego's speed and chooses its lamps."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple, cast

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from fogsim.core.parameters import checked_parameters
from fogsim.core.randomness import Seed
from fogsim.errors import InputError
from fogsim.scenario import Scenario, build
from fogsim.simulation.advised_driving import spread_advice, warned
from fogsim.values import Ending, Step
from fogsim_envs.actions import checked_action, checked_options
from fogsim_envs.hosting import Simulation, needs_completion, refuse_copies
from fogsim_envs.rendering import RENDER_MODES, StepRenderer, render_modes
from fogsim_envs.rewards import RewardWeights, WeightsOf, advice_standard, reward_terms
from fogsim_envs.spaces import ImageSize, action_space, command_of, observation_space, observe

Observation = dict[str, NDArray[Any]]


class ResetOptions(NamedTuple):
    """What `AdvisingEnv.reset` takes as ``options``."""

    overrides: Iterable[str] = ()  # ``key.path=value`` each, for this episode


class AdvisingEnv(gymnasium.Env[Observation, NDArray[Any]]):
    """One step is one decision period of a scenario; see `fogsim_envs.advisory.FogAdvisoryEnv` for the spaces."""

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 2}  # noqa: RUF012 - Gymnasium's own way
    reward_weights = WeightsOf(RewardWeights)

    def __init__(
        self,
        load: Callable[[Sequence[str]], Scenario],
        begin: Callable[[Scenario, int], tuple[Simulation, Step]],
        *,
        overrides: Iterable[str],
        image_size: ImageSize | None,
        continuous: bool,
        reward_weights: RewardWeights | None,
        render_mode: str | None,
    ) -> None:
        self._renderer = StepRenderer(render_mode, type(self).__name__)
        size = () if image_size is None else (f"camera.width={image_size[0]}", f"camera.height={image_size[1]}")
        self._load = load
        self._begin = begin
        self._overrides = (*size, *overrides)
        self._scenario = load(self._overrides)
        self._continuous = continuous
        self.reward_weights = reward_weights
        self._simulation: Simulation | None = None
        self._step: Step | None = None
        self.render_mode = render_mode
        self._act_in(self._scenario)
        self.observation_space = cast(
            "spaces.Space[Observation]", observation_space(build.camera_config(self._scenario).on())
        )
        self.action_space = action_space(continuous)

    def __getstate__(self) -> dict[str, Any]:
        """What pickle and copy take; a running simulation cannot be copied."""
        refuse_copies(self._simulation is not None)
        return self.__dict__

    def _act_in(self, scenario: Scenario) -> None:
        """Take up what a scenario says of clocks and safety, which an episode may change."""
        build.check_frames(scenario, "the agent")
        self._active = scenario
        self._frames = build.periods(scenario).decision_frames
        self._standard, self._advice = advice_standard(scenario), build.advice_config(scenario)
        rate = 1 / scenario.clocks.decision_period_s
        self.metadata = {**self.metadata, "render_modes": render_modes(), "render_fps": rate}

    @needs_completion
    @checked_parameters
    def reset(
        self, *, seed: Seed | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode; ``options={"overrides": ["fog.visibility_m=80"]}`` changes the scenario for it."""
        more = tuple(checked_options(ResetOptions, options).overrides)
        scenario = self._load([*self._overrides, *more]) if more else self._scenario
        if build.camera_config(scenario).on() != build.camera_config(self._scenario).on():
            raise InputError("overrides of reset() must not change the camera: the observation space is fixed")
        if scenario != self._active:
            self._act_in(scenario)
            self._end_simulation()
        super().reset(seed=None if seed is None else int(seed))
        run_seed = int(self.np_random.integers(2**31))
        self._step = None
        if self._simulation is None:
            self._simulation, self._step = self._begin(scenario, run_seed)
        else:
            self._step = self._simulation.start(run_seed)
        self._renderer.begin_episode()
        self._show(self._step)
        return observe(self._step), _info(self._step)

    def _show(self, step: Step) -> None:
        self._renderer.show(step, self.metadata["render_fps"])

    @needs_completion
    def step(self, action: NDArray[Any]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Let an action be in force for one decision period."""
        if self._simulation is None or self._step is None or self._step.ending is not None:
            raise gymnasium.error.ResetNeeded("the episode is over or none has begun: call reset() before step()")
        name = type(self).__name__ if self.spec is None else self.spec.id
        chosen = command_of(checked_action(action, self.action_space, name), self._continuous)
        # None until the next step is complete, so that an interrupted episode does not go on.
        before, self._step = self._step, None
        command = warned(spread_advice(chosen, self._advice, before.truth.sections), before, before.command)
        after = self._step = self._simulation.advance(command, self._frames)
        self._show(after)
        terms = reward_terms(before, after, self.reward_weights, self._standard)
        truncated = after.ending is Ending.TIME
        terminated = after.ending is not None and not truncated
        info = {**_info(after), "reward_terms": terms}
        return observe(after), float(sum(terms.values())), terminated, truncated, info

    def render(self) -> NDArray[np.uint8] | None:
        """Draw the latest camera frame and its panel; with a window, each step is drawn as it is made."""
        if self._step is None:
            raise gymnasium.error.ResetNeeded("call reset() before render()")
        return self._renderer.render(self._step)

    def close(self) -> None:
        """End the simulation and close the window; closing twice is allowed."""
        self._renderer.close()
        self._end_simulation()

    def _end_simulation(self) -> None:
        if self._simulation is not None:
            self._simulation.close()
        self._simulation, self._step = None, None


def _info(step: Step) -> dict[str, Any]:
    """Information returned next to the observation; agents must not use ``truth``."""
    return {
        "time_s": step.time,
        "route_position_m": step.route_position,
        "speed_mps": float(step.traffic.speed[step.ego]),
        "collisions": len(step.collisions),
        "warning": None if step.command.warning is None else step.command.warning.value,
        "ending": None if step.ending is None else step.ending.value,
        "unplayed": step.unplayed.lines,
        "truth": {
            "extinction_per_m": step.truth.extinction,
            "visibility_m": step.truth.visibility,
            "visibility_ahead_m": step.truth.visibility_ahead,
        },
    }
