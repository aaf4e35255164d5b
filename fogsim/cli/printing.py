"""What the commands print, where, and with which exit codes; text that a user's files can have a say in is made safe.

Results go to stdout, all else to stderr.
"""

import contextlib
from collections.abc import Iterable

from rich.console import Console
from rich.markup import escape as escape_markup

from fogsim.errors import printable

FAILED = 1
"""Exit code if an expectation was not met, or a user's method failed."""

BAD_INPUT = 2
"""Exit code of bad input."""

INTERRUPTED = 130
"""Exit code after Ctrl-C."""

stdout = Console(highlight=False, emoji=False)
stderr = Console(stderr=True, highlight=False, emoji=False)


def escape(text: object, *, in_one_line: bool = False) -> str:
    """`printable` text that is no markup for rich either.

    Parameters
    ----------
    text : object
        Any text, or what ``str`` makes text of.
    in_one_line : bool
        Escape ends of lines, too.
    """
    return escape_markup(printable(str(text), in_one_line=in_one_line))


def print_error(error: object) -> None:
    """Print an error on stderr.

    Parameters
    ----------
    error : object
        The error, or its message.
    """
    # The exit code counts, also where stderr takes no line.
    with contextlib.suppress(OSError):
        stderr.print(f"[bold red]error:[/] {escape(error)}", soft_wrap=True)


def print_remarks(label: str, remarks: Iterable[object], *, in_one_line: bool = True) -> None:
    """Print remarks on stderr.

    Parameters
    ----------
    label : str
        What they are: "warning", "assumed".
    remarks : iterable of object
        Their texts.
    in_one_line : bool
        Escape ends of lines in each.
    """
    for remark in remarks:
        stderr.print(f"[yellow]{label}:[/] {escape(remark, in_one_line=in_one_line)}", soft_wrap=True)
