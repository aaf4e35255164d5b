"""Options of SUMO's command line: which the installed SUMO knows, what they take, and which FogSim sets itself."""

import functools
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from fogsim.core.files.xml_reader import read_tree
from fogsim.errors import MissingDependencyError, nearest, shown
from fogsim.traffic.road.configuration import NO_LANES, OVERRIDES, configured_prefix, is_configured
from fogsim.traffic.road.opendrive import is_opendrive
from fogsim.traffic.road.unsafe_outputs import unsafe_option
from fogsim.traffic.setup import AfterCollision, TrafficSetup
from fogsim.traffic.sumo.libsumo_link import load_libsumo

_FOR_EVER = "1e6"
_PREFIX = "output-prefix"
_LOG = "error-log"


def command_line(setup: TrafficSetup, seed: int) -> list[str]:
    """SUMO's command line, without the program's name, and without where outputs go."""
    if setup.config is None:
        source = ["--net-file", str(setup.net)]
    else:
        source = ["--configuration-file", str(setup.config), *OVERRIDES]
    arguments = [*source, "--step-length", repr(setup.step_length), "--seed", str(seed)]
    # OpenDRIVE files among them are the sign map's; SUMO cannot read them here.
    additional = tuple(path for path in setup.additional if not is_opendrive(path))
    for option, paths in (("--route-files", setup.routes), ("--additional-files", additional)):
        if paths:
            arguments += [option, ",".join(map(str, paths))]
    # What the scenario sets takes the place of what is usual.
    chosen = {**_usual(setup), **{name: value for name, value in setup.sumo_options if name != _PREFIX}}
    return arguments + [part for name, value in chosen.items() for part in (f"--{name}", value)]


def _usual(setup: TrafficSetup) -> dict[str, str]:
    """Options as they are where no one has chosen."""
    quiet = {
        **dict.fromkeys(("no-step-log", "duration-log.disable", "no-warnings"), "true"),
        "verbose": "false",
    }
    # Vehicles are not teleported: collisions stay where they happen and are counted. They are contacts, where SUMO by
    # default counts each gap below a vehicle's minimum (2.5 m). A simulation of the user's own keeps what its
    # configuration says of these.
    own = {"time-to-teleport": "-1", "collision.check-junctions": "true", "collision.mingap-factor": "0"}
    own = own if setup.config is None else {}
    if setup.after_collision is AfterCollision.STOP:
        return {**quiet, **own, "collision.action": "warn", "collision.stoptime": _FOR_EVER}
    return {**quiet, **own, "collision.action": "remove"}


def has_error_log(setup: TrafficSetup) -> bool:
    """Whether the scenario or its configuration asks for SUMO's own log of warnings and errors."""
    return _LOG in dict(setup.sumo_options) or (setup.config is not None and is_configured(setup.config, _LOG))


def output_prefix(setup: TrafficSetup) -> str:
    """What names of SUMO's outputs begin with: as the scenario has it, or its configuration."""
    chosen = dict(setup.sumo_options).get(_PREFIX)
    configured = "" if setup.config is None else configured_prefix(setup.config)
    # A folder in it counts as little as those of the outputs themselves.
    return (configured if chosen is None else chosen).rpartition("/")[2]


OptionValue = bool | int | float | str
"""What an option is set to."""

_SEED = "a run must depend on its own seed alone (fogsim run --seed)"
_NO_RUN = "SUMO would print and end"
_VALIDATION = "SUMO would fetch schemas from the addresses that files name"
_TRACI = "SUMO runs inside FogSim, and waits for no clients"
_WINDOW = "SUMO has no window here"

OWN_OPTIONS: Mapping[str, str] = {
    "configuration-file": "give traffic.config",
    "help": _NO_RUN,
    "version": _NO_RUN,
    "net-file": "give traffic.net",
    "route-files": "give traffic.routes",
    "additional-files": "give traffic.additional",
    "load-state": "give it in a SUMO configuration (traffic.config)",
    "step-length": "give clocks.traffic_step_s",
    "end": "give duration_s, which counts from the ego's appearance",
    "mesosim": NO_LANES,
    "collision.action": "give traffic.after_collision",
    "collision.stoptime": "give traffic.after_collision",
    "seed": _SEED,
    "random": _SEED,
    "remote-port": _TRACI,
    "num-clients": _TRACI,
    "start": _WINDOW,
    "quit-on-end": _WINDOW,
    "gui-settings-file": _WINDOW,
    "breakpoints": _WINDOW,
    "xml-validation": _VALIDATION,
    "xml-validation.net": _VALIDATION,
    "xml-validation.routes": _VALIDATION,
}
"""Options that are FogSim's to set, or make no sense in a run, and what to do instead."""

_SHORT = {
    **dict.fromkeys(("c", "configuration"), "configuration-file"),
    **dict.fromkeys(("n", "net"), "net-file"),
    **dict.fromkeys(("r", "routes"), "route-files"),
    **dict.fromkeys(("a", "additional"), "additional-files"),
    "X": "xml-validation",
}
"""Other names of those that name files, where SUMO cannot be asked."""

_EXPECTED: Mapping[str, tuple[str, tuple[type, ...]]] = {
    "BOOL": ("true or false", (bool,)),
    "INT": ("a whole number", (int,)),
    "FLOAT": ("a number", (int, float)),
    "TIME": ("a time [s]", (int, float, str)),
    "STR": ("text", (int, float, str)),
}
"""What values kinds of options take, in words and in Python; all further kinds are texts."""


@dataclass(frozen=True, slots=True)
class _KnownOption:
    """An option of the installed SUMO."""

    name: str  # Its first name; synonyms are known by theirs
    kind: str  # What it takes, in SUMO's words: BOOL, INT, FLOAT, TIME, STR, FILE, …


def option_mistakes(options: Mapping[str, OptionValue]) -> dict[str, str]:
    """Say why options cannot be handed to SUMO, by their names; nothing of those that can.

    Where SUMO is not installed, or runs in this process and so cannot be asked for its options, only FogSim's own are
    checked; SUMO itself refuses what it does not know when it starts.
    """
    known = known_options() if options else {}
    mistakes = {name: _mistake(name, value, known) for name, value in options.items()}
    return {name: mistake for name, mistake in mistakes.items() if mistake is not None}


def _mistake(name: str, value: OptionValue, known: Mapping[str, _KnownOption]) -> str | None:
    option = known.get(name)
    first = _SHORT.get(name, name) if option is None else option.name
    reason = OWN_OPTIONS.get(first) or unsafe_option(first, str(value))
    if reason is not None:
        return f"this option of SUMO is not set here: {reason}"
    if first == "output-prefix" and "/" in str(value):
        return "SUMO's outputs go into the run's directory; the prefix must hold no folder"
    if not known:
        return None
    if option is None:
        near = nearest(name, known)
        return f"SUMO has no such option; {f'did you mean {near!r}? ' if near else ''}`sumo --help` lists them"
    expected, kinds = _EXPECTED.get(option.kind, _EXPECTED["STR"])
    fits = isinstance(value, kinds) and (option.kind == "BOOL" or not isinstance(value, bool))
    return None if fits else f"must be {expected}, got {shown(value)}"


def known_options() -> Mapping[str, _KnownOption]:
    """Every option of the installed SUMO by each of its names; none where it cannot be asked now."""
    try:
        # SUMO's options are global: asking would end a simulation that runs.
        return {} if load_libsumo().isLoaded() else _options_of_template()
    except MissingDependencyError:
        return {}


@functools.cache
def _options_of_template() -> Mapping[str, _KnownOption]:
    with tempfile.TemporaryDirectory(prefix="fogsim-") as folder:
        template = Path(folder, "options.xml")
        # Six milliseconds, in which nothing is simulated.
        load_libsumo().start(["sumo", "--save-template", str(template)])
        root = read_tree(template)
    found: dict[str, _KnownOption] = {}
    for element in root.iter():
        kind = element.get("type")
        if kind is not None:
            option = _KnownOption(element.tag, kind)
            found |= dict.fromkeys((element.tag, *element.get("synonymes", "").split()), option)
    return found
