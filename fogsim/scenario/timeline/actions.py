"""From the entries of a timeline to actions in SI units, where everyone is when they begin."""

import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence

from fogsim.atmosphere import FogConfig
from fogsim.scenario.sensors.faults import fault_of
from fogsim.scenario.timeline.lamps import lamp_switches
from fogsim.scenario.timeline.schema import Doing, FogActions, LightActions, SignalActions, TimelineEntry
from fogsim.scenario.timeline.vehicle_actions import (
    LONGEST_CHANGE,
    ArriveAction,
    DepartAction,
    LaneAction,
    PathAction,
    SpeedAction,
    StopAction,
    VehicleActions,
)
from fogsim.simulation.run_config import Situation
from fogsim.units import KMH_PER_MPS, extinction_from_visibility
from fogsim.values import Fault, FogChange, Lamp
from fogsim.values.light import ALL_LAMPS
from fogsim.values.script import (
    Actions,
    Arrive,
    ChangeFog,
    ChangeLane,
    ChangeLight,
    ChangeSpeed,
    Depart,
    Enter,
    Follow,
    FollowPath,
    Leave,
    SetLamps,
    SetSignal,
    Shape,
    Stop,
    TakeRoute,
    TrafficAction,
    Walk,
)

_HAZARD = Lamp.INDICATOR_LEFT | Lamp.INDICATOR_RIGHT
_SLOWEST = 0.01  # Speed at which a change of lane over any distance takes as long as it may [m/s]
SIGNAL_STATES = {"red": "r", "yellow": "y", "green": "G", "off": "O"}


Entries = Mapping[tuple[str, DepartAction], Enter]
"""What vehicles do that depart by themselves, by their ids and what the file says."""


def actions_of(entry: TimelineEntry, reference: float, entering: Entries, now: Situation) -> Actions | None:
    """What an entry begins; None while somebody whom it needs is not there (`reference` [1/m])."""
    traffic: list[TrafficAction] = []
    fog: list[ChangeFog] = []
    lights: list[ChangeLight] = []
    faults: list[Fault] = []
    for subject, doing in operations(entry):
        match doing:
            case VehicleActions():
                moves = _of_vehicle(subject, doing, entering, now)
                if moves is None:
                    return None
                traffic += moves
            case SignalActions():
                state = "r" if doing.state is None else SIGNAL_STATES.get(doing.state, doing.state)
                signal = subject.removeprefix("signal.")
                traffic.append(SetSignal(signal, doing.phase, state, _endless(doing.for_s)))
            case FogActions():
                fog.append(ChangeFog(_density(doing, reference), doing.over_s))
            case LightActions():
                lights.append(ChangeLight(doing.illuminance_lx, doing.over_s, doing.course == "factors"))
            case _:
                faults.append(fault_of(doing))
    return Actions(tuple(traffic), tuple(fog), tuple(lights), tuple(faults))


def operations(entry: TimelineEntry) -> Iterator[tuple[str, Doing]]:
    """Subjects of an entry, each with one thing that it does; those of several several times."""
    for subject, written in entry.do.items():
        yield from ((subject, doing) for doing in (written if isinstance(written, tuple) else (written,)))


def entry_name(entry: TimelineEntry, number: int) -> str:
    """What an entry is called in conditions and messages."""
    return entry.name or f"timeline.{number}"


def entry_text(entry: TimelineEntry) -> str:
    """What an entry does in a few words: ``slow: brake; fog: visibility_m``."""
    words = []
    for subject, doing in operations(entry):
        given = [key for key in type(doing).model_fields if key in doing.model_fields_set]
        fault = getattr(doing, "fault", "")
        words.append(f"{subject}: {fault or ' and '.join(key for key in given if key not in ('over_s', 'for_s'))}")
    return "; ".join(words)


def vehicles_of(entry: TimelineEntry) -> tuple[str, ...]:
    """Vehicles that an entry makes do something, or follow, as it names them; each once."""
    named = []
    for subject, doing in operations(entry):
        if isinstance(doing, VehicleActions):
            others = [
                doing.follow.vehicle if doing.follow else None,
                doing.arrive.vehicle if doing.arrive else None,
                doing.speed.like if doing.speed else None,
                doing.change_lane.to_lane_of if doing.change_lane else None,
                doing.depart.like if doing.depart else None,
            ]
            named += [subject, *(other for other in others if other is not None)]
    return tuple(dict.fromkeys(named))


def _endless(duration: float | None) -> float:
    return math.inf if duration is None else duration


def _of_vehicle(subject: str, doing: VehicleActions, entering: Entries, now: Situation) -> list[TrafficAction] | None:
    vehicle, speed = now.vehicle_id(subject), now.speed(subject)
    if doing.depart:
        return _departure(vehicle, doing.depart, entering, now) if speed is None else None
    if speed is None:
        # A path may bring a vehicle onto the road.
        return [_path(vehicle, doing.path)] if doing.path and doing.model_fields_set == {"path"} else None
    if doing.walk:
        return [Walk(vehicle, doing.walk.speed_kmh / KMH_PER_MPS)]
    if doing.leave:
        return [Leave(vehicle)]
    moves: list[TrafficAction | None] = [_path(vehicle, doing.path)] if doing.path else []
    moves += _motions(vehicle, doing, subject, speed, now)
    if doing.take_route:
        moves.append(TakeRoute(vehicle, doing.take_route))
    if doing.change_lane:
        moves.append(_lane_change(vehicle, doing.change_lane, subject, speed, now))
    moves += _switches(vehicle, doing)
    whole = [move for move in moves if move is not None]
    return whole if len(whole) == len(moves) else None


def _motions(
    vehicle: str, doing: VehicleActions, subject: str, speed: float, now: Situation
) -> Iterator[TrafficAction | None]:
    """What changes the speed of a vehicle; None for what cannot begin yet."""
    if doing.speed:
        yield _speed_change(vehicle, doing.speed, speed, now)
    if doing.brake:
        brake = doing.brake
        yield _braking(vehicle, speed, brake.to_kmh / KMH_PER_MPS, brake.deceleration_mps2, brake.hold_s)
    if doing.break_down:
        yield _braking(vehicle, speed, 0.0, doing.break_down.deceleration_mps2, None)
    if doing.follow:
        follow, leader = doing.follow, now.vehicle_id(doing.follow.vehicle)
        action = Follow(vehicle, leader, follow.headway_s, _endless(follow.for_s), follow.gap_m)
        yield action if now.speed(follow.vehicle) is not None else None
    if doing.arrive:
        yield _arrival(vehicle, doing.arrive, now)
    if doing.stop:
        yield _stopping(vehicle, doing.stop, now.position(subject))


def _departure(vehicle: str, action: DepartAction, entering: Entries, now: Situation) -> list[TrafficAction] | None:
    if action.like is None or action.gap_m is None:
        return [entering[vehicle, action]]
    speed = None if action.speed_kmh is None else action.speed_kmh / KMH_PER_MPS
    lane = action.lane if isinstance(action.lane, int) else None
    departing = Depart(vehicle, now.vehicle_id(action.like), action.gap_m, lane, speed, action.type or "")
    return None if now.speed(action.like) is None else [departing]


def departing_vehicles(entries: Sequence[TimelineEntry]) -> frozenset[str]:
    """Vehicles that a timeline brings onto the road."""
    doings = [pair for entry in entries for pair in operations(entry)]
    return frozenset(subject for subject, doing in doings if isinstance(doing, VehicleActions) and doing.depart)


def _speed_change(vehicle: str, action: SpeedAction, begin: float, now: Situation) -> ChangeSpeed | None:
    if action.profile:
        profile = tuple((time, speed / KMH_PER_MPS) for time, speed in action.profile)
        return ChangeSpeed(vehicle, profile[-1][1], hold=_endless(action.for_s), profile=profile)
    other = None if action.like is None else now.speed(action.like)
    if action.to_kmh is not None:
        speed = action.to_kmh / KMH_PER_MPS
    elif other is not None:
        speed = max(other * action.factor + action.plus_kmh / KMH_PER_MPS, 0.0)
    else:
        return None
    duration = abs(speed - begin) / action.rate_mps2 if action.rate_mps2 else action.over_s or 0.0
    change = ChangeSpeed(vehicle, speed, duration, action.shape, _endless(action.for_s))
    if not action.continuous or action.like is None:
        return change
    plus = action.plus_kmh / KMH_PER_MPS
    return dataclasses.replace(change, like=now.vehicle_id(action.like), factor=action.factor, plus=plus)


def _braking(vehicle: str, now: float, speed: float, deceleration: float, hold: float | None) -> ChangeSpeed:
    to = min(speed, now)
    return ChangeSpeed(vehicle, to, (now - to) / deceleration, Shape.LINEAR, _endless(hold))


def _switches(vehicle: str, doing: VehicleActions) -> Iterator[SetLamps]:
    if doing.break_down and not doing.break_down.lamps:
        yield SetLamps(vehicle, failed=ALL_LAMPS)
    if doing.break_down and doing.break_down.hazard_lights:
        yield SetLamps(vehicle, lit=_HAZARD)
    if doing.lamps is not None:
        yield from lamp_switches(vehicle, doing.lamps)
    if doing.hazard_lights is not None:
        lit, own = (_HAZARD, Lamp.NONE) if doing.hazard_lights else (Lamp.NONE, _HAZARD)
        yield SetLamps(vehicle, lit=lit, automatic=own)


def _arrival(vehicle: str, action: ArriveAction, now: Situation) -> Arrive:
    other = now.vehicle_id(action.vehicle)
    speed = None if action.to_kmh is None else action.to_kmh / KMH_PER_MPS
    steady = action.steady_m, action.steady_s
    return Arrive(vehicle, other, action.distance_m, action.its_distance_m, speed, action.factor, *steady)


def _path(vehicle: str, action: PathAction) -> FollowPath:
    headed = [(*point[:2], math.radians(point[2]) if len(point) > 2 else math.nan) for point in action.points]
    speed = None if action.speed_kmh is None else action.speed_kmh / KMH_PER_MPS
    return FollowPath(vehicle, tuple(headed), action.at_s, action.ahead_m, speed, action.stays, action.origin)


def _stopping(vehicle: str, action: StopAction, now: float | None) -> Stop | None:
    stand = _endless(action.for_s)
    if action.after_m is not None:
        return Stop(vehicle, action.after_m, action.deceleration_mps2, stand)
    if action.position_m is None or now is None:
        return None
    return Stop(vehicle, max(action.position_m - now, 0.0), action.deceleration_mps2, stand)


def _lane_change(vehicle: str, action: LaneAction, subject: str, speed: float, now: Situation) -> ChangeLane | None:
    oncoming = action.to == "oncoming"
    lanes, wanted = action.lanes or int(oncoming), None if action.to == "oncoming" else action.to
    if action.to_lane_of is not None:
        other = now.lane(action.to_lane_of)
        wanted = None if other is None else other + lanes
    if not oncoming and (action.to is not None or action.to_lane_of is not None):
        own = now.lane(subject)
        if own is None or wanted is None:
            return None
        lanes = wanted - own
    duration = action.duration_s
    if action.distance_m is not None:
        duration = min(action.distance_m / max(speed, _SLOWEST), LONGEST_CHANGE)
    return ChangeLane(vehicle, lanes, action.stay_s, duration, action.indicator_s, oncoming, action.offset_m)


def _density(action: FogActions, reference: float) -> float:
    if action.density is not None:
        return action.density
    visibility = math.inf if action.visibility_m is None else action.visibility_m
    return extinction_from_visibility(visibility) / reference if reference > 0.0 else 0.0


def fog_reference(entries: Sequence[TimelineEntry], extinction: float) -> float:
    """Extinction coefficient to which densities refer: the scenario's own, or the densest of the timeline's [1/m]."""
    wanted = [
        extinction_from_visibility(doing.visibility_m)
        for entry in entries
        for _, doing in operations(entry)
        if isinstance(doing, FogActions) and doing.visibility_m is not None
    ]
    return extinction if extinction > 0.0 else max(wanted, default=0.0)


def light_range(entries: Sequence[TimelineEntry], illuminance: float) -> tuple[float, float]:
    """Lowest and highest horizontal illuminance that there may be in a run [lx] (`illuminance` [lx])."""
    doings = [doing for entry in entries for _, doing in operations(entry)]
    levels = [illuminance, *(doing.illuminance_lx for doing in doings if isinstance(doing, LightActions))]
    return min(levels), max(levels)


def scripted_fog(entries: Sequence[TimelineEntry], config: FogConfig) -> FogConfig:
    """A fog that can reach the densities that a timeline gives it; clear air becomes fog of density 0."""
    fog = config.field
    reference = fog_reference(entries, fog.extinction)
    changes = [doing for entry in entries for _, doing in operations(entry) if isinstance(doing, FogActions)]
    if not changes:
        return config
    densities = tuple(_density(change, reference) for change in changes)
    fog = dataclasses.replace(fog, reachable_densities=densities)
    if not (fog.extinction > 0.0 or reference == 0.0 or config.banks):
        clear = FogChange(0.0, 0.0, fog.base, fog.top)
        fog = dataclasses.replace(fog, extinction=reference, changes=(clear,))
    return dataclasses.replace(config, field=fog)
