"""A time limit for one call of a user's method."""

import contextlib
import faulthandler
import signal
import threading
from collections.abc import Iterator
from types import FrameType

from fogsim.errors import InputError


class TimeLimitError(BaseException):
    """A call took too long; `except Exception` in the called code does not catch it."""


_GRACE = 5.0
"""Grace period after a limit before a process ends in which compiled code blocks the error [s]."""


@contextlib.contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Raise TimeLimitError in a block that takes longer, each time the limit passes; main thread only.

    Where compiled code prevents the error, the process ends.
    """
    if threading.current_thread() is not threading.main_thread():
        raise InputError("a time limit for methods needs the main thread of Python; run without one, or run there")

    def give_up(_: int, __: FrameType | None) -> None:
        raise TimeLimitError(f"took longer than {seconds:g} s")

    before = signal.signal(signal.SIGALRM, give_up)
    faulthandler.dump_traceback_later(seconds + _GRACE, exit=True, file=2)
    signal.setitimer(signal.ITIMER_REAL, seconds, seconds)
    try:
        yield
    except KeyboardInterrupt:
        # Its alarm, which repeats a lost signal, continues.
        raise
    except BaseException:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        raise
    else:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    finally:
        faulthandler.cancel_dump_traceback_later()
        signal.signal(signal.SIGALRM, before)
