"""SUMO's command line, of what a traffic simulation needs to know."""

from fogsim.traffic.road.configuration import OVERRIDES, configured_prefix, is_configured
from fogsim.traffic.road.opendrive import is_opendrive
from fogsim.traffic.setup import AfterCollision, TrafficSetup

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
        **dict.fromkeys(("verbose", "duration-log.statistics"), "false"),
    }
    # Vehicles are not teleported: collisions stay where they happen and are counted. How jams dissolve in a simulation
    # of the user's own is left to its configuration.
    # Nor is it changed whether it looks for collisions at junctions.
    own = {"time-to-teleport": "-1", "collision.check-junctions": "true"} if setup.config is None else {}
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
