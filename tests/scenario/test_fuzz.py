"""Every key of the schema with every wrong value: refused with its name, or the scenario runs, without a warning.

Keys come from the schema itself and from the methods' signatures, so that new ones are tried as well. To search longer,
``FOGSIM_FUZZ=5000 pytest tests/scenario/test_fuzz.py`` tries so many sets of keys and runs every value that is allowed.
"""

import contextlib
import copy
import json
import math
import os
import shutil
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, get_args, get_origin

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pydantic import BaseModel

from fogsim.advice import ADVISERS, CONTROLLERS
from fogsim.core.parameters import Range, accepted_parameters
from fogsim.errors import InputError, SimulationError
from fogsim.estimators import ESTIMATORS
from fogsim.fusion import FUSIONS
from fogsim.lighting import LIGHTING_POLICIES
from fogsim.scenario import Scenario, load_scenario
from fogsim.scenario.section import GIVEN_BY_THE_LOOP, Method
from fogsim.scene import build as scene_build
from fogsim.simulation.advised_driving import AdvisedDriving
from fogsim.simulation.loop import ClosedLoop
from fogsim.traffic import SPEED_CHOICES

FUZZ = int(os.environ.get("FOGSIM_FUZZ", "0"))
"""How many sets of keys are tried in a long search; 0 for a short one."""

ROAD = Path(__file__).resolve().parents[1] / "data" / "road"
PLAIN: dict[str, Any] = yaml.safe_load((ROAD / "scenario.yaml").read_text(encoding="utf-8"))
EVENT = {"vehicle": "lead", "at_time_s": 0.0}
EXAMPLES: dict[str, Any] = {
    "fog.banks": [{"start_m": 50.0, "end_m": 300.0, "visibility_m": 60.0}],
    "fog.patches": {"correlation_length_m": 20.0},
    "fog.wind": {"speed_kmh": 10.0, "from_deg": 90.0},
    "fog.changes": [{"at_s": 0.0}, {"at_s": 5.0}],
    "traffic.events": [
        {"kind": "brake", **EVENT},
        {"kind": "break_down", **EVENT},
        {"kind": "change_lane", "lanes": -1, **EVENT},
        {"kind": "lamps_fail", **EVENT},
    ],
}
"""Blocks that have required keys, and are there only where one of their keys is tried."""

METHODS = {
    "estimators": ESTIMATORS,
    "estimator": ESTIMATORS,
    "fusion": FUSIONS,
    "advice": ADVISERS,
    "lighting": LIGHTING_POLICIES,
    "speed_choice": SPEED_CHOICES,
    "controller": CONTROLLERS,
}

MISSING = object()
WRONG: list[Any] = [
    MISSING, None, True, False, "", "x", "5", "inf", "2026-11-22", [], [1], {}, {"x": 1}, math.nan, math.inf, -math.inf,
    0, -1, 7, 0.5, 1e308, -1e308, 1e-300, 5e-324, 10**30,
]  # fmt: skip

Path_ = tuple[str | int, ...]


class Key(NamedTuple):
    """A key that is tried: where it is, the ends of its range, and how a tried value is written there."""

    path: Path_
    ends: tuple[Any, ...] = ()
    method: str = ""

    @property
    def name(self) -> str:
        return ".".join(map(str, (*self.path, *([self.method] if self.method else []))))


def models_in(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for part in get_args(annotation) for model in models_in(part)]


def ends_of(schema: dict[str, Any], definitions: dict[str, Any]) -> tuple[Any, ...]:
    """Both ends of a range, or what can be chosen."""
    if "$ref" in schema:
        schema = definitions[schema["$ref"].rpartition("/")[2]]
    inner = [end for part in schema.get("anyOf", ()) for end in ends_of(part, definitions)]
    words = {"boolean": (True, False), "string": ("ego", "lead")}
    inner += words.get(schema.get("type", ""), ()) if "enum" not in schema else ()
    return (*inner, *schema.get("enum", ()), *(schema[end] for end in ("minimum", "maximum") if end in schema))


def keys(model: type[BaseModel] = Scenario, at: Path_ = ()) -> Iterator[Key]:
    schema = model.model_json_schema()
    for name, field in model.model_fields.items():
        if field.exclude:
            continue
        key = field.alias or name
        path = (*at, key)
        yield Key(path, ends_of(schema["properties"][key], schema.get("$defs", {})))
        inner = models_in(field.annotation)
        if Method in inner:
            for method, factory in METHODS[name].items():
                for parameter, its in accepted_parameters(factory, GIVEN_BY_THE_LOOP).items():
                    allowed = [part for part in get_args(its.annotation) if isinstance(part, Range)]
                    ends = tuple(end for one in allowed for end in (one.least, one.most)) or (True, False)
                    place = (*path, 0) if name == "estimators" else path
                    yield Key((*place, "parameters", parameter), ends, method)
        elif "tuple" in str(field.annotation):
            for number, one in enumerate(inner):
                yield from keys(one, (*path, number))
        else:
            by_name = ("one",) if get_origin(field.annotation) is dict else ()
            for one in inner:
                yield from keys(one, (*path, *by_name))


KEYS = list(keys())


def put_examples(path: Path_, data: dict[str, Any]) -> None:
    """Put the examples of the blocks around a key into plain data."""
    dotted = ".".join(map(str, path))
    for block in (block for block in EXAMPLES if dotted.startswith(f"{block}.")):
        put(data, tuple(block.split(".")), copy.deepcopy(EXAMPLES[block]), default=True)
    if dotted.startswith("fog.banks."):
        put(data, ("fog", "outside_visibility_m"), 500.0, default=True)
        data["fog"].pop("visibility_m", None)


def written(key: Key, value: Any, data: dict[str, Any]) -> None:
    """Put a value into plain data, and the examples of the blocks around it."""
    put_examples(key.path, data)
    if key.method:
        block = {"method": key.method, "parameters": {key.path[-1]: value} if value is not MISSING else {}}
        *place, _, _ = key.path
        put(data, tuple(place) if key.path[0] != "estimators" else ("estimators",), [block] if 0 in place else block)
    else:
        put(data, key.path, value)


def put(data: Any, path: Path_, value: Any, *, default: bool = False) -> None:
    for key in path[:-1]:
        data = data[key] if isinstance(data, list) else data.setdefault(key, {})
    if default and isinstance(data, dict) and path[-1] in data:
        return
    if value is not MISSING:
        data[path[-1]] = value
    elif isinstance(data, dict):
        data.pop(path[-1], None)


def yaml_of(value: Any) -> str:
    """JSON, which is YAML, with YAML's own words for what JSON has no word for."""
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)}: {yaml_of(one)}" for key, one in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(yaml_of, value)) + "]"
    return json.dumps(value)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder: Path = tmp_path_factory.mktemp("tiny")
    for name in ("road.net.xml", "road.rou.xml"):
        shutil.copy(ROAD / name, folder)
    return folder


@pytest.fixture(scope="module", autouse=True)
def _one_tree_of_a_kind() -> Iterator[None]:
    """Making trees takes most of the time until the first frame, and no key but a seed changes them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(scene_build, "tree_shapes", partial(scene_build.tree_shapes, kinds=1))
        yield


def loaded(folder: Path, text: str) -> Scenario | None:
    """The scenario; None if it is refused, as it must be: in lines that say where."""
    file = folder / "scenario.yaml"
    file.unlink(missing_ok=True)  # file systems such as ext4 wait for the disk when a file is emptied
    file.write_text(text, encoding="utf-8")
    try:
        return load_scenario(file)
    except InputError as error:
        told = str(error).splitlines()
    assert told
    assert all(line.isprintable() and line.startswith(str(file)) for line in told)
    return None


def take_two_steps(scenario: Scenario) -> int:
    """Take the first two steps; how many there are, 0 where the traffic cannot begin."""
    taken, camera = 0, scenario.camera
    if camera.width * camera.height * camera.samples**2 > 300_000:
        return taken  # large pictures take their time, and are tried elsewhere
    # An ego that does not appear is told when the traffic begins; wrong input is not, as it has been checked.
    with contextlib.suppress(SimulationError), ClosedLoop(scenario) as loop:
        config = scenario.run_config()
        policy, step = AdvisedDriving(config.advice, config.periods.decision_frames), loop.start(seed=1)
        for _ in range(2):
            if step.ending is None:
                step = loop.advance(policy.decide(step))
                taken = step.index
    return taken


def test_every_block_of_the_schema_is_tried() -> None:
    def blocks(model: type[BaseModel]) -> set[type[BaseModel]]:
        inner = {one for field in model.model_fields.values() for one in models_in(field.annotation)}
        return {model}.union(*map(blocks, inner))

    tried = {key.path for key in KEYS}
    assert all(any(path[-1] == (field.alias or name) for path in tried) for block in blocks(Scenario) - {Method} for
               name, field in block.model_fields.items() if not field.exclude)  # fmt: skip


def test_what_is_tried_runs_as_it_is(folder: Path) -> None:
    for block in [None, *EXAMPLES]:
        data = copy.deepcopy(PLAIN)
        put_examples((*(block or "").split("."), 0), data)
        scenario = loaded(folder, yaml_of(data))
        assert scenario is not None
        assert take_two_steps(scenario) == 2


def test_wrong_values_are_refused_or_run(folder: Path) -> None:
    """In a short search each key gets one of the values and its ends, the next key the next one."""
    for block in sorted({str(key.path[0]) for key in KEYS}):
        for number, key in enumerate(one for one in KEYS if one.path[0] == block):
            values = [*WRONG, *key.ends]
            for value in values if FUZZ else [values[number % len(values)]]:
                data = copy.deepcopy(PLAIN)
                written(key, value, data)
                scenario = loaded(folder, yaml_of(data))
                if scenario is not None and FUZZ and key.path != ("renderer",):
                    take_two_steps(scenario)


@st.composite
def sets_of_keys(draw: st.DrawFn) -> dict[str, Any]:
    """A scenario in which some keys have values that are most often allowed, and extreme."""
    data = copy.deepcopy(PLAIN)
    for key in draw(st.lists(st.sampled_from(KEYS), min_size=1, max_size=6, unique=True)):
        choices = [st.sampled_from(key.ends or (MISSING,))]
        if len(key.ends) == 2 and all(type(end) in (float, int) for end in key.ends):
            least, most = key.ends
            whole = isinstance(least, int) and isinstance(most, int)
            choices.append(st.integers(least, most) if whole else st.floats(least, most))
        if draw(st.integers(0, 9)) == 0:
            choices = [st.sampled_from([MISSING, 0, 1e-300, math.inf, "none", "all", *WRONG])]
        # A block that was set to something else has no keys to set any more.
        try:
            written(key, draw(st.one_of(choices)), data)
        except (TypeError, AttributeError, KeyError, IndexError):
            continue
    data["renderer"] = "cpu"
    return data


@settings(
    max_examples=FUZZ or 40,
    derandomize=not FUZZ,
    deadline=None,
    database=None,
    suppress_health_check=list(HealthCheck),
)
@given(data=sets_of_keys())
def test_what_is_allowed_runs(folder: Path, data: dict[str, Any]) -> None:
    scenario = loaded(folder, yaml_of(data))
    if scenario is not None:
        take_two_steps(scenario)
