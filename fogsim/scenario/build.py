"""From a scenario to the parts of the loop; here the units of scenario files become SI and radians, once."""

import dataclasses
import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fogsim.advice import ADVISERS, Adviser, VehicleAdviser
from fogsim.atmosphere import airlight_from_illuminance
from fogsim.camera import (
    USUAL_MOUNTS,
    AutoExposure,
    BodyPitch,
    CameraMount,
    CameraSensor,
    Metering,
    Sensor,
    Suspension,
)
from fogsim.errors import InputError
from fogsim.estimators import ESTIMATORS, Estimator
from fogsim.fusion import FUSIONS, Fusion
from fogsim.lighting import LIGHTING_POLICIES, LightingPolicy
from fogsim.metrics import SafetyStandard
from fogsim.obstruction import tunnels_of
from fogsim.scenario.drivers import driver_setup, driver_sight
from fogsim.scenario.fog import fog_along
from fogsim.scenario.roads.files import actors_of, traffic_files
from fogsim.scenario.schema import NO_RENDERER, Scenario
from fogsim.scenario.timeline import scripted_fog
from fogsim.scenario.timeline.lamps import LampActions, lamp_switches
from fogsim.scenario.traffic_schema import AnyEvent, Brake, BreakDown, ChangeLane, LampsFail
from fogsim.sensors import Gps, LeadSensor
from fogsim.traffic import (
    BrakeEvent,
    Event,
    LampFailureEvent,
    LaneChangeEvent,
    TrafficSetup,
    Trigger,
)
from fogsim.traffic.sumo.options import OptionValue
from fogsim.units import KMH_PER_MPS, clock_time
from fogsim.values import Camera, FogField, Structure

AIRLIGHT_EXPOSURE = 0.6
"""Share of saturation at which the fixed exposure puts the airlight: bright fog, yet room for lamps above it."""

CAR = "car"
"""Body kind of an ego of which no more is known."""

METERED_PERCENT = {Metering.HIGHLIGHTS: 65.0, Metering.LOG_AVERAGE: 18.0}
"""Share of saturation at which automatic exposure holds what it meters, where a scenario does not say [%]."""


@dataclasses.dataclass(frozen=True, slots=True)
class Periods:
    """The clocks as whole numbers.

    Attributes
    ----------
    camera_period : float
        Time between frames [s].
    traffic_steps : int
        Traffic steps in one camera period.
    decision_frames : int
        Camera periods in one decision period.
    frames : int
        Most camera periods that a run may last.
    """

    camera_period: float
    traffic_steps: int
    decision_frames: int
    frames: int

    def time(self, index: int) -> float:
        """Time of a camera period since the run began [s].

        Parameters
        ----------
        index : int
            Number of the camera period, from 0.
        """
        return clock_time(index * self.camera_period)


def periods(scenario: Scenario) -> Periods:
    """Clocks of a scenario.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    """
    clocks = scenario.clocks
    return Periods(
        camera_period=clocks.camera_period_s,
        traffic_steps=round(clocks.camera_period_s / clocks.traffic_step_s),
        decision_frames=round(clocks.decision_period_s / clocks.camera_period_s),
        frames=max(1, round(scenario.duration_s / clocks.camera_period_s)),
    )


_CONDITIONS = ("at_position_m", "at_time_s", "at_gap_to_ego_m")


def traffic_setup(scenario: Scenario) -> TrafficSetup:
    """What the traffic stage needs to know.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    """
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


def _staying_actors(scenario: Scenario) -> Iterator[str]:
    """Actors that stay in their lanes."""
    return (name for name, actor in actors_of(scenario).items() if actor.stays_in_lane)


def _switched_lamps(scenario: Scenario) -> Iterator[Event]:
    """Actors whose lamps are not their own when the run begins."""
    for name, actor in scenario.actors.items():
        if actor.lamps != "on":
            switches = tuple(lamp_switches(name, actor.lamps)) if isinstance(actor.lamps, LampActions) else ()
            yield LampFailureEvent(name, Trigger(None, 0.0, None, f"actors.{name}.lamps"), switches)


def _events(written: AnyEvent, place: int) -> tuple[Event, ...]:
    """What an event of a scenario file, at a place in its list, stands for."""
    vehicle = written.vehicle
    conditions = {key: value for key in _CONDITIONS if (value := getattr(written, key)) is not None}
    told = " or ".join(f"{key}={value:g}" for key, value in conditions.items())
    name = f"traffic.events.{place} ({written.kind} of {vehicle} {told})"
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


def camera_mount(scenario: Scenario, body: str = CAR) -> CameraMount:
    """Where on the ego its camera is.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    body : str
        Body kind of the ego, which settles what the scenario leaves open; see `TrafficState.types`.
    """
    section, usual = scenario.camera, USUAL_MOUNTS[body]
    return CameraMount(
        height=usual.height if section.mount_height_m is None else section.mount_height_m,
        setback=usual.setback if section.setback_m is None else section.setback_m,
    )


def camera(scenario: Scenario, body: str = CAR) -> Camera:
    """Calibration of the ego's camera.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    body : str
        Body kind of the ego; see `camera_mount`.
    """
    section = scenario.camera
    by_view = 0.5 * section.width / math.tan(0.5 * math.radians(section.field_of_view_deg))
    return Camera(
        width=section.width,
        height=section.height,
        focal_length=section.focal_length_px or by_view,
        principal_point=section.principal_point_px or (section.width / 2, section.height / 2),
        mount_height=camera_mount(scenario, body).height,
        pitch=math.radians(section.pitch_deg),
        roll=math.radians(section.roll_deg),
        response=section.response,
        bits=section.bits,
    )


def assumed_camera(scenario: Scenario, body: str = CAR) -> Camera:
    """Calibration that the ego's estimators assume, with the scenario's errors in it.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    body : str
        Body kind of the ego; see `camera_mount`.
    """
    true, told = camera(scenario, body), scenario.camera.told
    return dataclasses.replace(
        true,
        mount_height=true.mount_height * (1.0 + told.mount_height_error_percent / 100.0),
        pitch=true.pitch + math.radians(told.pitch_error_deg),
        roll=true.roll + math.radians(told.roll_error_deg),
        focal_length=true.focal_length * (1.0 + told.focal_length_error_percent / 100.0),
    )


def camera_sensor(scenario: Scenario) -> CameraSensor:
    """What takes the pictures of the ego's camera.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    """
    section = scenario.camera
    auto = auto_exposure(scenario) if section.automatic else None
    period = scenario.clocks.camera_period_s
    return CameraSensor(camera(scenario), sensor(scenario), auto, section.lens_shading, period, section.lens_glare)


def sensor(scenario: Scenario) -> Sensor:
    """Image sensor of the ego's camera, at the exposure that it has if it is fixed.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    """
    section = scenario.camera
    airlight = max(airlight_from_illuminance(scenario.light.illuminance_lx))
    return Sensor(
        saturation_luminance=section.saturation_luminance_cdpm2 or airlight / AIRLIGHT_EXPOSURE,
        full_well=section.full_well_e,
        read_noise=section.read_noise_e,
        bits=section.bits,
    )


def auto_exposure(scenario: Scenario) -> AutoExposure:
    """How the ego's camera sets its own exposure.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    """
    section = scenario.camera.exposure
    percent = METERED_PERCENT[section.metering] if section.target_percent is None else section.target_percent
    return AutoExposure(
        metering=section.metering,
        target=percent / 100.0,
        time_constant=section.time_constant_s,
        brightest=section.brightest_cdpm2,
        ungained=section.ungained_cdpm2,
        darkest=section.darkest_cdpm2,
    )


def body_pitch(scenario: Scenario) -> BodyPitch:
    """How the ego's body pitches when it brakes.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    """
    body = scenario.camera.body
    suspension = Suspension(math.radians(body.pitch_deg_per_mps2), body.time_constant_s)
    return BodyPitch(suspension, scenario.clocks.camera_period_s)


def lead_sensor(scenario: Scenario) -> LeadSensor:
    """Radar of the ego.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    """
    lead = scenario.sensors.lead
    view = math.radians(lead.field_of_view_deg)
    return LeadSensor(lead.reach_m, lead.distance_deviation_m, lead.speed_deviation_mps, view)


def gps(scenario: Scenario) -> Gps:
    """Satellite positioning of the ego.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    """
    section = scenario.sensors.gps
    return Gps(section.position_deviation_m, math.radians(section.heading_deviation_deg))


def fog_field(scenario: Scenario, route: NDArray[np.float64], structures: Sequence[Structure] = ()) -> FogField:
    """Fog of a scenario, laid along the ego's route.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    route : (n, 3) float64
        Polyline along the route [m].
    structures : sequence of Structure
        What stands beside the roads and over them; tunnels keep fog out.
    """
    airlight = airlight_from_illuminance(scenario.light.illuminance_lx)
    fog = fog_along(scenario.fog, airlight, route, tunnels_of(structures))
    return scripted_fog(scenario.timeline, fog)


def check_ego(scenario: Scenario, who: str) -> None:
    """Refuse a scenario without an ego.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    who : str
        Who needs it, for the message.

    Raises
    ------
    InputError
        If its ego is none.
    """
    if not scenario.traffic.has_ego:
        raise InputError(
            f"{who} needs an ego vehicle, and traffic.ego is none; name one, or run traffic alone with fogsim "
            "run, fogsim study or fogsim.run_traffic"
        )


def check_frames(scenario: Scenario, who: str) -> None:
    """Refuse a scenario that draws no frames.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    who : str
        Who needs them, for the message.

    Raises
    ------
    InputError
        If its renderer is "none", or its ego is.
    """
    check_ego(scenario, who)
    if scenario.renderer == NO_RENDERER:
        raise InputError(f"{who} needs frames, and renderer: none draws none; choose auto, opengl, cpu or reference")


def estimators(scenario: Scenario, assumed: Camera) -> tuple[Estimator, ...]:
    """Estimators of a scenario, with the calibration that the vehicle assumes.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    assumed : Camera
        The assumed calibration.
    """
    return tuple(ESTIMATORS.find(e.method, scenario.directory)(assumed, **e.parameters) for e in scenario.estimators)


def fusion(scenario: Scenario) -> Fusion:
    """Fusion of a scenario.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    """
    return FUSIONS.find(scenario.fusion.method, scenario.directory)(**scenario.fusion.parameters)


def adviser(scenario: Scenario) -> Adviser | VehicleAdviser:
    """Speed adviser of a scenario.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    """
    return ADVISERS.find(scenario.advice.method, scenario.directory)(**scenario.advice.parameters)


def road_adviser(scenario: Scenario) -> Adviser:
    """Speed adviser of a scenario, who advises roads.

    Parameters
    ----------
    scenario : Scenario
        The scenario.

    Raises
    ------
    InputError
        If it needs the sensors of a vehicle.
    """
    advising = adviser(scenario)
    if isinstance(advising, VehicleAdviser):
        raise InputError(
            f"advice: {scenario.advice.method!r} goes by a vehicle's own sensors (advise_vehicle), which roads do not "
            f"have; with drivers.advised: {scenario.drivers.advised} take an adviser with advise()"
        )
    return advising


def own_methods(scenario: Scenario) -> dict[str, str]:
    """Versions of the methods of a scenario that are not FogSim's, by their names.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    """
    folder = scenario.directory
    found = {
        **{one.method: ESTIMATORS.version(one.method, folder) for one in scenario.estimators},
        scenario.fusion.method: FUSIONS.version(scenario.fusion.method, folder),
        scenario.advice.method: ADVISERS.version(scenario.advice.method, folder),
        scenario.lighting.method: LIGHTING_POLICIES.version(scenario.lighting.method, folder),
    }
    return {name: version for name, version in found.items() if version is not None}


def safety_standard(scenario: Scenario) -> SafetyStandard:
    """What a run is judged by: the reaction time and deceleration that its advice counts with, where it has them.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    """
    advising, usual = adviser(scenario), SafetyStandard()
    return dataclasses.replace(
        usual,
        reaction_time=getattr(advising, "reaction_time", usual.reaction_time),
        deceleration=getattr(advising, "deceleration", usual.deceleration),
    )


def lighting_policy(scenario: Scenario) -> LightingPolicy:
    """Lighting policy of a scenario.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    """
    policy = LIGHTING_POLICIES.find(scenario.lighting.method, scenario.directory)
    return policy(**scenario.lighting.parameters)
