"""Environments in processes of their own: every request to one that is lost, stopped or failed ends in an error."""

import contextlib
import os
import signal
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ClosedEnvironmentError
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers import TimeLimit

from fogsim.errors import SimulationError
from fogsim.values import Command
from fogsim_envs.vector import make_vector

POLE = "CartPole-v1"


def step_in_parts(envs: Any) -> None:
    envs.step_async(np.array([0, 0]))
    envs.step_wait()


REQUESTS: dict[str, Callable[[Any], object]] = {
    "reset": lambda envs: envs.reset(seed=1),
    "step in parts": step_in_parts,
    "get_attr": lambda envs: envs.get_attr("spec"),
    "set_attr": lambda envs: envs.set_attr("own", [1, 2]),
}


@pytest.mark.timeout(60)
@pytest.mark.parametrize(("fault", "message"), [("SIGSTOP", "have not answered for 0.2 s"), ("SIGKILL", "has ended")])
@pytest.mark.parametrize("name", REQUESTS)
def test_no_request_waits_for_a_worker_that_is_lost(name: str, fault: str, message: str) -> None:
    envs: Any = make_vector(POLE, num_envs=2)
    envs.reset(seed=1)
    envs._timeout = 0.2
    os.kill(envs.processes[1].pid, getattr(signal, fault))
    if fault == "SIGKILL":
        envs.processes[1].join()
    with pytest.raises(SimulationError, match=message):
        REQUESTS[name](envs)
    assert not any(process.is_alive() for process in envs.processes)
    envs.close()


def test_a_worker_that_is_lost_as_it_begins_is_reported() -> None:
    parent = os.getpid()

    def end(env: gymnasium.Env[Any, Any]) -> gymnasium.Env[Any, Any]:
        if os.getpid() != parent:
            os._exit(1)
        return env

    with pytest.raises(SimulationError, match="has ended"):
        make_vector(POLE, num_envs=2, wrappers=[end], context="fork")


@pytest.mark.filterwarnings("ignore:.*ERROR")  # Gymnasium's own about its workers
def test_after_an_error_in_one_environment_all_are_closed() -> None:
    envs = make_vector(POLE, num_envs=2)
    envs.reset(seed=1)
    with pytest.raises(AssertionError):
        envs.step(np.array([0, 7]))
    with pytest.raises(ClosedEnvironmentError):
        envs.reset(seed=1)


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_episodes_follow_one_another_as_gymnasium_defines(mode: AutoresetMode) -> None:
    wrappers = [lambda env: TimeLimit(env, 2)]
    ours: Any = make_vector(POLE, num_envs=2, wrappers=wrappers, autoreset_mode=mode.value)
    theirs = gymnasium.make_vec(
        POLE, 2, vectorization_mode="sync", wrappers=wrappers, vector_kwargs={"autoreset_mode": mode}
    )
    with contextlib.closing(ours), contextlib.closing(theirs):
        assert ours.metadata["autoreset_mode"] is mode
        assert np.array_equal(ours.reset(seed=np.int64(3))[0], theirs.reset(seed=3)[0])
        for _ in range(2 if mode is AutoresetMode.DISABLED else 3):
            (found, *ends, info), (expected, *others, same) = (envs.step(np.array([0, 1])) for envs in (ours, theirs))
            assert np.array_equal(found, expected)
            assert np.array_equal(ends, others)
            assert info.keys() == same.keys()


@pytest.mark.parametrize("name", ["fogsim/FogAdvisoryFast-v2", "fogsim/FogAdvisory-v0", "fogsim/FogHighway-v0"])
def test_an_interrupted_episode_does_not_go_on(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    env = gymnasium.make(name, **({} if "Fast" in name else {"image_size": (32, 16)}))

    def interrupted(*_: Any) -> None:
        raise KeyboardInterrupt

    env.reset(seed=1)
    env.step([5, 0])
    loop: Any = env.unwrapped._simulation  # type: ignore[attr-defined]
    loop = getattr(loop, "_loop", loop)
    loop._next_step = interrupted
    with pytest.raises(KeyboardInterrupt):
        env.step([5, 0])
    del loop._next_step
    with pytest.raises(gymnasium.error.ResetNeeded, match="call reset"):
        env.step([5, 0])
    with pytest.raises(SimulationError, match="call start"):
        loop.advance(Command())
    for call in (env.reset, lambda: env.step([5, 0])):
        env.reset(seed=1)
        env.step([5, 0])
        # Ctrl-C while the step is shown, in which "human" waits.
        with monkeypatch.context() as patch:
            patch.setattr(env.unwrapped, "_show", interrupted)
            with pytest.raises(KeyboardInterrupt):
                call()
        with pytest.raises(gymnasium.error.ResetNeeded, match="call reset"):
            env.step([5, 0])
    env.close()
