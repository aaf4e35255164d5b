"""FogSim in simulations that the user has started: over a connection, or in a loop of the user's own."""

import dataclasses
import math
from collections.abc import Iterable
from operator import attrgetter
from pathlib import Path
from typing import Annotated, Any

from fogsim.core.parameters import NUMBER, Range, checked_parameters
from fogsim.core.randomness import Seed
from fogsim.errors import InputError
from fogsim.scenario.build import traffic_setup
from fogsim.scenario.loading import attached_scenario, clock_settings, override
from fogsim.scenario.runnable import Scenario
from fogsim.simulation.plugin import AttachedSession
from fogsim.traffic import AttachedTraffic, TraciLink, Traffic, step_length, traci_traffic

_DECISION_PERIOD = 0.5
"""Time between two decisions, as far as the simulation's step allows [s]."""

_FILES = tuple(f"traffic.{key}" for key in ("config", "net", "routes", "additional"))
_OF_THE_SIMULATION = ("road", "demand", "actors", *_FILES)
"""Keys that a simulation that runs decides itself."""


@checked_parameters
def connect(
    scenario: Scenario,
    host: str = "localhost",
    port: Annotated[int, Range(1, 65535)] = 8813,
    order: int | None = None,
    retries: Annotated[int, Range(0, math.inf)] = 40,
    timeout: Annotated[float, NUMBER] = 60.0,
) -> Traffic:
    """Reach a SUMO or sumo-gui that the user has started with ``--remote-port``.

    The simulation is taken as it is, whatever files and seed it was started with; only to begin a second run, the
    scenario's own files are loaded.

    Parameters
    ----------
    scenario : Scenario
        The ego, the clocks (SUMO's ``--step-length`` must be the scenario's) and how vehicles obey.
    host : str
        Where SUMO runs.
    port : int
        Its ``--remote-port``.
    order : int or None
        FogSim's place among several clients (SUMO's ``--num-clients``).
    retries : int
        How often to try again, every 0.25 s, while SUMO does not listen yet.
    timeout : float
        How long SUMO may leave one message unanswered [s]; ``inf`` for ever. Then it is given up with a
        `SimulationError`. A step waits for all clients, and sumo-gui for its start button.

    Returns
    -------
    Traffic
        For `run` or `ClosedLoop`; nothing is connected before they start.

    Raises
    ------
    InputError
        If the timeout is not more than 0.
    """
    # SUMO may run in another folder.
    here = scenario.model_copy(update={"directory": scenario.directory.resolve()})
    return traci_traffic(traffic_setup(here), TraciLink(host, port, order, retries, timeout))


@checked_parameters
def attach(
    api: Any,
    *,
    ego: str | None = None,
    visibility: Annotated[float, NUMBER] | None = None,
    scenario: Scenario | None = None,
    net: str | Path | None = None,
    settings: Iterable[str] = (),
    drivers: bool = True,
    seed: Seed = 0,
) -> AttachedSession:
    """Attach an ego with a camera to a SUMO simulation that runs already.

    Parameters
    ----------
    api : module or traci.Connection
        ``libsumo`` or ``traci`` after ``start``, or one connection of traci.
    ego : str
        Id of the ego; if not given, the scenario's.
    visibility : float
        Meteorological visibility of homogeneous fog [m].
    scenario : Scenario
        Fog, light, camera, sensors, estimators and policies, in place of the defaults; its traffic is not started, and
        its clocks give way to the simulation's step, the decision period as far as that allows.
    net : str or Path
        SUMO network to draw; if not given, the file that the simulation says it has loaded.
    settings : iterable of str
        ``key.path=value`` each, as after ``--set``.
    drivers : bool
        Whether the other drivers, too, see only what the fog lets them see, and choose their speeds in it; this is put
        in force by `AttachedSession.advise`. False leaves them as they are.
    seed : int
        Seed of the sensors' noise and of the drivers' differences.

    Returns
    -------
    AttachedSession
        The session; nothing is drawn until its `observe`.

    Raises
    ------
    InputError
        If the ego or the fog is missing, a setting does not fit, or `api` is something else.
    SimulationError
        If no simulation runs there.
    """
    fog = [] if visibility is None else [f"fog.visibility_m={float(visibility)!r}"]
    given, step = scenario, step_length(api)
    if scenario is not None:
        # There is a frame at each step that the simulation makes, whatever the scenario's own would be.
        clocks = _clocks(step, scenario.clocks.decision_period_s)
        scenario = override(scenario, [*clocks, *fog, *settings], others_add_vehicles=True)
    elif ego is None:
        raise InputError("attach: ego is missing: which vehicle is the ego?")
    else:
        scenario = attached_scenario(ego, [*_clocks(step), *fog, *settings])
    for key in _OF_THE_SIMULATION:
        now, before = (None if one is None else attrgetter(key)(one) for one in (scenario, given))
        if now and now != before:
            raise InputError(f"attach: {key}: roads and vehicles are those of the simulation that runs; leave it out")
    if not math.isclose(scenario.clocks.camera_period_s, step):
        raise InputError(
            f"attach: clocks.camera_period_s: there is a frame at each step of the simulation, {step:g} s; leave it out"
        )
    config = scenario.run_config()
    setup = dataclasses.replace(
        config.traffic,
        ego=ego or config.traffic.ego,
        net=None if net is None else Path(net),
        additional=(),
        config=None,
        sight=config.traffic.sight if drivers else None,
    )
    return AttachedSession(config, AttachedTraffic(setup, api), drivers, seed)


def _clocks(step: float, decision_period: float = _DECISION_PERIOD) -> list[str]:
    decision = step * max(1, round(decision_period / step))
    return clock_settings(step, step, decision)
