"""Ctrl-C is Ctrl-C also where compiled code runs."""

from pathlib import Path

import pytest

import fogsim
from fogsim.interruption import interruptible


def raise_as_numba_does() -> None:
    """What comes out of a kernel in which Ctrl-C came."""
    raise SystemError("returned a result with an exception set") from KeyboardInterrupt()


def test_an_interrupted_kernel_is_an_interruption() -> None:
    """Nothing is left of the error that it was wrapped in."""
    with pytest.raises(KeyboardInterrupt), interruptible():
        raise_as_numba_does()


def test_other_errors_stay_what_they_are() -> None:
    """A SystemError without Ctrl-C is none."""
    with pytest.raises(SystemError, match="of its own"), interruptible():
        raise SystemError("of its own")


def test_a_data_set_that_is_interrupted_in_a_kernel_is_whole(tmp_path: Path) -> None:
    """What was finished is described, and the rest can be made later."""

    def watch(done: int) -> None:
        if done == 2:
            raise_as_numba_does()

    scenario = fogsim.load_scenario("motorway_fog_bank", ["camera.width=160", "camera.height=120", "duration_s=2"])
    written = fogsim.write_dataset(scenario, tmp_path / "data", frames=4, watch=watch)
    assert (written.frames, written.complete) == (2, False)
