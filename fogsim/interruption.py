"""Ctrl-C, whatever runs when it comes."""

import contextlib
from collections.abc import Iterator


@contextlib.contextmanager
def interruptible() -> Iterator[None]:
    """Let Ctrl-C through as KeyboardInterrupt also where compiled code runs: numba may make a SystemError of it.

    Raises
    ------
    KeyboardInterrupt
        In place of a SystemError that one has caused.
    """
    try:
        yield
    except SystemError as error:
        if isinstance(error.__cause__, KeyboardInterrupt):
            raise error.__cause__ from None
        raise
