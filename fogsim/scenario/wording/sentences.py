"""A scenario in words: settings that are not defaults, and sentences as a paper's methods section needs them."""

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from fogsim.advice import ADVISERS
from fogsim.core.registry import Registry
from fogsim.errors import InputError
from fogsim.estimators import ESTIMATORS
from fogsim.scenario.build import traffic_setup
from fogsim.scenario.fog import Fog
from fogsim.scenario.parts.methods import DISPLAYS
from fogsim.scenario.roads.files import traffic_files
from fogsim.scenario.schema import ScenarioFile
from fogsim.scenario.section import key_descriptions
from fogsim.simulation.road_sections import stations
from fogsim.simulation.run_config import NO_RENDERER
from fogsim.traffic import FOLLOWING_MODELS, SPEED_CHOICES
from fogsim.traffic.drivers.following import OBSERVED_MIXTURE
from fogsim.traffic.road.configuration import configured_demand, configured_files
from fogsim.traffic.road.demand import read_flows
from fogsim.traffic.road.network import read_net, route_axis
from fogsim.traffic.sumo.loaded_files import planned_way
from fogsim.traffic.templates import usual_mix
from fogsim.units import KMH_PER_MPS

_WORDS = frozenset({"name", "description", "expect", "directory"})
"""Keys that decide nothing about a run."""


class Setting(NamedTuple):
    """A key's value and default as in a scenario file ("" if the key is required), and the key's description."""

    value: str
    default: str
    meaning: str


def non_default_settings(scenario: ScenarioFile) -> dict[str, Setting]:
    """Settings by key path, as in a scenario file."""
    return dict(_of_section(scenario, type(scenario).model_construct(), ()))


def _of_section(section: BaseModel, usual: object, path: tuple[str, ...]) -> Iterator[tuple[str, Setting]]:
    meanings = key_descriptions(type(section))
    for key, field in type(section).model_fields.items():
        if not path and key in _WORDS:
            continue
        value = getattr(section, key)
        default = getattr(usual, key) if isinstance(usual, type(section)) and hasattr(usual, key) else _default(field)
        if value != default:
            yield from _of_value(value, default, (*path, key), meanings.get(key, ""))


def _default(field: FieldInfo) -> object:
    return "" if field.is_required() else field.get_default(call_default_factory=True, validated_data={})


def _of_value(value: object, default: object, path: tuple[str, ...], meaning: str) -> Iterator[tuple[str, Setting]]:
    """Leaves of a value; lists and tables of sections are followed by number and by name."""
    if isinstance(value, BaseModel) and "parameters" not in type(value).model_fields:
        yield from _of_section(value, default, path)
    elif isinstance(value, tuple) and value and isinstance(value[0], BaseModel):
        for number, one in enumerate(value):
            yield from _of_value(one, None, (*path, str(number)), meaning)
    elif isinstance(value, dict) and value and isinstance(next(iter(value.values())), BaseModel):
        for name, one in value.items():
            yield from _of_value(one, None, (*path, name), meaning)
    else:
        usual = "" if default is None and isinstance(value, BaseModel) else shown_value(default)
        yield ".".join(path), Setting(shown_value(value), usual, " ".join(meaning.split()))


def shown_value(value: Any) -> str:
    """A value as in a scenario file; methods by name with their parameters."""
    if isinstance(value, BaseModel):
        value = value.model_dump(mode="json", exclude_defaults=True)
    if isinstance(value, dict):
        method, others = value.get("method"), {key: one for key, one in value.items() if key != "method"}
        if method is not None and not others:
            return str(method)
        return "{" + ", ".join(f"{key}: {shown_value(one)}" for key, one in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(shown_value, value)) + "]"
    if isinstance(value, bool) or value is None:
        return {True: "true", False: "false", None: "none"}[value]
    return f"{value:.10g}" if isinstance(value, float) else str(value)


_CITATION = re.compile(r"[A-Z][\w-]+(?:(?:,| &| et al\.| van der| [A-Z][\w-]+)+)*,? (?:19|20)\d\d")
_VISIBILITY = "Meteorological: the distance at which 5 % contrast is left, ln 20 over the extinction coefficient k."


def _run_words(scenario: ScenarioFile) -> str:
    traffic, clocks = scenario.traffic, scenario.clocks
    if not traffic.has_ego:
        begin = f"Traffic alone; each run lasts at most {scenario.duration_s:g} s after a warm-up of "
        begin += f"{traffic.warm_up_s:g} s."
    else:
        begin = f"Each run lasts at most {scenario.duration_s:g} s from the appearance of the ego vehicle "
        begin += f"({traffic.ego})" + (", or until it collides." if scenario.end_on_collision else ".")
    end = f" It ends when {scenario.end_when}." if scenario.end_when is not None else ""
    about = " ".join(scenario.description.split())
    return (
        f"{scenario.name}: {about} {begin}{end} Steps: traffic {clocks.traffic_step_s:g} s, sensors "
        f"{clocks.camera_period_s:g} s, decisions {clocks.decision_period_s:g} s."
    )


def empty_start(scenario: ScenarioFile) -> str:
    """A warning if the network of a run without ego is empty at its start; "" if it is not."""
    if scenario.traffic.has_ego or scenario.road is not None or scenario.traffic.warm_up_s > 0.0:
        return ""
    return (
        "The warm-up is 0 s, so vehicles that depart from the simulation's begin on find an empty road; set "
        "traffic.warm_up_s to about the time that a vehicle needs for the road."
    )


def _net_of(scenario: ScenarioFile) -> Path | None:
    config = scenario.traffic.config
    return traffic_files(scenario).net if config is None else configured_files(scenario.directory / config)[0]


def _road_words(scenario: ScenarioFile) -> str:
    net, way = _net_of(scenario), scenario.traffic.along
    if net is None:
        return "The network is that of the running simulation."
    source = f"template {scenario.road.template}" if scenario.road is not None else net.name
    try:
        planned = planned_way(traffic_setup(scenario))
        way = planned.edges if planned is not None else way
        roads = read_net(net)
        if not way:
            return f"SUMO network {source} with {len(roads.edges)} edges."
        axis, _ = route_axis(roads, way)
    except (InputError, KeyError):
        return f"SUMO network {source}."
    lanes = _span(len(roads.edges[edge]) for edge in way)
    limits = _span(KMH_PER_MPS * roads.speed_limit(edge) for edge in way)
    whose = "ego's route" if scenario.traffic.has_ego else "road along which positions count"
    length = float(stations(axis)[-1]) / 1000.0
    return f"SUMO network: {source}. The {whose}: {length:.3g} km, lanes {lanes}, limit {limits} km/h."


def _span(values: Iterator[float]) -> str:
    known = sorted({round(value) for value in values})
    return f"{known[0]}" if len(known) == 1 else f"{known[0]} to {known[-1]}"


def _demand_words(scenario: ScenarioFile) -> str:
    if scenario.road is not None:
        demand = scenario.demand
        rates = {} if demand is None else {key: value for key, value in demand if key.endswith("_vph") and value}
        flows = ", ".join(f"{key.removesuffix('_vph').replace('_', ' ')} {value:g}" for key, value in rates.items())
        written = None if demand is None else demand.mix
        shares = dict(usual_mix(scenario.road.template)) if written is None else written
        mix = {name: share for name, share in shares.items() if share}
        return (f"Vehicles per hour: {flows} ({_shares(mix)})." if flows else "No traffic flows.") + _actors(scenario)
    config, files = scenario.traffic.config, traffic_files(scenario)
    of_config = () if config is None else configured_demand(scenario.directory / config).files
    found = read_flows((*of_config, *files.additional, *files.routes))
    total = math.fsum(found.rates.values())
    text = f"Flows: {found.flows}, of all directions"
    text += f", together {total:.0f} vehicles/h while all of them last ({_shares(found.rates)})" if total else ""
    single = ", ".join(f"{name} {number:.3g}" for name, number in found.single.items())
    text += f"; vehicles that depart one by one, by type: {single}" if single else ""
    return text + ("." if found.is_whole else "; not all demand files could be read.") + _actors(scenario)


def _actors(scenario: ScenarioFile) -> str:
    scripted = len(scenario.traffic.events) + len(scenario.timeline)
    actors = f" Actors placed by the scenario: {', '.join(scenario.actors)}." if scenario.actors else ""
    return actors + (f" Scripted events: {scripted}." if scripted else "")


def _shares(numbers: Mapping[str, float]) -> str:
    total = math.fsum(numbers.values()) or 1.0
    return ", ".join(f"{name} {100.0 * n / total:.3g} %" for name, n in numbers.items())


def _fog_words(scenario: ScenarioFile) -> str:
    fog, outside = scenario.fog, scenario.fog.outside_visibility_m
    if fog.visibility_m is not None:
        everywhere = f"Meteorological visibility {fog.visibility_m:g} m everywhere"
        text = "Clear air" if math.isinf(fog.visibility_m) else everywhere
    else:
        banks = "; ".join(
            f"{one.visibility_m:g} m from {one.start_m:g} to {one.end_m:g} m (edges of {one.edge_m:g} m)"
            for one in fog.banks
        )
        text = "Clear air" if outside is None or math.isinf(outside) else f"Meteorological visibility {outside:g} m"
        text += f" outside banks, and {banks or 'no banks'}"
    return f"{text}{_layers(fog)}; illuminance by the sky {scenario.light.illuminance_lx:g} lx."


def _layers(fog: Fog) -> str:
    parts = [f"up to {fog.top_m:g} m above the lowest point of the road"] if math.isfinite(fog.top_m) else []
    parts += [f"from {fog.base_m:g} m on"] if fog.base_m is not None else []
    parts += [f"thinning upwards with a scale height of {fog.scale_height_m:g} m"] if fog.scale_height_m else []
    if fog.patches is not None:
        seed = "drawn for each seed" if fog.patches.seed is None else f"the same in every run (seed {fog.patches.seed})"
        parts.append(
            f"with log-normal patches, {seed}, of correlation length {fog.patches.correlation_length_m:g} m and "
            f"standard deviation {fog.patches.strength:g} of ln k"
        )
    parts += [f"in a wind of {fog.wind.speed_kmh:g} km/h from {fog.wind.from_deg:g}°"] if fog.wind else []
    parts += [f"changing at {', '.join(f'{one.at_s:g} s' for one in fog.changes)}"] if fog.changes else []
    return "".join(f", {part}" for part in parts)


def _sensor_words(scenario: ScenarioFile) -> str:
    drivers, reports = scenario.drivers, scenario.sensors.reports
    roadside = f" Roadside sensors: {shown_value(reports.roadside)}." if reports.roadside is not None else ""
    if scenario.traffic.has_ego and scenario.renderer != NO_RENDERER:
        camera = scenario.camera
        methods = [one.method for one in scenario.estimators]
        image = f"{camera.width} × {camera.height} px, an image every {scenario.clocks.camera_period_s:g} s"
        text = f"Estimators {', '.join(methods)}{_cited(ESTIMATORS, methods)} read the ego's camera ({image}); "
        text += f"{scenario.fusion.method} fuses their estimates."
    elif scenario.traffic.has_ego:
        text = "No camera is simulated, since nothing in the run depends on it."
    elif drivers.advised in DISPLAYS:
        text = "Each advised section of road has its own visibility meter."
    else:
        text = "Visibility meters stand every 100 m along the road, and the lowest reading counts."
        text = text if scenario.traffic.along else "One visibility meter stands for the whole network."
    return text + roadside


def _advice_words(scenario: ScenarioFile) -> str:
    advice, drivers = scenario.advice, scenario.drivers
    if advice.method == "none":
        return "No speed is advised."
    informed = {"belief": "the ego's belief", "truth": "the true visibility", "sensors": "sensor reports"}
    given = f" with {shown_value(advice.parameters)}" if advice.parameters else ""
    text = f"{advice.method}{given}{_cited(ADVISERS, [advice.method])}, informed by {informed[advice.informed_by]}; "
    text += f"advised: {drivers.advised}."
    if drivers.advised == "signs":
        signs = drivers.signs
        where = ", ".join(f"{at:g}" for at in signs.at_m) or f"{signs.from_m:g} and then every {signs.spacing_m:g}"
        last = "the end of the road" if math.isinf(signs.to_m) else f"{signs.to_m:g} m"
        text += f" Signs at {where} m, the last valid to {last}."
    elif drivers.advised == "stretch":
        text += f" The stretch is from {drivers.advised_stretch.start_m:g} to {drivers.advised_stretch.end_m:g} m."
    elif drivers.advised == "equipped":
        text += f" {100.0 * drivers.equipped_share:g} % of the vehicles are equipped."
    return text


def _driver_words(scenario: ScenarioFile) -> str:
    drivers, choice = scenario.drivers, scenario.drivers.speed_choice
    kinds = drivers.following or (OBSERVED_MIXTURE if choice.method == "observed" else {"unaffected": 1.0})
    constants = f" with {shown_value(choice.parameters)}" if choice.parameters else ""
    sight = (
        "SUMO's drivers, who see through fog"
        if drivers.see_through_fog
        else "Drivers react to a leader only once the fog lets them see it (Koschmieder for bodies, Allard for lamps), "
        f"{drivers.reaction_time_s:g} s after it comes into sight"
    )
    obeyed = ", ".join(f"{key} {shown_value(value)}" for key, value in drivers.compliance if key != "like")
    return (
        f"{sight}. Speed choice: {choice.method}{constants}{_cited(SPEED_CHOICES, [choice.method])}, with a "
        f"factor for each driver (log-standard deviation {drivers.speed_spread:g}). Car following: {_shares(kinds)}"
        f"{_cited(FOLLOWING_MODELS, kinds)}. Compliance with advice: {obeyed}. FogSim's docs/explanation/drivers.md "
        "describes the models."
    )


def _cited(registry: Registry[Any], names: Iterable[str]) -> str:
    """Publications that the docstrings of registered methods cite, in parentheses; "" if there are none."""
    docs = [" ".join((registry[name].__doc__ or "").split()) for name in names if name in registry.known]
    cited = dict.fromkeys(found for doc in docs for found in _CITATION.findall(doc))
    return f" ({'; '.join(cited)})" if cited else ""


SENTENCES: Mapping[str, Callable[[ScenarioFile], str]] = {
    "Scenario": _run_words,
    "Road": _road_words,
    "Demand": _demand_words,
    "Fog": _fog_words,
    "Visibility": lambda _: _VISIBILITY,
    "Sensors": _sensor_words,
    "Advice": _advice_words,
    "Drivers": _driver_words,
}
"""Sentences on a scenario, by heading."""
