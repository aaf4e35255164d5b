"""A first run compiles in two processes: its own renders, and a second one runs estimators and fusion.

Estimators and fusion share hardly a kernel with rendering, and take two thirds of the time; so this process runs the
last of them when it has rendered its first frame.
"""

import gc
import importlib
import json
import os
import subprocess
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fogsim.scenario import Scenario

_PACKAGES = ("fogsim.vision.", "fogsim.estimators.", "fogsim.fusion.")
"""Modules whose kernels the other process compiles."""

_ENDS_WITHIN = 5.0
"""Time that the other process has to end when it is no longer needed [s]."""


@contextmanager
def compiling_in_background() -> Iterator[Callable[["Scenario"], None]]:
    """Start the second process, if its kernels are not cached yet; yield a function that passes it a scenario.

    It is started before a scenario is loaded, so that its imports are done when the scenario arrives.
    """
    process = _started()
    if process is None:
        yield lambda _: None
        return
    from fogsim.core.jit import COMPILER_PROCESS

    with ExitStack() as stack:
        stack.callback(_end, process)

        def send(scenario: "Scenario") -> None:
            methods = _methods(scenario)
            if not methods or not _is_first():
                # It has nothing to do in this run, however long the run is.
                _end(process)
                return
            message = {"size": (scenario.camera.width, scenario.camera.height), **methods}
            read = partial(_read_last, message)
            stack.enter_context(COMPILER_PROCESS.compiles(lambda: process.poll() is not None, _PACKAGES, read))
            _send(process, message)

        yield send


def _started() -> "subprocess.Popen[bytes] | None":
    """Start the other process; None if it has nothing to do, or no resources."""
    import fogsim.vision.light.pixel_kernels  # noqa: F401 - what methods need first; it loads little

    if not _is_first():
        return None
    command = [sys.executable, "-P", "-c", f"from {__name__} import read_pictures; read_pictures({os.getpid()})"]
    quiet = subprocess.DEVNULL
    try:
        return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=quiet, stderr=quiet)  # noqa: S603 - this module's own
    except OSError:
        # Too little memory or too many processes: this one compiles alone, as on a single processor.
        return None


def _read_last(wanted: Mapping[str, Any]) -> None:
    """Run all methods but the first, in reverse order, and the fusion: this process's part while it would wait."""
    from fogsim.cli.compile import fuse_estimates, read_foggy_road

    _, *others = wanted["methods"]
    # What these images make of a method is no concern of the run.
    with suppress(Exception), warnings.catch_warnings(action="ignore"):
        estimates = [read_foggy_road(name, parameters, wanted["size"]) for name, parameters in reversed(others)]
        if wanted["fusion"] is not None and estimates:
            fusion, parameters = wanted["fusion"]
            fuse_estimates(fusion, parameters, estimates)


def _send(process: "subprocess.Popen[bytes]", message: Mapping[str, Any]) -> None:
    """Pass the other process what to compile; if it has died, this one compiles alone."""
    if (pipe := process.stdin) is not None:
        with suppress(OSError), pipe:
            pipe.write(json.dumps(message).encode())


def _end(process: "subprocess.Popen[bytes]") -> None:
    process.terminate()
    try:
        process.wait(_ENDS_WITHIN)
    except subprocess.TimeoutExpired:
        process.kill()


def _methods(scenario: "Scenario") -> dict[str, Any]:
    """Names and parameters of FogSim's own methods and fusion of the scenario; {} without methods."""
    from fogsim.estimators import ESTIMATORS
    from fogsim.fusion import FUSIONS

    own, fusions = set(ESTIMATORS), set(FUSIONS)
    methods = [(one.method, dict(one.parameters)) for one in scenario.estimators if one.method in own]
    chosen = scenario.fusion
    fusion = (chosen.method, dict(chosen.parameters)) if chosen.method in fusions else None
    return {"methods": methods, "fusion": fusion} if methods else {}


def _is_first() -> bool:
    """Whether no kernel of those modules was ever compiled here, and kernels can be cached."""
    from fogsim.core.jit import is_kept, processors

    # Everything that the methods use was imported with them.
    modules = [module for name, module in tuple(sys.modules.items()) if name.startswith(_PACKAGES)]
    kept = [is_kept(value) for module in modules for value in vars(module).values()]
    return processors() > 1 and False in kept and True not in kept


def read_pictures(parent: int) -> None:
    """Run estimators and a fusion on images until their kernels are cached: the second process's part.

    Standard input has JSON: size of the images, methods with their parameters, and a fusion. It ends when the process
    `parent` has ended.
    """
    # It ends before the memory is missed, and an eighth of its time would go into finding what compilers leave.
    gc.disable()
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    from fogsim.cli.compile import BANK, follow_a_bend, fuse_estimates, read_foggy_road, read_own_beams

    # Modules of methods and fusions are imported while the scenario is loaded.
    for name in ("fogsim.estimators", "fogsim.fusion"):
        importlib.import_module(name)
    if not (message := sys.stdin.read()):
        return
    wanted = json.loads(message)
    size: Sequence[int] = wanted["size"]
    estimates = [read_foggy_road(name, parameters, size) for name, parameters in wanted["methods"]]
    if wanted["fusion"] is not None:
        fusion, parameters = wanted["fusion"]
        fuse_estimates(fusion, parameters, estimates)
    if any(name in {"night_road", "gallen2014_veil"} for name, _ in wanted["methods"]):
        read_own_beams()
    if any(name == "joint_road" for name, _ in wanted["methods"]):
        follow_a_bend(size)
    # What a run's first frames seldom need.
    for name, parameters in wanted["methods"]:
        read_foggy_road(name, parameters, size, BANK)


def _end_with(parent: int) -> None:
    """End this process after its parent."""
    while os.getppid() == parent:
        time.sleep(1.0)
    os._exit(1)
