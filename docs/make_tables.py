"""Write those tables of the docs that come from the code: ``python docs/make_tables.py`` (a test holds them to it)."""

import inspect
import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import astuple, fields
from functools import partial
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

from page_tables import filled, lines_of
from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from fogsim.advice import ADVISERS, CONTROLLERS
from fogsim.conditions import SIGNALS
from fogsim.core.parameters import accepted_parameters, mismatch
from fogsim.estimators import ESTIMATORS
from fogsim.estimators.huang2015_medians import Huang2015Repair
from fogsim.estimators.negru2013 import Negru2013Repair
from fogsim.estimators.repairs import Repair
from fogsim.estimators.zhu2015_road import Zhu2015Repair
from fogsim.fusion import FUSIONS
from fogsim.lighting import LIGHTING_POLICIES
from fogsim.lighting.legal import LAWS
from fogsim.metrics import metric_definitions
from fogsim.openscenario.actions import ACTIONS, LAMPS
from fogsim.openscenario.environment import CLASSES
from fogsim.openscenario.positions import POSITIONS
from fogsim.openscenario.triggers import CONDITIONS
from fogsim.openscenario.xml_tree import HARMLESS, REFUSED
from fogsim.recorders.events import EVENT_COLUMNS
from fogsim.recorders.table_columns import Column, table_columns, traffic_table_columns
from fogsim.recorders.trajectories import TRAJECTORY_COLUMNS
from fogsim.scenario import Scenario
from fogsim.scenario.section import GIVEN_BY_THE_LOOP, Method, key_descriptions
from fogsim.scenario.sensors.faults import FaultSection
from fogsim.scenario.timeline import TimelineEntry
from fogsim.scene import SIGN_KINDS
from fogsim.traffic import COMPLIANCES, FOLLOWING_MODELS, SPEED_CHOICES
from fogsim.traffic.drivers.following import OBSERVED_MIXTURE

HERE = Path(__file__).resolve().parent


def scenario_keys(model: type[BaseModel] = Scenario, prefix: str = "") -> list[tuple[str, ...]]:
    """Key, default, what is allowed, and meaning of every key; N stands for a place in a list, NAME for a name."""
    rows: list[tuple[str, ...]] = []
    schema = model.model_json_schema()
    for name, field in model.model_fields.items():
        if field.exclude:
            continue
        inner = [model for model in _models_in(field.annotation) if model is not Method]
        if model is TimelineEntry:
            # What is wrong with sensors is told where it stands for the whole run.
            inner = [one for one in inner if not issubclass(one, FaultSection)]
        if not inner or _has_words(field.annotation):
            # Where a word may stand, a block next to it is told in the same row.
            inner = []
            key = field.alias or name
            allowed = _allowed(schema["properties"][key], schema.get("$defs", {}))
            told = " ".join(key_descriptions(model).get(name, "").split())
            rows.append((f"`{prefix}{key}`", _default(field), allowed, told))
        by_name = get_origin(field.annotation) is dict
        place = ".NAME" if by_name else ".N" if "tuple" in str(field.annotation) else ""
        for model_inside in inner:
            more = scenario_keys(model_inside, f"{prefix}{name}{place}.")
            # Kinds of one list share keys: each is told once.
            rows += [row for row in more if row not in rows]
    return rows


def _default(field: FieldInfo) -> str:
    value = field.get_default(call_default_factory=True, validated_data={})
    if value is PydanticUndefined:
        return "required"
    if value is None or value == "":
        return "none"
    if isinstance(value, tuple):
        return "`[" + ", ".join(str(getattr(v, "method", v)) for v in value) + "]`"
    return f"`{getattr(value, 'method', value)}`"


def _allowed(schema: dict[str, Any], definitions: dict[str, Any]) -> str:
    """What a value may be by its JSON schema, in words."""
    if "$ref" in schema:
        schema = definitions[schema["$ref"].rpartition("/")[2]]
    if "anyOf" in schema:
        parts = [part for part in schema["anyOf"] if part.get("type") != "null"]
        return schema.get("format") or " or ".join(_allowed(part, definitions) for part in parts)
    if "enum" in schema or "const" in schema:
        return ", ".join(f"`{value}`" for value in schema.get("enum") or [schema["const"]])
    return _allowed_of_type(schema, definitions)


def _allowed_of_type(schema: dict[str, Any], definitions: dict[str, Any]) -> str:
    if schema["type"] == "array":
        inner = schema["items"] if "items" in schema else schema["prefixItems"][0]
        return f"list of {_allowed(inner, definitions)}"
    shares = next(iter(schema.get("patternProperties", {}).values()), schema.get("additionalProperties"))
    if isinstance(shares, dict) and "minimum" in shares:
        schema = shares
    if isinstance(shares, dict) and "enum" in shares:
        return f"by name, each {_allowed(shares, definitions)}"
    keys = schema.get("properties", {})
    if keys and "method" not in keys:
        return f"block of {', '.join(f'`{key}`' for key in keys)}"
    if "minimum" not in schema:
        words = {"boolean": "true, false", "string": schema.get("format", "text")}
        return words.get(schema["type"], "by name, each a truth value, number or text" if shares else "method")
    kind = "whole, " if schema["type"] == "integer" else "by name, each " if shares else ""
    return f"{kind}{schema['minimum']:.6g} … {schema['maximum']:.6g}" + (" or inf" if "or" in schema else "")


def _models_in(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for part in get_args(annotation) for model in _models_in(part)]


def _has_words(annotation: Any) -> bool:
    return get_origin(annotation) is Literal or any(_has_words(part) for part in get_args(annotation))


def columns(found: Sequence[Column[Any]]) -> list[tuple[str, ...]]:
    """Columns of steps.parquet."""
    return [(f"`{column.name}`", str(column.kind), column.meaning) for column in found]


def columns_by_name(found: Mapping[str, tuple[Any, str]]) -> list[tuple[str, ...]]:
    """Columns of ``trajectories.parquet`` or ``events.parquet``."""
    return [(f"`{name}`", str(kind), meaning) for name, (kind, meaning) in found.items()]


def metrics() -> list[tuple[str, ...]]:
    """Keys of metrics.json."""
    ranks = {"lower": "lower is better", "higher": "higher is better", None: "–"}
    return [
        (
            *(f"`{key}`", one.meaning.replace("|", "\\|"), one.numerator or "–", one.denominator),
            *("yes" if one.denominator_moves else "no", ranks[one.better]),
        )
        for key, one in metric_definitions().items()
    ]


def signals() -> list[tuple[str, ...]]:
    """Signals of conditions."""
    return [
        (f"`{name}`", signal.stated_in or signal.kind.value, signal.meaning, ", ".join(sorted(signal.needs)))
        for name, signal in SIGNALS.items()
    ]


def signs() -> list[tuple[str, ...]]:
    """Kinds of signs that have a face of their own."""
    return [(f"`{name}`", kind.code, kind.meaning) for name, kind in SIGN_KINDS.items()]


def repairs(kind: type[Repair]) -> list[tuple[str, ...]]:
    """Repairs of a paper's method: name, what the paper has, and what is done instead."""
    return [(f"`{one.value}`", one.paper, one.corrected) for one in kind]


def parameters() -> list[tuple[str, ...]]:
    """Parameters of every method that a scenario can name, with what they may be."""
    rows = []
    for registry in (ESTIMATORS, FUSIONS, ADVISERS, CONTROLLERS, LIGHTING_POLICIES, SPEED_CHOICES):
        for name, method in registry.items():
            meanings = _meanings(method)
            for key, parameter in accepted_parameters(method, GIVEN_BY_THE_LOOP).items():
                default = _shown_default(parameter.default)
                allowed = (mismatch(parameter.annotation, object()) or "").replace("a whole number", "whole,")
                rows.append((f"`{name}`", f"`{key}`", default, allowed.removeprefix("a number "), meanings[key]))
    return rows


def laws() -> list[tuple[str, ...]]:
    """Rules of lighting by country, each with its source."""
    told = {
        "rear_fog_below": "rear fog lamps below",
        "front_fog_below": "front fog lamps below",
        "high_beam_from": "high beams from",
        "near_lead": "no high beams on who is ahead within",
    }
    return [
        (f"`{country}`", what, f"{getattr(law, name):g}", law.sources[name])
        for country, law in LAWS.items()
        for name, what in told.items()
    ]


def _shown_default(default: object) -> str:
    """A parameter's default value as a table shows it."""
    if default is None or default is inspect.Parameter.empty:
        return "none" if default is None else "required"
    if isinstance(default, tuple):
        return f"`[{', '.join(f'{number:.4g}' for number in default)}]`"
    return f"`{default:.4g}`" if type(default) is float else f"`{default}`"


def _meanings(method: object) -> dict[str, str]:
    """Meaning of each parameter, those that a class has from its bases included."""
    bases = reversed(method.__mro__) if isinstance(method, type) else (method,)
    return {key: meaning for base in bases for key, meaning in _described(base).items()}


def _described(method: object) -> dict[str, str]:
    """Meaning of each parameter, from a docstring in numpydoc's form."""
    text = re.search(r"\n(?:Parameters|Attributes)\n-+\n(.*?)(?=\n\n|\Z)", inspect.getdoc(method) or "", re.DOTALL)
    meanings = {}
    for names, told in re.findall(r"^(\S[^:]*) : [^\n]*\n((?: .*\n?)+)", text.group(1) if text else "", re.MULTILINE):
        meanings |= dict.fromkeys(names.split(", "), " ".join(told.split()))
    return meanings


def speed_choices() -> list[tuple[str, ...]]:
    """How drivers may choose their speed in fog."""
    return [(f"`{name}`", _said(choice)) for name, choice in SPEED_CHOICES.items()]


def kinds_of_drivers() -> list[tuple[str, ...]]:
    """How drivers may follow, with their parameters and the share of the default mixture."""
    return [
        (f"`{name}`", _said(model), _constants(model), f"{OBSERVED_MIXTURE.get(name, 0.0):g}")
        for name, model in FOLLOWING_MODELS.items()
    ]


def _said(thing: object) -> str:
    """First paragraph of a docstring."""
    return (inspect.getdoc(thing) or "").partition("\n\n")[0]


def _constants(model: Any) -> str:
    values = {field.name: getattr(model, field.name) for field in fields(model)}
    return ", ".join(f"{name} {value:g}" for name, value in values.items() if not isinstance(value, bool))


def compliances() -> list[tuple[str, ...]]:
    """Kinds of advice, with what drivers do."""
    return [(f"`{name}`", *(f"{value:g}" for value in astuple(how))) for name, how in COMPLIANCES.items()]


VALUES = {
    "SimulationTimeCondition": "`time`.",
    "ParameterCondition": "`happened(EVENT)` that sets it, if that makes a difference; otherwise always or never.",
    "VariableCondition": "As `ParameterCondition`.",
    "StoryboardElementStateCondition": "`happened(EVENT)`, for states of beginning, and of being over by the time that "
    "the actions take.",
}
"""Conditions of OpenSCENARIO files by value, and what becomes of them."""


def openscenario_elements() -> list[tuple[str, ...]]:
    """Elements of OpenSCENARIO files that are read."""
    kinds = {f"vehicleCategory {kind}": f"SUMO's class `{name}`." for kind, name in CLASSES.items()}
    lamps = {f"vehicleLightType {kind}": ", ".join(f"`{one}`" for one in named) for kind, named in LAMPS.items()}
    read = {tag: inspect.getdoc(method) or "" for tag, method in {**POSITIONS, **ACTIONS, **CONDITIONS}.items()}
    return [(f"`{element}`", told) for table in (read, VALUES, kinds, lamps) for element, told in table.items()]


def openscenario_honoured() -> list[tuple[str, ...]]:
    """Elements of OpenSCENARIO files that are honoured, with their attributes that are."""
    decided, honoured = {*HARMLESS, *REFUSED}, {}
    for line in (HERE.parent / "tests" / "data" / "openscenario_1_3.txt").read_text(encoding="utf-8").splitlines():
        name, *keys = line.split()
        if name not in {"#", *decided}:
            honoured[name] = ", ".join(f"`{key}`" for key in sorted(keys) if f"{name}@{key}" not in decided)
    rows = [(f"`{name}`", keys) for name, keys in sorted(honoured.items()) if keys]
    return [*rows, (", ".join(f"`{name}`" for name, keys in sorted(honoured.items()) if not keys), "none")]


def openscenario_reasons(decided: Mapping[str, str]) -> list[tuple[str, ...]]:
    """Elements and attributes of OpenSCENARIO files by the reason why they are harmless or refused."""
    reasons = dict.fromkeys(decided.values())
    return [(", ".join(f"`{name}`" for name, told in decided.items() if told == why), why) for why in reasons]


TABLES = {
    "explanation/drivers.md": {
        "speeds": (("name", "speed in fog"), speed_choices),
        "kinds": (("kind", "how they follow", "constants [s], [m], [-]", "share by default"), kinds_of_drivers),
        "compliances": (
            ("`like`", "`reached_share`", "`rate`", "`strength`", "`delay_s`", "`trust`", "`foreseen`"),
            compliances,
        ),
    },
    "benchmarks/papers.md": {
        f"repairs-{name}": (("repair", "the paper", "corrected (the default)"), partial(repairs, kind))
        for name, kind in (
            ("negru2013", Negru2013Repair),
            ("zhu2015", Zhu2015Repair),
            ("huang2015_rough", Huang2015Repair),
        )
    },
    "reference/scenarios.md": {
        "signs": (("kind", "code", "meaning"), signs),
        "keys": (("key", "default", "allowed", "meaning"), scenario_keys),
        "parameters": (("method", "parameter", "default", "allowed", "meaning"), parameters),
    },
    "how_to/openscenario.md": {
        "supported": (("element", "what becomes of it"), openscenario_elements),
        "honoured": (("element", "attributes"), openscenario_honoured),
        "harmless": (("elements and attributes", "why"), partial(openscenario_reasons, HARMLESS)),
        "refused": (("elements and attributes", "why"), partial(openscenario_reasons, REFUSED)),
    },
    "reference/tests.md": {"signals": (("signal", "unit or kind", "meaning", "needs"), signals)},
    "explanation/night.md": {"laws": (("rules", "what", "from, up to [m]", "source"), laws)},
    "reference/metrics.md": {
        "metrics": (("key", "meaning", "numerator", "denominator", "a policy moves it", "ranks policies"), metrics)
    },
    "reference/results.md": {
        # With those of one estimator.
        "columns": (("column", "type", "meaning"), partial(columns, table_columns(["METHOD"]))),
        "traffic_columns": (("column", "type", "meaning"), partial(columns, traffic_table_columns())),
        "trajectories": (("column", "type", "meaning"), partial(columns_by_name, TRAJECTORY_COLUMNS)),
        "events": (("column", "type", "meaning"), partial(columns_by_name, EVENT_COLUMNS)),
    },
}
"""Tables by file and marker, with their headings and rows."""


def pages() -> dict[Path, str]:
    """Every page with its tables as they should be."""
    result = {}
    for name, tables in TABLES.items():
        text = (HERE / name).read_text(encoding="utf-8")
        for marker, (headings, rows) in tables.items():
            text = filled(text, marker, lines_of(headings, rows()))
        result[HERE / name] = text
    return result


def main() -> int:
    """Write the pages, or with --check say which are not up to date."""
    stale = [path for path, text in pages().items() if path.read_text(encoding="utf-8") != text]
    if "--check" in sys.argv:
        for path in stale:
            print(f"{path.name} is not up to date: run python docs/make_tables.py")  # noqa: T201 - the line is the result
        return int(bool(stale))
    for path, text in pages().items():
        path.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
