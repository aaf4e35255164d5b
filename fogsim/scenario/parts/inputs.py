"""Files that a scenario reads."""

import contextlib
import os
from collections.abc import Iterable, Iterator
from pathlib import Path

from fogsim.errors import InputError
from fogsim.scenario.document import read_document
from fogsim.scenario.schema import ScenarioFile
from fogsim.scenario.written_form import deciding
from fogsim.traffic.road.configuration import configured_inputs, included_files


def input_files(scenario: ScenarioFile) -> tuple[Path, ...]:
    """Files that traffic and methods of a scenario read, and those that these name; InputError if SUMO's are missing.

    Modules of methods are not among them.
    """
    traffic, folder = scenario.traffic, scenario.directory
    named = [path for path in (traffic.config, traffic.net, *traffic.routes, *traffic.additional) if path is not None]
    files = [folder / path for path in named]
    if traffic.config is not None:
        files += configured_inputs(folder / traffic.config)
    files += included_files(files)
    for path in files:
        if not path.is_file():
            source = folder / traffic.config if traffic.config is not None else scenario.name
            raise InputError(f"{source} names {path}, which is not there")
    return tuple(dict.fromkeys((*files, *(folder / name for name in named_files(scenario)))))


def named_files(scenario: ScenarioFile) -> tuple[Path, ...]:
    """Files that parameters of methods and options of SUMO name, as seen from the scenario's folder.

    Those that YAML files among them name in turn, such as the beams of a file of lamps, follow.
    """
    folder = scenario.directory
    found = list(_files(_free_texts(deciding(scenario)), folder, Path()))
    for path in [one for one in found if one.suffix in (".yaml", ".yml")]:
        with contextlib.suppress(InputError):  # a method has its own way to read a file
            found += _files(_texts(read_document(folder / path).data), folder, path.parent)
    return tuple(dict.fromkeys(found))


def _files(texts: Iterable[str], folder: Path, place: Path) -> Iterator[Path]:
    """Files among texts, which are relative to a place in a folder."""
    names = dict.fromkeys(place / name for text in texts for name in (text, *text.split(",")))
    return (name for name in names if os.path.isfile(folder / name))  # noqa: PTH113 - False for any text


def _texts(data: object) -> Iterator[str]:
    if isinstance(data, str):
        yield data
    elif isinstance(data, dict | list):
        for one in data.values() if isinstance(data, dict) else data:
            yield from _texts(one)


def _free_texts(data: object) -> Iterator[str]:
    """Texts in parameters of methods and in options of SUMO, which may name files."""
    if isinstance(data, dict):
        for key, value in data.items():
            yield from (_texts if key in ("parameters", "sumo_options") else _free_texts)(value)
    elif isinstance(data, list):
        for one in data:
            yield from _free_texts(one)
