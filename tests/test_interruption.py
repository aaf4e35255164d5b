"""Ctrl-C is Ctrl-C also where compiled code runs."""

import os
import signal
import sys
import threading
import time
from pathlib import Path
from typing import NamedTuple

import pytest
from early_motorway import EARLY

import fogsim
from fogsim.core import interruption
from fogsim.core.interruption import Interruption, ProgramSignals, interruptible


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

    scenario = fogsim.load_scenario(
        "motorway_fog_bank", [EARLY, "camera.width=160", "camera.height=120", "duration_s=2"]
    )
    written = fogsim.write_dataset(scenario, tmp_path / "data", frames=4, watch=watch)
    assert (written.frames, written.complete) == (2, False)


def press() -> None:
    """Ctrl-C."""
    os.kill(os.getpid(), signal.SIGINT)


def test_a_signal_is_held_until_what_is_written_is_whole() -> None:
    written = []
    with pytest.raises(KeyboardInterrupt), Interruption():  # noqa: PT012 - signals come between statements
        press()
        written.append("whole")
    assert written == ["whole"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_it_is_let_through_where_it_does_no_harm_and_held_within() -> None:
    reached = []
    with Interruption() as signals:
        with pytest.raises(KeyboardInterrupt), signals.allowed():  # noqa: PT012 - signals come between statements
            with signals.held():
                press()
                reached.append("held")
            reached.append("never")
        press()
        reached.append("after")
        signals._waiting = None  # handled
    assert reached == ["held", "after"]


def test_an_exception_that_is_lost_is_raised_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in a destructor, whose exceptions go nowhere."""
    monkeypatch.setattr(interruption, "_PATIENCE", 0.01)
    alarm = signal.signal(signal.SIGALRM, signal.SIG_DFL)
    timer = signal.setitimer(signal.ITIMER_REAL, 0.0)
    lost = []
    try:
        with Interruption() as signals, pytest.raises(KeyboardInterrupt), signals.allowed():  # noqa: PT012 - signals come between statements
            try:
                press()
            except KeyboardInterrupt:
                lost.append(True)
            time.sleep(60.0)
    finally:
        signal.signal(signal.SIGALRM, alarm)
        signal.setitimer(signal.ITIMER_REAL, *timer)
    assert lost == [True]


class Unraisable(NamedTuple):
    """What a hook for exceptions of destructors is told, as far as it is looked at."""

    exc_type: type[BaseException]


def test_what_a_signal_has_left_half_made_complains_to_nobody(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[type[BaseException]] = []
    monkeypatch.setattr(sys, "__unraisablehook__", lambda unraisable: told.append(unraisable.exc_type))
    signals = ProgramSignals()
    for error in (AttributeError, ValueError):
        signals._note_unraisable(Unraisable(error))
    assert told == [AttributeError, ValueError]
    signals.last = signal.SIGINT
    for error in (AttributeError, ValueError):
        signals._note_unraisable(Unraisable(error))
    assert told == [AttributeError, ValueError, ValueError]


def test_an_error_that_a_library_has_made_of_a_signal_is_an_interruption() -> None:
    with Interruption() as signals:
        with pytest.raises(KeyboardInterrupt), signals.allowed():  # noqa: PT012 - signals come between statements
            try:
                press()
            except KeyboardInterrupt as error:
                raise OSError("the library's own") from error
        with pytest.raises(OSError, match="another"), signals.allowed():
            raise OSError("another")


def test_another_thread_has_no_signals_to_hold() -> None:
    done = []

    def work() -> None:
        with Interruption() as signals, signals.allowed():
            done.append(True)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert done == [True]


def test_a_handler_of_the_user_is_theirs_and_called_at_the_end() -> None:
    called = []
    before = signal.signal(signal.SIGTERM, lambda *_: called.append("theirs"))
    try:
        with Interruption():
            os.kill(os.getpid(), signal.SIGTERM)
            called.append("written")
        assert called == ["written", "theirs"]
    finally:
        signal.signal(signal.SIGTERM, before)
