"""From a scenario to the ego's sensors, and what these know of themselves."""

import dataclasses
import math

from fogsim.atmosphere import airlight_from_illuminance
from fogsim.camera import USUAL_MOUNTS, AutoExposure, BodyPitch, CameraMount, CameraSensor, Metering, Sensor, Suspension
from fogsim.scenario.camera_schema import CameraSection
from fogsim.scenario.schema import Scenario
from fogsim.scenario.sensors.reports import RoadsideCamera
from fogsim.sensors import Gps, LeadSensor, Scatterometer
from fogsim.values import Camera

AIRLIGHT_EXPOSURE = 0.6
"""Share of saturation at which the fixed exposure puts the airlight: bright fog, yet room for lamps above it."""

CAR = "car"
"""Body kind of an ego by default."""

METERED_PERCENT = {Metering.HIGHLIGHTS: 65.0, Metering.LOG_AVERAGE: 18.0}
"""Share of saturation at which automatic exposure holds what it meters, where a scenario does not say [%]."""


def camera_mount(scenario: Scenario, body: str = CAR) -> CameraMount:
    """Where on the ego its camera is."""
    section, usual = scenario.camera, USUAL_MOUNTS[body]
    return CameraMount(
        height=usual.height if section.mount_height_m is None else section.mount_height_m,
        setback=usual.setback if section.setback_m is None else section.setback_m,
    )


def camera(scenario: Scenario, body: str = CAR) -> Camera:
    """Calibration of the ego's camera."""
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
        black_level=section.black_level_percent / 100.0,
    )


def assumed_camera(scenario: Scenario, body: str = CAR) -> Camera:
    """Calibration that the ego's estimators assume, with the scenario's errors in it."""
    true, errors = camera(scenario, body), scenario.camera.told
    return dataclasses.replace(
        true,
        mount_height=true.mount_height * (1.0 + errors.mount_height_error_percent / 100.0),
        pitch=true.pitch + math.radians(errors.pitch_error_deg),
        roll=true.roll + math.radians(errors.roll_error_deg),
        focal_length=true.focal_length * (1.0 + errors.focal_length_error_percent / 100.0),
    )


def camera_sensor(scenario: Scenario) -> CameraSensor:
    """What takes the pictures of the ego's camera."""
    section = scenario.camera
    auto = auto_exposure(scenario) if section.automatic else None
    period = scenario.clocks.camera_period_s
    return CameraSensor(camera(scenario), sensor(scenario), auto, section.lens_shading, period, section.lens_glare)


def sensor(scenario: Scenario) -> Sensor:
    """Image sensor of the ego's camera, at the exposure that it has if it is fixed."""
    section = scenario.camera
    airlight = max(airlight_from_illuminance(scenario.light.illuminance_lx, scenario.fog.airlight_share))
    return Sensor(
        saturation_luminance=section.saturation_luminance_cdpm2 or airlight / AIRLIGHT_EXPOSURE,
        full_well=section.full_well_e,
        read_noise=section.read_noise_e,
        bits=section.bits,
        black_level=section.black_level_percent / 100.0,
        gained_read_noise=section.gained_read_noise_e,
    )


def auto_exposure(scenario: Scenario) -> AutoExposure:
    """How the ego's camera sets its own exposure."""
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
    """How the ego's body pitches when it brakes."""
    body = scenario.camera.body
    suspension = Suspension(math.radians(body.pitch_deg_per_mps2), body.time_constant_s)
    return BodyPitch(suspension, scenario.clocks.camera_period_s)


def roadside_scenario(scenario: Scenario, section: RoadsideCamera) -> Scenario:
    """The scenario with a roadside camera in place of the ego's, and the estimator that reads it."""
    place = {
        name: getattr(section, name) for name in type(section).model_fields.keys() & CameraSection.model_fields.keys()
    }
    alone = {"focal_length_px": None, "principal_point_px": None, "roll_deg": 0.0}
    camera = scenario.camera.model_copy(update={**place, **alone})
    return scenario.model_copy(update={"camera": camera, "estimators": (section.estimator,)})


def lead_sensor(scenario: Scenario) -> LeadSensor:
    """Radar of the ego."""
    lead = scenario.sensors.lead
    view = math.radians(lead.field_of_view_deg)
    return LeadSensor(lead.reach_m, lead.distance_deviation_m, lead.speed_deviation_mps, view)


def gps(scenario: Scenario) -> Gps:
    """Satellite positioning of the ego."""
    section = scenario.sensors.gps
    return Gps(section.position_deviation_m, math.radians(section.heading_deviation_deg))


def scatterometer(scenario: Scenario) -> Scatterometer | None:
    """The ego's forward-scatter visibility sensor, if it has one."""
    section = scenario.sensors.scatterometer
    if section is None:
        return None
    return Scatterometer(section.relative_deviation, section.calibration_deviation, section.averaging_time_s)
