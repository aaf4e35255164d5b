"""Output of the commands and their exit codes; text that can come from users' files is escaped.

Results go to stdout, everything else to stderr.
"""

import contextlib
from collections.abc import Iterable

from rich.console import Console
from rich.markup import escape as escape_markup

from fogsim.errors import printable

FAILED = 1
"""Exit code if an expectation or a user's method failed."""

BAD_INPUT = 2
"""Exit code of bad input."""

INTERRUPTED = 130
"""Exit code after Ctrl-C."""

stdout = Console(highlight=False, emoji=False)
stderr = Console(stderr=True, highlight=False, emoji=False)


def escape(text: object, *, in_one_line: bool = False) -> str:
    """`printable` text without rich markup; `in_one_line` also escapes line ends."""
    return escape_markup(printable(str(text), in_one_line=in_one_line))


def print_error(error: object) -> None:
    """Print an error, or its message, on stderr."""
    # The exit code matters even if stderr cannot be written.
    with contextlib.suppress(OSError):
        stderr.print(f"[bold red]error:[/] {escape(error)}", soft_wrap=True)


def print_remarks(label: str, remarks: Iterable[object], *, in_one_line: bool = True) -> None:
    """Print remarks on stderr under a label such as "warning"; `in_one_line` escapes line ends."""
    for remark in remarks:
        stderr.print(f"[yellow]{label}:[/] {escape(remark, in_one_line=in_one_line)}", soft_wrap=True)
