"""What a data set was made from: digests of files, and versions."""

import hashlib
from pathlib import Path
from typing import Any

from fogsim.errors import InputError
from fogsim.recorders import versions
from fogsim.scenario import Scenario, build, resolved
from fogsim.traffic.road.configuration import input_files


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
        "versions": found,
    }


def input_digests(scenario: Scenario) -> dict[str, str]:
    """SHA-256 of each SUMO file of a scenario, by name: net, routes, additional, configuration."""
    setup = build.traffic_setup(scenario)
    files = [*([] if setup.net is None else [setup.net]), *setup.routes, *setup.additional]
    if setup.config is not None:
        files += [setup.config, *input_files(setup.config)]
    return {_name(file, scenario.directory): _digest(file) for file in files}


def _name(file: Path, folder: Path) -> str:
    return file.relative_to(folder).as_posix() if file.is_relative_to(folder) else file.name


def _digest(file: Path) -> str:
    try:
        return hashlib.sha256(file.read_bytes()).hexdigest()
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror}") from error
