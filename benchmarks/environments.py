"""Speed of environments: steps a second next to highway-env's fastest, and resets.

Any id that Gymnasium knows once ``fogsim_envs`` is imported. The agent holds the middle of the action space, and time
that resets take between two steps is not counted. highway-fast-v0, which draws no camera, is measured alternately in
the same process, so that what else the machine does slows both: their ratio holds where speeds do not.

An id that makes vectors only is one of 256 environments, whose steps are counted each, and whose resets are by one.
"""

import argparse
import json
import statistics
import time
from typing import Any

import gymnasium
import highway_env  # noqa: F401 - registers the peer
import numpy as np
from gymnasium import spaces
from harness import Row, parse_options, publish

import fogsim_envs  # noqa: F401 - registers the environments

PEER_ID = "highway-fast-v0"
BATCH = 256

Env = gymnasium.Env[Any, Any]
Vector = gymnasium.vector.VectorEnv[Any, Any, Any]


def middle(space: spaces.Space[Any]) -> Any:
    """An action that an agent may hold: the middle of its space."""
    if isinstance(space, spaces.Dict):
        return {name: middle(part) for name, part in space.items()}
    if isinstance(space, spaces.Discrete):
        return space.start + space.n // 2
    if isinstance(space, spaces.MultiDiscrete):
        return space.start + space.nvec // 2
    if isinstance(space, spaces.Box):
        return (0.5 * (space.low + space.high)).astype(space.dtype)
    return space.sample()


def camera_of(space: spaces.Space[Any]) -> str:
    """Size of the pictures among the observations, or that there are none."""
    parts = space.values() if isinstance(space, spaces.Dict) else (space,)
    sizes = [part.shape for part in parts if isinstance(part, spaces.Box) and part.dtype == np.uint8]
    return "none" if not sizes else f"{sizes[0][1]}x{sizes[0][0]}"


def steps_per_second(env: Env | Vector, steps: int, action: Any) -> tuple[float, float]:
    """Steps a second by the clock and by the processor's time, resets not counted but in a vector."""
    env.reset(seed=1)
    spent = worked = 0.0
    for _ in range(steps):
        started, begun = time.perf_counter(), time.process_time()
        *_, terminated, truncated, _ = env.step(action)
        spent += time.perf_counter() - started
        worked += time.process_time() - begun
        if not isinstance(env, gymnasium.vector.VectorEnv) and (terminated or truncated):
            env.reset()
    number = steps * getattr(env, "num_envs", 1)
    return number / spent, number / worked


def reset_ms(env: Env | Vector, repeat: int) -> float:
    """Time of a reset, the first one not counted [ms]."""
    times = []
    for number in range(repeat + 1):
        started = time.perf_counter()
        env.reset(seed=number)
        times.append(1e3 * (time.perf_counter() - started))
    return round(statistics.median(times[1:]) / getattr(env, "num_envs", 1), 3)


def measure(arguments: argparse.Namespace, env_id: str, peer: Env) -> Row:
    """One record for one environment."""
    is_batch = gymnasium.spec(env_id).entry_point is None
    env: Env | Vector = (
        gymnasium.make_vec(env_id, BATCH, **arguments.kwargs)
        if is_batch
        else gymnasium.make(env_id, **arguments.kwargs)
    )
    action, peer_action = middle(env.action_space), middle(peer.action_space)
    own, peers = [], []
    for _ in range(arguments.repeat):
        own.append(steps_per_second(env, arguments.steps, action))
        peers.append(steps_per_second(peer, arguments.steps, peer_action)[0])
    # Of the whole state only FogSim's own environments know.
    last = getattr(env.unwrapped, "_step", None)
    record = {
        "env": env_id,
        "camera": camera_of(env.observation_space),
        "vehicles": None if last is None else len(last.traffic.ids),
        "steps_per_s": round(statistics.median(wall for wall, _ in own), 2),
        "steps_per_cpu_s": round(statistics.median(cpu for _, cpu in own), 2),
        "frames_per_step": getattr(env.unwrapped, "_frames", None),
        "peer": PEER_ID,
        "peer_steps_per_s": round(statistics.median(peers), 2),
        "ratio": round(statistics.median(a / b for (a, _), b in zip(own, peers, strict=True)), 3),
        "reset_ms": reset_ms(env, arguments.resets),
    }
    env.close()
    return record


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        env=(["fogsim/FogAdvisory-v0"], "ids of environments"),
        kwargs=("{}", "arguments of the environments, as JSON"),
        steps=(100, "steps a repetition"),
        repeat=(3, "repetitions"),
        resets=(5, "resets"),
    )
    given.kwargs = json.loads(given.kwargs)
    peer: Env = gymnasium.make(PEER_ID)
    records = [measure(given, env_id, peer) for env_id in given.env]
    peer.close()
    publish(given, records)


if __name__ == "__main__":
    main()
