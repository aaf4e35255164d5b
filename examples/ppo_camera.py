"""Train an agent on pictures alone, fogsim/FogAdvisory-v2's camera, by PPO in one file.

    pip install 'fogsim[rl]'
    python examples/ppo_camera.py --minutes 60 --out runs/ppo_camera

Four grey frames of 84 by 84 pixels, half a second apart, are all that it sees: neither belief nor speed. The folder
gets ``curve.csv`` and ``curve.png`` (returns of the training's episodes) and ``checkpoint.pt``; the same command goes
on from there, in new episodes. At the end the agent is compared with baselines on episodes of the split "test".

The algorithm is that of Schulman et al. (2017), https://arxiv.org/abs/1707.06347: clipped ratio, advantages by GAE. The
network is a small one, as a processor has to learn with it.
"""

import argparse
import csv
import time
from collections import deque
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import torch
from gymnasium.vector import AsyncVectorEnv, AutoresetMode
from gymnasium.wrappers import FrameStackObservation, GrayscaleObservation, ResizeObservation
from matplotlib.figure import Figure
from torch import nn
from torch.distributions import Categorical

from fogsim_envs import evaluate

ID = "fogsim_envs:fogsim/FogAdvisory-v2"
SIDE, FRAMES = 84, 4
REWARD_SCALE = 0.1
RECENT = 50
COLUMNS = ("minutes", "steps", "episodes", "return", "entropy", "value_loss")


@dataclass
class Settings:
    """Parameters of PPO."""

    steps: int = 256
    epochs: int = 3
    minibatches: int = 4
    learning_rate: float = 5e-4
    discount: float = 0.99
    gae: float = 0.95
    clip: float = 0.2
    entropy: float = 0.005
    value: float = 0.5
    gradient: float = 0.5


@dataclass
class Progress:
    """How far the training has come."""

    minutes: float = 0.0
    steps: int = 0
    episodes: int = 0
    returns: deque[float] = field(default_factory=lambda: deque(maxlen=RECENT))


def make_env(**arguments: Any) -> gym.Env[Any, Any]:
    """The environment, its frames grey, small and stacked."""
    env = gym.make(ID, observation="camera", **arguments)
    return FrameStackObservation(ResizeObservation(GrayscaleObservation(env), (SIDE, SIDE)), FRAMES)


def layer(module: Any, gain: float = 2.0**0.5) -> Any:
    """A layer with orthogonal weights."""
    nn.init.orthogonal_(module.weight, gain)
    nn.init.zeros_(module.bias)
    return module


class Agent(nn.Module):
    """Policy and value of stacked frames; the policy has one choice for each entry of an action."""

    def __init__(self, choices: list[int]) -> None:
        super().__init__()
        self.choices = choices
        self.body = nn.Sequential(
            layer(nn.Conv2d(FRAMES, 16, 8, 4)), nn.ReLU(),
            layer(nn.Conv2d(16, 32, 4, 2)), nn.ReLU(),
            layer(nn.Conv2d(32, 32, 3, 2)), nn.ReLU(),
            nn.Flatten(),
            layer(nn.Linear(32 * 4 * 4, 256)), nn.ReLU(),
        )  # fmt: skip
        self.policy = layer(nn.Linear(256, sum(choices)), 0.01)
        self.critic = layer(nn.Linear(256, 1), 1.0)

    def forward(self, frames: torch.Tensor) -> tuple[list[Categorical], torch.Tensor]:
        """Distributions of the choices, and the value."""
        features = self.body(frames.float() / 255.0 - 0.5)
        heads = self.policy(features).split(self.choices, dim=1)
        return [Categorical(logits=one) for one in heads], self.critic(features).squeeze(1)

    def judge(self, frames: torch.Tensor, actions: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Log probability of actions, entropy, and value."""
        heads, value = self(frames)
        likely = sum(head.log_prob(actions[:, entry]) for entry, head in enumerate(heads))
        return likely, sum(head.entropy() for head in heads), value

    @torch.no_grad()
    def best(self, frames: Any) -> np.ndarray:
        """The likeliest action for one observation."""
        heads, _ = self(torch.as_tensor(np.asarray(frames))[None])
        return np.array([int(head.probs.argmax()) for head in heads])


@dataclass
class Rollout:
    """What came of some steps in all environments (steps, environments, …)."""

    frames: torch.Tensor
    actions: torch.Tensor
    likely: torch.Tensor
    rewards: torch.Tensor
    over: torch.Tensor
    values: torch.Tensor
    last_value: torch.Tensor

    def advantages(self, settings: Settings) -> torch.Tensor:
        """Generalised advantage estimates (steps, environments)."""
        found, following, value = torch.zeros_like(self.rewards), torch.zeros_like(self.last_value), self.last_value
        for step in reversed(range(len(self.rewards))):
            goes_on = 1.0 - self.over[step]
            error = self.rewards[step] + settings.discount * goes_on * value - self.values[step]
            following = error + settings.discount * settings.gae * goes_on * following
            found[step], value = following, self.values[step]
        return found


class Collector:
    """Runs the agent in the environments, and counts what episodes came to."""

    def __init__(self, envs: AsyncVectorEnv, seed: int, progress: Progress) -> None:
        self.envs, self.progress = envs, progress
        observed, _ = envs.reset(seed=seed)
        self.observed = torch.as_tensor(np.array(observed))
        self.sums = np.zeros(envs.num_envs)

    @torch.no_grad()
    def collect(self, agent: Agent, steps: int) -> Rollout:
        """Some steps in all environments."""
        kept: list[tuple[torch.Tensor, ...]] = []
        for _ in range(steps):
            heads, value = agent(self.observed)
            action = torch.stack([head.sample() for head in heads], dim=1)
            likely = sum(head.log_prob(action[:, entry]) for entry, head in enumerate(heads))
            observed, reward, terminated, truncated, _ = self.envs.step(action.numpy())
            over = terminated | truncated
            self._count(np.asarray(reward), over)
            scaled = torch.as_tensor(REWARD_SCALE * reward, dtype=torch.float32)
            kept.append((self.observed, action, likely, scaled, torch.as_tensor(over).float(), value))
            self.observed = torch.as_tensor(np.array(observed))
        last_value = agent(self.observed)[1]
        return Rollout(*(torch.stack(one) for one in zip(*kept, strict=True)), last_value)

    def _count(self, reward: np.ndarray, over: np.ndarray) -> None:
        self.sums += reward
        self.progress.steps += len(reward)
        for value in self.sums[over].tolist():
            self.progress.episodes += 1
            self.progress.returns.append(value)
        self.sums[over] = 0.0


def improve(
    agent: Agent, optimiser: torch.optim.Optimizer, rollout: Rollout, settings: Settings
) -> tuple[float, float]:
    """Some epochs on a rollout; the last minibatch's entropy and loss of the value."""
    advantages = rollout.advantages(settings)
    returns = (advantages + rollout.values).flatten()
    parts = (rollout.frames, rollout.actions, rollout.likely, advantages)
    frames, actions, before, gained = (part.flatten(0, 1) for part in parts)
    for _ in range(settings.epochs):
        for rows in torch.randperm(len(returns)).chunk(settings.minibatches):
            likely, entropy, value = agent.judge(frames[rows], actions[rows])
            ratio = (likely - before[rows]).exp()
            worth = (gained[rows] - gained[rows].mean()) / (gained[rows].std() + 1e-8)
            clipped = ratio.clamp(1.0 - settings.clip, 1.0 + settings.clip)
            policy_loss = -torch.min(ratio * worth, clipped * worth).mean()
            value_loss = 0.5 * (value - returns[rows]).square().mean()
            loss = policy_loss + settings.value * value_loss - settings.entropy * entropy.mean()
            optimiser.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(agent.parameters(), settings.gradient)
            optimiser.step()
    return float(entropy.mean()), float(value_loss)


def save(folder: Path, agent: Agent, optimiser: torch.optim.Optimizer, progress: Progress) -> None:
    """Write the checkpoint in one go, so that who is killed meanwhile has the one before."""
    told = {"minutes": progress.minutes, "steps": progress.steps, "episodes": progress.episodes,
            "returns": list(progress.returns)}  # fmt: skip
    new = folder / "checkpoint.new"
    torch.save({"agent": agent.state_dict(), "optimiser": optimiser.state_dict(), "progress": told}, new)
    new.replace(folder / "checkpoint.pt")


def resume(folder: Path, agent: Agent, optimiser: torch.optim.Optimizer) -> Progress:
    """Take up a checkpoint, if there is one."""
    file = folder / "checkpoint.pt"
    if not file.exists():
        return Progress()
    kept = torch.load(file, weights_only=True)
    agent.load_state_dict(kept["agent"])
    optimiser.load_state_dict(kept["optimiser"])
    told = kept["progress"]
    print(f"going on from {told['minutes']:.1f} min, {told['steps']} steps, of {file}")
    return Progress(told["minutes"], told["steps"], told["episodes"], deque(told["returns"], maxlen=RECENT))


def note(folder: Path, row: dict[str, float]) -> None:
    """Add a row to the curve and draw it anew."""
    file = folder / "curve.csv"
    is_new = not file.exists()
    with file.open("a", newline="", encoding="utf-8") as written:
        writer = csv.DictWriter(written, COLUMNS)
        if is_new:
            writer.writeheader()
        writer.writerow(row)
    with file.open(newline="", encoding="utf-8") as read:
        rows = [{name: float(value) for name, value in one.items()} for one in csv.DictReader(read)]
    figure = Figure(figsize=(6, 3.5), layout="constrained")
    axes = figure.add_subplot()
    axes.plot([one["minutes"] for one in rows], [one["return"] for one in rows])
    axes.set(title="PPO on pictures alone", xlabel="training [min]")
    axes.set_ylabel(f"return, mean of the last {RECENT} episodes")
    axes.grid(alpha=0.3)
    figure.savefig(folder / "curve.png", dpi=120)


def train(agent: Agent, folder: Path, asked: argparse.Namespace) -> None:
    """Train until the time is up, keeping a checkpoint and a row of the curve every minute."""
    settings = Settings()
    optimiser = torch.optim.Adam(agent.parameters(), lr=settings.learning_rate, eps=1e-5)
    progress = resume(folder, agent, optimiser)
    begun, earlier, kept = time.monotonic(), progress.minutes, progress.minutes
    if progress.minutes >= asked.minutes:
        return
    workers = [make_env] * asked.workers
    envs = AsyncVectorEnv(workers, context="forkserver", autoreset_mode=AutoresetMode.SAME_STEP)
    try:
        # Who goes on has other episodes than before.
        collector = Collector(envs, asked.seed + progress.steps, progress)
        while progress.minutes < asked.minutes:
            left = max(1.0 - progress.minutes / asked.minutes, 0.05)
            optimiser.param_groups[0]["lr"] = settings.learning_rate * left
            entropy, loss = improve(agent, optimiser, collector.collect(agent, settings.steps), settings)
            progress.minutes = earlier + (time.monotonic() - begun) / 60.0
            if progress.returns and (progress.minutes - kept >= 1.0 or progress.minutes >= asked.minutes):
                kept = progress.minutes
                row = (kept, progress.steps, progress.episodes, float(np.mean(progress.returns)), entropy, loss)
                note(folder, dict(zip(COLUMNS, (round(one, 3) for one in row), strict=True)))
                save(folder, agent, optimiser, progress)
                print(f"{kept:.1f} min, {progress.steps} steps, {progress.episodes} episodes: return {row[3]:.1f}")
    finally:
        envs.close()


def main() -> None:
    """Train, keep, evaluate."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=60.0, help="of training, those of earlier runs included")
    parser.add_argument("--workers", type=int, default=2, help="processes with an environment each")
    parser.add_argument("--threads", type=int, default=1, help="of torch")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("runs/ppo_camera"))
    parser.add_argument("--episodes", type=int, default=50, help="of the split 'test' in the evaluation; 0 for none")
    asked = parser.parse_args()
    torch.manual_seed(asked.seed)
    torch.set_num_threads(asked.threads)
    asked.out.mkdir(parents=True, exist_ok=True)
    space = gym.make(ID, observation="camera").action_space
    agent = Agent([int(count) for count in space.nvec])
    train(agent, asked.out, asked)
    if asked.episodes:
        seeds, env = range(asked.episodes), make_env(split="test")
        for name, policy in (("agent", lambda seen, _: agent.best(seen)), *((one, one) for one in ("rule", "none"))):
            print(f"{name}: {evaluate(policy, env, seeds)}")
        env.close()


if __name__ == "__main__":
    main()
