"""Arguments and options that several commands share, and the scenario that they select."""

import json
import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fogsim.cli.printing import print_remarks
from fogsim.core.files.readers import MAPS
from fogsim.errors import InputError

if TYPE_CHECKING:
    from fogsim.scenario import Scenario
    from fogsim.scenario.variation import Case

SCENARIO_HELP = "Scenario name (fogsim list), file or folder."

ScenarioName = Annotated[str | None, typer.Argument(help=SCENARIO_HELP)]
SumoConfiguration = Annotated[Path | None, typer.Option(help="SUMO configuration, instead of a scenario.")]
EgoId = Annotated[
    str | None,
    typer.Option(help="Id of the ego vehicle; any for the first suitable one, none for traffic only."),
]
HomogeneousVisibility = Annotated[
    float | None, typer.Option(help="Meteorological visibility of homogeneous fog in metres.", min=1.0, max=math.inf)
]
Settings = Annotated[
    list[str] | None, typer.Option("--set", metavar="KEY.PATH=VALUE", help="Override a value of the scenario file.")
]

CaseValues = Annotated[
    str,
    typer.Option("--case", metavar="NAME=VALUE,…", help="Only the cases with these values, if the file has `vary`."),
]


def _use_maps(folder: Path | None) -> Path | None:
    """Let readers, also those of other processes, find maps in a folder."""
    if folder is not None:
        if not folder.is_dir():
            raise InputError(f"--maps {folder} is not a folder; give the name of a folder")
        os.environ[MAPS] = str(folder.resolve())
    return folder


Maps = Annotated[
    Path | None,
    typer.Option(
        "--maps",
        envvar=MAPS,
        callback=_use_maps,
        help="Folder with the maps that OpenSCENARIO files name: Town01.xodr or Town01.net.xml for Town01.",
    ),
]

MethodTimeout = Annotated[
    float | None,
    typer.Option(
        min=0.001,
        help="Fail a run if one call of your own method takes longer than this many seconds. Default: no limit.",
    ),
]


def with_timeout(settings: Sequence[str] | None, method_timeout: float | None) -> list[str]:
    """Settings with the time limit for methods [s] from an option."""
    return [*(settings or ()), *([] if method_timeout is None else [f"method_timeout_s={method_timeout!r}"])]


class CodeNotice:
    """Names each Python file next to a scenario once, before its import, and allows it."""

    def __init__(self) -> None:
        self._named: set[Path] = set()

    def __call__(self, file: Path) -> bool:
        """Name a file."""
        if file not in self._named:
            self._named.add(file)
            print_remarks("importing", (file,))
        return True


def chosen_scenario(
    name: str | None, sumocfg: Path | None, ego: str | None, visibility: float | None, settings: Sequence[str] | None
) -> "Scenario":
    """Scenario given by exactly one of a name or a SUMO configuration; InputError if something is missing.

    The SUMO configuration also needs `ego` (``none`` for traffic alone) and a visibility [m] or a fog in the settings.
    """
    return chosen_case(name, sumocfg, ego, visibility, settings, "", None)[0]


def chosen_case(
    name: str | None,
    sumocfg: Path | None,
    ego: str | None,
    visibility: float | None,
    settings: Sequence[str] | None,
    case: str,
    seed: int | None,
) -> "tuple[Scenario, Case]":
    """Scenario as in `chosen_scenario`, and its case ``name=value`` ("" for the first), which `seed` must fit."""
    from fogsim.scenario import scenario_from_config
    from fogsim.scenario.loading import check_configuration, load_cases
    from fogsim.scenario.variation import Case, first_of_several

    settings, may_import = settings or (), CodeNotice()
    fog = [] if visibility is None else [f"fog.visibility_m={visibility!r}"]
    if sumocfg is not None and name is None:
        check_configuration(sumocfg)
        if ego is None:
            raise InputError(
                f"--sumocfg {sumocfg}: --ego is missing: which vehicle is the ego? Traffic alone is for fogsim study"
            )
        if not fog and not any(setting.startswith("fog.") for setting in settings):
            raise InputError(f"--sumocfg {sumocfg}: --visibility is missing, or a fog by --set fog.…")
        if case:
            raise InputError(f"--case {case}: a SUMO configuration has no cases; a scenario file that varies has")
        return scenario_from_config(sumocfg, ego, [*fog, *settings], may_import=may_import), Case({}, seed or 0)
    if name is not None and sumocfg is None:
        if name.endswith(".sumocfg"):
            raise InputError(f"{name} is a SUMO configuration, not a scenario: run it with --sumocfg {name} --ego ID")
        changed = [*fog, *([] if ego is None else [f"traffic.ego={json.dumps(ego)}"]), *settings]
        loaded = load_cases(name, changed, case, seed, may_import=may_import)
        if not case and (note := first_of_several(loaded.document)):
            print_remarks("case", (note,))
        chosen, scenario = loaded.cases[0]
        return scenario, chosen
    given = "neither" if name is None else f"both: {name} and --sumocfg {sumocfg}"
    raise InputError(f"expected either a scenario or --sumocfg FILE, got {given}")
