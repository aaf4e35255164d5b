"""The progress bars of all commands."""

import contextlib
import sys
from collections.abc import Callable, Iterator
from types import TracebackType
from typing import TYPE_CHECKING, Self

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from fogsim.cli.printing import INTERRUPTED, stderr
from fogsim.core.interruption import interruptible

if TYPE_CHECKING:
    from fogsim.values import TrafficStep

STARTING = "starting; a first run compiles for some seconds"
"""Description of a bar before the first step."""


class _Bar(Progress):
    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is not None and not any(task.completed for task in self.tasks):
            self.live.transient = True
            # `stop` would print an empty line into a file.
            self.live.stop()
        else:
            super().__exit__(kind, error, trace)


def progress_bar(console: Console, *, stays: bool = False) -> Progress:
    """Bar, share, description and time left; it `stays` when full, and is then printed even without a terminal.

    Otherwise it disappears, as at an error before anything is done, and nothing is drawn without a terminal.
    """
    # rich would redirect stdout to its own console, stderr: fine on a terminal, but wrong for a pipe or a file.
    to_terminal = sys.stdout.isatty()
    columns = (
        BarColumn(bar_width=20),
        TaskProgressColumn(),
        TextColumn("{task.description}", markup=False),
        TimeRemainingColumn(),
        TextColumn("left"),
    )
    hidden = not stays and not console.is_terminal
    return _Bar(*columns, console=console, transient=not stays, redirect_stdout=to_terminal, disable=hidden)


@contextlib.contextmanager
def counting_bar(console: Console, description: str) -> Iterator[Callable[[int, int], None]]:
    """Bar that is called with the number of finished items and their total; it disappears at the end."""
    with progress_bar(console) as progress:
        task = progress.add_task(description, total=None)
        yield lambda done, total: progress.update(task, completed=done, total=total)


@contextlib.contextmanager
def tally_bar(total: int, what: str) -> Iterator[Callable[..., None]]:
    """Bar that stays, called with the numbers of finished and of failed items, and perhaps another description."""
    with progress_bar(stderr, stays=True) as progress:
        task = progress.add_task(STARTING, total=total)

        def show(done: int, failed: int = 0, instead: str = "") -> None:
            failures = f", {failed} failed" if failed else ""
            progress.update(task, completed=done, description=instead or f"{done} of {total} {what}{failures}")

        yield show


@contextlib.contextmanager
def measuring_bar(name: str, total: int | None, what: str, ended: str) -> Iterator[Callable[[int, int], None]]:
    """Bar that is called with the number of finished steps and their total; Ctrl-C ends the command.

    It then prints `ended`, with how far it came in place of ``{}``.
    """
    so_far = f"0 {what}" if total is None else f"0 of {total} {what}"
    with progress_bar(stderr) as progress:
        task = progress.add_task(f"{name}: a first run compiles for some seconds", total=total)

        def watch(done: int, total: int) -> None:
            nonlocal so_far
            so_far = f"{done} of {total} {what}"
            progress.update(task, completed=done, total=total, description=f"{name}: {so_far}")

        try:
            with interruptible():
                yield watch
        except KeyboardInterrupt:
            progress.stop()
            stderr.print(ended.format(so_far), soft_wrap=True)
            raise typer.Exit(INTERRUPTED) from None


class SimulationProgress:
    """A bar over simulated time up to `duration` [s], with its rate and the belief or number of vehicles."""

    def __init__(self, console: Console, duration: float) -> None:
        self._duration = duration
        self._progress = progress_bar(console, stays=True)
        self._task = self._progress.add_task(STARTING, total=duration)

    def show(self, step: "TrafficStep") -> None:
        """Advance the bar to a finished step."""
        from fogsim.values import Step

        task = self._progress.tasks[self._task]
        rate = step.time / task.elapsed if task.elapsed else 0.0
        found = f"V ≈ {step.belief.visibility:.0f} m" if isinstance(step, Step) else f"{len(step.traffic.ids)} vehicles"
        description = f"{step.time:.0f} of {self._duration:.0f} s, {rate:.1f}× real time, {found}"
        # A finished run is complete, however much of its longest duration is left.
        done = step.time if step.ending is None else self._duration
        self._progress.update(self._task, completed=done, description=description)

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._progress.__exit__(kind, error, trace)
