"""From a scenario to the traffic that it asks for."""

from collections.abc import Iterator
from pathlib import Path

from fogsim.scenario.parts.drivers import driver_setup, driver_sight
from fogsim.scenario.roads.files import actors_of, traffic_files
from fogsim.scenario.schema import ScenarioFile
from fogsim.scenario.timeline.lamps import LampActions, lamp_switches
from fogsim.scenario.traffic_schema import AnyEvent, Brake, BreakDown, ChangeLane, LampsFail
from fogsim.traffic import BrakeEvent, Event, LampFailureEvent, LaneChangeEvent, TrafficSetup, Trigger
from fogsim.traffic.sumo.options import OptionValue
from fogsim.units import KMH_PER_MPS

_CONDITIONS = ("at_position_m", "at_time_s", "at_gap_to_ego_m")


def traffic_setup(scenario: ScenarioFile) -> TrafficSetup:
    """What the traffic stage needs to know."""
    traffic, folder, files = scenario.traffic, scenario.directory, traffic_files(scenario)
    return TrafficSetup(
        net=files.net,
        routes=files.routes,
        additional=files.additional,
        ego=traffic.ego if traffic.has_ego else None,
        step_length=scenario.clocks.traffic_step_s,
        keep_lane=tuple(dict.fromkeys((*traffic.keep_lane, *_staying_actors(scenario)))),
        warm_up_limit=traffic.warm_up_limit_s,
        warm_up=traffic.warm_up_s,
        advice_deceleration=traffic.advice_deceleration_mps2,
        reading_radius=traffic.reading_radius_m,
        events=(
            *(e for place, one in enumerate(traffic.events) for e in _events(one, place)),
            *_switched_lamps(scenario),
        ),
        sight=driver_sight(scenario),
        drivers=driver_setup(scenario),
        after_collision=traffic.after_collision,
        config=None if traffic.config is None else folder / traffic.config,
        sumo_options=tuple((name, _option_text(value, folder)) for name, value in traffic.sumo_options.items()),
    )


def _option_text(value: OptionValue, folder: Path) -> str:
    """Value of an option on SUMO's command line; files that lie in the scenario's folder are named by their place."""
    if isinstance(value, bool):
        return str(value).lower()
    if not isinstance(value, str):
        return str(value)
    return ",".join(str(folder / name) if name and (folder / name).is_file() else name for name in value.split(","))


def _staying_actors(scenario: ScenarioFile) -> Iterator[str]:
    """Actors that stay in their lanes."""
    return (name for name, actor in actors_of(scenario).items() if actor.stays_in_lane)


def _switched_lamps(scenario: ScenarioFile) -> Iterator[Event]:
    """Actors whose lamps are not their own when the run begins."""
    for name, actor in scenario.actors.items():
        if actor.lamps != "on":
            switches = tuple(lamp_switches(name, actor.lamps)) if isinstance(actor.lamps, LampActions) else ()
            yield LampFailureEvent(name, Trigger(None, 0.0, None, f"actors.{name}.lamps"), switches)


def _events(written: AnyEvent, place: int) -> tuple[Event, ...]:
    """What an event of a scenario file, at a place in its list, stands for."""
    vehicle = written.vehicle
    conditions = {key: value for key in _CONDITIONS if (value := getattr(written, key)) is not None}
    begins = " or ".join(f"{key}={value:g}" for key, value in conditions.items())
    name = f"traffic.events.{place} ({written.kind} of {vehicle} {begins})"
    trigger = Trigger(written.at_position_m, written.at_time_s, written.at_gap_to_ego_m, name)
    match written:
        case Brake():
            speed = written.to_speed_kmh / KMH_PER_MPS
            return (BrakeEvent(vehicle, trigger, speed, written.deceleration_mps2, written.hold_s),)
        case BreakDown():
            stop = BrakeEvent(vehicle, trigger, deceleration=written.deceleration_mps2)
            return (stop,) if written.lamps else (stop, LampFailureEvent(vehicle, trigger))
        case ChangeLane():
            return (LaneChangeEvent(vehicle, trigger, written.lanes, written.stay_s),)
        case LampsFail():
            return (LampFailureEvent(vehicle, trigger),)
