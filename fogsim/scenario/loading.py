"""From a scenario file to a checked `Scenario`; mistakes name file, line, key, value and what is allowed."""

import json
import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from fogsim.core.files.readers import nearest_file
from fogsim.core.parameters import checked_parameters
from fogsim.core.registry.user_code import MayImport, import_anything
from fogsim.errors import InputError, UnknownNameError, nearest, shown, suggest
from fogsim.scenario.document import Document, apply_overrides, read_scenario_document
from fogsim.scenario.expect.checks import last_time
from fogsim.scenario.mistakes import mistake_lines
from fogsim.scenario.plain_yaml import KeyPath, dotted
from fogsim.scenario.roads.files import DemandError, TrafficFiles, entering_vehicles, traffic_files, with_way
from fogsim.scenario.runnable import Scenario
from fogsim.scenario.sumo_check import demand_mistakes, option_lines, step_mistake, trigger_mistakes
from fogsim.scenario.system_under_test import BLOCK, without_sut, without_sut_in_path
from fogsim.scenario.traffic_schema import Traffic
from fogsim.scenario.variation import KEYS, Case, Value, Variation, chosen_cases, read_variation, with_case
from fogsim.scenario.written_form import resolved
from fogsim.scenario.written_units import with_units_in_keys
from fogsim.traffic.road.configuration import check_configured_files, check_sumo_file
from fogsim.traffic.road.unsafe_outputs import check_outputs
from fogsim.traffic.templates import PlacementError

SCENARIO_FILE = "scenario.yaml"
_PACKAGE = Path(__file__).resolve().parent.parent


def catalogue() -> dict[str, Path]:
    """Names and files of the scenarios that come with FogSim: in the wheel, or next to it in a checkout."""
    for folder in (_PACKAGE / "_scenarios", _PACKAGE.parent / "scenarios"):
        files = sorted(folder.glob(f"*/{SCENARIO_FILE}"))
        if files:
            return {file.parent.name: file for file in files}
    return {}


def scenario_file(name_or_path: str | Path) -> Path:
    """File of a catalogue name, a scenario file, or a folder that holds ``scenario.yaml``."""
    path = Path(name_or_path)
    # Without a name, the path would be the working directory.
    if _is_folder(path) and str(name_or_path):
        path = path / SCENARIO_FILE
    if _exists(path) and not path.is_dir():
        return path
    known = catalogue()
    if str(name_or_path) in known:
        return known[str(name_or_path)]
    if path.suffix in {".yaml", ".yml", ".xosc"} or "/" in str(name_or_path):
        raise InputError(f"{name_or_path}: there is no such scenario file{nearest_file(path)}")
    raise UnknownNameError("scenario", str(name_or_path), known)


def _exists(path: Path) -> bool:
    """Whether a path exists; False for impossible names."""
    try:
        return path.exists()
    except OSError:
        return False


def _is_folder(path: Path) -> bool:
    return _exists(path) and path.is_dir()


def _is_file(path: Path) -> bool:
    return _exists(path) and path.is_file()


_BESIDE = (BLOCK, *KEYS)
"""Blocks of scenario files in addition to the keys of the schema."""

_LONG_RUN = 600.0
"""Longest run of the user's own simulation [s]."""

DAY = 86_400.0
"""Simulated time within which the ego of the user's own simulation must appear [s]."""


@checked_parameters
def load_scenario(
    name_or_path: str | Path,
    overrides: Iterable[str] = (),
    *,
    others_add_vehicles: bool = False,
    may_import: MayImport = import_anything,
) -> Scenario:
    """Load and check a scenario; for a file with cases, the first one.

    Parameters
    ----------
    name_or_path : str or Path
        A name in the catalogue, a scenario file, or a folder that holds ``scenario.yaml``.
    overrides : iterable of str
        ``key.path=value`` each, replacing the file's values.
    others_add_vehicles : bool
        True if vehicles may come that are not in the route files, as in a simulation with other clients.
    may_import : callable
        Decides, from its path, whether a Python file next to the scenario is imported, which runs it; otherwise,
        the parameters of its methods are not checked.

    Returns
    -------
    Scenario
        The scenario, with the folder that its file names are relative to.

    Raises
    ------
    InputError
        If anything does not fit; one line for each mistake, with file, line, key path, value and what is allowed.
    """
    return scenario_reader(name_or_path, others_add_vehicles=others_add_vehicles, may_import=may_import)(overrides)


def scenario_reader(
    name_or_path: str | Path, *, others_add_vehicles: bool = False, may_import: MayImport = import_anything
) -> Callable[[Iterable[str]], Scenario]:
    """Read a scenario file once and return a function from overrides to scenarios, as `load_scenario` gives."""
    path = scenario_file(name_or_path)
    document, context = read_scenario_document(path), _context(path.parent, may_import)
    return lambda overrides: _checked(document, overrides, context, closed_demand=not others_add_vehicles)


def _context(folder: Path, may_import: MayImport = import_anything, *, is_test: bool = False) -> dict[str, Any]:
    """What the schema's validators are given; the folder is also where file names are relative to."""
    return {"folder": folder, "may_import": may_import, "is_test": is_test}


@dataclass(frozen=True, slots=True)
class ScenarioCases:
    """The requested cases of a scenario file, and everything that it varies."""

    document: Document
    variation: Variation
    cases: tuple[tuple[Case, Scenario], ...]


CountWatch = Callable[[int, int], None]
"""Called with the number of finished items and their total."""


def load_cases(
    name_or_path: str | Path,
    overrides: Iterable[str] = (),
    wanted: str = "",
    seed: int | None = None,
    watch: CountWatch | None = None,
    *,
    may_import: MayImport = import_anything,
    is_test: bool = False,
) -> ScenarioCases:
    """Load and check the cases of a scenario file; a file that varies nothing has one.

    `wanted` selects cases by comma-separated ``name=value`` ("" for all), `seed` replaces their seeds, and `watch`
    receives the number of checked cases and their total. In a test each expectation must be decided within the run,
    even if ``--set`` has shortened it. InputError describes the first case that does not fit.
    """
    path = scenario_file(name_or_path)
    document = _overridden(read_scenario_document(path), overrides)
    variation = read_variation(document)
    checked: dict[str, Scenario] = {}
    cases = []
    chosen = chosen_cases(variation, wanted, path, seed)
    for done, case in enumerate(chosen, 1):
        put = with_case(document, case)
        # Cases that differ only in their seed share a scenario.
        key = json.dumps(put.data)
        if key not in checked:
            checked[key] = _checked_case(put, case, _context(path.parent, may_import, is_test=is_test))
        cases.append((case, checked[key]))
        if watch is not None:
            watch(done, len(chosen))
    return ScenarioCases(document, variation, tuple(cases))


@dataclass(frozen=True, slots=True)
class SpaceReader:
    """A scenario file with a space, read once; `case` is the one whose values the space replaces."""

    variation: Variation
    case: Case
    document: Document
    context: Mapping[str, Any]

    def load(self, drawn: Mapping[str, Value], seed: int) -> tuple[Case, Scenario]:
        """Load and check the case with other values of the space; InputError if it does not fit."""
        case = self.variation.drawn_case(self.case, drawn, seed)
        return case, _checked_case(with_case(self.document, case), case, self.context)


def read_space(
    path: Path, overrides: Iterable[str], wanted: str, may_import: MayImport = import_anything
) -> SpaceReader:
    """Read a scenario file with a space; `wanted` selects one case of ``vary`` as in `load_cases`."""
    document = _overridden(read_scenario_document(path), overrides)
    variation = read_variation(document)
    if not variation.space:
        raise InputError(
            f"{path}: space is missing; declare what is drawn, such as space: {{fog: {{loguniform: [20 m, 1 km]}}}}"
        )
    chosen = chosen_cases(variation, wanted, path)
    if len(chosen) > 1:
        raise InputError(
            f"{path}: a campaign is of one case of vary, and {len(chosen)} are there; choose one with --case"
        )
    return SpaceReader(variation, chosen[0], document, _context(path.parent, may_import, is_test=True))


def check_configuration(config: Path) -> None:
    """Raise InputError unless a file's first element is that of a SUMO configuration."""
    if _is_folder(config):
        there = sorted(one.name for one in config.glob("*.sumocfg"))
        raise InputError(f"{config} is a folder; expected a SUMO configuration; in it: {', '.join(there) or 'none'}")
    if not _is_file(config):
        raise InputError(_no_file(Document(config, {}, {}), config.parent, ("traffic", "config"), Path(config.name)))
    check_sumo_file("config", config)


def scenario_from_config(
    config: Path,
    ego: str,
    overrides: Iterable[str] = (),
    *,
    others_add_vehicles: bool = False,
    may_import: MayImport = import_anything,
) -> Scenario:
    """Make a scenario of a SUMO configuration.

    Parameters
    ----------
    config : Path
        The ``.sumocfg`` file.
    ego : str
        Id of the vehicle that becomes the ego.
    overrides : iterable of str
        ``key.path=value`` each; the fog must be among them.
    others_add_vehicles, may_import
        As in `load_scenario`.

    Raises
    ------
    InputError
        If anything does not fit.
    """
    check_configuration(config)
    traffic = {"config": config.name, "ego": ego, "warm_up_limit_s": DAY}
    document = Document(config, _bare(config.stem, traffic), {})
    return _checked(document, overrides, _context(config.parent, may_import), closed_demand=not others_add_vehicles)


def attached_scenario(ego: str, overrides: Iterable[str]) -> Scenario:
    """Scenario of a running simulation, which names no files; the overrides must set the fog."""
    document = Document(Path("attached"), _bare("attached", {"ego": ego}), {})
    return _checked(document, overrides, _context(Path()), named_files=False)


def _bare(name: str, traffic: dict[str, Any]) -> dict[str, Any]:
    return {"name": re.sub(r"[^A-Za-z0-9_.-]", "_", name), "duration_s": _LONG_RUN, "traffic": traffic}


@checked_parameters
def override(
    scenario: Scenario,
    overrides: Iterable[str],
    *,
    others_add_vehicles: bool = False,
    may_import: MayImport = import_anything,
) -> Scenario:
    """Copy of a scenario with ``key.path=value`` overrides; InputError if it does not fit."""
    document = Document(scenario.directory / SCENARIO_FILE, resolved(scenario), {})
    context = _context(scenario.directory, may_import)
    return _checked(document, overrides, context, closed_demand=not others_add_vehicles)


def clock_settings(step: float, camera: float, decision: float) -> list[str]:
    """Overrides that set the traffic step, the camera period and the decision period [s]."""
    times = {"traffic_step": step, "camera_period": camera, "decision_period": decision}
    return [f"clocks.{key}_s={float(time)!r}" for key, time in times.items()]


def _checked(
    document: Document,
    overrides: Iterable[str],
    context: Mapping[str, Any],
    named_files: bool = True,
    closed_demand: bool = True,
) -> Scenario:
    document = _overridden(document, overrides)
    case = read_variation(document).cases[0]
    return _checked_case(with_case(document, case), case, context, named_files, closed_demand)


def _overridden(document: Document, overrides: Iterable[str]) -> Document:
    """Copy of a document with overrides, without the block ``sut`` around its keys."""
    if isinstance(overrides, str):
        raise InputError(f"overrides must be a list of key.path=value each, got the text {shown(overrides)}")
    overrides = tuple(one for text in overrides for one in without_sut_in_path(text))

    def change(one: Document) -> Document:
        one = without_sut(one)
        return replace(one.overridden(overrides), data=apply_overrides(one.data, overrides))

    return document.changed(change)


def _checked_case(
    document: Document, case: Case, context: Mapping[str, Any], named_files: bool = True, closed_demand: bool = True
) -> Scenario:
    """Scenario of a case; its mistakes name the case."""
    try:
        return _checked_scenario(document, context, named_files, closed_demand)
    except InputError as error:
        if not case.label:
            raise
        raise InputError(f"{error}\nin the case {case.label}") from error


def _checked_scenario(
    document: Document, context: Mapping[str, Any], named_files: bool, closed_demand: bool
) -> Scenario:
    document, unfit = with_units_in_keys(document, Scenario)
    if unfit:
        raise InputError("\n".join(unfit))
    data = document.data
    mistakes = _unnamed_files(document, data) if named_files else []
    try:
        scenario = Scenario.model_validate(data, context={**context, "is_shortened": _is_shortened(document, context)})
        scenario = scenario.model_copy(update={"directory": context["folder"]})
    except ValidationError as error:
        raise InputError(mistake_lines(document, Scenario, error, mistakes, _BESIDE)) from error
    # A running simulation, or one of another simulator, keeps its own time.
    uncountable = step_mistake(scenario.clocks) if named_files else None
    if uncountable:
        key_path = ("clocks", "traffic_step_s")
        mistakes.append(f"{document.where(key_path)}: {dotted(key_path)}: {uncountable}")
    if mistakes:
        raise InputError("\n".join(mistakes))
    refused = option_lines(document, scenario, own_simulation=named_files) or trigger_mistakes(document, scenario)
    if refused:
        raise InputError("\n".join(refused))
    _check_files(document, scenario)
    files = _placed_files(document, scenario)
    _check_departures(document, scenario)
    scenario = with_way(scenario)
    end = math.inf if _is_shortened(document, context) else last_time(scenario)
    unknown = demand_mistakes(document, scenario, files, end) if named_files and closed_demand else []
    if unknown:
        raise InputError("\n".join(unknown))
    return scenario


def _is_shortened(document: Document, context: Mapping[str, Any]) -> bool:
    """Whether a run may end before its expectations are decided: an override set its end, and it is no test."""
    is_set = document.is_overridden(("duration_s",)) or not document.is_written(("expect",))
    return is_set and not context["is_test"]


_TRAFFIC = "it is required, or road (a road by template) in its place"


def _unnamed_files(document: Document, data: dict[str, Any]) -> list[str]:
    """Required files that a scenario does not name; the schema cannot express alternatives of keys."""
    traffic = data.get("traffic")
    if data.get("road") is not None:
        return []
    if "traffic" not in data:
        # A misspelt key is reported as such, and not as missing.
        if any(nearest(key, Scenario.model_fields) == "traffic" for key in data):
            return []
        return [f"{document.where(('traffic',))}: traffic: this key is missing; {_TRAFFIC}"]
    if not isinstance(traffic, dict):
        return []
    meant = {nearest(key, Traffic.model_fields): value for key, value in traffic.items()}
    if meant.get("config") is not None:
        return []
    what = "net with routes is required, or config (a SUMO configuration) in their place"
    needed = ("net",) if data.get("actors") else ("net", "routes")
    places = [("traffic", key) for key in needed if meant.get(key) in (None, "", [])]
    return [f"{document.where(place)}: {dotted(place)}: this key is missing; {what}" for place in places]


def _check_files(document: Document, scenario: Scenario) -> None:
    traffic = scenario.traffic
    named: list[tuple[KeyPath, Path]] = [
        (("traffic", key), path) for key, path in (("config", traffic.config), ("net", traffic.net)) if path is not None
    ]
    named += [(("traffic", "routes", i), p) for i, p in enumerate(traffic.routes)]
    named += [(("traffic", "additional", i), p) for i, p in enumerate(traffic.additional)]
    missing = [(key_path, path) for key_path, path in named if not _is_file(scenario.directory / path)]
    if missing:
        raise InputError("\n".join(_no_file(document, scenario.directory, *one) for one in missing))
    mistakes = []
    for key_path, path in named:
        try:
            check_sumo_file(str(key_path[1]), scenario.directory / path)
            if path == traffic.config:
                check_configured_files(scenario.directory / path)
            else:
                check_outputs((scenario.directory / path,))
        except InputError as error:
            mistakes.append(f"{document.where(key_path)}: {dotted(key_path)}: {error}")
    if mistakes:
        raise InputError("\n".join(mistakes))


def _check_departures(document: Document, scenario: Scenario) -> None:
    try:
        entering_vehicles(scenario)
    except PlacementError as error:
        for number, entry in enumerate(scenario.timeline):
            if error.actor in entry.do:
                at: KeyPath = ("timeline", number, "do", error.actor)
                raise InputError(f"{document.where(at)}: {dotted(at)}.depart: {error.message}") from error
        raise


def _placed_files(document: Document, scenario: Scenario) -> TrafficFiles:
    try:
        return traffic_files(scenario)
    except (PlacementError, DemandError) as error:
        at = ("actors", error.actor) if isinstance(error, PlacementError) else ("demand", *error.key.split("."))
        raise InputError(f"{document.where(at)}: {dotted(at)}: {error.message}") from error
    except InputError as error:
        raise InputError(f"{document.where(('road',))}: road: {error}") from error


def _no_file(document: Document, directory: Path, key_path: KeyPath, path: Path) -> str:
    is_folder = _is_folder(directory / path)
    folder = directory / path if is_folder else (directory / path).parent
    pattern = "*.sumocfg" if key_path[-1] == "config" else "*.xml"
    there = sorted(p.name for p in folder.glob(pattern)) if _is_folder(folder) else []
    return (
        f"{document.where(key_path)}: {dotted(key_path)}: there is {'a folder and ' if is_folder else ''}no file "
        f"{shown(str(path))} in {directory}; {suggest(path.name, there)}"
    )
