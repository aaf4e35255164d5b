"""The closed loop: traffic → scene → render → atmosphere → camera → estimators → fusion → advice → traffic."""

import dataclasses
import warnings
from collections.abc import Generator, Sequence
from pathlib import Path
from types import TracebackType
from typing import Annotated, Protocol, Self

from fogsim.atmosphere import FogNow
from fogsim.core.parameters import Range, checked_parameters
from fogsim.core.randomness import Seed, spawn_streams
from fogsim.errors import InputError, SimulationError, UnplayedWarning
from fogsim.simulation.controlled_driving import own_policy
from fogsim.simulation.ego.equipment import EgoEquipment
from fogsim.simulation.ego.view_rendering import Surrounding
from fogsim.simulation.fleet import EquippedFleet, camera_messages
from fogsim.simulation.run_config import Periods, ScenarioLike, check_ego
from fogsim.simulation.timeline import Timeline
from fogsim.traffic import AnyTraffic, FogAccess, Traffic, libsumo_traffic
from fogsim.values import (
    Begun,
    Collision,
    Command,
    Ending,
    FogField,
    RoadNetwork,
    SignMap,
    Step,
    TrafficSnapshot,
    TrafficStep,
)
from fogsim.values.result_checks import checked_command

Processes = Annotated[int, Range(0, 1000)]
"""How many processes draw."""


@checked_parameters
def run(
    scenario: ScenarioLike,
    seed: Seed = 0,
    traffic: Traffic | None = None,
    *,
    sumo_outputs: Path | None = None,
    camera_processes: Processes = 0,
) -> Generator[Step, None, None]:
    """Run a scenario with its own advice and lighting policy.

    Parameters
    ----------
    scenario : Scenario or RunConfig
        From `load_scenario`, or made of plain values.
    seed : int
        The same seed gives the same run, bit for bit.
    traffic : Traffic or None
        The traffic simulation; None for SUMO in this process, as the scenario describes it.
    sumo_outputs : Path or None
        Folder of the files that SUMO in this process writes where its files or options ask for outputs; None to keep
        none of them. Those of an earlier run with the same names are replaced.
    camera_processes : int
        Processes that draw for equipped vehicles other than the ego (``traffic.equipped``); 0 for this one. The steps
        are the same with any number.

    Yields
    ------
    Step
        One a camera period; the last has its `ending` set.

    Raises
    ------
    FogSimError
        If a part of the loop cannot start; see `ClosedLoop.start`.

    Warns
    -----
    UserWarning
        If SUMO writes files that are not kept.
    UnplayedWarning
        After the last step, if something of the script was not played and a longer run would not have played it
        either; `Step.unplayed` of the last step has all that was not played.
    """
    config = scenario.run_config()
    policy = own_policy(config)
    with ClosedLoop(config, traffic, sumo_outputs, camera_processes) as loop:
        step = loop.start(seed)
        yield step
        while step.ending is None:
            step = loop.advance(policy.decide(step))
            yield step
    warn_of_unplayed(config.name, step)


def warn_of_unplayed(name: str, last: TrafficStep) -> None:
    """Warn of what was not played in a run that is over, if a longer one would not have played it either."""
    came_to_end = last.ending in (Ending.ARRIVED, Ending.LEFT_NETWORK, Ending.NONE_LEFT)
    if last.unplayed and (came_to_end or last.unplayed.is_final):
        warnings.warn(f"{name}: not played: {last.unplayed}", UnplayedWarning, stacklevel=3)


class _EntersFog(Protocol):
    """A traffic simulation, as far as fog concerns it."""

    def enter_fog(self, fog: FogAccess) -> None:
        """Let drivers see only what this fog lets them see; see `Traffic.enter_fog`."""


class DriversFog:
    """The fog about the drivers of a traffic simulation, which moves on with time."""

    def __init__(self) -> None:
        self._fog: FogNow | None = None
        self._field: FogField | None = None

    @property
    def is_entered(self) -> bool:
        """Whether the traffic has the fog."""
        return self._fog is not None

    def matches(self, fog: FogField) -> bool:
        """Whether drivers have about them what a fog is; clear air needs not be entered.

        Parameters
        ----------
        fog : FogField
            The fog over time.
        """
        return self._field == fog or (self._field is None and fog.extinction == 0 and not fog.banks)

    def enter(self, fog: FogField, traffic: _EntersFog) -> None:
        """Pass the fog to a traffic; its place is known only when the ego's route is.

        Parameters
        ----------
        fog : FogField
            The fog over time.
        traffic : Traffic
            Or something else with `Traffic.enter_fog`.
        """
        self._fog, self._field = FogNow(fog), fog
        traffic.enter_fog(self._fog)

    def restart(self) -> None:
        """Let it be the beginning of a run, in the fog that was entered."""
        if self._fog is not None and self._field is not None:
            self._fog.change(self._field)
            self._fog.set_time(0.0)

    def change(self, fog: FogField) -> None:
        """Let the fog do something else from now on, within its bounds.

        Parameters
        ----------
        fog : FogField
            The fog over time.
        """
        if self._fog is not None:
            self._fog.change(fog)

    def set_time(self, time: float) -> None:
        """Let it be a time from here on.

        Parameters
        ----------
        time : float
            Time since the run began [s].
        """
        if self._fog is not None:
            self._fog.set_time(time)


def advance_traffic(traffic: AnyTraffic, fog: DriversFog, periods: Periods, index: int, command: Command) -> None:
    """Move a traffic simulation by one camera period, the fog with it."""
    for number in range(periods.traffic_steps):
        fog.set_time((index + number / periods.traffic_steps) * periods.camera_period)
        traffic.advance(command)


@checked_parameters
class ClosedLoop:
    """One ego vehicle in one simulation, from command to finished step.

    Parameters
    ----------
    scenario : Scenario or RunConfig
        The scenario.
    traffic : Traffic or None
        The traffic simulation; None for SUMO in this process, as the scenario describes it.
    sumo_outputs : Path or None
        See `run`.
    camera_processes : int
        See `run`.

    Raises
    ------
    InputError
        If the scenario has no ego; see `run_traffic`.
    """

    def __init__(
        self,
        scenario: ScenarioLike,
        traffic: Traffic | None = None,
        sumo_outputs: Path | None = None,
        camera_processes: Processes = 0,
    ) -> None:
        config = scenario.run_config()
        check_ego(config.traffic.ego, "the closed loop")
        self._config, self._periods = config, config.periods
        self._traffic = traffic or libsumo_traffic(config.traffic, sumo_outputs)
        self._replays = traffic is None
        self._equipment = EgoEquipment(config)
        self._fleet = EquippedFleet(config, camera_processes)
        self._drivers_fog = DriversFog()
        self._timeline = Timeline(config.script)
        self._fog: FogField | None = None
        self._step: Step | None = None

    @checked_parameters
    def start(self, seed: Seed) -> Step:
        """Begin a run, or begin again.

        Parameters
        ----------
        seed : int
            Seed of every random number of the run.

        Raises
        ------
        SimulationError
            If SUMO cannot start, runs already in this process, or the ego does not appear.
        MissingDependencyError
            If no renderer works here.
        """
        streams = spawn_streams(seed)
        self._step = None
        self._drivers_fog.restart()
        self._timeline = Timeline(self._config.script)
        if self._replays:
            self._enter_known_fog(streams.patch_seed)
        self._traffic.start(streams.traffic_seed)
        snapshot = self._observe_ego()
        body = snapshot.state.types[snapshot.ego]
        fog = self._fog = self._equipment.start_run(streams, self._traffic.network, body)
        if not self._drivers_fog.matches(fog):
            self._drivers_fog.enter(fog, self._traffic)
            if self._replays:
                # The ego's way was not known before. Drivers must have had the fog about them while the road filled.
                self._traffic.start(streams.traffic_seed)
                snapshot = self._observe_ego()
        self._fleet.start_run(seed, self._traffic.network)
        first = self._complete_step(0, snapshot, self._ending(0, snapshot), Command())
        self._step = self._with_unplayed(self._with_ending(first))
        return self._step

    def _enter_known_fog(self, patch_seed: int) -> None:
        """Surround drivers with the fog from the beginning if the ego's route, along which it lies, is known."""
        fog = self._fog
        if fog is None and (planned := self._traffic.planned_network()) is not None:
            fog = self._config.world.fog.along(planned[0].route, planned[0].structures)
        if fog is not None:
            fog = self._config.world.fog.of_run(fog, patch_seed)
            if not self._drivers_fog.matches(fog):
                self._drivers_fog.enter(fog, self._traffic)

    def _observe_ego(self) -> TrafficSnapshot:
        snapshot = self._traffic.observe()
        if snapshot is None:
            raise SimulationError("the ego left the road as soon as it had appeared")
        return snapshot

    def advance(self, command: Command, periods: int = 1) -> Step:
        """Move by one camera period, or some, with a command in force.

        Where nothing of a step can change the traffic, that of all periods is simulated first: drawing takes SUMO's
        memory out of the processor's, which costs as much as a step of SUMO.

        Parameters
        ----------
        command : Command
            Advice and lamps.
        periods : int
            How many camera periods, if the run does not end before.

        Returns
        -------
        Step
            The finished instant, with the collisions of all these periods. If the ego left the network on the way, what
            was last seen of it, with its ending.

        Raises
        ------
        InputError
            If the command is none, a speed in it is nan or negative, or there are no periods.
        SimulationError
            If the run has not been started or is over.
        """
        if periods < 1:
            raise InputError(f"periods: expected at least 1, got {periods!r}")
        step = self._step
        if step is None or step.ending is not None:
            raise SimulationError("the run has not been started or is over: call start() before advance()")
        if command is not step.command:
            checked_command(command)
        if not self._drivers_fog.is_entered and self._fog is not None and command.is_for_others:
            # In clear air no one else has chosen a speed so far.
            self._drivers_fog.enter(self._fog, self._traffic)
        runs_ahead = self._replays and self._timeline.is_idle and not self._fleet.is_there
        collisions: tuple[Collision, ...] = ()
        try:
            while periods > 0 and step.ending is None:
                begun = self._begin_what_is_due(step)
                for_all = self._fleet.advised(command, step.equipped)
                snapshots = self._snapshots(step.index, for_all, periods if runs_ahead else 1)
                periods -= len(snapshots)
                for snapshot, ending in snapshots:
                    step = self._step = self._next_step(step, snapshot, ending, command, begun)
                    collisions += step.collisions
        except BaseException:
            # The traffic may be ahead of the last step.
            self._step = None
            raise
        return step if collisions == step.collisions else dataclasses.replace(step, collisions=collisions)

    def _snapshots(
        self, index: int, command: Command, periods: int
    ) -> Sequence[tuple[TrafficSnapshot | None, Ending | None]]:
        """The traffic after each of some periods, and why the run is over then; none after the end."""
        found: list[tuple[TrafficSnapshot | None, Ending | None]] = []
        for last in range(index, index + periods):
            advance_traffic(self._traffic, self._drivers_fog, self._periods, last, command)
            snapshot = self._traffic.observe()
            ending = Ending.LEFT_NETWORK if snapshot is None else self._ending(last + 1, snapshot)
            found.append((snapshot, ending))
            if ending is not None:
                break
        return found

    def _next_step(
        self,
        last: Step,
        snapshot: TrafficSnapshot | None,
        ending: Ending | None,
        command: Command,
        begun: tuple[Begun, ...],
    ) -> Step:
        index = last.index + 1
        if snapshot is None:
            time = self._periods.time(index)
            seen = dataclasses.replace(last, collisions=(), begun=())
            step = dataclasses.replace(seen, index=index, time=time, ending=ending)
        else:
            step = self._complete_step(index, snapshot, ending, command)
        return self._with_unplayed(self._with_ending(dataclasses.replace(step, begun=begun) if begun else step))

    def _begin_what_is_due(self, step: Step) -> tuple[Begun, ...]:
        """Let begin what the timeline asks for after a step."""
        due = self._timeline.due(step)
        refused = self._traffic.begin(due.actions.traffic) if due.actions.traffic else ()
        first_time = self._periods.time(step.index + 1)
        fog = self._equipment.begin(due.actions, step.time, first_time)
        self._fleet.begin(due.actions, step.time, first_time)
        if due.actions.fog:
            self._drivers_fog.change(fog)
        return self._timeline.begun(due, refused)

    def surrounding(self) -> Surrounding:
        """Describe the surroundings of the ego's camera now: scene, vehicles, camera and lamps.

        Raises
        ------
        SimulationError
            If the run has not been started.
        """
        step = self._step
        if step is None or step.truth.pose is None:
            raise SimulationError("the run has not been started: call start()")
        return self._equipment.surrounding(step.traffic, step.ego, step.truth.pose)

    def network(self) -> tuple[RoadNetwork, SignMap]:
        """Return the roads around the ego and their signs.

        Raises
        ------
        SimulationError
            If the run has not been started.
        """
        if self._step is None:
            raise SimulationError("the run has not been started: call start()")
        return self._traffic.network()

    def _with_ending(self, step: Step) -> Step:
        """A step; one at which the scenario's end has come, with it."""
        ended = self._timeline.ended(step)
        return step if ended is None or step.ending is not None else dataclasses.replace(step, ending=ended)

    def _with_unplayed(self, step: Step) -> Step:
        """A step; one that ends a run with what was not played."""
        if step.ending is None:
            return step
        return dataclasses.replace(step, unplayed=self._traffic.unplayed() + self._timeline.unplayed(step))

    def _complete_step(self, index: int, snapshot: TrafficSnapshot, ending: Ending | None, command: Command) -> Step:
        time = self._periods.time(index)
        sent = () if self._step is None or self._config.reports.cameras is None else camera_messages(self._step)
        sent += self._equipment.look_from_roadside(time, snapshot.state)
        self._fleet.ask(index, time, snapshot, sent)
        step = self._equipment.complete_step(index, time, snapshot, command, ending, sent)
        equipped = self._fleet.answer()
        return dataclasses.replace(step, equipped=equipped) if equipped else step

    def _ending(self, index: int, snapshot: TrafficSnapshot) -> Ending | None:
        if snapshot.collisions and self._config.ends_on_collision:
            ego = snapshot.state.ids[snapshot.ego]
            if any(ego in (one.collider, one.victim) for one in snapshot.collisions):
                return Ending.COLLISION
        if snapshot.route_position >= snapshot.route_length - self._config.stop_before_end:
            return Ending.ARRIVED
        return Ending.TIME if index >= self._periods.frames or snapshot.is_ended else None

    def close(self) -> None:
        """End the simulation and free the renderer; closing twice is allowed."""
        self._traffic.close()
        self._equipment.close()
        self._fleet.close()
        self._step = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
