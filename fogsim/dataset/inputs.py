"""What a data set was made from: digests of files, and versions."""

import hashlib
from pathlib import Path
from typing import Any

from fogsim.errors import InputError
from fogsim.recorders import versions
from fogsim.scenario import Scenario, build, resolved
from fogsim.traffic.road.configuration import input_files


def identity(scenario: Scenario, seed: int, every: int) -> dict[str, Any]:
    """All that decides a data set's frames; JSON values only.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    seed : int
        Seed of the first run.
    every : int
        One frame is taken of so many camera periods.

    Raises
    ------
    InputError
        If a file of the scenario cannot be read.
    """
    found = versions()
    # The same frames are made on any machine.
    del found["platform"]
    return {
        "seed": seed,
        "every": every,
        "scenario": resolved(scenario),
        "inputs": input_digests(scenario),
        "versions": found,
    }


def input_digests(scenario: Scenario) -> dict[str, str]:
    """SHA-256 of each file of a scenario's simulation, by its name: net, routes, additional, SUMO configuration.

    Parameters
    ----------
    scenario : Scenario
        The scenario.

    Raises
    ------
    InputError
        If one cannot be read.
    """
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
