"""Train PPO of Stable-Baselines3 on fogsim/FogAdvisoryBatch-v2, and compare it with FogSim's own rule.

    pip install 'fogsim[rl]'
    python examples/train_ppo.py --minutes 5 --out runs/ppo            # trains seed 0: policy and learning curve
    python examples/train_ppo.py --minutes 5 --out runs/ppo --seeds 0 1 2 3 4
    python examples/train_ppo.py --out runs/ppo --on fogsim/FogAdvisoryFast-v2 fogsim/FogAdvisory-v2   # only evaluates
    python examples/train_ppo.py --minutes 5 --out runs/careful --cost-limit 1.0

Minutes are the processor's, of each training. Evaluation is on 100 episodes of the split "test", which training never
has. The rule is compared with its own constants and with ones that are searched on the split "train" (kept in
rule.json). With a cost limit, a multiplier of info["cost"] rises until an episode's cost is below the limit.
"""

import argparse
import json
import math
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import torch
from matplotlib.figure import Figure
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

from fogsim_envs import Evaluation, evaluate
from fogsim_envs.batch import RuleConstants
from fogsim_envs.batch.stable_baselines import BatchVecEnv

BATCH = "fogsim/FogAdvisoryBatch-v2"
DISCOUNT, REPEAT = 0.98, 4  # An action is in force for 2 s, so that it shows in what the next ones earn
FIRST_RATE, LAST_RATE = 1e-3, 2e-5
MULTIPLIER_RATE = 0.05


class Training(BaseCallback):
    """Ends the training after some minutes of the processor, and keeps the curve; steps become smaller."""

    def __init__(self, envs: BatchVecEnv, minutes: float, cost_limit: float) -> None:
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
        if not ends:
            return
        cost = float(np.mean([one["cost"] for one in ends]))
        if math.isfinite(self._limit):
            self._envs.multiplier = max(self._envs.multiplier + MULTIPLIER_RATE * (cost - self._limit), 0.0)
        minutes = round(self.spent * self._seconds / 60.0, 3)
        earned = float(np.mean([one["earned"] for one in ends]))
        self.curve.append((minutes, self.num_timesteps, round(earned, 2), round(cost, 3)))


def trained(minutes: float, seed: int, cost_limit: float) -> tuple[PPO, list[tuple[float, int, float, float]]]:
    """An agent, and its curve: minutes, steps, and mean return and cost of the last 500 episodes."""
    envs = BatchVecEnv(gym.make_vec(BATCH, num_envs=256).unwrapped, REPEAT)
    workers = VecMonitor(envs, info_keywords=("earned", "cost"))
    workers.seed(seed)
    # Only rewards are scaled: the state's entries are in -1 ... 1 already.
    scaled = VecNormalize(workers, norm_obs=False, gamma=DISCOUNT)
    clock = Training(envs, minutes, cost_limit)
    agent = PPO(
        "MlpPolicy", scaled, n_steps=32, batch_size=2048, n_epochs=6, gamma=DISCOUNT, gae_lambda=0.9,
        learning_rate=clock.learning_rate, ent_coef=0.002, stats_window_size=500, seed=seed, device="cpu",
        policy_kwargs={"net_arch": [64, 64]},
    )  # fmt: skip
    agent.learn(10**9, callback=clock)
    agent.learning_rate = LAST_RATE  # The file need not hold the clock, and with it all episodes.
    agent._setup_lr_schedule()
    return agent, clock.curve


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
        minutes, _, earned, _ = np.array(json.loads(path.read_text(encoding="utf-8"))).T
        smooth = np.convolve(earned, np.full(9, 1 / 9), "valid")
        axes.plot(minutes[4 : len(smooth) + 4], smooth, lw=1, label=f"seed {path.stem.rpartition('_')[2]}")
    axes.set(xlabel="training [min of processor]", ylabel="return of training episodes", ylim=(0, None))
    axes.legend()
    figure.savefig(folder / "curve.png", dpi=120)


def main() -> None:
    """Train, save, evaluate."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=5.0)
    parser.add_argument("--seeds", type=int, nargs="*", default=[0])
    parser.add_argument("--out", type=Path, default=Path("runs/ppo"), help="folder; agents in it are not trained again")
    parser.add_argument("--on", nargs="*", default=[BATCH], help="ids to evaluate on")
    parser.add_argument("--episodes", type=int, default=100)
    parser.add_argument("--cost-limit", type=float, default=math.inf, help="mean cost of an episode that is aimed at")
    asked = parser.parse_args()
    torch.set_num_threads(1)
    asked.out.mkdir(parents=True, exist_ok=True)
    agents = {}
    for seed in asked.seeds:
        file = asked.out / f"agent_{seed}.zip"
        if not file.exists():
            agent, curve = trained(asked.minutes, seed, asked.cost_limit)
            (asked.out / f"curve_{seed}.json").write_text(json.dumps(curve), encoding="utf-8")
            agent.save(file)
        agents[seed] = PPO.load(file, device="cpu")
    draw_curves(asked.out)
    tuned = tuned_rule(asked.minutes, asked.out / "rule.json")
    print(tuned)
    for env_id in asked.on:
        seeds, state = range(asked.episodes), {"observation": "state"} if "Batch" not in env_id else {}
        others = {name: evaluate(name, env_id, seeds, **state) for name in ("rule", "oracle")}
        others["tuned rule"] = evaluate("rule", env_id, seeds, **state, **rule_arguments(env_id, tuned))
        for number, agent in agents.items():
            ours = evaluate(agent, env_id, seeds, **state)
            gains = {name: compared(ours, one) for name, one in others.items()}
            print(json.dumps({"id": env_id, "seed": number, **gains}), flush=True)


if __name__ == "__main__":
    main()
