"""Traffic alone in fog: no ego, no camera, advice by visibility meters at the road; traffic → advice → traffic."""

import dataclasses
import math
from collections.abc import Generator, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere import extinction, field_at, with_change
from fogsim.core.parameters import checked_parameters
from fogsim.core.randomness import Seed, spawn_streams
from fogsim.errors import InputError, SimulationError, shown, suggest
from fogsim.simulation.advised_driving import spread_advice
from fogsim.simulation.chosen_methods import road_adviser
from fogsim.simulation.ego.fog_reports import FogReports
from fogsim.simulation.ego.road_meters import RoadMeters
from fogsim.simulation.loop import DriversFog, advance_traffic, warn_of_unplayed
from fogsim.simulation.road_advice import RoadAdvice
from fogsim.simulation.road_sections import EYES, stations
from fogsim.simulation.run_config import RunConfig, ScenarioLike
from fogsim.simulation.timeline import Timeline
from fogsim.traffic import NetworkTraffic, libsumo_network_traffic
from fogsim.traffic.road.configuration import configured_files
from fogsim.traffic.road.network import read_net, route_axis
from fogsim.traffic.road.structures import structures
from fogsim.values import Begun, Cohort, Command, Ending, NetworkSnapshot, TrafficStep, Truth
from fogsim.values.belief import certain_belief
from fogsim.values.result_checks import checked_advice, checked_command

_METER_SPACING = 100.0
"""Distance between visibility meters along a road [m]."""


@checked_parameters
def run_traffic(
    scenario: ScenarioLike, seed: Seed = 0, sumo_outputs: Path | None = None
) -> Generator[TrafficStep, None, None]:
    """Run a scenario without an ego (``traffic.ego: none``) with its own advice.

    Parameters
    ----------
    scenario : Scenario or RunConfig
        From `load_scenario`, or made of plain values.
    seed : int
        The same seed gives the same run, bit for bit.
    sumo_outputs : Path or None
        See `fogsim.run`.

    Yields
    ------
    TrafficStep
        One a camera period, with all vehicles of the network; the last has its `ending` set: the duration is over, or
        all vehicles have gone and no more will come.

    Raises
    ------
    FogSimError
        If the scenario has an ego, or SUMO cannot start.

    Warns
    -----
    UnplayedWarning
        See `fogsim.run`.
    """
    config = scenario.run_config()
    policy = _MeteredAdvice(config)
    with TrafficRun(config, sumo_outputs=sumo_outputs) as traffic:
        step, limit = traffic.start(seed)
        yield step
        while step.ending is None:
            step, limit = traffic.advance(policy.decide(step, limit))
            yield step
    warn_of_unplayed(config.name, step)


class _MeteredAdvice:
    """The run's adviser, who goes by the visibility meters; asked once a decision period."""

    def __init__(self, config: RunConfig) -> None:
        self._advice, self._frames = config.advice, config.periods.decision_frames
        self._adviser = road_adviser(config.advice.adviser)
        self._road = RoadAdvice(config.advice) if config.advice.sections else None

    def decide(self, step: TrafficStep, speed_limit: float) -> Command:
        """Command for the next camera period; the one in force between decisions (`speed_limit` [m/s])."""
        if step.index % self._frames:
            return step.command
        if self._road is not None:
            return Command(stretches=self._road.advise_traffic(step))
        measured = certain_belief(step.truth.extinction)
        advised = self._adviser.advise(measured, speed_limit, step.time, step.command.advice)
        advice = checked_advice(self._advice.adviser.name, advised)
        command = spread_advice(Command(advice=advice), self._advice)
        # Without an ego there is no place to be near to.
        return dataclasses.replace(command, advice_reach=math.inf) if command.advice_reach else command


@checked_parameters
class TrafficRun:
    """The traffic of one simulation in fog, from command to finished step."""

    def __init__(
        self, scenario: ScenarioLike, traffic: NetworkTraffic | None = None, sumo_outputs: Path | None = None
    ) -> None:
        config = scenario.run_config()
        setup, along = config.traffic, config.along
        if setup.ego is not None:
            raise InputError(
                f"traffic alone has no ego, and traffic.ego is {setup.ego!r}; write none, or call fogsim.run"
            )
        self._periods = config.periods
        self._traffic = traffic or libsumo_network_traffic(setup, sumo_outputs)
        net, files = (setup.net, setup.additional) if setup.config is None else configured_files(setup.config)
        # Fog without a road along which it lies has no heights either, so that its ground may be anywhere.
        axis, limits = _axis_along(along, net) if along and net is not None else (np.zeros((1, 3)), np.zeros(0))
        self._route = axis if along else None
        self._fog = config.world.fog.along(axis, structures(path for path in files if path.is_file()))
        self._fog_now, self._config, self._timeline = self._fog, config, Timeline(config.script)
        # A meter that stands for a whole network does not see single patches.
        self._sees_patches = bool(along)
        self._meters = _places_along(axis) + EYES
        self._section_meters = RoadMeters(config.advice.sections, axis, limits)
        self._reporters = FogReports(config.reports, axis)
        self._drivers_fog = DriversFog()
        self._cohort = _CohortWatch(config.cohort)
        self._step: TrafficStep | None = None

    @checked_parameters
    def start(self, seed: Seed) -> tuple[TrafficStep, float]:
        """Begin a run, or begin again.

        Returns the first instant, and the highest speed limit of any driven road [m/s].
        """
        self._step = None
        streams = spawn_streams(seed)
        self._fog = self._config.world.fog.of_run(self._fog, streams.patch_seed)
        self._timeline, self._fog_now = Timeline(self._config.script), self._fog
        self._cohort = _CohortWatch(self._config.cohort)
        self._drivers_fog.restart()
        if not self._drivers_fog.matches(self._fog):
            self._drivers_fog.enter(self._fog, self._traffic)
        self._reporters.reset(streams.reports)
        self._section_meters.reset()
        self._traffic.start(streams.traffic_seed)
        return self._complete_step(0, Command())

    def advance(self, command: Command) -> tuple[TrafficStep, float]:
        """Move by one camera period with a command in force.

        Returns what `start` does.
        """
        last = self._step
        if last is None or last.ending is not None:
            raise SimulationError("the run has not been started or is over: call start() before advance()")
        checked_command(command)
        if not self._drivers_fog.is_entered and command.is_for_others:
            # In clear air no one has chosen a speed so far.
            self._drivers_fog.enter(self._fog, self._traffic)
        # Until the next step is complete: after an interruption the traffic may be ahead of the last one.
        self._step = None
        begun = self._begin_what_is_due(last)
        advance_traffic(self._traffic, self._drivers_fog, self._periods, last.index, command)
        return self._complete_step(last.index + 1, command, begun)

    def _begin_what_is_due(self, step: TrafficStep) -> tuple[Begun, ...]:
        """Let begin what the timeline asks for after a step."""
        due = self._timeline.due(step)
        for change in due.actions.fog:
            self._fog_now = with_change(self._fog_now, step.time, change.density, change.duration)
            self._drivers_fog.change(self._fog_now)
        refused = self._traffic.begin(due.actions.traffic) if due.actions.traffic else ()
        return self._timeline.begun(due, refused)

    def _complete_step(self, index: int, command: Command, begun: tuple[Begun, ...] = ()) -> tuple[TrafficStep, float]:
        snapshot, time = self._traffic.observe_network(), self._periods.time(index)
        cohort = self._cohort.update(time, snapshot)
        step = TrafficStep(
            index=index,
            time=time,
            traffic=snapshot.state,
            collisions=snapshot.collisions,
            truth=self._truth(snapshot, time),
            command=command,
            ending=self._ending(index, snapshot, cohort),
            begun=begun,
            waiting=len(snapshot.waiting),
            cohort=cohort,
        )
        ended = self._timeline.ended(step)
        if step.ending is None and ended is not None:
            step = dataclasses.replace(step, ending=ended)
        if step.ending is not None:
            unplayed = self._traffic.unplayed() + self._timeline.unplayed(step)
            step = dataclasses.replace(step, unplayed=unplayed)
        self._step = step
        return step, snapshot.speed_limit

    def _truth(self, snapshot: NetworkSnapshot, time: float) -> Truth:
        fog = field_at(self._fog_now, time)
        metered = fog if self._sees_patches or fog.patches is None else dataclasses.replace(fog, patches=None)
        measured = float(extinction(metered, self._meters).max())
        seen = extinction(fog, snapshot.state.position + EYES)
        self._section_meters.hear(self._reporters.heard_from_roadside(time, fog))
        sections = self._section_meters.measure(fog)
        return Truth(
            measured,
            measured,
            fog=fog,
            vehicle_extinctions=seen,
            sections=sections,
            route=self._route,
            illuminance=self._config.world.illuminance,
        )

    def _ending(self, index: int, snapshot: NetworkSnapshot, cohort: Cohort | None) -> Ending | None:
        if cohort is not None and self._cohort.has_left:
            return Ending.COHORT_LEFT
        if index >= self._periods.frames or snapshot.is_ended:
            return Ending.TIME
        return Ending.NONE_LEFT if snapshot.is_over else None

    def close(self) -> None:
        """End the simulation; closing twice is allowed."""
        self._traffic.close()
        self._step = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class _CohortWatch:
    """Finds the vehicles that are due in the first seconds of a run, if a duration is given, and when they leave."""

    def __init__(self, duration: float | None) -> None:
        self._duration = duration
        self._before: frozenset[str] | None = None
        self._due: frozenset[str] = frozenset()
        self._lost: frozenset[str] = frozenset()  # Removed after a collision
        self._is_complete = self.has_left = False

    def update(self, time: float, snapshot: NetworkSnapshot) -> Cohort | None:
        """The cohort after a step; vehicles that are due at the first step already are not in it."""
        if self._duration is None:
            return None
        here = {*snapshot.state.ids, *snapshot.waiting}
        if self._before is None:
            self._before = frozenset(here)
        if not self._is_complete:
            new = here - self._before - self._due
            self._due = self._due | new if new else self._due
            self._is_complete = time >= self._duration
        hit = {vehicle for one in snapshot.collisions for vehicle in (one.collider, one.victim)}
        self._lost |= (self._due & hit) - here
        waiting, on_the_way = len(self._due.intersection(snapshot.waiting)), len(self._due & here)
        self.has_left = self._is_complete and not on_the_way
        return Cohort(self._due, waiting, unfinished=on_the_way + len(self._lost))


def _axis_along(edges: Sequence[str], net: Path) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points along a road [m], and the speed limits on the way to them [m/s]."""
    roads = read_net(net)
    for edge in edges:
        if edge not in roads.edges:
            raise InputError(f"traffic.along: {net} has no edge {shown(edge)}; {suggest(edge, roads.edges)}")
    return route_axis(roads, edges)


def _places_along(axis: NDArray[np.float64]) -> NDArray[np.float64]:
    """Places of visibility meters on the ground along a polyline (n, 3) [m], its beginning and end among them."""
    station = stations(axis)
    at = np.linspace(0.0, station[-1], 1 + math.ceil(station[-1] / _METER_SPACING))
    return np.stack([np.interp(at, station, axis[:, i]) for i in range(3)], axis=1)
