"""The agent advises the ego's speed and chooses its lamps."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.metrics import step_metrics
from fogsim.recorders import FramePanel
from fogsim.scenario import Scenario, build, load_scenario, override
from fogsim.values import Ending, Step
from fogsim_envs.hosting import Simulation, begin
from fogsim_envs.rewards import RewardWeights, reward_terms
from fogsim_envs.spaces import action_space, command_of, observation_space, observe

Observation = dict[str, NDArray[Any]]


class FogAdvisoryEnv(gymnasium.Env[Observation, NDArray[Any]]):
    """Advise a vehicle's speed and lamps in fog that only its camera can judge.

    One step is one decision period of the scenario (0.5 s in ``motorway_fog_bank``).

    ### Action
    ``MultiDiscrete([13, 3])``, or with ``continuous=True`` ``Box(-1, 1, (2,))``

    | entry | discrete | continuous |
    |---|---|---|
    | advised speed | level i is 20 + 10 i km/h; level 12 is no advice | −1 … 1 is 20 … 130 km/h; 1 is no advice |
    | lamps | 0 low beam, 1 and front fog, 2 and rear fog | thirds of −1 … 1 |

    ### Observation
    ``Dict`` of what the vehicle itself has; the truth is in ``info["truth"]`` and nowhere else

    | key | space | meaning |
    |---|---|---|
    | camera | uint8 (rows, cols, 3) | the latest frame |
    | signs | float32 (8, 4) in −1 … 1 | signs by the map: distance / 250 m, lateral / 25 m, value / 50 m/s, size / 2 |
    | signs_mask | 0 or 1 (8,) | which rows of ``signs`` are filled |
    | state | float32 (11,) in −1 … 1 | see below |

    ``state``: own speed / 50 m/s; lead present; lead distance / 200 m; lead relative speed / 50 m/s; estimate valid;
    estimated visibility on a log scale (1 m … 10 km to 0 … 1); relative deviation of the estimate; believed visibility
    on the same scale; deviation of ln k; advised speed in force / 50 m/s; fog lamps lit.

    ### Reward
    Sum of the terms in ``info["reward_terms"]``: progress, visibility_margin, conflict, discomfort, collision, lamps
    (`fogsim_envs.rewards`; weights by ``reward_weights``).

    ### Start and end
    The ego enters the road in running traffic. Terminated by a collision of the ego, by its arrival or if it leaves
    the network; truncated after the scenario's duration.

    ### Arguments
    scenario : name in the catalogue, file, or `fogsim.Scenario`
    overrides : ``key.path=value`` each, as after ``fogsim run --set``; ``reset(options={"overrides": [...]})`` adds
    to them for one episode
    image_size : (width, height) of the camera; None keeps the scenario's
    continuous : which action space
    reward_weights : `RewardWeights`
    render_mode : None or "rgb_array" (the camera frame beside a panel with estimate, truth, advice, speed and lamps)

    ### Version history
    * v0: first version
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 2}  # noqa: RUF012 - Gymnasium's own way

    def __init__(
        self,
        scenario: str | Path | Scenario = "motorway_fog_bank",
        *,
        overrides: Sequence[str] = (),
        image_size: tuple[int, int] | None = (160, 120),
        continuous: bool = False,
        reward_weights: RewardWeights | None = None,
        render_mode: str | None = None,
    ) -> None:
        if render_mode is not None and render_mode not in self.metadata["render_modes"]:
            raise InputError(f"unknown render_mode {render_mode!r}; known: None, 'rgb_array'")
        size = () if image_size is None else (f"camera.width={image_size[0]}", f"camera.height={image_size[1]}")
        self._source = scenario
        self._overrides = (*size, *overrides)
        self._scenario = self._load(())
        self._active = self._scenario
        self._continuous = continuous
        self._weights = reward_weights or RewardWeights()
        self._frames = build.periods(self._scenario).decision_frames
        self._simulation: Simulation | None = None
        self._step: Step | None = None
        self._panel = FramePanel()
        self.render_mode = render_mode
        self.metadata = {**self.metadata, "render_fps": 1 / self._scenario.clocks.decision_period_s}
        self.observation_space = cast("spaces.Space[Observation]", observation_space(build.camera(self._scenario)))
        self.action_space = action_space(continuous)

    def _load(self, more: Sequence[str]) -> Scenario:
        if isinstance(self._source, Scenario):
            return override(self._source, [*self._overrides, *more])
        return load_scenario(self._source, [*self._overrides, *more])

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode; ``options={"overrides": ["fog.visibility_m=80"]}`` changes the scenario for it."""
        super().reset(seed=seed)
        more = tuple((options or {}).get("overrides", ()))
        scenario = self._load(more) if more else self._scenario
        if build.camera(scenario) != build.camera(self._scenario):
            raise InputError("overrides of reset() must not change the camera: the observation space is fixed")
        if scenario != self._active:
            self.close()
            self._active = scenario
        run_seed = int(self.np_random.integers(2**31))
        if self._simulation is None:
            self._simulation, self._step = begin(scenario, run_seed)
        else:
            self._step = self._simulation.start(run_seed)
        self._panel = FramePanel()
        return observe(self._step), _info(self._step)

    def step(self, action: NDArray[Any]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Let an action be in force for one decision period."""
        if self._simulation is None or self._step is None:
            raise gymnasium.error.ResetNeeded("call reset() before step()")
        before, command = self._step, command_of(action, self._continuous)
        for _ in range(self._frames):
            self._step = self._simulation.advance(command)
            if self._step.ending is not None:
                break
        after = self._step
        terms = reward_terms(before, after, self._weights)
        truncated = after.ending is Ending.TIME
        terminated = after.ending is not None and not truncated
        info = {**_info(after), "reward_terms": terms}
        return observe(after), float(sum(terms.values())), terminated, truncated, info

    def render(self) -> NDArray[np.uint8] | None:
        """Draw the latest camera frame and its panel."""
        if self.render_mode is None:
            gymnasium.logger.warn("render() was called, but no render_mode was given to gymnasium.make()")
            return None
        if self._step is None:
            raise gymnasium.error.ResetNeeded("call reset() before render()")
        return self._panel.draw(self._step, step_metrics(self._step))

    def close(self) -> None:
        """End the simulation; closing twice is allowed."""
        if self._simulation is not None:
            self._simulation.close()
        self._simulation, self._step = None, None


def _info(step: Step) -> dict[str, Any]:
    """What is told beside the observation; agents must not use ``truth``."""
    return {
        "time_s": step.time,
        "route_position_m": step.route_position,
        "speed_mps": float(step.traffic.speed[step.ego]),
        "collisions": len(step.collisions),
        "ending": None if step.ending is None else step.ending.value,
        "truth": {
            "extinction_per_m": step.truth.extinction,
            "visibility_m": step.truth.visibility,
            "visibility_ahead_m": step.truth.visibility_ahead,
        },
    }
