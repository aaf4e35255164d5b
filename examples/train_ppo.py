"""Train PPO of Stable-Baselines3 on fogsim/FogAdvisoryFast-v1, and compare it with FogSim's own rule.

    pip install 'fogsim[rl]'
    python examples/train_ppo.py --minutes 15 --out advisory.zip

Evaluation is on 50 episodes of the split "test", which training never has: first without frames, then with
``--camera`` on fogsim/FogAdvisory-v1, where a real estimator judges frames.
"""

import argparse
import time

import gymnasium as gym
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import SubprocVecEnv, VecMonitor, VecNormalize

from fogsim_envs import evaluate

FAST, CAMERA = "fogsim_envs:fogsim/FogAdvisoryFast-v1", "fogsim_envs:fogsim/FogAdvisory-v1"
DISCOUNT = 0.98
FIRST_RATE, LAST_RATE = 1e-3, 2e-5


class UntilTimeIsUp(BaseCallback):
    """Ends the training after some minutes, towards the end of which steps become smaller."""

    def __init__(self, minutes: float) -> None:
        super().__init__()
        self._seconds = 60.0 * minutes
        self._end = time.monotonic() + self._seconds

    def learning_rate(self, _: float) -> float:
        """Learning rate now; the share of steps that are left, which Stable-Baselines3 tells, is not known here."""
        left = (self._end - time.monotonic()) / self._seconds
        return LAST_RATE + FIRST_RATE * min(max(1.5 * left, 0.0), 1.0)

    def _on_step(self) -> bool:
        return time.monotonic() < self._end


def main() -> None:
    """Train, save, evaluate."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=15.0)
    parser.add_argument("--workers", type=int, default=4)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", default="advisory.zip")
    parser.add_argument("--camera", action="store_true", help="evaluate on real frames, too")
    asked = parser.parse_args()
    torch.set_num_threads(1)
    makers = [lambda: gym.make(FAST) for _ in range(asked.workers)]
    workers = VecMonitor(SubprocVecEnv(makers, start_method="forkserver"))
    workers.seed(asked.seed)
    # Only rewards are scaled: the state's entries are in -1 ... 1 already.
    scaled = VecNormalize(workers, norm_obs=False, gamma=DISCOUNT)
    clock = UntilTimeIsUp(asked.minutes)
    agent = PPO(
        "MlpPolicy", scaled, n_steps=2048 // asked.workers, batch_size=512, n_epochs=8, gamma=DISCOUNT,
        learning_rate=clock.learning_rate, ent_coef=0.003, seed=asked.seed, device="cpu", verbose=1,
        policy_kwargs={"net_arch": [128, 128]},
    )  # fmt: skip
    agent.learn(10**9, callback=clock, progress_bar=False)
    agent.save(asked.out)
    workers.close()
    for env_id, arguments in ((FAST, {}), (CAMERA, {"observation": "state"})):
        if env_id == FAST or asked.camera:
            print(env_id)
            policies = {"PPO": agent, "rule": "rule", "oracle": "oracle"}
            found = {name: evaluate(one, env_id, seeds=range(50), **arguments) for name, one in policies.items()}
            for name, one in found.items():
                print(f"  {name}: {one}")
            mean, low, high = found["PPO"].minus(found["rule"])
            print(f"  PPO over the rule, on the same seeds: {mean:+.1f} ({low:+.1f} … {high:+.1f})")


if __name__ == "__main__":
    main()
