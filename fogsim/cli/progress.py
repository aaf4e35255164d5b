"""The progress bar of commands that work through a known number of steps."""

import sys

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn


def progress_bar(console: Console) -> Progress:
    """Bar, share, description and time left; nothing of it stays, and nothing is drawn where there is no terminal.

    Parameters
    ----------
    console : Console
        Where it is drawn: that of stderr, since stdout is for results.
    """
    # rich would lead stdout to its own console, which is stderr: fine on a terminal, and wrong for a pipe or a file.
    to_terminal = sys.stdout.isatty()
    columns = (BarColumn(bar_width=20), TaskProgressColumn(), TextColumn("{task.description}"), TimeRemainingColumn())
    shown = console.is_terminal
    return Progress(*columns, console=console, transient=True, redirect_stdout=to_terminal, disable=not shown)
