"""A first run compiles in two processes: its own, which draws, and one beside it, which reads pictures.

What each method asks of pictures shares hardly a kernel with what draws them, and takes nearly half of the time.
"""

import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fogsim.scenario import Scenario

PACKAGES = ("fogsim.vision.", "fogsim.estimators.")
"""Modules whose kernels the other process compiles."""

_ENDS_WITHIN = 5.0
"""Time that the other process is given to end when it is not wanted any more [s]."""


@contextmanager
def compiling_beside(scenario: "Scenario") -> Iterator[None]:
    """Compile what a scenario's methods need in another process, if nothing of it is kept on the disk yet.

    Parameters
    ----------
    scenario : Scenario
        What is about to be run.
    """
    process = _started(scenario)
    if process is None:
        yield
        return
    from fogsim.jit import BESIDE

    try:
        with BESIDE.compiles(lambda: process.poll() is not None, PACKAGES):
            yield
    finally:
        process.terminate()
        try:
            process.wait(_ENDS_WITHIN)
        except subprocess.TimeoutExpired:
            process.kill()


def _started(scenario: "Scenario") -> "subprocess.Popen[bytes] | None":
    """Start the other process, if there is something for it to do; None also where there is no room for it."""
    methods = _methods(scenario)
    if not methods or not _is_first():
        return None
    told = json.dumps({"width": scenario.camera.width, "height": scenario.camera.height, "methods": methods})
    command = [sys.executable, "-c", f"from {__name__} import read_pictures; read_pictures({told!r}, {os.getpid()})"]
    quiet = subprocess.DEVNULL
    try:
        return subprocess.Popen(command, stdin=quiet, stdout=quiet, stderr=quiet)  # noqa: S603 - this module's own
    except OSError:
        # Too little memory or too many processes: this one compiles all by itself, as it would on one processor.
        return None


def _methods(scenario: "Scenario") -> list[tuple[str, Mapping[str, Any]]]:
    """Names and parameters of the scenario's methods that are FogSim's own."""
    from fogsim.estimators import ESTIMATORS

    own = set(ESTIMATORS)
    return [(one.method, dict(one.parameters)) for one in scenario.estimators if one.method in own]


def _is_first() -> bool:
    """Whether no kernel of those modules was ever compiled here, and such can be kept."""
    from fogsim.jit import is_kept, processors

    # With the methods all that they are made of was imported.
    modules = [module for name, module in tuple(sys.modules.items()) if name.startswith(PACKAGES)]
    kept = [is_kept(value) for module in modules for value in vars(module).values()]
    return processors() > 1 and False in kept and True not in kept


def read_pictures(told: str, parent: int) -> None:
    """Let methods read pictures until all that they need is on the disk; the other process's part.

    Parameters
    ----------
    told : str
        JSON: size of the pictures, and methods with their parameters.
    parent : int
        Process for which it is done: nobody needs it any more when that has ended.
    """
    from fogsim.cli.compile import read_foggy_road, read_own_beams

    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    wanted = json.loads(told)
    size: Sequence[int] = (wanted["width"], wanted["height"])
    for name, parameters in wanted["methods"]:
        read_foggy_road(name, parameters, size)
    if any(name in {"night_road", "gallen2014_veil"} for name, _ in wanted["methods"]):
        read_own_beams()


def _end_with(parent: int) -> None:
    """End this process once its parent is gone."""
    while os.getppid() == parent:
        time.sleep(1.0)
    os._exit(1)
