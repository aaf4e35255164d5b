"""The vector environment for Stable-Baselines3, an extra: ``BatchVecEnv(gymnasium.make_vec(…))``."""

from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv

from fogsim.errors import InputError, shown
from fogsim_envs.batch.vector_env import FogAdvisoryBatchEnv


class BatchVecEnv(VecEnv):  # type: ignore[misc] # an extra, untyped where it is missing
    """A `FogAdvisoryBatchEnv` as Stable-Baselines3 wants it; each action is in force for `repeat` steps.

    Rewards are less by `multiplier` times ``info["cost"]``, 0 at first, for constrained learning. The info of an
    episode's last step has what it ``earned`` without that, and the sum of its ``cost``.
    """

    def __init__(self, envs: VectorEnv[Any, Any, Any], repeat: int = 1) -> None:
        if not isinstance(getattr(envs, "unwrapped", None), FogAdvisoryBatchEnv):
            raise InputError(f"envs: expected a fogsim/FogAdvisoryBatch of gymnasium.make_vec, got {shown(envs)}")
        if not (np.issubdtype(type(repeat), np.integer) and repeat >= 1):
            raise InputError(f"repeat: expected a whole number of at least 1, got {shown(repeat)}")
        if envs.metadata["autoreset_mode"] is not AutoresetMode.SAME_STEP:
            raise InputError('autoreset_mode: BatchVecEnv expects "SameStep"')
        self.envs, self._repeat, self.multiplier = envs, repeat, 0.0
        self._earned, self._cost = np.zeros(envs.num_envs), np.zeros(envs.num_envs)
        self._has_begun = False
        super().__init__(envs.num_envs, envs.single_observation_space, envs.single_action_space)

    def reset(self) -> NDArray[np.float32]:
        """Begin an episode in each, with the seed that `seed` has set."""
        seeds, options = self._seeds, next(filter(None, self._options), None)
        self._has_begun = False
        self._earned[:] = self._cost[:] = 0.0
        self._reset_seeds()
        self._reset_options()
        observations: NDArray[np.float32] = self.envs.reset(seed=seeds, options=options)[0]
        self._has_begun = True
        return observations

    def step_async(self, actions: NDArray[Any]) -> None:
        """Keep the actions for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> tuple[NDArray[np.float32], NDArray[np.float64], NDArray[np.bool_], list[dict[str, Any]]]:
        """Step all; an info has what Stable-Baselines3 reads at an episode's end."""
        if not self._has_begun:
            raise gymnasium.error.ResetNeeded("no episode has begun, or a step was interrupted: call reset()")
        shown: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        total, over = np.zeros(self.num_envs), np.zeros(self.num_envs, bool)
        for _ in range(self._repeat):
            observations, rewards, terminated, truncated, infos = self.envs.step(self._actions)
            # Refused actions change nothing.
            self._has_begun = False
            costs = infos.get("final_info", infos)["cost"]
            # What the action earns in the next episode is nothing that the agent chose there.
            self._earned += np.where(over, 0.0, rewards)
            self._cost += np.where(over, 0.0, costs)
            total += np.where(over, 0.0, rewards - self.multiplier * costs)
            for i in np.flatnonzero((terminated | truncated) & ~over).tolist():
                shown[i] = {
                    "terminal_observation": infos["final_obs"][i],
                    "TimeLimit.truncated": bool(truncated[i]),
                    "earned": float(self._earned[i]),
                    "cost": float(self._cost[i]),
                }
            over |= terminated | truncated
        self._earned[over] = self._cost[over] = 0.0
        self._has_begun = True
        return observations, total, over, shown

    def close(self) -> None:
        """Close the environment."""
        self.envs.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Attribute, the same for each."""
        return [self._found(attr_name)] * len(self._chosen(indices))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set an attribute of all; they have it in common."""
        self._expect_all(f"set_attr({attr_name!r})", indices)
        setattr(self.envs.unwrapped, attr_name, value)

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        """Call a method once for all."""
        self._expect_all(f"env_method({method_name!r})", indices)
        return [self._found(method_name)(*args, **kwargs)] * self.num_envs

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:  # noqa: ARG002 - none is
        """Whether each is wrapped: it is not."""
        return [False] * len(self._chosen(indices))

    def _found(self, name: str) -> Any:
        """Attribute of the wrappers, or of the environment in them."""
        return getattr(self.envs if hasattr(self.envs, name) else self.envs.unwrapped, name)

    def _chosen(self, indices: Any) -> list[int]:
        return [range(self.num_envs)[number] for number in self._get_indices(indices)]

    def _expect_all(self, call: str, indices: Any) -> None:
        """Refuse what would be done to all environments where some are meant."""
        if len(set(self._chosen(indices))) < self.num_envs:
            raise InputError(f"{call}: expected indices of all environments, which are one kernel, got {indices!r}")
