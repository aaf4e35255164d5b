"""Train PPO, SAC or DQN of Stable-Baselines3 on an advisory task, and compare the agent with FogSim's own rule.

    pip install 'fogsim[rl]'
    python examples/train_agent.py --minutes 5 --out runs/ppo            # trains seed 0: policy and learning curve
    python examples/train_agent.py --minutes 5 --out runs/ppo --seeds 0 1 2 3 4
    python examples/train_agent.py --out runs/ppo --on fogsim/FogAdvisoryFast-v2 fogsim/FogAdvisory-v2  # only evaluates
    python examples/train_agent.py --minutes 15 --out runs/fast --train-on fogsim/FogAdvisoryFast-v2
    python examples/train_agent.py --minutes 5 --out runs/sac --method SAC
    python examples/train_agent.py --minutes 5 --out runs/careful --cost-limit 1.0
    python examples/train_agent.py --minutes 2 --out runs/no_belief --hide belief

Minutes are the processor's, of each training. Evaluation is on 100 episodes of the split "test", which training never
has. The rule is compared with its own constants and with ones that are searched on the split "train" (kept in
rule.json). With a cost limit, a multiplier of info["cost"] rises until an episode's cost is below the limit.
"""

import argparse
import json
import math
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import torch
from matplotlib.figure import Figure
from numpy.typing import NDArray
from stable_baselines3 import DQN, PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv, VecEnvWrapper, VecMonitor, VecNormalize

from fogsim_envs import Evaluation, evaluate
from fogsim_envs.baselines import baseline
from fogsim_envs.batch import RuleConstants
from fogsim_envs.batch.stable_baselines import BatchVecEnv
from fogsim_envs.task.observation import STATE_FEATURES

BATCH = "fogsim/FogAdvisoryBatch-v2"
REPEAT = 4  # An action is in force for 2 s, so that it shows in what the next ones earn
FIRST_RATE, LAST_RATE = 1e-3, 2e-5
MULTIPLIER_RATE = 0.05
SMOOTH = 9  # Points of a curve whose mean is drawn
SHORTEST = 0.01  # Between two points of a curve [min]
MOST = 100_000_000  # Decisions, more than any training makes; DQN explores during a share of them
METHODS = {"PPO": PPO, "SAC": SAC, "DQN": DQN}
CONSTANTS: dict[str, dict[str, Any]] = {
    "PPO": {"n_steps": 32, "batch_size": 2048, "n_epochs": 6, "gae_lambda": 0.9, "ent_coef": 0.002},
    "PPO of few decisions": {
        "n_steps": 2048, "batch_size": 256, "n_epochs": 10, "gae_lambda": 0.9, "ent_coef": 0.0, "gamma": 0.95,
        "policy_kwargs": {"net_arch": [64, 64], "log_std_init": -0.9},
    },
    "SAC": {"learning_starts": 2000, "train_freq": 1, "gradient_steps": 4, "ent_coef": "auto_0.1"},
    "DQN": {
        "learning_starts": 2000, "train_freq": 1, "gradient_steps": 8, "batch_size": 128,
        "target_update_interval": 1000, "exploration_fraction": 0.0005, "learning_rate": 3e-4,
    },
}  # fmt: skip
"""Where SUMO makes decisions slow, PPO begins as the rule, with less noise, and learns from nearer rewards."""
DEMONSTRATED = 20_000  # Steps of the rule that it imitates first
PARTS = {
    "lead": ("lead_present", "lead_distance", "lead_relative_speed"),
    "estimate": tuple(one for one in STATE_FEATURES if one.startswith("estimate")),
    "belief": tuple(one for one in STATE_FEATURES if one.startswith("belief")),
    "progress": ("distance_to_go", "time_left"),
    "own_advice": ("advised_speed", "front_fog_lamps", "rear_fog_lamp"),
    "light": ("ambient_light",),
}
"""Parts of the state that can be hidden, to see what each is worth."""


class Hidden(VecEnvWrapper):  # type: ignore[misc] # an extra, untyped where it is missing
    """Environments whose state has 0 for what the agent does not see."""

    def __init__(self, envs: VecEnv, parts: list[str]) -> None:
        super().__init__(envs)
        self._shown = shown(parts)

    def reset(self) -> NDArray[np.float32]:
        """Begin an episode in each."""
        return self.venv.reset() * self._shown

    def step_wait(self) -> tuple[NDArray[np.float32], NDArray[np.float64], NDArray[np.bool_], list[dict[str, Any]]]:
        """Step all."""
        states, rewards, over, infos = self.venv.step_wait()
        for i in np.flatnonzero(over):
            infos[i]["terminal_observation"] = infos[i]["terminal_observation"] * self._shown
        return states * self._shown, rewards, over, infos


@dataclass(frozen=True)
class Seeing:
    """An agent as `evaluate` wants it, which sees what it saw in training."""

    agent: BaseAlgorithm
    parts: list[str]

    def predict(self, observation: Any, *given: Any, deterministic: bool = False) -> Any:
        """Action, and the agent's memory."""
        return self.agent.predict(observation * shown(self.parts), *given, deterministic=deterministic)


def shown(hidden: list[str]) -> NDArray[np.float32]:
    """For each entry of the state 1 if the agent sees it, 0 if it is in a hidden part."""
    names = [name for part in hidden for name in PARTS[part]]
    return np.array([name not in names for name in STATE_FEATURES], np.float32)


class Repeated(gym.Wrapper[Any, Any, Any, Any]):
    """A task of one vehicle as `BatchVecEnv` has many: actions are in force for some steps, and what was earned."""

    def reset(self, **given: Any) -> tuple[Any, dict[str, Any]]:
        """Begin an episode."""
        self._earned = self._cost = 0.0
        return self.env.reset(**given)

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Let an action be in force."""
        before, steps, over = self._earned, 0, False
        while steps < REPEAT and not over:
            state, reward, terminated, truncated, info = self.env.step(action)
            self._earned, self._cost = self._earned + float(reward), self._cost + info["cost"]
            steps, over = steps + 1, terminated or truncated
        return state, self._earned - before, terminated, truncated, {"earned": self._earned, "cost": self._cost}


class Training(BaseCallback):
    """Ends the training after some minutes of the processor, and keeps the curve; steps become smaller."""

    def __init__(self, envs: VecEnv, minutes: float, cost_limit: float) -> None:
        super().__init__()
        self._envs, self._limit = envs, cost_limit
        self._seconds, self._begun = 60.0 * minutes, time.process_time()
        self.curve: list[tuple[float, int, float, float]] = []

    @property
    def spent(self) -> float:
        """Share of the time that is spent."""
        return (time.process_time() - self._begun) / self._seconds

    def learning_rate(self, _: float) -> float:
        """Learning rate now; Stable-Baselines3 gives the share of steps that are left, which is not known here."""
        return LAST_RATE + FIRST_RATE * min(max(1.2 * (1.0 - self.spent), 0.0), 1.0)

    def _on_step(self) -> bool:
        return self.spent < 1.0

    def _on_rollout_end(self) -> None:
        ends = list(self.model.ep_info_buffer)
        minutes = round(self.spent * self._seconds / 60.0, 3)
        if not ends or (self.curve and minutes < self.curve[-1][0] + SHORTEST):
            return
        cost = float(np.mean([one["cost"] for one in ends]))
        if math.isfinite(self._limit):
            self._envs.multiplier = max(self._envs.multiplier + MULTIPLIER_RATE * (cost - self._limit), 0.0)
        earned = float(np.mean([one["earned"] for one in ends]))
        self.curve.append((minutes, self.num_timesteps, round(earned, 2), round(cost, 3)))


def trained(asked: argparse.Namespace, seed: int) -> tuple[BaseAlgorithm, list[tuple[float, int, float, float]]]:
    """An agent, and its curve: minutes, decisions, and mean return and cost of the last 500 episodes (SUMO: 50)."""
    is_batch, method = "Batch" in asked.train_on, asked.method
    is_few = method == "PPO" and not is_batch
    actions = {"continuous": method == "SAC" or is_few, "discrete": method == "DQN"}
    if is_batch:
        # What learns from each decision many times needs fewer of them.
        number = 256 if method == "PPO" else 16
        envs: VecEnv = BatchVecEnv(gym.make_vec(asked.train_on, num_envs=number, **actions).unwrapped, REPEAT)
    else:
        task = gym.make(asked.train_on, observation="state", **actions)
        envs = DummyVecEnv([lambda: Repeated(task)])
    workers = VecMonitor(Hidden(envs, asked.hide), info_keywords=("earned", "cost"))
    workers.seed(seed)
    clock = Training(envs, asked.minutes, asked.cost_limit)
    constants = {"gamma": 0.98, "policy_kwargs": {"net_arch": [64, 64]}}
    constants |= {"learning_rate": clock.learning_rate} if method == "PPO" else {}
    constants |= CONSTANTS["PPO of few decisions" if is_few else method]
    # Only rewards are scaled: the state's entries are in -1 ... 1 already.
    scaled = VecNormalize(workers, norm_obs=False, gamma=constants["gamma"])
    window = 500 if is_batch else 50
    agent = METHODS[method]("MlpPolicy", scaled, stats_window_size=window, seed=seed, device="cpu", **constants)
    if is_few:
        imitate_rule(agent, task, shown(asked.hide), seed)
    agent.learn(MOST, callback=clock)
    agent.learning_rate = LAST_RATE  # The file need not hold the clock, and with it all episodes.
    agent._setup_lr_schedule()
    scaled.close()  # A process runs one task on SUMO; a second one would be in another, whose time is not counted.
    return agent, clock.curve


def imitate_rule(agent: BaseAlgorithm, env: gym.Env[Any, Any], seen: NDArray[np.float32], seed: int) -> None:
    """Give an agent the rule's actions as its mean actions."""
    rule, states, actions, over = baseline("rule", env.action_space), [], [], True
    for step in range(DEMONSTRATED):
        if over:
            state, info = env.reset(seed=seed if step == 0 else None)
        states.append(state * seen)
        actions.append(rule(state, info))
        state, _, terminated, truncated, info = env.step(actions[-1])
        over = terminated or truncated
    wanted = torch.as_tensor(np.array(actions, np.float32))
    given = torch.as_tensor(np.array(states))
    optimizer = torch.optim.Adam(agent.policy.parameters(), FIRST_RATE)
    for _ in range(10):
        for some in torch.randperm(len(given)).split(256):
            mean = agent.policy.get_distribution(given[some]).distribution.mean
            optimizer.zero_grad()
            (mean - wanted[some]).square().mean().backward()
            optimizer.step()


def tuned_rule(minutes: float, path: Path) -> RuleConstants:
    """Constants of the rule that earn most on the split "train", by random search for as long as an agent trains."""
    if path.exists():
        return RuleConstants(**json.loads(path.read_text(encoding="utf-8")))
    rng, begun, found = np.random.default_rng(0), time.process_time(), (-math.inf, RuleConstants())
    candidates = drawn_constants(rng)
    while time.process_time() - begun < 60.0 * minutes:
        one = next(candidates)
        found = max(found, (evaluate("rule", BATCH, range(500), split="train", rule=one).mean, one))
    path.write_text(json.dumps(found[1]._asdict()), encoding="utf-8")
    return found[1]


def drawn_constants(rng: np.random.Generator) -> Iterator[RuleConstants]:
    """Constants to try, the rule's own first."""
    yield RuleConstants()
    while True:
        yield RuleConstants(
            quantile=float(rng.choice((0.05, 0.25, 0.5, 0.75))),
            fallback=float(rng.choice((np.inf, *(np.arange(40.0, 120.0, 10.0) / 3.6)))),
            widest=float(rng.choice((0.4, 0.7, 1.0, 1.5))),
            sight_share=float(rng.choice((0.6, 0.8, 1.0))),
            hold=float(rng.choice((0.0, 1.5, 3.0, 6.0))),
        )


def rule_arguments(env_id: str, rule: RuleConstants) -> dict[str, Any]:
    """What gives an environment's built-in rule these constants."""
    if env_id == BATCH:
        return {"rule": rule}
    given = {
        "quantile": rule.quantile,
        "widest_belief": rule.widest,
        "sight_share": rule.sight_share,
        "hold": rule.hold,
    }
    if math.isfinite(rule.fallback):
        given["fallback"] = rule.fallback
    return {"overrides": [f"advice={json.dumps({'method': 'stopping_sight_distance', 'parameters': given})}"]}


def actions_of(agent: BaseAlgorithm) -> dict[str, bool]:
    """Which actions an environment must have for an agent."""
    space = agent.action_space
    return {"continuous": isinstance(space, gym.spaces.Box), "discrete": isinstance(space, gym.spaces.Discrete)}


def compared(agent: Evaluation, other: Evaluation) -> dict[str, float]:
    """Means, and the gain on the same seeds with its 95 % interval."""
    gain, low, high = agent.minus(other)
    values = {"agent": agent.mean, "other": other.mean, "gain": gain, "low": low, "high": high}
    return {name: round(value, 2) for name, value in values.items()}


def draw_curves(folder: Path) -> None:
    """Learning curves of all seeds in a folder, as an image."""
    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots()
    for path in sorted(folder.glob("curve_*.json")):
        curve = json.loads(path.read_text(encoding="utf-8"))
        if len(curve) < SMOOTH:
            continue
        minutes, _, earned, _ = np.array(curve).T
        smooth = np.convolve(earned, np.full(SMOOTH, 1 / SMOOTH), "valid")
        axes.plot(minutes[SMOOTH - 1 :], smooth, lw=1, label=f"seed {path.stem.rpartition('_')[2]}")
    axes.set(xlabel="training [min of processor]", ylabel="return of training episodes", ylim=(0, None))
    axes.legend()
    figure.savefig(folder / "curve.png", dpi=120)


def main() -> None:
    """Train, save, evaluate."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--method", choices=METHODS, default="PPO")
    parser.add_argument("--train-on", default=BATCH, help="id to train on")
    parser.add_argument("--minutes", type=float, default=5.0)
    parser.add_argument("--seeds", type=int, nargs="*", default=[0])
    parser.add_argument("--out", type=Path, default=Path("runs/ppo"), help="folder; agents in it are not trained again")
    parser.add_argument("--on", nargs="*", help="ids to evaluate on, by default the one to train on")
    parser.add_argument("--episodes", type=int, default=100)
    parser.add_argument("--cost-limit", type=float, default=math.inf, help="mean cost of an episode that is aimed at")
    parser.add_argument("--hide", nargs="*", choices=PARTS, default=[], help="parts of the state that it does not see")
    asked = parser.parse_args()
    if math.isfinite(asked.cost_limit) and asked.train_on != BATCH:
        parser.error(f"--cost-limit: only with --train-on {BATCH}, got {asked.train_on}")
    torch.set_num_threads(1)
    asked.out.mkdir(parents=True, exist_ok=True)
    agents = {}
    for seed in asked.seeds:
        file = asked.out / f"agent_{seed}.zip"
        if not file.exists():
            agent, curve = trained(asked, seed)
            (asked.out / f"curve_{seed}.json").write_text(json.dumps(curve), encoding="utf-8")
            agent.save(file)
        agents[seed] = Seeing(METHODS[asked.method].load(file, device="cpu"), asked.hide)
    draw_curves(asked.out)
    tuned = tuned_rule(asked.minutes, asked.out / "rule.json")
    print(tuned)
    for env_id in asked.on or [asked.train_on]:
        seeds, state = range(asked.episodes), {} if "Batch" in env_id else {"observation": "state"}
        others = {name: evaluate(name, env_id, seeds, **state) for name in ("rule", "oracle")}
        others["tuned rule"] = evaluate("rule", env_id, seeds, **state, **rule_arguments(env_id, tuned))
        for number, agent in agents.items():
            ours = evaluate(agent, env_id, seeds, **state, **actions_of(agent.agent))
            gains = {name: compared(ours, one) for name, one in others.items()}
            print(json.dumps({"id": env_id, "seed": number, **gains}), flush=True)


if __name__ == "__main__":
    main()
