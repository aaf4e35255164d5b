"""How good a policy is: return, safety and speed over episodes, with intervals."""

import copy
import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Annotated, Any, Protocol, runtime_checkable

import gymnasium
import numpy as np
from numpy.typing import NDArray

from fogsim.core.parameters import Range, checked_parameters
from fogsim.core.randomness import Seed
from fogsim.core.registry import make
from fogsim.errors import InputError, shown
from fogsim.units import finite_or_none
from fogsim_envs.actions import checked_action
from fogsim_envs.advising import AdvisingEnv
from fogsim_envs.baselines import Info, Policy, baseline, check_baseline, reward_weights
from fogsim_envs.infos import numbers_of, row_of, word_of
from fogsim_envs.task.rewards import TaskWeights

_RESAMPLES = 2000
_CONFIDENCE = 0.95

_BATCH = "fogsim/FogAdvisoryBatch-"
"""How the ids begin that are vector environments alone."""

_CORRIDOR = "fogsim/FogCorridor-v1"
"""The id that is PettingZoo's, not Gymnasium's."""


@runtime_checkable
class Predictor(Protocol):
    """An agent of Stable-Baselines3, or one that is asked like it."""

    def predict(
        self, observation: Any, state: Any = None, episode_start: Any = None, deterministic: bool = False
    ) -> Any:
        """Choose an action; returns it and a state."""


AnyPolicy = Policy | Predictor | Callable[..., Any] | str
"""What `evaluate` takes as a policy."""


@dataclass(frozen=True, slots=True)
class EpisodeResult:
    """One episode."""

    seed: int  # Its seed
    value: float  # Sum of its rewards, discounted as asked [points]
    steps: int  # Decisions
    time: float  # How long it took [s]
    ending: str  # Why it ended
    struck: bool  # Whether the ego struck somebody; without an ego, whether anybody did
    cost: float  # Sum of ``info["cost"]``
    terms: Mapping[str, float]  # Undiscounted sums of the reward's terms
    metrics: Mapping[str, float]  # Metrics of the drive by a study's names; NaN where one is undefined


@dataclass(frozen=True, slots=True)
class Evaluation:
    """Results of a policy.

    Attributes
    ----------
    episodes : tuple of EpisodeResult
        The episodes, in the order of the seeds.
    mean, low, high : float
        Mean return and its 95 % interval, by bootstrap over episodes [points].
    arrived, struck : float
        Shares of episodes in which the ego arrived, and collided (without an ego: none, and any collision).
    metrics : mapping from str to (float, float, float)
        Mean of each metric, by the names of a study, and its 95 % interval, over the episodes in which it is defined;
        empty where the environment measures none (`metrics=True`).
    """

    episodes: tuple[EpisodeResult, ...]
    mean: float
    low: float
    high: float
    arrived: float
    struck: float
    metrics: Mapping[str, tuple[float, float, float]]

    def __str__(self) -> str:
        """One line."""
        return (
            f"return {self.mean:.1f} ({self.low:.1f} … {self.high:.1f}) over {len(self.episodes)} episodes, "
            f"arrived {self.arrived:.0%}, collided with others {self.struck:.0%}"
        )

    def minus(self, other: "Evaluation") -> tuple[float, float, float]:
        """Mean of what was gained over another policy on the same seeds, and its 95 % interval [points].

        Episodes differ more from one another than policies do, so this separates policies even where the intervals of
        their means overlap.

        Parameters
        ----------
        other : Evaluation
            Of the other policy.

        Raises
        ------
        InputError
            If its seeds are others.
        """
        ours, theirs = ([episode.seed for episode in one.episodes] for one in (self, other))
        if ours != theirs:
            raise InputError(f"other: expected episodes of the seeds {ours}, got {theirs}")
        gained = np.array([a.value - b.value for a, b in zip(self.episodes, other.episodes, strict=True)])
        return (float(gained.mean()), *bootstrap_interval(gained))

    def as_json(self) -> str:
        """All of it as JSON; null where something is undefined."""
        return json.dumps(_plain(asdict(self)), allow_nan=False)


def _plain(value: Any) -> Any:
    """A value as JSON has it."""
    if isinstance(value, Mapping):
        return {name: _plain(one) for name, one in value.items()}
    if isinstance(value, tuple):
        return [_plain(one) for one in value]
    return finite_or_none(value) if isinstance(value, float) else value


@checked_parameters
def evaluate(
    policy: AnyPolicy,
    env_id: Any = "fogsim/FogAdvisory-v2",
    seeds: Iterable[Seed] = range(50),
    *,
    discount: Annotated[float, Range(0.0, 1.0)] = 1.0,
    **arguments: Any,
) -> Evaluation:
    """Run a policy once for each seed.

    Parameters
    ----------
    policy : Policy, Predictor or str
        Callable of observation and info; an agent whose ``predict(observation, state, episode_start,
        deterministic=True)`` returns an action and a state, as those of Stable-Baselines3; or the name of one of
        `fogsim_envs.baselines.BASELINES` (of FogCorridor: `fogsim_envs.corridor.baselines.SIGN_BASELINES`).
    env_id : str, gymnasium.Env or pettingzoo.ParallelEnv
        The environment; one that is made here has ``split="test"`` and ``metrics=True`` by default. Of several agents
        (``fogsim/FogCorridor-v1``) each asks the policy by itself, and all are paid the same.
    seeds : iterable of int
        Seeds of the episodes.
    discount : float
        By which a reward counts less for each step that it comes later, 0 … 1.
    **arguments
        Arguments of the environment.

    Raises
    ------
    InputError
        If there are no seeds or one is given twice, the discount is none, the environment is of version 0, arguments
        are given for one that is made already, or a baseline that advises speeds is given for FogDrive.
    """
    given: Iterable[Any] = seeds
    numbers = tuple(int(seed) if isinstance(seed, np.integer) else seed for seed in given)
    if not numbers:
        raise InputError("seeds: expected at least one")
    if len(set(numbers)) < len(numbers):
        raise InputError("seeds: a seed is given twice")
    if discount == 0.0:
        raise InputError("discount: expected more than 0, got 0")
    if not isinstance(env_id, str):
        _check_made(env_id, arguments)
        return summarise([_episode_of(policy, env_id, seed, discount) for seed in numbers])
    if env_id.rpartition(":")[2].startswith(_BATCH):
        return summarise(_batch_episodes(policy, env_id, numbers, discount, arguments))
    env = _made(env_id, arguments)
    try:
        return summarise([_episode_of(policy, env, seed, discount) for seed in numbers])
    finally:
        env.close()


def _check_made(env: Any, arguments: Mapping[str, Any]) -> None:
    """Refuse what is no environment for `evaluate`, and arguments that came too late for it."""
    if not isinstance(env, gymnasium.Env) and not hasattr(env, "possible_agents"):
        raise InputError(
            f"env_id: expected an id, a gymnasium.Env or a pettingzoo.ParallelEnv, got {shown(env)}; "
            "evaluate runs an id of a batch by itself"
        )
    if isinstance(getattr(env, "unwrapped", None), AdvisingEnv):
        raise _of_version_0(env)
    if arguments:
        raise InputError(f"{', '.join(arguments)}: only an environment that is made here, by its id, takes arguments")


def _of_version_0(env: object) -> InputError:
    return InputError(
        f"env_id: expected version 1 or later, since version 0 has no split of episodes, got {shown(env)}"
    )


def _made(env_id: str, arguments: Mapping[str, Any]) -> Any:
    name = env_id.rpartition(":")[2]
    if name.startswith("fogsim/") and name.endswith("-v0"):
        raise _of_version_0(env_id)
    if name != _CORRIDOR:
        return gymnasium.make(env_id, **{"split": "test", "metrics": True, **arguments})
    # It needs PettingZoo, an extra.
    from fogsim_envs.corridor import parallel_env  # noqa: PLC0415

    return parallel_env(**{"split": "test", **arguments})


def _episode_of(policy: AnyPolicy, env: Any, seed: int, discount: float) -> EpisodeResult:
    if isinstance(env, gymnasium.Env):
        if isinstance(policy, str):
            check_baseline(policy, env)
        return _episode(env, _policy(policy, env.action_space, reward_weights(env)), seed, discount)
    return _parallel_episode(env, policy, seed, discount)


def summarise(episodes: Sequence[EpisodeResult]) -> Evaluation:
    """Means and intervals over episodes."""
    values = np.array([episode.value for episode in episodes])
    low, high = bootstrap_interval(values)
    return Evaluation(
        tuple(episodes),
        float(values.mean()),
        low,
        high,
        sum(episode.ending == "arrived" for episode in episodes) / len(episodes),
        sum(episode.struck for episode in episodes) / len(episodes),
        _metrics_over(episodes),
    )


def _metrics_over(episodes: Sequence[EpisodeResult]) -> dict[str, tuple[float, float, float]]:
    """Means of metrics and their intervals, over the episodes in which they are defined."""
    columns = {
        name: np.array([episode.metrics.get(name, math.nan) for episode in episodes]) for name in episodes[0].metrics
    }
    defined = {name: values[~np.isnan(values)] for name, values in columns.items()}
    return {name: (float(one.mean()), *bootstrap_interval(one)) for name, one in defined.items() if one.size}


def bootstrap_interval(values: NDArray[np.float64]) -> tuple[float, float]:
    """95 % interval of a mean, by percentiles of resampled means (`values` (n,))."""
    rng = np.random.default_rng(0)
    means = values[rng.integers(len(values), size=(_RESAMPLES, len(values)))].mean(axis=1)
    low, high = np.quantile(means, [(1.0 - _CONFIDENCE) / 2.0, (1.0 + _CONFIDENCE) / 2.0]).tolist()
    return low, high


class _Predicting:
    """A predictor as a policy of so many episodes at once (`number`)."""

    def __init__(self, predictor: Predictor, number: int = 1) -> None:
        self._predictor, self._number = predictor, number
        self.reset(0)

    def reset(self, seed: int) -> None:  # noqa: ARG002 - the protocol's parameters
        self._state: Any = None
        self._is_first = True

    def __call__(self, observation: Any, info: Info) -> NDArray[Any]:  # noqa: ARG002 - the protocol's parameters
        # In a batch all episodes begin together.
        starts = np.full(self._number, self._is_first)
        action, self._state = self._predictor.predict(observation, self._state, starts, deterministic=True)
        self._is_first = False
        return np.asarray(action)


class _Plain:
    """A bare function as a policy."""

    def __init__(self, function: Any) -> None:
        self._function = function

    def reset(self, seed: int) -> None:
        """Do nothing; see `Policy.reset`."""

    def __call__(self, observation: Any, info: Info) -> NDArray[Any]:
        return np.asarray(self._function(observation, info))


def _policy(policy: AnyPolicy, action_space: gymnasium.Space[Any], weights: TaskWeights | None) -> Policy:
    if isinstance(policy, str):
        return baseline(policy, action_space, weights)
    if isinstance(policy, Predictor):
        return _Predicting(policy)
    if callable(policy):
        return policy if hasattr(policy, "reset") else _Plain(policy)
    raise InputError(f"policy: expected a callable, an agent with predict(), or a baseline's name; got {policy!r}")


def _own_policy(policy: AnyPolicy, action_space: gymnasium.Space[Any], weights: TaskWeights | None = None) -> Policy:
    """A policy for one of several episodes or agents at once, which has a memory of its own."""
    one = _policy(policy, action_space, weights)
    if one is not policy:
        return one
    try:
        return copy.deepcopy(one)
    except Exception as error:
        raise InputError(
            f"policy: several episodes at once need a copy each, and {type(one).__name__} cannot be copied: {error}; "
            "give one without reset(), which all share, or an agent with predict()"
        ) from error


class _Sums:
    """What the rewards of an episode come to."""

    def __init__(self, discount: float) -> None:
        self._discount, self._weight = discount, 1.0
        self.value, self.steps, self.cost, self.collisions, self.strikes = 0.0, 0, 0.0, 0.0, 0
        self.terms: dict[str, float] = {}

    def add(self, reward: float, info: Info) -> None:
        self.value += self._weight * float(reward)
        self._weight *= self._discount
        self.steps += 1
        self.cost += float(info.get("cost", 0.0))
        self.collisions += float(info.get("collisions", 0.0))
        self.strikes += word_of(info, "fault") == "ego"
        for name, term in numbers_of(info, "reward_terms").items():
            self.terms[name] = self.terms.get(name, 0.0) + float(term)

    def result(self, seed: int, info: Info, struck: bool) -> EpisodeResult:
        ending, time = word_of(info, "ending") or "time", float(info.get("time_s", math.nan))
        metrics = numbers_of(info, "metrics")
        return EpisodeResult(seed, self.value, self.steps, time, ending, struck, self.cost, self.terms, metrics)


def _episode(env: gymnasium.Env[Any, Any], policy: Policy, seed: int, discount: float) -> EpisodeResult:
    policy.reset(seed)
    observation, info = env.reset(seed=seed)
    sums, over = _Sums(discount), False
    while not over:
        observation, reward, terminated, truncated, info = env.step(policy(observation, info))
        sums.add(float(reward), info)
        over = terminated or truncated
    return sums.result(seed, info, sums.strikes > 0)


def _batch_episodes(
    policy: AnyPolicy, env_id: str, seeds: Sequence[int], discount: float, arguments: Mapping[str, Any]
) -> list[EpisodeResult]:
    """All episodes at once."""
    envs: Any = gymnasium.make_vec(env_id, num_envs=len(seeds), **{"split": "test", **arguments})
    if isinstance(policy, Predictor):
        together, policies = _Predicting(policy, len(seeds)), []
    else:
        policies = [_own_policy(policy, envs.single_action_space, reward_weights(envs)) for _ in seeds]
        for one, seed in zip(policies, seeds, strict=True):
            one.reset(seed)
    observations, infos = envs.reset(seed=list(seeds))
    sums, results = [_Sums(discount) for _ in seeds], dict[int, EpisodeResult]()
    while len(results) < len(seeds):
        running = [i for i in range(len(seeds)) if i not in results]
        if policies:
            actions = np.stack([envs.single_action_space.sample()] * len(seeds))
            for i in running:
                chosen = policies[i](observations[i], row_of(infos, i))
                actions[i] = checked_action(chosen, envs.single_action_space, env_id)
        else:
            actions = together(observations, infos)
        observations, rewards, terminated, truncated, infos = envs.step(actions)
        ends = infos.get("final_info", infos)
        for i in running:
            info = row_of(ends, i)
            sums[i].add(rewards[i], info)
            if terminated[i] or truncated[i]:
                results[i] = sums[i].result(seeds[i], info, sums[i].strikes > 0)
    return [results[i] for i in range(len(seeds))]


def _parallel_episode(env: Any, policy: AnyPolicy, seed: int, discount: float) -> EpisodeResult:
    """One episode of several agents who are paid the same."""
    # Who has signs has PettingZoo, without which that room cannot be imported.
    from fogsim_envs.corridor.baselines import SIGN_BASELINES  # noqa: PLC0415

    policies = {
        agent: make(SIGN_BASELINES, policy, space) if isinstance(policy, str) else _own_policy(policy, space)
        for agent, space in ((one, env.action_space(one)) for one in env.possible_agents)
    }
    for number, one in enumerate(policies.values()):
        one.reset(len(policies) * seed + number)
    observations, infos = env.reset(seed=seed)
    first, sums = env.possible_agents[0], _Sums(discount)
    while env.agents:
        actions = {agent: policies[agent](observations[agent], infos[agent]) for agent in env.agents}
        observations, rewards, _, _, infos = env.step(actions)
        sums.add(rewards[first], infos[first])
    return sums.result(seed, infos[first], sums.collisions > 0.0)
