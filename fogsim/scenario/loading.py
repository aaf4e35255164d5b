"""From a scenario file to a checked `Scenario`; a mistake is told with file, line, key, value and what is allowed."""

import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from fogsim.errors import InputError, suggest
from fogsim.scenario.document import Document, KeyPath, dotted, read_document
from fogsim.scenario.locating import SCENARIO_FILE, scenario_file
from fogsim.scenario.methods import MISTAKE
from fogsim.scenario.overrides import apply_overrides
from fogsim.scenario.schema import Scenario
from fogsim.scenario.traffic_schema import AnyEvent
from fogsim.traffic.configuration import configured_files

LONG_RUN = 600.0
"""Longest run of a simulation that is the user's own [s]."""

DAY = 86_400.0
"""Simulated time within which the ego of a simulation of the user's own must appear [s]."""


def load_scenario(name_or_path: str | Path, overrides: Iterable[str] = ()) -> Scenario:
    """Load and check a scenario.

    Parameters
    ----------
    name_or_path : str or Path
        A name in the catalogue, a scenario file, or a folder that holds ``scenario.yaml``.
    overrides : iterable of str
        ``key.path=value`` each, put in place of the file's values.

    Returns
    -------
    Scenario
        The scenario, with the folder that its file names are relative to.

    Raises
    ------
    InputError
        If anything does not fit; one line for each mistake, with file, line, key path, value and what is allowed.
    """
    path = scenario_file(name_or_path)
    return _checked(read_document(path), overrides, path.parent)


def scenario_from_config(config: Path, ego: str, overrides: Iterable[str] = ()) -> Scenario:
    """Make a scenario of a SUMO configuration.

    Parameters
    ----------
    config : Path
        The ``.sumocfg`` file.
    ego : str
        Id of the vehicle that becomes the ego.
    overrides : iterable of str
        ``key.path=value`` each; the fog must be among them.

    Raises
    ------
    InputError
        If anything does not fit.
    """
    traffic = {"config": config.name, "ego": ego, "warm_up_limit_s": DAY}
    return _checked(Document(config, _bare(config.stem, traffic), {}), overrides, config.parent)


def attached_scenario(ego: str, overrides: Iterable[str]) -> Scenario:
    """Make a scenario of a simulation that runs already, so that it names no files.

    Parameters
    ----------
    ego : str
        Id of the vehicle that becomes the ego.
    overrides : iterable of str
        ``key.path=value`` each; the fog must be among them.

    Raises
    ------
    InputError
        If anything does not fit.
    """
    document = Document(Path("attached"), _bare("attached", {"ego": ego}), {})
    return _checked(document, overrides, Path(), named_files=False)


def _bare(name: str, traffic: dict[str, Any]) -> dict[str, Any]:
    return {"name": re.sub(r"[^A-Za-z0-9_.-]", "_", name), "duration_s": LONG_RUN, "traffic": traffic}


def override(scenario: Scenario, overrides: Iterable[str]) -> Scenario:
    """Copy of a scenario with single keys changed.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    overrides : iterable of str
        ``key.path=value`` each.

    Raises
    ------
    InputError
        If the changed scenario does not fit.
    """
    document = Document(scenario.directory / SCENARIO_FILE, resolved(scenario), {})
    return _checked(document, overrides, scenario.directory)


def resolved(scenario: Scenario) -> dict[str, Any]:
    """A scenario as plain data with every default filled in, fit for JSON; endless visibility is written "inf"."""
    data: dict[str, Any] = _without_infinities(scenario.model_dump(mode="json", exclude_none=True))
    return data


def _without_infinities(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_infinities(v) for key, v in value.items()}
    if isinstance(value, list):
        return [_without_infinities(v) for v in value]
    return "inf" if value == math.inf else value


def _checked(document: Document, overrides: Iterable[str], folder: Path, named_files: bool = True) -> Scenario:
    overrides = tuple(overrides)
    data = apply_overrides(document.data, overrides)
    document = document.overridden(overrides)
    mistakes = _unnamed_files(document, data) if named_files else []
    try:
        scenario = Scenario.model_validate({**data, "directory": folder})
    except ValidationError as error:
        mistakes = [_told(document, detail) for detail in _without_consequences(error.errors())] + mistakes
    if mistakes:
        raise InputError("\n".join(mistakes))
    _check_files(document, scenario)
    return scenario


def _unnamed_files(document: Document, data: dict[str, Any]) -> list[str]:
    """Say which files a scenario does not name, and must; the schema knows no keys of which either one or others do."""
    traffic = data.get("traffic")
    if not isinstance(traffic, dict) or traffic.get("config") is not None:
        return []
    what = "net with routes is required, or config (a SUMO configuration) in their place"
    where = document.where(("traffic",))
    return [f"{where}: traffic.{key}: this key is missing; {what}" for key in ("net", "routes") if not traffic.get(key)]


def _without_consequences(details: Sequence[ErrorDetails]) -> list[ErrorDetails]:
    """Mistakes that are not there for another's sake: a list whose entries are wrong is not too short."""
    places = [detail["loc"] for detail in details]
    return [d for d in details if not any(len(p) > len(d["loc"]) and p[: len(d["loc"])] == d["loc"] for p in places)]


def _told(document: Document, detail: ErrorDetails) -> str:
    """One mistake in one line."""
    location: KeyPath = tuple(detail["loc"])
    key_path = _without_kinds(location)
    where = f"{document.where(key_path)}: {dotted(key_path) or 'scenario'}"
    if detail["type"] == "extra_forbidden":
        return f"{where}: unknown key; {suggest(str(key_path[-1]), _known_keys(location[:-1]))}"
    if detail["type"] == "union_tag_invalid":
        context = detail["ctx"]
        allowed = [kind.strip(" '") for kind in str(context["expected_tags"]).split(",")]
        return f"{where}.kind: unknown kind {context['tag']!r}; {suggest(str(context['tag']), allowed)}"
    if detail["type"] == "union_tag_not_found":
        return f"{where}.kind: this key is missing; it is required"
    if detail["type"] == "missing":
        return f"{where}: this key is missing; it is required"
    if detail["type"] == MISTAKE:
        return f"{where}: {detail['msg']}"
    message = detail["msg"].removeprefix("Value error, ")
    value = detail["input"]
    # A message about a whole block names the values that it is about itself.
    shown = "" if isinstance(value, dict | BaseModel) else f"; got {value!r}"
    return f"{where}: {message[0].lower()}{message[1:]}{shown}"


def _without_kinds(location: KeyPath) -> KeyPath:
    """Key path of a mistake: pydantic puts the kind of a list's entry behind its place, where files have no key."""
    kinds = _kinds()
    return tuple(
        key
        for key, before in zip(location, (None, *location), strict=False)
        if not (isinstance(before, int) and key in kinds)
    )


def _kinds() -> dict[str, type[BaseModel]]:
    """Models of list entries by their kind."""
    models = (*get_args(get_args(AnyEvent)[0]),)
    return {str(get_args(model.model_fields["kind"].annotation)[0]): model for model in models}


def _known_keys(location: Sequence[str | int]) -> list[str]:
    """Keys that the schema allows at a location."""
    model: Any = Scenario
    for before, key in zip((None, *location), location, strict=False):
        if isinstance(key, int):
            continue
        if isinstance(before, int) and key in _kinds():
            model = _kinds()[str(key)]
        else:
            model = _model_in(model.model_fields[key].annotation)
    return [name for name, field in model.model_fields.items() if not field.exclude]


def _model_in(annotation: object) -> Any:
    """First model class inside an annotation such as ``tuple[Bank, ...]``."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((model for part in get_args(annotation) if (model := _model_in(part)) is not None), None)


def _check_files(document: Document, scenario: Scenario) -> None:
    traffic = scenario.traffic
    named: list[tuple[KeyPath, Path]] = [
        (("traffic", key), path) for key, path in (("config", traffic.config), ("net", traffic.net)) if path is not None
    ]
    named += [(("traffic", "routes", i), p) for i, p in enumerate(traffic.routes)]
    named += [(("traffic", "additional", i), p) for i, p in enumerate(traffic.additional)]
    for key_path, path in named:
        if not (scenario.directory / path).is_file():
            pattern = "*.sumocfg" if key_path[-1] == "config" else "*.xml"
            there = sorted(p.name for p in (scenario.directory / path).parent.glob(pattern))
            raise InputError(
                f"{document.where(key_path)}: {dotted(key_path)}: there is no file {str(path)!r} in "
                f"{scenario.directory}; {suggest(path.name, there)}"
            )
    if traffic.config is not None:
        configured_files(scenario.directory / traffic.config)
