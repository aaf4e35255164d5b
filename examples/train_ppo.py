"""Train PPO of Stable-Baselines3 on fogsim/FogAdvisoryBatch-v1, and compare it with FogSim's own rule.

    pip install 'fogsim[rl]'
    python examples/train_ppo.py --minutes 2 --out advisory.zip
    python examples/train_ppo.py --agent advisory.zip --on fogsim/FogAdvisoryFast-v1      # evaluates a saved agent

Minutes are the processor's. Evaluation is on 100 episodes of the split "test", which training never has. The rule is
compared with its own constants and, in the batch, with ones that were tuned there on the split "train".
"""

import argparse
import json
import time

import gymnasium as gym
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

from fogsim_envs import Evaluation, evaluate
from fogsim_envs.batch.layout import RuleConstants
from fogsim_envs.batch.stable_baselines import BatchVecEnv

BATCH = "fogsim/FogAdvisoryBatch-v1"
DISCOUNT, REPEAT = 0.98, 4  # An action is in force for 2 s, so that it shows in what the next ones earn
TUNED = RuleConstants(quantile=0.05, fallback=60.0 / 3.6)
FIRST_RATE, LAST_RATE = 1e-3, 2e-5


class UntilTimeIsUp(BaseCallback):
    """Ends the training after some minutes of the processor, and keeps the curve; steps become smaller."""

    def __init__(self, minutes: float) -> None:
        super().__init__()
        self._seconds, self._begun = 60.0 * minutes, time.process_time()
        self.curve: list[tuple[float, int, float]] = []

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
        ends = [one["r"] for one in self.model.ep_info_buffer]
        if ends:
            self.curve.append((round(self.spent, 3), self.num_timesteps, round(float(sum(ends)) / len(ends), 2)))


def trained(minutes: float, seed: int) -> tuple[PPO, list[tuple[float, int, float]]]:
    """An agent, and its curve: share of the time, steps, mean return of the last 500 episodes."""
    workers = VecMonitor(BatchVecEnv(gym.make_vec(BATCH, num_envs=256).unwrapped, REPEAT))
    workers.seed(seed)
    # Only rewards are scaled: the state's entries are in -1 ... 1 already.
    scaled = VecNormalize(workers, norm_obs=False, gamma=DISCOUNT)
    clock = UntilTimeIsUp(minutes)
    agent = PPO(
        "MlpPolicy", scaled, n_steps=32, batch_size=2048, n_epochs=6, gamma=DISCOUNT, gae_lambda=0.9,
        learning_rate=clock.learning_rate, ent_coef=0.002, stats_window_size=500, seed=seed, device="cpu", verbose=1,
        policy_kwargs={"net_arch": [64, 64]},
    )  # fmt: skip
    agent.learn(10**9, callback=clock, progress_bar=False)
    return agent, clock.curve


def compared(agent: Evaluation, other: Evaluation) -> dict[str, float]:
    """Means, and the gain on the same seeds with its 95 % interval."""
    gain, low, high = agent.minus(other)
    return {"agent": agent.mean, "other": other.mean, "gain": gain, "low": low, "high": high}


def main() -> None:
    """Train, save, evaluate."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=2.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", default="advisory.zip")
    parser.add_argument("--agent", default="", help="a saved agent, which is not trained further")
    parser.add_argument("--on", nargs="*", default=[BATCH], help="ids to evaluate on")
    parser.add_argument("--episodes", type=int, default=100)
    asked = parser.parse_args()
    torch.set_num_threads(1)
    agent, curve = (PPO.load(asked.agent, device="cpu"), []) if asked.agent else trained(asked.minutes, asked.seed)
    if not asked.agent:
        agent.save(asked.out)
    for env_id in asked.on:
        seeds, state = range(asked.episodes), {} if "Fast" in env_id or env_id == BATCH else {"observation": "state"}
        found = {name: evaluate(name, env_id, seeds, **state) for name in ("rule", "oracle")}
        if env_id == BATCH:
            found["tuned rule"] = evaluate("rule", env_id, seeds, rule=TUNED)
        ours = evaluate(agent, env_id, seeds, **state)
        result = {"id": env_id, "seed": asked.seed, **{n: compared(ours, one) for n, one in found.items()}}
        print(json.dumps(result), flush=True)
    print(json.dumps({"steps": curve[-1][1] if curve else 0, "curve": curve}))


if __name__ == "__main__":
    main()
