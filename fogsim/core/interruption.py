"""Signals that end a run: Ctrl-C (SIGINT), SIGTERM and SIGHUP, whatever runs when they come."""

import contextlib
import math
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from types import FrameType, TracebackType
from typing import Self

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""Signals that ask a program to end."""

_ENDING_TIME = 3.0
"""Time within which a second signal does not cut off what the first one has ended [s]."""

_PATIENCE = 1.5
"""Time after which a signal whose exception was lost, as in a destructor, comes again [s]."""

_AT_ONCE = 0.01

_Handler = Callable[[int, FrameType | None], object]


def leave_on_signals() -> None:
    """Let signals end this process at once, in one line: for as long as there is nothing to be saved.

    An exception would be raised in the middle of whatever is imported, which may take it for its own failure.
    """
    _handle_signals(leave)


def leave(signum: int, _: FrameType | None = None) -> None:
    """End the process at once, with one line and the exit code of a signal: 130 for SIGINT, 143 SIGTERM, 129 SIGHUP."""
    # The terminal may be gone after SIGHUP.
    with contextlib.suppress(OSError):
        os.write(2, b"interrupted\n")
    os._exit(128 + signum)


def _handle_signals(handler: _Handler) -> None:
    for signum in SIGNALS:
        # What is ignored from the start (by nohup, or in the background of a script) stays so.
        if signal.getsignal(signum) is not signal.SIG_IGN:
            signal.signal(signum, handler)


class ProgramSignals:
    """The first signal, `last`, as KeyboardInterrupt, for a program, from `listen` on; the next ends it at once.

    So does the first one while a module is imported, which may take the exception for its own failure, or where the
    exception is lost, or what it ends takes too long; `Interruption` gives more time, and lets imports finish.
    """

    def __init__(self) -> None:
        self.last: int | None = None

    def listen(self) -> None:
        """Begin; signals that are ignored stay so."""
        signal.signal(signal.SIGALRM, self._lost)
        sys.unraisablehook = self._note_unraisable
        _handle_signals(self._raise)

    def _note_unraisable(self, unraisable: "sys.UnraisableHookArgs") -> None:
        """Have a signal come again at once whose exception a destructor or a library could not hand on.

        What lacks an attribute then is an object whose making the signal has cut off: that is no news.
        """
        if self.last is not None and issubclass(unraisable.exc_type, KeyboardInterrupt):
            signal.setitimer(signal.ITIMER_REAL, _AT_ONCE, _PATIENCE)
        elif self.last is None or not issubclass(unraisable.exc_type, AttributeError):
            sys.__unraisablehook__(unraisable)

    def _lost(self, _: int, __: FrameType | None) -> None:
        if self.last is not None:
            leave(self.last)

    def _raise(self, signum: int, frame: FrameType | None) -> None:
        if self.last is not None:
            leave(self.last)
        if _imports(frame):
            leave(signum)
        self.last = signum
        signal.setitimer(signal.ITIMER_REAL, _PATIENCE, _PATIENCE)
        raise KeyboardInterrupt


def _imports(frame: FrameType | None) -> bool:
    """Whether a module is being imported by a frame or one of those that called it."""
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            return True
        frame = frame.f_back
    return False


class Interruption:
    """Holds signals back, so that what is being written is finished, and lets them through where they do no harm.

    It concerns signals for which this process has a handler of Python's (SIGINT has one always), in the main thread;
    elsewhere none is raised. One that is held is handled at the end, the last of several.
    """

    def __init__(self) -> None:
        self._handlers: dict[int, _Handler] = {}
        self._allowed = False
        self._waiting: int | None = None
        self._raised = -math.inf
        self._alarm: _Handler | signal.Handlers | int | None = None

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            found = {signum: signal.getsignal(signum) for signum in SIGNALS}
            self._handlers = {signum: handler for signum, handler in found.items() if callable(handler)}
            for signum in self._handlers:
                signal.signal(signum, self._take)
            alarm = signal.getsignal(signal.SIGALRM)
            # Whoever has an alarm of their own keeps it.
            if alarm is signal.SIG_DFL or isinstance(getattr(alarm, "__self__", None), ProgramSignals):
                self._alarm = alarm
                signal.signal(signal.SIGALRM, self._raise_again)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._alarm is not None:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, self._alarm)
        for signum, handler in self._handlers.items():
            signal.signal(signum, handler)
        if error is None:
            self._handle_waiting()

    def _take(self, signum: int, _: FrameType | None) -> None:
        # Who is impatient presses twice, and what the first one ends must be able to end.
        if self._allowed and time.monotonic() - self._raised > _ENDING_TIME:
            self._let_through(signum)
        else:
            self._waiting = signum

    def _let_through(self, signum: int) -> None:
        self._raised = time.monotonic()
        if self._alarm is not None and self._allowed:
            signal.setitimer(signal.ITIMER_REAL, _PATIENCE, _PATIENCE)
        # Without the frame, for there is something to save, whatever is imported.
        self._handlers[signum](signum, None)

    def _raise_again(self, _: int, __: FrameType | None) -> None:
        if self._allowed:
            raise KeyboardInterrupt

    def _handle_waiting(self) -> None:
        signum, self._waiting = self._waiting, None
        if signum is not None:
            self._let_through(signum)

    @contextlib.contextmanager
    def allowed(self) -> Iterator[None]:
        """Let signals through, one that waits at once."""
        before = self._raised
        try:
            with interruptible():
                self._allowed = True
                self._handle_waiting()
                yield
        except Exception as error:
            if self._raised != before:
                raise KeyboardInterrupt from error
            raise
        finally:
            self._allowed = False

    @contextlib.contextmanager
    def held(self) -> Iterator[None]:
        """Hold signals back for a while within `allowed`."""
        self._allowed = False
        try:
            yield
        finally:
            self._allowed = True
        self._handle_waiting()


@contextlib.contextmanager
def interruptible() -> Iterator[None]:
    """Let Ctrl-C through as KeyboardInterrupt also where compiled code runs: numba may make a SystemError of it."""
    try:
        yield
    except SystemError as error:
        if isinstance(error.__cause__, KeyboardInterrupt):
            raise error.__cause__ from None
        raise
