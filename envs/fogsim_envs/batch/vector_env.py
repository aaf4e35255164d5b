"""The vector environment."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from fogsim.core.kinematics import DECELERATION, REACTION_TIME
from fogsim.core.parameters import Range, checked_parameters, parameter_mistakes
from fogsim.errors import InputError, shown
from fogsim_envs.actions import checked_action
from fogsim_envs.batch.beginning_kernels import begin
from fogsim_envs.batch.drawing import draw_numbers
from fogsim_envs.batch.drive_kernels import LIMIT, advance
from fogsim_envs.batch.layout import (
    COLLISION,
    DRAWN,
    DRIVERS,
    ENDINGS,
    KNOWN_QUANTILES,
    MOST_DEMAND,
    OTHERS,
    TERMS,
    Episodes,
    RuleConstants,
    SurrogateArrays,
)
from fogsim_envs.infos import flat_arrays
from fogsim_envs.plain_arguments import takes_plain_data
from fogsim_envs.rewards import WeightsOf
from fogsim_envs.spaces import ACTION_LEVELS, ADVISED_SPEEDS, LAMP_MODES, action_space
from fogsim_envs.task.episodes import FogDistribution, ScenarioDistribution
from fogsim_envs.task.fast import FAST_FOG, FAST_SCENARIO
from fogsim_envs.task.observation import task_space
from fogsim_envs.task.rewards import TaskWeights
from fogsim_envs.task.sampling import split_number
from fogsim_envs.task.surrogate import MEASURED, MEASURED_2, SurrogateTable

Infos = dict[str, Any]
Outcome = tuple[NDArray[np.float32], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], Infos]
_SPEEDS = np.array([*ADVISED_SPEEDS, np.inf])
_SHOWN = (
    "time", "position", "speed", "struck", "ending", "rule_speed", "rule_lamps",
    "quantile_5", "quantile_50", "quantile_95", "visibility", "visibility_ahead",
)  # fmt: skip
_FAULTS = np.array(["", "ego", "other"])
_LAMPS = np.array([int(one) for one in LAMP_MODES])


@takes_plain_data
@checked_parameters
class FogAdvisoryBatchEnv(VectorEnv[NDArray[np.float32], NDArray[Any], NDArray[Any]]):
    """Many episodes of ``fogsim/FogAdvisoryFast-v1`` in one kernel, without SUMO: for training.

    Spaces, reward, ``info`` and baselines are those of `FogAdvisoryFastEnv`, and episodes are drawn as there: the same
    seed gives the same fog, light, script and driver. Traffic is simpler than SUMO's: Krauss' drivers who see only
    through the fog, of whom the ego alone changes lanes; who leaves the road enters it again. An episode that is over
    is followed by the next in the same step (`AutoresetMode.SAME_STEP`), and ``infos["final_obs"]`` and
    ``infos["final_info"]`` have its end; or in the next step, whose action is ignored there (`NEXT_STEP`).

    ### Arguments
    num_envs : how many episodes at once
    fog_distribution, scenario_distribution, split, continuous, discrete, reward_weights, surrogate, flat_info : as in
        `FogAdvisoryFastEnv`
    rule : `RuleConstants` of the built-in adviser
    autoreset_mode : `AutoresetMode` SAME_STEP or NEXT_STEP, or its value, "SameStep" or "NextStep"

    ### Version history
    * v1: first version
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.SAME_STEP}  # noqa: RUF012
    reward_weights = WeightsOf(TaskWeights)
    _measured_errors = MEASURED

    def __init__(
        self,
        num_envs: Annotated[int, Range(1, 1_000_000)] = 256,
        *,
        fog_distribution: FogDistribution | None = None,
        scenario_distribution: ScenarioDistribution | None = None,
        split: str = "train",
        continuous: bool = False,
        discrete: bool = False,
        reward_weights: TaskWeights | None = None,
        surrogate: str | Path | None = None,
        rule: RuleConstants | None = None,
        flat_info: bool = False,
        autoreset_mode: AutoresetMode | Literal["SameStep", "NextStep"] = AutoresetMode.SAME_STEP,
    ) -> None:
        mode = AutoresetMode(autoreset_mode)
        if mode is AutoresetMode.DISABLED:
            raise InputError("autoreset_mode: expected SAME_STEP or NEXT_STEP, got DISABLED")
        self.metadata = {**self.metadata, "autoreset_mode": mode}
        if continuous and discrete:
            raise InputError("continuous and discrete: expected one of them at most")
        self.num_envs, self._is_flat = num_envs, flat_info
        self.single_observation_space = task_space("state", None)
        self.single_action_space = (
            spaces.Discrete(int(np.prod(ACTION_LEVELS))) if discrete else action_space(continuous)
        )
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._split, self._fog = split_number(split), fog_distribution or FAST_FOG
        self._scenes = scenario_distribution or FAST_SCENARIO
        if (most := max(self._scenes.demand)) > MOST_DEMAND:
            raise InputError(
                f"scenario_distribution.demand: expected at most {MOST_DEMAND:g} vehicles/h, since at most "
                f"{OTHERS - 1} vehicles are in traffic, got {most:g}; fogsim/FogAdvisoryFast-v2 takes more"
            )
        own = [one for one, weight in self._scenes.drivers.items() if weight > 0.0 and one not in DRIVERS]
        if own:
            raise InputError(
                f"scenario_distribution.drivers: expected those of {', '.join(DRIVERS)}, which the kernel has, got "
                f"{own[0]!r}; fogsim/FogAdvisoryFast-v2 takes others"
            )
        self.reward_weights = reward_weights
        table = SurrogateTable.load(self._measured_errors if surrogate is None else Path(surrogate))
        self._table = SurrogateArrays(*(getattr(table, name) for name in SurrogateArrays._fields))
        self._rule = rule or RuleConstants()
        for name, mistake in parameter_mistakes(RuleConstants, self._rule._asdict()):
            raise InputError(f"rule.{name}: {mistake}")
        if self._rule.quantile not in KNOWN_QUANTILES:
            raise InputError(f"rule.quantile: expected one of {KNOWN_QUANTILES}, got {self._rule.quantile!r}")
        self._episodes = Episodes.empty(num_envs)
        self._generators: list[np.random.Generator] = []
        self._over = np.empty(0, np.int64)
        self._has_begun = False

    @checked_parameters
    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | NDArray[np.integer[Any]] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[NDArray[np.float32], Infos]:
        """Begin all episodes.

        Parameters
        ----------
        seed : int, sequence of int or None, or array of int
            Seed of each environment; a single one is that of the first, and the others have the following ones. None
            goes on with the numbers of before.
        options : None
            There are none.

        Raises
        ------
        InputError
            If there are options, or not as many seeds as environments.
        """
        if options:
            raise InputError(f"reset(): expected no options, got {sorted(options)}")
        seeds: Sequence[int | None]
        if isinstance(seed, int | np.integer):
            seeds = range(int(seed), int(seed) + self.num_envs)
        elif isinstance(seed, np.ndarray):
            seeds = seed.ravel().tolist()
        else:
            seeds = [None] * self.num_envs if seed is None else seed
        if len(seeds) != self.num_envs:
            raise InputError(f"seed: expected {self.num_envs} seeds, one for each environment, got {len(seeds)}")
        before = self._generators
        self._generators = [
            before[i] if one is None and before else seeding.np_random(None if one is None else int(one))[0]
            for i, one in enumerate(seeds)
        ]
        # False until all have begun, or have made a step, so that interrupted episodes do not go on.
        self._has_begun, self._over = False, np.empty(0, np.int64)
        self._begin(np.arange(self.num_envs))
        infos, self._has_begun = self._infos(), True
        return self._episodes.state.copy(), infos

    def _begin(self, rows: NDArray[np.int64]) -> None:
        drawn = (draw_numbers(self._generators[i], self._split, self._scenes, self._fog) for i in rows.tolist())
        draws = np.array(list(drawn), DRAWN)
        begin(self._episodes, rows, draws, self._table, self._rule)

    def step(self, actions: Any) -> Outcome:
        """Let an action be in force in each environment for one decision period.

        Parameters
        ----------
        actions : array_like
            A member of the action space.

        Raises
        ------
        gymnasium.error.ResetNeeded
            If no episode has begun, or a step or reset was interrupted.
        InputError
            If the actions are no member of the action space.
        """
        if not self._has_begun:
            raise gymnasium.error.ResetNeeded("no episode has begun: call reset() before step()")
        commanded = self._commanded(self._checked(actions))
        self._has_begun = False
        outcome = self._advance(*commanded)
        self._has_begun = True
        return outcome

    def _advance(self, advised: NDArray[np.float64], lamps: NDArray[np.int64]) -> Outcome:
        """Make a step with an advised speed [m/s] and a lamp mode of each."""
        ego = self._episodes.ego
        ego["advised"], ego["lamps"] = advised, lamps
        weights = np.array([getattr(self.reward_weights, name) for name in TERMS])
        advance(self._episodes, weights, self._table, self._rule)
        if len(self._over):
            self._begin(self._over)
        rewards, ending = self._episodes.terms.sum(axis=1), ego["ending"]
        truncated = ending == ENDINGS.index("time")
        terminated = (ending > 0) & ~truncated
        over = np.flatnonzero(ending)
        is_next_step = self.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
        if is_next_step:
            self._over = over
        if is_next_step or not len(over):
            return self._episodes.state.copy(), rewards, terminated, truncated, self._infos()
        final = {"final_obs": self._episodes.state.copy(), "final_info": self._infos()}
        self._begin(over)
        mask = terminated | truncated
        ends = {**final, "_final_obs": mask, "_final_info": mask.copy()}
        return self._episodes.state.copy(), rewards, terminated, truncated, {**self._infos(), **ends}

    def _checked(self, actions: Any) -> NDArray[Any]:
        """Actions as an array, or a refusal that names the first environment whose action does not fit."""
        name = type(self).__name__
        try:
            return checked_action(actions, self.action_space, name)
        except InputError:
            given = list(actions) if np.iterable(actions) else []
            if len(given) != self.num_envs:
                raise InputError(
                    f"action of {name}: expected {self.num_envs} members of {self.single_action_space}, one for each "
                    f"environment; got {shown(actions)}"
                ) from None
            for number, action in enumerate(given):
                checked_action(action, self.single_action_space, f"{name}, environment {number}")
            raise

    def _commanded(self, actions: NDArray[Any]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Advised speed [m/s] and number of the lamp mode of each."""
        if isinstance(self.single_action_space, spaces.Box):
            share = np.clip((actions.astype(float) + 1.0) / 2.0, 0.0, 1.0)
            speed = _SPEEDS[0] + share[:, 0] * (_SPEEDS[-2] - _SPEEDS[0])
            modes = np.minimum((share[:, 1] * len(LAMP_MODES)).astype(np.int64), len(LAMP_MODES) - 1)
            return np.where(share[:, 0] == 1.0, np.inf, speed), modes
        if isinstance(self.single_action_space, spaces.Discrete):
            level, modes = np.unravel_index(actions, ACTION_LEVELS)
            return _SPEEDS[level], modes
        return _SPEEDS[actions[:, 0]], actions[:, 1]

    def _infos(self) -> Infos:
        """The Fast task's, an array for each number; agents must not use ``truth``."""
        ego, terms = {name: self._episodes.ego[name].copy() for name in _SHOWN}, self._episodes.terms.copy()
        needed = ego["speed"] * REACTION_TIME + ego["speed"] ** 2 / (2.0 * DECELERATION)
        unseen = np.maximum(0.0, 1.0 - ego["visibility_ahead"] / np.maximum(needed, 1e-9))
        infos = {
            "time_s": ego["time"],
            "route_position_m": ego["position"],
            "speed_mps": ego["speed"],
            "speed_limit_mps": np.full(self.num_envs, LIMIT),
            "fault": _FAULTS[np.where(ego["ending"] == COLLISION, 2 - ego["struck"], 0)],
            "ending": np.array(ENDINGS)[ego["ending"]],
            "built_in_advice_mps": ego["rule_speed"],
            "built_in_lamps": _LAMPS[ego["rule_lamps"]],
            "belief": {
                "visibility_m": ego["quantile_50"],
                "visibility_low_m": ego["quantile_5"],
                "visibility_high_m": ego["quantile_95"],
            },
            "cost": ego["struck"] + unseen,
            "truth": {"visibility_m": ego["visibility"], "visibility_ahead_m": ego["visibility_ahead"]},
            "reward_terms": {name: terms[:, i] for i, name in enumerate(TERMS)},
        }
        return flat_arrays(infos) if self._is_flat else infos


class FogAdvisoryBatchV2Env(FogAdvisoryBatchEnv):
    """Many episodes of ``fogsim/FogAdvisoryFast-v2`` in one kernel, without SUMO: see `FogAdvisoryBatchEnv`.

    ### Version history
    * v2: estimates are drawn as those of the estimators for day and night err
    """

    _measured_errors = MEASURED_2
