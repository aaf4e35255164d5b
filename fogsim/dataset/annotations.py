"""Annotations of a frame: its entry in the COCO file, and its objects with their boxes."""

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.dataset.ground_truth import SemanticClass, vehicle_class
from fogsim.units import finite_or_none
from fogsim.values import Camera, CameraPose, Observation, Step

CATEGORIES = [
    {"id": int(kind), "name": kind.name.lower(), "supercategory": "sign" if kind is SemanticClass.SIGN else "vehicle"}
    for kind in SemanticClass
    if SemanticClass.SIGN <= kind <= SemanticClass.OTHER_VEHICLE
]
"""COCO categories: ids are those of the semantic masks."""


def frame_record(step: Step) -> dict[str, Any]:
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
            "told": _calibration(_assumed_camera(observation)),
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


def coco(information: Mapping[str, Any], records: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
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
        "categories": CATEGORIES,
        "images": images,
        "annotations": annotations,
    }


def _assumed_camera(observation: Observation) -> Camera | None:
    return getattr(observation.frame, "camera", None)


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
