"""A scenario's frames with their ground truth, written down."""

import contextlib
import dataclasses
import itertools
import math
from collections.abc import Callable, Generator, Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Annotated

from fogsim.core.interruption import Interruption
from fogsim.core.parameters import Range, checked_parameters
from fogsim.core.randomness import Seed
from fogsim.dataset.annotations import coco, frame_record, object_records
from fogsim.dataset.directory import DatasetDirectory
from fogsim.dataset.encoding import DEPTH_UNIT, TRANSMISSION_UNIT, encoded_depth, encoded_transmission
from fogsim.dataset.ground_truth import SemanticClass, depth, instance_mask, semantic_mask, sign_picture, transmission
from fogsim.dataset.inputs import identity
from fogsim.errors import InputError
from fogsim.scenario import Scenario, build
from fogsim.simulation.advised_driving import AdvisedDriving
from fogsim.simulation.loop import ClosedLoop
from fogsim.values import Ending, Step

Count = Annotated[int, Range(1, math.inf)]


@dataclasses.dataclass(frozen=True, slots=True)
class WrittenDataset:
    """Result of writing a data set.

    Attributes
    ----------
    directory : Path
        The directory.
    frames : int
        Number of frames in it.
    written : int
        Number of frames that this call wrote.
    complete : bool
        False if it was interrupted; the same call again continues it.
    """

    directory: Path
    frames: int
    written: int
    complete: bool


@checked_parameters
def write_dataset(
    scenario: Scenario,
    out: Path | str,
    frames: Count,
    *,
    seed: Seed = 0,
    every: Count = 1,
    watch: Callable[[int], None] = lambda _: None,
) -> WrittenDataset:
    """Write frames of a scenario with their ground truth, or continue where an earlier call stopped.

    When a run ends before there are enough frames, another begins, with the next seed. A continued data set is
    the same, byte for byte, as one that was written at once: the simulation is replayed from the start of the run with
    the first missing frame, and existing files are kept.

    Parameters
    ----------
    scenario : Scenario
        From `load_scenario`.
    out : Path or str
        Directory; new, empty, or of the same data set.
    frames : int
        Number of frames, at least 1.
    seed : int
        Seed of the first run.
    every : int
        Camera periods per frame, at least 1.
    watch : callable
        Called with the number of existing frames, for a progress bar.

    Returns
    -------
    WrittenDataset
        Complete, or interrupted (KeyboardInterrupt, as from Ctrl-C); in both cases all files are complete.

    Raises
    ------
    InputError
        If a number is out of range, or the directory holds something else, or what was made with other inputs, or is
        written by another process.
    FogSimError
        If a part of the loop cannot start or fails.
    """
    build.check_frames(scenario, "a dataset")
    with Interruption() as interruption, DatasetDirectory(Path(out), identity(scenario, seed, every)) as directory:
        if more := directory.beyond(frames):
            raise InputError(f"{directory.path} holds {more} frames already, more than the {frames} asked for")
        written = 0
        try:
            with (
                contextlib.closing(_missing(scenario, directory, frames, seed, every)) as missing,
                interruption.allowed(),
            ):
                for number, run_number, step in missing:
                    if step is not None:
                        with interruption.held():
                            _write_frame(directory, number, step, run_number, seed)
                            written += 1
                    watch(number + 1)
        except KeyboardInterrupt:
            pass
        finally:
            there = _write_annotations(directory, scenario, frames, seed, every)
    return WrittenDataset(directory.path, there, written, there == frames)


def _missing(
    scenario: Scenario, directory: DatasetDirectory, frames: int, seed: int, every: int
) -> Generator[tuple[int, int, Step | None], None, None]:
    """Index, number of the run and step of each frame; None in place of the step of an existing frame."""
    number, run_number = _resume(directory, frames)
    for there in range(number):
        yield there, 0, None
    if number == frames:
        return
    with ClosedLoop(scenario) as loop:
        while number < frames:
            for step in itertools.islice(_pictures(loop, scenario, seed + run_number, every), frames - number):
                yield number, run_number, None if directory.has(number) else step
                number += 1
            run_number += 1


def _pictures(loop: ClosedLoop, scenario: Scenario, seed: int, every: int) -> Iterator[Step]:
    """Every n-th step of a run, if it has its own image."""
    policy = AdvisedDriving(scenario)
    step = loop.start(seed)
    while True:
        # After the ego has left the network, its last frame is only repeated.
        if step.index % every == 0 and step.ending is not Ending.LEFT_NETWORK:
            yield step
        if step.ending is not None:
            return
        step = loop.advance(policy.decide(step))


def _resume(directory: DatasetDirectory, frames: int) -> tuple[int, int]:
    """The first missing frame, and the number of its run, as far as known."""
    runs: list[int] = []
    while len(runs) < frames and directory.has(len(runs)):
        runs.append(directory.record(len(runs))["image"]["run"])
    if len(runs) == frames or not runs:
        return len(runs), 0
    # The last run that has a frame may have had more.
    return runs.index(runs[-1]), runs[-1]


def _write_frame(directory: DatasetDirectory, number: int, step: Step, run_number: int, seed: int) -> None:
    instance, through = instance_mask(step), transmission(step)
    image = step.observation.image
    layers = {
        "frames": image,
        "depth": encoded_depth(depth(step)),
        "instance": instance,
        "semantic": semantic_mask(step),
        "transmission": encoded_transmission(through),
        "sign_map": step.observation.sign_map,
        "signs": sign_picture(step, instance),
    }
    about = {"width": image.shape[1], "height": image.shape[0], "run": run_number, "seed": seed + run_number}
    objects = object_records(step, instance, through)
    directory.write(number, layers, {"image": {**about, **frame_record(step)}, "annotations": objects})


def _write_annotations(directory: DatasetDirectory, scenario: Scenario, frames: int, seed: int, every: int) -> int:
    """Write the COCO file of the existing frames, and return their number."""
    records = [directory.record(number) for number in range(frames) if directory.has(number)]
    information = {
        "description": f"{scenario.name}: camera frames in fog with their ground truth",
        "version": version("fogsim"),
        "scenario": scenario.name,
        "seed": seed,
        "every": every,
        "complete": len(records) == frames,
        "depth_unit_m": DEPTH_UNIT,
        "transmission_unit": TRANSMISSION_UNIT,
        "semantic_classes": {kind.name.lower(): int(kind) for kind in SemanticClass},
    }
    directory.write_annotations(coco(information, records))
    return len(records)
