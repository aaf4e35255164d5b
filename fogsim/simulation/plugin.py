"""FogSim in simulations that the user has started: over a connection, or in a loop of the user's own."""

import contextlib
import dataclasses
import math
import warnings
from collections.abc import Iterable
from pathlib import Path
from types import TracebackType
from typing import Annotated, Any, Self

from fogsim.core.parameters import NUMBER, Range, checked_parameters
from fogsim.core.randomness import Seed, spawn_streams
from fogsim.errors import InputError, SimulationError, UnplayedWarning
from fogsim.scenario import Scenario, attached_scenario, build, override
from fogsim.scenario.loading import clock_settings
from fogsim.simulation.advised_driving import AdvisedDriving
from fogsim.simulation.ego.equipment import EgoEquipment
from fogsim.simulation.loop import DriversFog
from fogsim.simulation.timeline import Timeline
from fogsim.traffic import AttachedTraffic, TraciLink, Traffic, step_length, traci_traffic
from fogsim.units import clock_time
from fogsim.values import NOTHING_UNPLAYED, Begun, Command, Step
from fogsim.values.result_checks import checked_command

_DECISION_PERIOD = 0.5
"""Time between two decisions, as far as the simulation's step allows [s]."""


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
    return traci_traffic(build.traffic_setup(here), TraciLink(host, port, order, retries, timeout))


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
) -> "AttachedSession":
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
    fog = [] if visibility is None else [f"fog.visibility_m={visibility!r}"]
    if scenario is not None:
        # There is a frame at each step that the simulation makes, whatever the scenario's own would be.
        clocks = _clocks(step_length(api), scenario.clocks.decision_period_s)
        scenario = override(scenario, [*clocks, *fog, *settings], others_add_vehicles=True)
        ego = ego or scenario.traffic.ego
    elif ego is None:
        raise InputError("attach: ego is missing: which vehicle is the ego?")
    else:
        scenario = attached_scenario(ego, [*_clocks(step_length(api)), *fog, *settings])
    setup = dataclasses.replace(
        build.traffic_setup(scenario), ego=ego, net=None if net is None else Path(net), additional=(), config=None
    )
    return AttachedSession(scenario, AttachedTraffic(setup, api), drivers, seed)


def _clocks(step: float, decision_period: float = _DECISION_PERIOD) -> list[str]:
    decision = step * max(1, round(decision_period / step))
    return clock_settings(step, step, decision)


class AttachedSession:
    """An ego in a simulation that another program runs; see `attach`."""

    def __init__(self, scenario: Scenario, traffic: AttachedTraffic, drivers: bool, seed: int) -> None:
        if scenario.traffic.has_equipped:
            raise InputError(
                "attach: traffic.equipped and a list of egos are for simulations that FogSim runs; attach to one ego"
            )
        self._name = scenario.name
        # A scenario for another ego gives fog and camera; whom else it names drives in another simulation.
        self._reports_unplayed = scenario.traffic.ego == traffic.ego
        self._traffic = traffic
        self._drivers = drivers
        self._seed = seed
        self._equipment = EgoEquipment(scenario)
        self._policy = AdvisedDriving(scenario)
        self._timeline = Timeline(scenario)
        self._begun: tuple[Begun, ...] = ()
        self._last: Step | None = None
        self._command = Command()
        self._times: tuple[float, float] | None = None
        self._index = 0
        self._drivers_fog = DriversFog()
        self._started = False
        self._equipped = False
        self._looked = False
        self._closed = False

    def observe(self) -> Step | None:
        """Take in what the last simulation step has brought; to be called after each.

        Returns the finished instant, its time counted from the first; None while the ego is not on the road. An ego
        that is teleported is off the road at least once.
        """
        if self._closed:
            raise SimulationError("the session is closed")
        self._looked = True
        if self._started:
            self._traffic.look()
        elif self._traffic.ego_is_there():
            self._traffic.start(self._seed)
            self._started = True
        else:
            return None
        snapshot = self._traffic.observe()
        if snapshot is None:
            return None
        if not self._equipped:
            body = snapshot.state.types[snapshot.ego]
            fog = self._equipment.start_run(spawn_streams(self._seed), self._traffic.network, body)
            self._equipped = True
            if self._drivers:
                self._drivers_fog.enter(fog, self._traffic)
        time = self._elapsed(snapshot.state.time)
        self._drivers_fog.set_time(time)
        sent = self._equipment.look_from_roadside(time, snapshot.state)
        step = self._equipment.complete_step(self._index, time, snapshot, self._command, None, sent)
        step, self._begun = dataclasses.replace(step, begun=self._begun), ()
        self._index += 1
        return step

    def _elapsed(self, now: float) -> float:
        began, last = (now, now) if self._times is None else self._times
        if now < last:
            raise SimulationError(
                f"the simulation's time went back from {last:g} s to {now:g} s: attach again after reloading it"
            )
        self._times = (began, now)
        return clock_time(now - began)

    @checked_parameters
    def advise(self, step: Step, command: Command | None = None) -> Command:
        """Put a command in force for the next simulation step; to be called before each of them.

        The other drivers' sight in the fog, their choice of speed and scripted events are put in force here too.

        Returns what is in force.
        """
        self._command = self._policy.decide(step) if command is None else checked_command(command)
        if step is not self._last:
            self._begin_what_is_due(step)
            self._last = step
        self._traffic.obey(self._command)
        return self._command

    def _begin_what_is_due(self, step: Step) -> None:
        """Let begin what the timeline asks for after a step, which is looked at once."""
        due = self._timeline.due(step)
        if due.parts:
            fog = self._equipment.begin(due.actions, step.time, step.time)
            if due.actions.fog:
                self._drivers_fog.change(fog)
        refused = self._traffic.begin(due.actions.traffic) if due.actions.traffic else ()
        self._begun += self._timeline.begun(due, refused)

    def close(self) -> None:
        """Let drivers drive and see by themselves again and free the renderer; the simulation goes on.

        Every vehicle gets back what was changed about it: top speed, time headway, lane-change mode, the ego's own
        speed, and sight of its leader.
        """
        is_reporting = self._reports_unplayed and self._started and not self._closed
        self._end()
        unplayed = self._traffic.unplayed() if is_reporting else NOTHING_UNPLAYED
        if is_reporting and self._last is not None:
            unplayed += self._timeline.unplayed(self._last)
        if unplayed:
            warnings.warn(f"{self._name}: not played: {unplayed}", UnplayedWarning, stacklevel=2)

    def _end(self) -> None:
        if not self._closed and not self._started and self._looked:
            warnings.warn(self._traffic.absence(), stacklevel=2)
        if not self._closed and self._started:
            # No one is left to be held in a simulation that has ended first.
            with contextlib.suppress(SimulationError):
                self._traffic.release()
        self._closed = True
        self._equipment.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is None:
            self.close()
        else:
            self._end()
