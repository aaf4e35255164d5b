"""Creating a scenario of your own from an existing one."""

import json
import os
import re
import shutil
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from fogsim.advice import ADVISERS, CONTROLLERS
from fogsim.core.files.atomic import write_json, write_text
from fogsim.core.files.output_targets import refuse_unwritable_folder
from fogsim.core.registry import Registry
from fogsim.core.registry.user_code import import_nothing, is_class_name, source_files
from fogsim.errors import InputError, shown
from fogsim.estimators import ESTIMATORS
from fogsim.fusion import FUSIONS
from fogsim.lighting import LIGHTING_POLICIES
from fogsim.openscenario import is_openscenario
from fogsim.scenario.build import named_files
from fogsim.scenario.document import read_document
from fogsim.scenario.json_schema import scenario_json_schema
from fogsim.scenario.loading import SCENARIO_FILE, load_scenario, scenario_file
from fogsim.scenario.runnable import Scenario
from fogsim.scenario.section import Method
from fogsim.traffic import SPEED_CHOICES
from fogsim.traffic.road.configuration import configured_inputs, included_files, seldom_files

_NAME_KEY = re.compile(r"^name:.*$", re.MULTILINE)

_FOREIGN_KEY = re.compile(r"^scenario:.*$", re.MULTILINE)

_HEAD = """\
# yaml-language-server: $schema=fogsim.schema.json
# Begun from {source} by `fogsim new`. Editors that know YAML complete the keys by {schema} (`fogsim schema` makes it);
# `fogsim validate {folder}` checks them, `fogsim run {folder}` runs them.
"""

_SCHEMA_FILE = "fogsim.schema.json"
"""File with which editors complete and check a scenario's keys."""


def begin_scenario(name: str, source: str, parent: Path) -> tuple[Path, ...]:
    """Copy a scenario with its SUMO files and comments into a new folder; return the files, the scenario's first."""
    if not re.fullmatch(r"[A-Za-z0-9_.-]{1,100}", name) or set(name) == {"."}:
        raise InputError(f"a scenario's name has letters, digits, '_', '.' and '-', up to 100; got {shown(name)}")
    refuse_unwritable_folder(parent, "--in")
    if is_openscenario(scenario_file(source)):
        raise InputError(f"--from {source}: expected a YAML scenario; begin one with the line scenario: FILE.xosc")
    old, text = load_scenario(source, may_import=import_nothing), scenario_file(source).read_text(encoding="utf-8")
    folder = parent / name
    if folder.exists():
        raise InputError(f"{folder} already exists; give another name")
    traffic = old.traffic
    needed = [path for path in (traffic.config, traffic.net, *traffic.routes, *traffic.additional) if path is not None]
    of_methods = [*_files_of_methods(old), *named_files(old)]
    outside = [path for path in (*needed, *of_methods) if path.is_absolute() or ".." in path.parts]
    further: tuple[Path, ...] = ()
    if traffic.config is not None and traffic.config not in outside:
        config = old.directory / traffic.config
        needed += _in_folder(old.directory, configured_inputs(config), config)
        further = seldom_files(config)
    included = included_files(old.directory / path for path in needed if path not in outside)
    needed += _in_folder(old.directory, (*included, *further), scenario_file(source))
    needed += of_methods
    for path in outside:
        text = text.replace(str(path), str((old.directory / path).resolve()))
    foreign = read_document(scenario_file(source)).data.get("scenario")
    if foreign is not None:
        text = _FOREIGN_KEY.sub(lambda _: f"scenario: {json.dumps(str((old.directory / foreign).resolve()))}", text)
    head = _HEAD.format(source=source, folder=folder, schema=_SCHEMA_FILE)
    made = [folder / SCENARIO_FILE]
    folder.mkdir(parents=True)
    try:
        for path in dict.fromkeys(needed):
            if path not in outside:
                (folder / path).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(old.directory / path, folder / path)
                made.append(folder / path)
        write_text(made[0], head + _NAME_KEY.sub(f"name: {name}", text, count=1))
        write_json(folder / _SCHEMA_FILE, scenario_json_schema())
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    return (*made, folder / _SCHEMA_FILE)


def _files_of_methods(scenario: Scenario) -> Iterator[Path]:
    """Modules of the user's methods in the scenario's folder and those that they import, and files that are methods."""
    roadside = scenario.sensors.reports.roadside
    camera = None if roadside is None else roadside.camera
    chosen: list[tuple[Registry[Any], Method | None]] = [
        *((ESTIMATORS, one) for one in scenario.estimators),
        (ESTIMATORS, None if camera is None else camera.estimator),
        (FUSIONS, scenario.fusion),
        (ADVISERS, scenario.advice),
        (SPEED_CHOICES, scenario.drivers.speed_choice),
        (LIGHTING_POLICIES, scenario.lighting),
        (CONTROLLERS, scenario.controller),
    ]
    for registry, method in chosen:
        if method is None:
            continue
        kind, _, file = method.method.partition(":")
        if kind in registry.files:
            yield Path(file)
        elif is_class_name(method.method):
            home, package = scenario.directory.resolve(), scenario.directory.resolve() / kind.partition(".")[0]
            sources = source_files(method.method, home)
            if any(package in source.parents for source in sources):
                sources += package.rglob("*.py")
            yield from (one.relative_to(home) for one in sources)


def _in_folder(directory: Path, files: Iterable[Path], source: Path) -> list[Path]:
    """Files that `source` names, or others for it, as seen from the scenario's folder."""
    named = [Path(os.path.relpath(path, directory)) for path in files]
    for path in named:
        if ".." in path.parts or not (directory / path).is_file():
            raise InputError(
                f"{source}: {shown(str(path))} is no file in the scenario's folder; copy it there, and name it by its "
                "place there"
            )
    return named
