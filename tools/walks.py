"""Follow three walks of the data: the files whose functions run, in the order in which they are entered.

    python tools/walks.py            # the files of each walk
    python tools/walks.py --json     # their names by walk

- ``fog``: a fog's visibility, from a scenario file to the pixels of a frame (drawing what stands in it left out);
- ``estimate``: a frame, from an estimator's `update` to its estimate: all methods of the day but those that need a
  vehicle ahead;
- ``advice``: a belief, from the advice to what SUMO is set to.

Kernels do not show as they run: those that a function names count as run by it.
"""

import argparse
import json
import os
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import CodeType, FrameType, ModuleType
from typing import Any

import fogsim

HERE = str(Path(fogsim.__file__).parent) + os.sep
SETTINGS = ("duration_s=3", "camera.width=64", "camera.height=48", "renderer=cpu", "fog.outside_visibility_m=80")
METHODS = ("negru2013", "zhu2015", "huang2015_rough", "joint_road")
ROOMS = {
    "fog": ("scenario", "units", "values", "simulation", "atmosphere", "camera"),
    "estimate": ("estimators", "vision", "values", "units"),
    "advice": ("simulation", "advice", "values", "traffic", "fusion"),
}
"""Rooms that a walk leads through; what runs next to it in others is not of it."""


def entered(work: Callable[[], Any], rooms: tuple[str, ...], begin: str = "", end: str = "") -> list[str]:
    """Files of rooms whose functions run, in order, between the first calls of `begin` and `end` if these are given."""
    found: dict[str, None] = {}
    counting = not begin

    def watch(frame: FrameType, event: str, _: object) -> None:
        nonlocal counting
        code = frame.f_code
        if event != "call" or not code.co_filename.startswith(HERE) or code.co_name == "<module>":
            return
        counting = counting or code.co_name == begin
        if counting:
            for path in (code.co_filename, *kernel_files(code, frame.f_globals)):
                file = path.removeprefix(HERE)
                if Path(file).parts[0].removesuffix(".py") in rooms:
                    found.setdefault(file)
        counting = counting and code.co_name != end

    sys.setprofile(watch)
    try:
        work()
    finally:
        sys.setprofile(None)
    return list(found)


def kernel_files(code: CodeType, names: Mapping[str, Any]) -> Iterator[str]:
    """Files of the kernels that a function names, by itself or as a module's attributes, and of those they name."""
    for name in code.co_names:
        value = names.get(name)
        inner = vars(value) if isinstance(value, ModuleType) else {}
        found = [value, *(inner.get(other) for other in code.co_names)]
        for each in found:
            plain = getattr(each, "py_func", None)
            if plain is not None and plain.__code__ is not code:
                yield plain.__code__.co_filename
                yield from kernel_files(plain.__code__, plain.__globals__)


def walks() -> Iterator[tuple[str, list[str]]]:
    """Each walk's name and files."""

    def run() -> fogsim.Step:
        steps = fogsim.run(fogsim.load_scenario("motorway_fog_bank", SETTINGS), seed=1)
        return next(step for step in steps if step.time > 0.5)  # the first step starts everything

    # Once without counting: imports and first uses are no part of a walk.
    step = run()
    yield "fog", entered(run, ROOMS["fog"])
    observation = step.observation
    estimators = [fogsim.estimators.make(name, observation.frame.camera) for name in METHODS]
    yield "estimate", entered(lambda: [each.update(observation) for each in estimators], ROOMS["estimate"])
    yield "advice", entered(run, ROOMS["advice"], begin="advise")


def main() -> None:
    """Print the walks."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print the files by walk")
    found = dict(walks()) if parser.parse_args().json else None
    if found is not None:
        json.dump(found, sys.stdout, indent=1)
        return
    for name, files in walks():
        print(f"{name}: {len(files)} files", *files, sep="\n    ")  # noqa: T201 - what the command is for


if __name__ == "__main__":
    main()
