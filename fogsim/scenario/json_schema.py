"""The schema of FogSim's files as JSON Schema, by which editors complete and check what is written."""

import math
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel

from fogsim.advice import ADVISERS, CONTROLLERS
from fogsim.core.registry import Registry
from fogsim.estimators import ESTIMATORS
from fogsim.fusion import FUSIONS
from fogsim.lighting import LIGHTING_POLICIES
from fogsim.scenario.runnable import Scenario
from fogsim.scenario.system_under_test import BLOCK, KEYS
from fogsim.scenario.variation import VariationKeys
from fogsim.traffic import SPEED_CHOICES
from fogsim.units.quantities import UNIT_OF_SUFFIX

_DIALECT = "https://json-schema.org/draft/2020-12/schema"
"""Which JSON Schema it is."""

_METHODS: Mapping[str, Registry[Any]] = {
    "estimators": ESTIMATORS,
    "fusion": FUSIONS,
    "advice": ADVISERS,
    "controller": CONTROLLERS,
    "lighting": LIGHTING_POLICIES,
}

_NUMBER = r"^\s*([-+]?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?|[-+]?inf)\s*"
_PER_CENT = {"type": "string", "pattern": _NUMBER + r"%\s*$"}
_WITH_UNIT = {"type": "string", "pattern": _NUMBER + r"\S.*$"}
_VARIED = {"type": "string", "pattern": r"\$", "description": "A name of `vary`."}
_ENDLESS = {"enum": ["inf", "infinity", ".inf"]}
_SCALARS = {"number", "integer", "string", "boolean"}


def scenario_json_schema() -> dict[str, Any]:
    """JSON Schema of a scenario file."""
    schema, beside = json_schema(Scenario), json_schema(VariationKeys)
    written = schema["properties"]
    written.update(beside["properties"])
    schema["$defs"].update(beside["$defs"])
    for key, registry in _METHODS.items():
        written[key] = _methods(written[key], registry)
    beside_road = schema["$defs"]["RoadsideCamera"]["properties"]
    beside_road["estimator"] = _methods(beside_road["estimator"], ESTIMATORS)
    drivers = schema["$defs"]["DriversSection"]["properties"]
    drivers["speed_choice"] = _methods(drivers["speed_choice"], SPEED_CHOICES)
    written[BLOCK] = {
        "type": "object",
        "description": "What is under test: keys that may stand by themselves too.",
        "additionalProperties": False,
        "properties": {key: written[key] for key in KEYS},
    }
    return schema


def json_schema(model: type[BaseModel]) -> dict[str, Any]:
    """JSON Schema of a file, with every way to write its values: with a unit, in per cent, or as a name of ``vary``."""
    schema = model.model_json_schema()
    blocks = [schema, *schema.get("$defs", {}).values()]
    for block in blocks:
        if "properties" in block:
            _open(block)
    return {"$schema": _DIALECT, **schema}


def _open(block: dict[str, Any]) -> None:
    """Let the keys of a block be written in all their ways."""
    required: list[str] = block.pop("required", [])
    written: dict[str, Any] = {}
    either: list[dict[str, Any]] = []
    for key, value in block["properties"].items():
        endless = [_ENDLESS] if any(way.get("or") == "inf" for way in (value, *value.get("anyOf", ()))) else []
        written[key] = _opened(value)
        stem, _, suffix = key.rpartition("_")
        if stem and suffix in UNIT_OF_SUFFIX and stem not in block["properties"]:
            description = (
                f"{value.get('description', '')} A number with its unit: `10 {UNIT_OF_SUFFIX[suffix]}`.".strip()
            )
            ways = [_WITH_UNIT, {"const": 0}, _VARIED, *endless]
            if any(way.get("type") == "array" for way in (value, *value.get("anyOf", ()))):
                ways.append({"type": "array", "items": {"anyOf": [_WITH_UNIT, {"const": 0}, _VARIED]}})
            written[stem] = {"anyOf": ways, "description": description}
            if key in required:
                either.append({"anyOf": [{"required": [key]}, {"required": [stem]}]})
        elif key in required:
            either.append({"required": [key]})
    block["properties"] = written
    if either:
        block["allOf"] = either


def _opened(value: dict[str, Any]) -> dict[str, Any]:
    """What a value may be, and a name of ``vary`` in place of a number or a word."""
    annotations: dict[str, Any] = {key: value[key] for key in ("description", "title") if key in value}
    plain = {key: part for key, part in value.items() if key not in {"description", "title", "default", "or"}}
    default = value.get("default")
    if isinstance(default, float) and math.isinf(default):
        annotations["default"] = "inf"
    elif "default" in value and not isinstance(default, dict | list):
        annotations["default"] = default
    if "const" in plain:
        return {**plain, **annotations}
    ways = list(plain["anyOf"]) if "anyOf" in plain else [plain]
    for way in tuple(ways):
        if way.pop("or", value.get("or")) == "inf":
            ways.append(_ENDLESS)
        if way.get("type") == "number" and way.get("minimum", -2) >= -1 and way.get("maximum", 2) <= 1:
            ways.append(_PER_CENT)
        elif way.get("type") == "object" and "additionalProperties" in way:
            # Shares by name: one of them may be written as its name.
            ways.append({"type": "string"})
            if isinstance(way["additionalProperties"], dict) and way["additionalProperties"].get("type") == "number":
                way["additionalProperties"] = _opened(way["additionalProperties"])
    is_varied = any(way.get("type") in _SCALARS or "enum" in way for way in ways)
    return (
        {"anyOf": [*ways, _VARIED] if is_varied else ways, **annotations}
        if len(ways) > 1 or is_varied
        else {**ways[0], **annotations}
    )


def _methods(value: dict[str, Any], registry: Registry[Any]) -> dict[str, Any]:
    """What names a method, or several."""
    files = "".join(rf"|^{kind}:." for kind in registry.files)
    names = [{"enum": registry.known}, {"type": "string", "pattern": rf"^[\w.]+:\w+$|\${files}"}]
    if value.get("type") == "array":
        return {**value, "items": {"anyOf": [*names, value["items"]]}}
    block = {key: part for key, part in value.items() if key != "description"}
    return {"anyOf": [*names, block], "description": value["description"]}
