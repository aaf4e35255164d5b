"""A scenario's frames with their ground truth, written down."""

import contextlib
import dataclasses
import hashlib
import itertools
import math
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from fogsim.core.interruption import Interruption
from fogsim.core.parameters import Range, checked_parameters
from fogsim.core.randomness import Seed
from fogsim.dataset.directory import (
    DEPTH_UNIT,
    TRANSMISSION_UNIT,
    DatasetDirectory,
    encoded_depth,
    encoded_transmission,
)
from fogsim.dataset.ground_truth import (
    SemanticClass,
    depth,
    instance_mask,
    semantic_mask,
    sign_picture,
    transmission,
    vehicle_class,
)
from fogsim.errors import InputError
from fogsim.recorders import versions
from fogsim.scenario import Scenario, build, resolved
from fogsim.simulation.controlled_driving import own_policy
from fogsim.simulation.loop import ClosedLoop
from fogsim.units import finite_or_none
from fogsim.values import Camera, CameraPose, Ending, Step

_CATEGORIES = [
    {"id": int(kind), "name": kind.name.lower(), "supercategory": "sign" if kind is SemanticClass.SIGN else "vehicle"}
    for kind in SemanticClass
    if SemanticClass.SIGN <= kind <= SemanticClass.OTHER_VEHICLE
]
"""COCO categories: ids are those of the semantic masks."""


def _frame_record(step: Step) -> dict[str, Any]:
    """Entry of one frame: the ground truth and the vehicle's inputs; infinite visibility is null."""
    truth, observation = step.truth, step.observation
    return {
        "step": step.index,
        "time_s": step.time,
        "visibility_m": finite_or_none(truth.visibility),
        "visibility_ahead_m": finite_or_none(truth.visibility_ahead),
        "extinction_per_m": truth.extinction,
        "speed_mps": observation.speed,
        "speed_limit_mps": finite_or_none(step.speed_limit),
        "ego_id": step.traffic.ids[step.ego],
        "lead_distance_m": None if observation.lead is None else observation.lead.distance,
        "camera": {
            "true": _calibration(truth.camera),
            "told": _calibration(getattr(observation.frame, "camera", None)),
            "pose": _pose(truth.pose),
        },
        "signs": [
            {
                "sign_id": sign.sign_id,
                "kind": sign.kind,
                "value": sign.value,
                "distance_m": sign.distance,
                "lateral_m": sign.lateral,
                "diameter_m": sign.diameter,
            }
            for sign in observation.signs
        ],
    }


def object_records(step: Step, instance: NDArray[np.uint16], transmission: NDArray[np.float32]) -> list[dict[str, Any]]:
    """Objects with a visible pixel: box and area [px], distance, and transmission."""
    records = []
    for number, box, inside in _objects(instance):
        if number == step.ego + 1:
            # The own bonnet is not an object.
            continue
        rows, cols = box
        records.append(
            {
                **_object(step, number),
                "instance": number,
                "bbox": [cols.start, rows.start, cols.stop - cols.start, rows.stop - rows.start],
                "area": int(np.count_nonzero(inside)),
                "iscrowd": 0,
                "distance_m": float(step.view.distance[box][inside].min()),
                "transmission": float(np.mean(transmission[box][inside], dtype=np.float64)),
            }
        )
    return records


def _objects(instance: NDArray[np.uint16]) -> Iterable[tuple[int, tuple[slice, slice], NDArray[np.bool_]]]:
    """Number, box and pixels within the box of every object of a mask."""
    rows, cols = np.nonzero(instance)
    numbers = instance[rows, cols]
    for number in np.unique(numbers):
        own = numbers == number
        box = (
            slice(int(rows[own].min()), int(rows[own].max()) + 1),
            slice(int(cols[own].min()), int(cols[own].max()) + 1),
        )
        yield int(number), box, instance[box] == number


def _object(step: Step, number: int) -> dict[str, Any]:
    """Attributes of an object by its number in the instance mask."""
    row, vehicles = number - 1, len(step.traffic.ids)
    if row < vehicles:
        return {
            "category_id": int(vehicle_class(step.traffic.types[row])),
            "vehicle_id": step.traffic.ids[row],
            "speed_mps": float(step.traffic.speed[row]),
            "lamps": int(step.traffic.lamps[row]),
        }
    signs = () if step.truth.signs is None else step.truth.signs.signs
    sign, heading = signs[row - vehicles], step.traffic.heading[step.ego]
    return {
        "category_id": int(SemanticClass.SIGN),
        "sign_id": sign.sign_id,
        "kind": sign.kind,
        "value": sign.value,
        "shows_face": bool(math.cos(sign.heading - float(heading)) > 0),
    }


def _coco(information: Mapping[str, Any], records: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """COCO file of frames in order; each record has an "image" and its "annotations"."""
    images: list[dict[str, Any]] = []
    annotations: list[dict[str, Any]] = []
    for number, record in enumerate(records, start=1):
        images.append({"id": number, **record["image"]})
        for annotation in record["annotations"]:
            annotations.append({"id": len(annotations) + 1, "image_id": number, **annotation})
    return {
        "info": dict(information),
        "licenses": [],
        "categories": _CATEGORIES,
        "images": images,
        "annotations": annotations,
    }


def _calibration(camera: Camera | None) -> dict[str, Any] | None:
    if camera is None:
        return None
    return {
        "width": camera.width,
        "height": camera.height,
        "focal_length_px": camera.focal_length,
        "principal_point_px": list(camera.principal_point),
        "mount_height_m": camera.mount_height,
        "pitch_rad": camera.pitch,
        "roll_rad": camera.roll,
        "response": camera.response.value,
        "bits": camera.bits,
    } | ({"black_level": camera.black_level} if camera.black_level > 0 else {})


def _pose(pose: CameraPose | None) -> dict[str, Any] | None:
    if pose is None:
        return None
    return {"position_m": list(pose.position), "heading_rad": pose.heading, "grade_rad": pose.grade}


def identity(scenario: Scenario, seed: int, every: int) -> dict[str, Any]:
    """Everything that determines a data set's frames, as JSON data; `every` counts camera periods per frame."""
    found = versions()
    # Any machine makes the same frames.
    del found["platform"]
    return {
        "seed": seed,
        "every": every,
        "scenario": resolved(scenario),
        "inputs": input_digests(scenario),
        "versions": {**found, **build.own_methods(scenario)},
    }


def input_digests(scenario: Scenario) -> dict[str, str]:
    """SHA-256 of the files that a scenario's traffic and methods read, by name; same names share an entry."""
    setup = build.traffic_setup(scenario)
    # A road by template has files that no key names.
    files = [*([] if setup.net is None else [setup.net]), *setup.routes, *setup.additional]
    files += build.input_files(scenario)
    digests: dict[str, str] = {}
    for file in dict.fromkeys(files):
        name, digest = _name(file, scenario.directory), _digest(file)
        digests[name] = f"{digests[name]} {digest}" if name in digests else digest
    return digests


def _name(file: Path, folder: Path) -> str:
    return file.relative_to(folder).as_posix() if file.is_relative_to(folder) else file.name


def _digest(file: Path) -> str:
    try:
        return hashlib.sha256(file.read_bytes()).hexdigest()
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror}") from error


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
    # JSON has no numbers of NumPy.
    frames, seed, every = int(frames), int(seed), int(every)
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
    policy = own_policy(scenario.run_config())
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
    directory.write(number, layers, {"image": {**about, **_frame_record(step)}, "annotations": objects})


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
    directory.write_annotations(_coco(information, records))
    return len(records)
