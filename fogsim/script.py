"""Scenario files by Python: the blocks as typed classes, conditions by operators, and the YAML that they stand for.

Arguments have the same keys as the file: ``Fog(visibility_m=80)`` is ``fog: {visibility_m: 80}``.
"""

import copy
import os
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from fogsim.conditions import Condition
from fogsim.conditions.terms import SignalTerm, all_of, any_of, condition, held, negated, signal
from fogsim.core.files.atomic import write_text
from fogsim.core.files.output_targets import refuse_unwritable
from fogsim.core.parameters import checked_parameters
from fogsim.errors import InputError, shown, suggest
from fogsim.scenario import Scenario
from fogsim.scenario.camera_schema import CalibrationErrors, CameraSection, Exposure
from fogsim.scenario.drivers_schema import DriversSection as Drivers
from fogsim.scenario.expect.schema import Expectation
from fogsim.scenario.fog import Bank, Change, Fog, Patches, Wind
from fogsim.scenario.loading import load_cases
from fogsim.scenario.plain_yaml import Dumper
from fogsim.scenario.roads.schema import ActorSection as Actor
from fogsim.scenario.roads.schema import DemandSection as Demand
from fogsim.scenario.roads.schema import Road
from fogsim.scenario.schema import Clocks, InformedMethod, Light
from fogsim.scenario.section import Method
from fogsim.scenario.sensors.faults import (
    CameraBlackout,
    CameraCalibration,
    CameraDirtyLens,
    CameraDroppedFrames,
    CameraFrozen,
    CameraGlare,
    CameraLatency,
    CameraWetLens,
    GpsHeadingBias,
    GpsOutage,
    GpsPositionBias,
)
from fogsim.scenario.sensors.faults import LeadBiasSection as LeadBias
from fogsim.scenario.sensors.faults import LeadDropoutSection as LeadDropout
from fogsim.scenario.sensors.faults import LeadNarrowViewSection as LeadNarrowView
from fogsim.scenario.sensors.faults import LeadNoiseSection as LeadNoise
from fogsim.scenario.sensors.faults import SignsMissingSection as SignsMissing
from fogsim.scenario.sensors.faults import SignsMovedSection as SignsMoved
from fogsim.scenario.sensors.schema import Sensors
from fogsim.scenario.timeline.lamps import LampActions, LampSides, StopLampSides
from fogsim.scenario.timeline.schema import FogActions, LightActions, SignalActions, TimelineEntry
from fogsim.scenario.timeline.vehicle_actions import (
    BrakeAction,
    BreakDownAction,
    DepartAction,
    FollowAction,
    LaneAction,
    SpeedAction,
    StopAction,
    VehicleActions,
)
from fogsim.scenario.traffic_schema import Traffic
from fogsim.scenario.variation.cases import Verdict
from fogsim.scenario.written_form import as_written
from fogsim.units.quantities import UNIT_OF_SUFFIX

_TRAFFIC_FILES = ("config", "net")


@dataclass(frozen=True, slots=True)
class Varied:
    """What differs between the cases of a file.

    Attributes
    ----------
    values : object
        As ``vary`` has them in files: a list, ``{"from": 10, "to": 30, "step": 5}``, ``"20 seeds"``, a distribution.
    keys : tuple of str
        Key paths whose values it takes the place of: ``fog.patches.strength``.
    """

    values: object
    keys: tuple[str, ...] = ()


def varied(values: object, *keys: str) -> Varied:
    """Let keys vary.

    Parameters
    ----------
    values : object
        See `Varied`.
    *keys : str
        Their paths.
    """
    return Varied(values, keys)


@checked_parameters
def to_yaml(
    scenario: Scenario,
    vary: Mapping[str, Varied] | None = None,
    verdict: Verdict | None = None,
    folder: Path | None = None,
) -> str:
    """A scenario as the text of its file, with the keys that were set.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    vary : mapping from str to Varied, optional
        What differs between the cases of the file, by name.
    verdict : Verdict, optional
        When all cases together pass.
    folder : Path, optional
        Where the file will lie, to which SUMO's files are named relative; by default the scenario's own folder.

    Raises
    ------
    InputError
        If a key that is to vary is not there, or a value is not plain, as an array is not.
    """
    data = as_written(scenario)
    if folder is not None and folder.resolve() != scenario.directory.resolve():
        _name_files_from(data.get("traffic", {}), scenario.directory, folder)
    for name, one in (vary or {}).items():
        for key in one.keys:
            _put(data, key.split("."), name, one.values)
    if vary:
        data["vary"] = {name: copy.deepcopy(one.values) for name, one in vary.items()}
    if verdict is not None:
        data["verdict"] = verdict.model_dump(mode="json", exclude_unset=True)
    try:
        text: str = yaml.dump(data, Dumper=Dumper, sort_keys=False, allow_unicode=True, width=120)
    except yaml.representer.RepresenterError as error:
        plain = "numbers, text, true, false, lists and mappings, as .tolist() makes of an array"
        raise InputError(f"vary: expected {plain}; got {shown(repr(error.args[-1]))}") from None
    return text


@checked_parameters
def write(
    scenario: Scenario,
    path: str | Path,
    vary: Mapping[str, Varied] | None = None,
    verdict: Verdict | None = None,
    *,
    overwrite: bool = False,
) -> Path:
    """Write a scenario into a file, and check all its cases there as `load_scenario` does.

    Parameters
    ----------
    scenario, vary, verdict
        See `to_yaml`.
    path : str or Path
        The file; ``NAME.fog.yaml`` is found by ``fogsim test`` and pytest.
    overwrite : bool
        True to replace what is there.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If it is there already or cannot be written, or what would stand in it does not fit; nothing is written then.
    """
    path = Path(path)
    refuse_unwritable(path, overwrite=overwrite)
    text = to_yaml(scenario, vary, verdict, path.parent)
    # SUMO's files are named relative to the folder.
    with tempfile.NamedTemporaryFile("w", encoding="utf-8", dir=path.parent, prefix=".", suffix=path.suffix) as trial:
        trial.write(text)
        trial.flush()
        try:
            load_cases(trial.name)
        except InputError as error:
            raise InputError(str(error).replace(trial.name, str(path))) from error
    write_text(path, text)
    return path


def _name_files_from(traffic: dict[str, Any], old: Path, new: Path) -> None:
    """Name SUMO's files from another folder."""
    for key in _TRAFFIC_FILES:
        if key in traffic:
            traffic[key] = os.path.relpath((old / traffic[key]).resolve(), new.resolve())
    for key in ("routes", "additional"):
        if key in traffic:
            traffic[key] = [os.path.relpath((old / name).resolve(), new.resolve()) for name in traffic[key]]


def _put(data: Any, path: list[str], name: str, values: object) -> None:
    """Put a name at a key path in place of a value; a number in the path is a place in a list."""
    dotted_key, block = ".".join(path), data
    for key in path[:-1]:
        place = int(key) if isinstance(block, list) and key.isdecimal() else key
        try:
            block = block[place]
        except (KeyError, IndexError, TypeError):
            known = block if isinstance(block, dict) else ()
            raise InputError(f"vary: there is no {dotted_key}; {suggest(str(place), known)}") from None
    if not isinstance(block, dict) or not block:
        raise InputError(f"vary: there is no {dotted_key}; it must be a key of a block that is written")
    key = path[-1]
    stem, _, suffix = key.rpartition("_")
    if suffix in UNIT_OF_SUFFIX and _bring_units(values):
        block.pop(key, None)
        key = stem
    block[key] = f"${name}"


def _bring_units(values: object) -> bool:
    """Whether values that vary are written with their units."""
    inner = values.values() if isinstance(values, Mapping) else values if isinstance(values, list | tuple) else ()
    return any(isinstance(one, str) or _bring_units(one) for one in inner)


__all__ = [
    "Actor",
    "Bank",
    "BrakeAction",
    "BreakDownAction",
    "CalibrationErrors",
    "CameraBlackout",
    "CameraCalibration",
    "CameraDirtyLens",
    "CameraDroppedFrames",
    "CameraFrozen",
    "CameraGlare",
    "CameraLatency",
    "CameraSection",
    "CameraWetLens",
    "Change",
    "Clocks",
    "Condition",
    "Demand",
    "DepartAction",
    "Drivers",
    "Expectation",
    "Exposure",
    "Fog",
    "FogActions",
    "FollowAction",
    "GpsHeadingBias",
    "GpsOutage",
    "GpsPositionBias",
    "InformedMethod",
    "LampActions",
    "LampSides",
    "LaneAction",
    "LeadBias",
    "LeadDropout",
    "LeadNarrowView",
    "LeadNoise",
    "Light",
    "LightActions",
    "Method",
    "Patches",
    "Road",
    "Scenario",
    "Sensors",
    "SignalActions",
    "SignalTerm",
    "SignsMissing",
    "SignsMoved",
    "SpeedAction",
    "StopAction",
    "StopLampSides",
    "TimelineEntry",
    "Traffic",
    "Varied",
    "VehicleActions",
    "Verdict",
    "Wind",
    "all_of",
    "any_of",
    "condition",
    "held",
    "negated",
    "signal",
    "to_yaml",
    "varied",
    "write",
]
