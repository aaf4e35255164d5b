"""Traffic by SUMO, wherever it runs."""

import contextlib
import functools
import math
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Concatenate, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

from fogsim.errors import SimulationError
from fogsim.traffic.drivers.events import Order, Script, Situation
from fogsim.traffic.drivers.sight import ClearAir, FogAccess
from fogsim.traffic.setup import ANY_EGO, CollisionLog, TrafficSetup
from fogsim.traffic.sumo.claims import LoadMark, new_session
from fogsim.traffic.sumo.lane_changes import LaneChangeSmoothing
from fogsim.traffic.sumo.link import Api, SumoLink, has_lane
from fogsim.traffic.sumo.loaded_files import (
    LEFT_OUT,
    LoadedRoads,
    check_microscopic,
    check_step_length,
    describe_seen,
    describe_warnings,
    end_time,
)
from fogsim.traffic.sumo.options import command_line
from fogsim.traffic.sumo.roster import Roster
from fogsim.traffic.sumo.vehicle_reader import SubscribedReader, VehicleReader
from fogsim.traffic.sumo_behaviour.ego_driving import EgoDriving, choose_ego
from fogsim.traffic.sumo_behaviour.scripted_actions import LampPublisher, LaneKeeping, ScriptedActions
from fogsim.traffic.sumo_behaviour.speed_control import SpeedControl, SumoDesiredSpeeds
from fogsim.traffic.sumo_drivers.drivers_perception import DriversPerception
from fogsim.traffic.sumo_drivers.vehicle_sight import DriversView
from fogsim.traffic.sumo_lanes.directions import LaneDirections
from fogsim.traffic.sumo_lanes.leaders import Courses, Leaders
from fogsim.traffic.sumo_lanes.long_bodies import LongBodies, rail_collisions
from fogsim.traffic.sumo_lanes.route_position import GapToEgo, RoutePosition
from fogsim.traffic.sumo_lanes.street import LightsAhead, PersonReader, SignalReader
from fogsim.values import Command, Lamp, NetworkSnapshot, RoadNetwork, SignMap, TrafficSnapshot, TrafficState, Unplayed
from fogsim.values.obstruction import CLEAR_SIGHT, Obstructions, obstructions_of
from fogsim.values.script import Leave, TrafficAction

_NO_ADVICE = Command()
_P = ParamSpec("_P")
_R = TypeVar("_R")


@dataclass(frozen=True, slots=True)
class _Run:
    """The parts that live as long as one run."""

    api: Api
    roster: Roster
    reader: VehicleReader
    lane_changes: LaneChangeSmoothing
    speeds: SpeedControl
    driving: EgoDriving
    lamps: LampPublisher
    lanes: LaneKeeping
    collisions: CollisionLog
    script: Script
    actions: ScriptedActions
    session: str
    mark: LoadMark
    persons: PersonReader
    leaders: Leaders
    courses: Courses
    lights: LightsAhead
    bodies: LongBodies
    directions: LaneDirections
    perception: DriversPerception | None = None
    drivers: SumoDesiredSpeeds | None = None


def _translates_errors(
    method: Callable[Concatenate["SumoTraffic", _P], _R],
) -> Callable[Concatenate["SumoTraffic", _P], _R]:
    """Turn the errors of a simulation that is lost or refuses a call into `SimulationError`."""

    @functools.wraps(method)
    def translating(self: "SumoTraffic", /, *arguments: _P.args, **named: _P.kwargs) -> _R:
        # Entering the block costs more than most methods, so it is entered only once there is an error.
        try:
            return method(self, *arguments, **named)
        except Exception:
            with self._link.translated_errors():
                raise

    return translating


class SumoTraffic:
    """A SUMO simulation with one ego vehicle, or without: see `Traffic` and `NetworkTraffic`."""

    def __init__(self, setup: TrafficSetup, link: SumoLink) -> None:
        self._setup, self._link, self._any_ego = setup, link, setup.ego == ANY_EGO
        self._ego_of_seed: int | None = None
        self._run: _Run | None = None
        self._fog: FogAccess | None = None
        self._seed, self._command, self._mark = 0, _NO_ADVICE, 0
        self._begun, self._end, self._teleported, self._arrived = 0.0, math.inf, False, False
        self._route: RoutePosition | None = None
        self._last: TrafficSnapshot | None = None
        self._roads = LoadedRoads(setup.net, setup.additional)
        self._signals: SignalReader | None = None

    @property
    def _running(self) -> _Run:
        if self._run is None:
            raise SimulationError("the traffic simulation has not been started, or is closed")
        return self._run

    @_translates_errors
    def start(self, seed: int) -> None:
        """Begin, or begin again, and run until the ego is on the road or, without one, through the warm-up."""
        arguments = command_line(self._setup, seed)
        api = self._link.begin(arguments)
        if self._any_ego and self._ego_of_seed != seed:
            try:
                self._setup = replace(self._setup, ego=self._chosen_ego(api))
            except SimulationError as error:
                raise self._ended(error, None) from error
            self._ego_of_seed = seed
            api = self._link.begin(arguments)
        setup = self._setup
        session = new_session(api)
        mark = LoadMark(api, session)
        roster = Roster(api, self._link.remote, mark)
        reader = SubscribedReader if self._link.remote else VehicleReader
        script, speeds, changes = Script(setup.events), SpeedControl(api, setup.step_length), LaneChangeSmoothing()
        self._run = _Run(
            api=api,
            roster=roster,
            reader=reader(api, setup.ego, setup.reading_radius, roster),
            lane_changes=changes,
            speeds=speeds,
            driving=EgoDriving(api, setup.ego, setup.step_length, session),
            lamps=LampPublisher(api),
            lanes=LaneKeeping(api, setup.keep_lane, roster, session),
            collisions=CollisionLog(),
            script=script,
            actions=ScriptedActions(
                api, speeds, script.lamps, changes, session, lambda: self._roads.net(api).left_hand
            ),
            session=session,
            mark=mark,
            persons=PersonReader(api, self._link.shared),
            leaders=Leaders(api, self._link.remote),
            courses=Courses(api, self._link.remote),
            lights=LightsAhead(api),
            bodies=LongBodies(api, self._link.remote),
            directions=LaneDirections(api),
        )
        self._signals, self._seed = None, seed
        if self._fog is not None:
            self.enter_fog(self._fog)
        elif self._obstructions(api):
            # What stands next to the roads hides vehicles in clear air, too.
            self._run = replace(self._run, perception=self._perception(self._run, ClearAir()))
        self._command = _NO_ADVICE
        self._route, self._last, self._mark, self._teleported, self._arrived = None, None, 0, False, False
        try:
            check_step_length(api, setup.step_length)
            check_microscopic(api)
            self._end = end_time(api)
            self._warm_up(self._running)
        except SimulationError as error:
            raise self._ended(error, setup.ego) from error
        except Exception:
            self.close()
            raise

    def _ended(self, error: SimulationError, ego: str | None) -> SimulationError:
        """An error that ends the simulation, with what SUMO has warned of."""
        self._run = None
        self.close()
        return SimulationError("; ".join(filter(None, (str(error), describe_warnings(self._link.warnings(), ego)))))

    def _chosen_ego(self, api: Api) -> str:
        """Id of the first vehicle that suits as the ego, for which the simulation runs until it drives."""
        if self._link.shared:
            raise SimulationError(f"ego: {ANY_EGO}: FogSim can choose only in its own simulation; name a vehicle")
        last = min(api.simulation.getTime() + self._setup.warm_up_limit, end_time(api))
        found = choose_ego(api, self._link.step, last)
        warnings.warn(f"traffic.ego: {ANY_EGO}: the ego is {found!r}", stacklevel=2)
        return found

    def _warm_up(self, run: _Run) -> None:
        simulation, vehicle, ego = run.api.simulation, run.api.vehicle, self._setup.ego
        begun, seen = simulation.getTime(), set(vehicle.getIDList())
        while ego is None and simulation.getTime() - begun < self._setup.warm_up - 0.5 * self._setup.step_length:
            self._step(run)
        while ego is not None and ego not in vehicle.getIDList():
            now = simulation.getTime()
            waited, ended, limit = now - begun, now >= self._end, self._setup.warm_up_limit
            if waited > limit or ended or simulation.getMinExpectedNumber() == 0:
                until = f"the simulation's end is {self._end:g}" if ended else f"traffic.warm_up_limit_s is {limit:g}"
                raise SimulationError(
                    f"the ego {ego!r} did not appear within {waited:g} s of simulated time ({until}); "
                    f"{describe_seen(ego, seen)}"
                )
            self._step(run)
            seen.update(simulation.getDepartedIDList())
        self._begun = simulation.getTime()
        run.collisions.take()

    def enter_fog(self, fog: FogAccess) -> None:
        """Let drivers see only what this fog lets them see; see `Traffic.enter_fog`."""
        self._fog = fog
        if self._run is not None:
            setup, api, roster, session = self._setup, self._run.api, self._run.roster, self._run.session
            self._run = replace(
                self._run,
                perception=self._perception(self._run, fog),
                drivers=SumoDesiredSpeeds(api, setup, fog, self._seed, roster, session, self._link.remote),
            )

    def _perception(self, run: _Run, fog: FogAccess) -> DriversPerception | None:
        """What drivers see in a fog, past what stands next to the roads; None if they see through both."""
        sight, standing = self._setup.sight, self._obstructions(run.api)
        if sight is None:
            return None
        view = DriversView(run.api, fog, sight, run.roster, run.session, self._link.remote, standing)
        return DriversPerception(view, self._setup.net)

    def _obstructions(self, api: Api) -> Obstructions:
        """What stands next to the roads and hides others from drivers."""
        return CLEAR_SIGHT if self._setup.sight is None else obstructions_of(self._roads.structures(api))

    def planned_network(self) -> tuple[RoadNetwork, SignMap] | None:
        """Roads and signs along the ego's written way; see `Traffic.planned_network`."""
        return self._roads.plan(self._setup)

    @_translates_errors
    def network(self) -> tuple[RoadNetwork, SignMap]:
        """Roads and signs; see `Traffic.network`."""
        api = self._running.api
        return self._roads.along(api, tuple(api.vehicle.getRoute(self._setup.ego)))

    @_translates_errors
    def begin(self, actions: Sequence[TrafficAction]) -> tuple[TrafficAction, ...]:
        """Begin actions with the next step; see `Traffic.begin`."""
        run = self._running
        run.roster.update()
        refused = run.actions.begin(actions, self._elapsed(run), run.roster.present)
        if any(isinstance(action, Leave) for action in actions):
            run.roster.check_count()
        return refused

    def _elapsed(self, run: _Run) -> float:
        """Time since the ego appeared [s], by a roster that is up to date."""
        return run.roster.time - self._begun

    @_translates_errors
    def advance(self, command: Command) -> None:
        """Move by one traffic step; see `Traffic.advance`."""
        self.obey(command)
        self._link.step()
        self.look()

    @_translates_errors
    def obey(self, command: Command) -> None:
        """Put a command in force for the next step."""
        run, self._command = self._running, command
        orders = self._play_script(run, command)
        if run.driving.apply(command.control, run.roster.present) and self._setup.ego is not None:
            orders.pop(self._setup.ego, None)
        run.speeds.apply(orders)
        lamps = self._published_lamps()
        run.lamps.publish(lamps, run.roster.present)
        run.actions.play(self._elapsed(run), run.roster.present)
        self._update_drivers(run, command, lamps)

    def _play_script(self, run: _Run, command: Command) -> dict[str, Order]:
        run.roster.update()
        present, ego = run.roster.present, self._setup.ego
        orders: dict[str, Order] = {}
        if ego is not None and ego in present:
            orders[ego] = command.advice.speed, self._setup.advice_deceleration
        if run.script.is_idle:
            return orders
        actions = run.script.play(self._situation(run, present))
        for event in actions.lane_changes:
            run.api.vehicle.changeLaneRelative(event.vehicle, event.lanes, event.stay)
        # What is scripted comes last, so that it overrides advice.
        return {**orders, **actions.orders}

    def _situation(self, run: _Run, present: set[str]) -> Situation:
        ego = self._setup.ego

        def gap_to_ego(other: str) -> float | None:
            return GapToEgo(run.api, ego).measure(other) if ego is not None and ego in present else None

        may_change = functools.partial(has_lane, run.api)
        return Situation(self._elapsed(run), present, run.directions.driven, gap_to_ego, may_change)

    def _step(self, run: _Run) -> None:
        self._update_drivers(run, _NO_ADVICE, self._published_lamps())
        self._link.step()
        self.look()

    def _update_drivers(self, run: _Run, command: Command, lamps: Mapping[str, Lamp]) -> None:
        if run.perception is not None:
            run.perception.update(lamps, run.script.lamps)
        if run.drivers is not None:
            run.drivers.update(command)

    @_translates_errors
    def look(self) -> float:
        """Read the last step; return its time [s]."""
        run = self._running
        run.collisions.add(run.reader.collisions())
        run.roster.update(has_stepped=True)
        if self._link.shared:
            # SUMO has let the other clients do what they do in this step before it answers.
            run.roster.check_count()
        self._teleported |= self._setup.ego in run.roster.teleported
        self._arrived |= self._setup.ego in run.roster.arrived
        run.lanes.update()
        run.persons.look()
        return run.roster.time

    @_translates_errors
    def observe(self) -> TrafficSnapshot | None:
        """Report where everyone near the ego is; see `Traffic.observe`."""
        run, ego = self._running, self._setup.ego
        teleported, self._teleported = self._teleported, False
        run.roster.update()
        if teleported or ego is None or ego not in run.roster.present:
            # Where it comes back, if it does, has nothing to do with where it was.
            route, self._route, last, self._last = self._route, None, self._last, None
            if last is None or route is None:
                return None
            may_arrive = self._arrived and not self._link.shared and route.may_end(last.state, run.roster.time)
            if not may_arrive and not run.collisions.includes(ego):
                return None
            # A collision took it, or it arrived: it is shown once more where it was.
            self._teleported, last = teleported, replace(last, collisions=run.collisions.take())
            last = replace(last, state=replace(last.state, time=run.roster.time))
            return replace(last, route_length=last.route_position) if may_arrive else last
        new, self._mark = run.roster.entered_since(self._mark)
        # Another vehicle may have come under the ego's name.
        self._route = RoutePosition(run.api, ego) if self._route is None or ego in new else self._route
        state = run.reader.state(self._command.lamps, self._heard(run), self._command.lamps_of)
        row = state.ids.index(ego)
        route_position, route_length = self._route.update(state.position[row], state.lane[row])
        state = self._shown(run, state)
        self._last = TrafficSnapshot(
            state=self._with_street(run, state, state.position[row]),
            ego=row,
            route_position=route_position,
            route_length=route_length,
            speed_limit=math.inf if state.off_lanes[row] else run.api.lane.getMaxSpeed(state.lane[row]),
            leader=run.leaders.of_ego(ego),
            collisions=run.collisions.take(),
            signal_ahead=run.lights.shown_to(ego),
            is_ended=run.roster.time >= self._end,
        )
        return self._last

    @_translates_errors
    def observe_network(self) -> NetworkSnapshot:
        """Report where everyone is; see `NetworkTraffic.observe_network`."""
        run = self._running
        run.roster.update()
        state = run.reader.state(self._command.lamps, self._heard(run))
        limits = [float(run.api.lane.getMaxSpeed(lane)) for lane in {*state.lane} if lane]
        state = self._shown(run, state)
        return NetworkSnapshot(
            state=self._with_street(run, state, None),
            speed_limit=max(limits, default=math.inf),
            collisions=run.collisions.take(),
            is_over=run.api.simulation.getMinExpectedNumber() == 0,
            waiting=tuple(run.api.simulation.getPendingVehicles()),
            is_ended=run.roster.time >= self._end,
        )

    def _shown(self, run: _Run, state: TrafficState) -> TrafficState:
        """The traffic as it is to be seen, and what has collided in it."""
        run.lane_changes.smooth(state := run.courses.add(state))
        shown = run.bodies.add(run.script.lamps.shown(state, self._elapsed(run)))
        run.collisions.add(rail_collisions(shown))
        return shown

    def _with_street(self, run: _Run, state: TrafficState, here: NDArray[np.float64] | None) -> TrafficState:
        """The traffic with persons on foot and, near the ego, traffic lights."""
        persons, signals = run.persons.state(here, run.roster.time), state.signals
        if here is not None:
            if self._signals is None:
                heads = self._roads.net(run.api).signal_heads if run.api.trafficlight.getIDCount() else ()
                self._signals = SignalReader(run.api, heads)
            signals = self._signals.state(here)
        return replace(state, signals=signals, persons=persons) if signals.ids or persons.ids else state

    def _heard(self, run: _Run) -> Mapping[str, float]:
        """What everyone has heard advised, the ego its own [m/s]."""
        heard = {} if run.drivers is None else run.drivers.heard
        ego, own = self._setup.ego, self._command.advice.speed
        return heard if ego is None or math.isinf(own) else {**heard, ego: own}

    def _published_lamps(self) -> Mapping[str, Lamp]:
        """Lamps that the command lights."""
        own = {} if self._setup.ego is None else {self._setup.ego: self._command.lamps}
        return {**self._command.lamps_of, **own}

    def unplayed(self) -> Unplayed:
        """What of the script has not been played; see `Traffic.unplayed`."""
        return self._unplayed(())

    def _unplayed(self, seen_before: Iterable[str]) -> Unplayed:
        run = self._running
        seen, _ = run.roster.entered_since(0)
        return run.script.unplayed({*seen, *seen_before}, run.roster.present, self._setup.keep_lane)

    @_translates_errors
    def release(self) -> None:
        """Give every vehicle on the road back what was changed about it: it drives and sees by itself again."""
        run = self._running
        if not run.mark.is_there():
            # In a simulation that was loaded since, other vehicles have the same names.
            return
        run.roster.reload()
        run.driving.apply(None, run.roster.present)
        run.speeds.release(run.roster.present)
        run.lanes.release(run.roster.present)
        run.actions.release(run.roster.present)
        if run.perception is not None:
            run.perception.release()
        if run.drivers is not None:
            run.drivers.release()

    def close(self) -> None:
        """End the simulation, or leave it to its other clients; see `Traffic.close`."""
        if self._run is not None and self._link.shared:
            with contextlib.suppress(SimulationError):
                self.release()
        was_running, self._run = self._run is not None, None
        self._link.end()
        left_out = [one for one in self._link.warnings() if LEFT_OUT.search(one)]
        if was_running and left_out:
            warnings.warn(describe_warnings(left_out, None), stacklevel=2)
