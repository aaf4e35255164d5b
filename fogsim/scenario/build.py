"""From a scenario to what runs are made of; here the units of scenario files become SI and radians, once."""

import contextlib
import math
import os
from collections.abc import Iterable, Iterator
from functools import partial
from pathlib import Path

from fogsim.atmosphere import airlight_from_illuminance
from fogsim.errors import InputError
from fogsim.scenario.document import read_document
from fogsim.scenario.fog import fog_config
from fogsim.scenario.parts.methods import (
    advice_config,
    check_frames,
    controller_config,
    driver_setup,
    driver_sight,
    method,
    own_methods,
    sections_config,
)
from fogsim.scenario.parts.sensors import (
    AIRLIGHT_EXPOSURE,
    METERED_PERCENT,
    camera_config,
    reports_config,
    sensors_config,
)
from fogsim.scenario.roads.files import actors_of, entering_vehicles, traffic_files
from fogsim.scenario.schema import ScenarioFile
from fogsim.scenario.timeline import (
    actions_of,
    entry_name,
    entry_text,
    fog_reference,
    light_range,
    scripted_fog,
    vehicles_of,
)
from fogsim.scenario.timeline.lamps import LampActions, lamp_switches
from fogsim.scenario.traffic_schema import AnyEvent, Brake, BreakDown, ChangeLane, LampsFail
from fogsim.scenario.written_form import deciding
from fogsim.simulation.run_config import Periods, RunConfig, Script, ScriptEntry, WorldConfig
from fogsim.traffic import BrakeEvent, Event, LampFailureEvent, LaneChangeEvent, TrafficSetup, Trigger
from fogsim.traffic.road.configuration import configured_inputs, included_files
from fogsim.traffic.sumo.options import OptionValue
from fogsim.units import KMH_PER_MPS, extinction_from_visibility
from fogsim.values import Pavement

__all__ = [
    "AIRLIGHT_EXPOSURE",
    "METERED_PERCENT",
    "advice_config",
    "camera_config",
    "check_frames",
    "input_files",
    "method",
    "own_methods",
    "periods",
    "reports_config",
    "run_config",
    "sections_config",
    "traffic_setup",
    "world_config",
]


def periods(scenario: ScenarioFile) -> Periods:
    """Clocks of a scenario."""
    clocks = scenario.clocks
    return Periods(
        camera_period=clocks.camera_period_s,
        traffic_steps=round(clocks.camera_period_s / clocks.traffic_step_s),
        decision_frames=round(clocks.decision_period_s / clocks.camera_period_s),
        frames=max(1, round(scenario.duration_s / clocks.camera_period_s)),
    )


def world_config(scenario: ScenarioFile) -> WorldConfig:
    """Fog, light, and what is drawn."""
    illuminance, pavement = scenario.light.illuminance_lx, scenario.pavement
    airlight = airlight_from_illuminance(illuminance, scenario.fog.airlight_share)
    return WorldConfig(
        fog=scripted_fog(scenario.timeline, fog_config(scenario.fog, airlight, scenario.camera.mount_height_m or 0.0)),
        illuminance=illuminance,
        darkest=light_range(scenario.timeline, illuminance)[0],
        renderer=scenario.renderer,
        has_street_lamps=scenario.street_lamps,
        scenery_seed=scenario.scenery_seed,
        pavement=Pavement(pavement.surface, pavement.wheel_tracks, pavement.repairs),
    )


def _script(scenario: ScenarioFile) -> Script:
    """What happens in a run."""
    fog = scenario.fog.visibility_m or scenario.fog.outside_visibility_m or math.inf
    reference = fog_reference(scenario.timeline, extinction_from_visibility(fog))
    entering = entering_vehicles(scenario)
    entries = tuple(
        ScriptEntry(
            name=entry_name(entry, number),
            key=f"timeline.{number}",
            when=entry.when,
            actions=partial(actions_of, entry, reference, entering),
            text=entry_text(entry),
            vehicles=vehicles_of(entry),
            delay=entry.delay_s,
            happens_once=entry.repeat == "once",
        )
        for number, entry in enumerate(scenario.timeline)
    )
    return Script(entries, scenario.end_when)


def input_files(scenario: ScenarioFile) -> tuple[Path, ...]:
    """Files that traffic and methods (not their modules) read, or that these name; InputError if SUMO's are missing."""
    traffic, folder = scenario.traffic, scenario.directory
    named = [path for path in (traffic.config, traffic.net, *traffic.routes, *traffic.additional) if path is not None]
    files = [folder / path for path in named]
    if traffic.config is not None:
        files += configured_inputs(folder / traffic.config)
    files += included_files(files)
    for path in files:
        if not path.is_file():
            source = folder / traffic.config if traffic.config is not None else scenario.name
            raise InputError(f"{source} names {path}, which is not there")
    return tuple(dict.fromkeys((*files, *(folder / name for name in named_files(scenario)))))


def named_files(scenario: ScenarioFile) -> tuple[Path, ...]:
    """Files that parameters and SUMO's options name, and those that YAML files among them name in turn."""
    folder = scenario.directory
    found = list(_files(_free_texts(deciding(scenario)), folder, Path()))
    for path in [one for one in found if one.suffix in (".yaml", ".yml")]:
        with contextlib.suppress(InputError):  # a method has its own way to read a file
            found += _files(_texts(read_document(folder / path).data), folder, path.parent)
    return tuple(dict.fromkeys(found))


def _files(texts: Iterable[str], folder: Path, place: Path) -> Iterator[Path]:
    """Files among texts, which are relative to a place in a folder."""
    names = dict.fromkeys(place / name for text in texts for name in (text, *text.split(",")))
    return (name for name in names if os.path.isfile(folder / name))  # noqa: PTH113 - False for any text


def _texts(data: object) -> Iterator[str]:
    if isinstance(data, str):
        yield data
    elif isinstance(data, dict | list):
        for one in data.values() if isinstance(data, dict) else data:
            yield from _texts(one)


def _free_texts(data: object) -> Iterator[str]:
    """Texts in parameters of methods and in options of SUMO, which may name files."""
    if isinstance(data, dict):
        for key, value in data.items():
            yield from (_texts if key in ("parameters", "sumo_options") else _free_texts)(value)
    elif isinstance(data, list):
        for one in data:
            yield from _free_texts(one)


_CONDITIONS = ("at_position_m", "at_time_s", "at_gap_to_ego_m")


def traffic_setup(scenario: ScenarioFile) -> TrafficSetup:
    """What the traffic stage needs to know."""
    traffic, folder, files = scenario.traffic, scenario.directory, traffic_files(scenario)
    staying = (name for name, actor in actors_of(scenario).items() if actor.stays_in_lane)
    return TrafficSetup(
        net=files.net,
        routes=files.routes,
        additional=files.additional,
        ego=traffic.ego if traffic.has_ego else None,
        step_length=scenario.clocks.traffic_step_s,
        keep_lane=tuple(dict.fromkeys((*traffic.keep_lane, *staying))),
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


def run_config(scenario: ScenarioFile) -> RunConfig:
    """What a run is made of."""
    traffic = scenario.traffic
    return RunConfig(
        traffic=traffic_setup(scenario),
        world=world_config(scenario),
        camera=camera_config(scenario),
        sensors=sensors_config(scenario.sensors),
        reports=reports_config(scenario),
        estimators=tuple(method(scenario, one) for one in scenario.estimators),
        fusion=method(scenario, scenario.fusion),
        advice=advice_config(scenario),
        controller=controller_config(scenario),
        script=_script(scenario),
        periods=periods(scenario),
        equipped_share=traffic.equipped,
        equipped_vehicles=traffic.equipped_vehicles,
        ends_on_collision=scenario.end_on_collision,
        stop_before_end=traffic.stop_before_end_m,
        along=traffic.along,
        cohort=traffic.cohort_s,
        name=scenario.name,
        description=scenario.description,
    )
