"""From a scenario to the ego's camera and other sensors, and to senders of reports."""

import math

from fogsim.atmosphere import airlight_from_illuminance
from fogsim.camera import (
    USUAL_MOUNTS,
    AutoExposure,
    CalibrationErrors,
    CameraConfig,
    CameraMount,
    Metering,
    Sensor,
    Shutter,
    StereoConfig,
    Suspension,
)
from fogsim.scenario.camera_schema import CalibrationErrors as WrittenErrors
from fogsim.scenario.camera_schema import CameraSection, Exposure, StereoSection
from fogsim.scenario.parts.methods import method
from fogsim.scenario.schema import ScenarioFile
from fogsim.scenario.section import in_si
from fogsim.scenario.sensors.faults import fault_of
from fogsim.scenario.sensors.schema import (
    CameraReports,
    RoadsideCamera,
    RoadsideReports,
    Sensors,
    VehicleReports,
)
from fogsim.sensors import Gps, LeadSensor
from fogsim.simulation.run_config import (
    LightSensor,
    MastCamera,
    RadioSender,
    ReportsConfig,
    RoadsideSender,
    ScatterometerConfig,
    SensorsConfig,
)
from fogsim.values import Camera

AIRLIGHT_EXPOSURE = 0.6
"""Share of saturation at which the fixed exposure puts the airlight: bright fog, yet room for lamps above it."""

METERED_PERCENT = {Metering.HIGHLIGHTS: 65.0, Metering.LOG_AVERAGE: 18.0}
"""Share of saturation at which automatic exposure holds what it meters, where a scenario does not say [%]."""


def camera_config(scenario: ScenarioFile) -> CameraConfig:
    """Camera of the ego."""
    return _camera(scenario, scenario.camera)


def _camera(scenario: ScenarioFile, section: CameraSection) -> CameraConfig:
    mounts = {
        body: CameraMount(
            height=usual.height if section.mount_height_m is None else section.mount_height_m,
            setback=usual.setback if section.setback_m is None else section.setback_m,
        )
        for body, usual in USUAL_MOUNTS.items()
    }
    body = section.body
    return CameraConfig(
        camera=_calibration(section, mounts["car"].height),
        sensor=_sensor(scenario, section),
        exposure=_auto_exposure(section.exposure) if section.automatic else None,
        errors=_errors(section.told),
        mounts=mounts,
        samples=section.samples,
        has_bonnet=section.bonnet,
        lens_shading=section.lens_shading,
        lens_glare=section.lens_glare,
        shutter=Shutter(**in_si(section.motion_blur)),
        suspension=Suspension(math.radians(body.pitch_deg_per_mps2), body.time_constant_s),
        stereo=None if section.stereo is None else _stereo(section.stereo),
    )


def _calibration(section: CameraSection, height: float) -> Camera:
    by_view = 0.5 * section.width / math.tan(0.5 * math.radians(section.field_of_view_deg))
    return Camera(
        width=section.width,
        height=section.height,
        focal_length=section.focal_length_px or by_view,
        principal_point=section.principal_point_px or (section.width / 2, section.height / 2),
        mount_height=height,
        pitch=math.radians(section.pitch_deg),
        roll=math.radians(section.roll_deg),
        response=section.response,
        bits=section.bits,
        black_level=section.black_level_percent / 100.0,
    )


def _sensor(scenario: ScenarioFile, section: CameraSection) -> Sensor:
    """Image sensor, at the exposure that it has if it is fixed."""
    airlight = max(airlight_from_illuminance(scenario.light.illuminance_lx, scenario.fog.airlight_share))
    return Sensor(
        saturation_luminance=section.saturation_luminance_cdpm2 or airlight / AIRLIGHT_EXPOSURE,
        full_well=section.full_well_e,
        read_noise=section.read_noise_e,
        bits=section.bits,
        black_level=section.black_level_percent / 100.0,
        gained_read_noise=section.gained_read_noise_e,
    )


def _auto_exposure(section: Exposure) -> AutoExposure:
    percent = METERED_PERCENT[section.metering] if section.target_percent is None else section.target_percent
    return AutoExposure(target=percent / 100.0, **in_si(section, "mode", "target_percent"))


def _errors(written: WrittenErrors) -> CalibrationErrors:
    return CalibrationErrors(
        pitch=math.radians(written.pitch_error_deg),
        roll=math.radians(written.roll_error_deg),
        focal_length_ratio=1.0 + written.focal_length_error_percent / 100.0,
        mount_height_ratio=1.0 + written.mount_height_error_percent / 100.0,
    )


def _stereo(section: StereoSection) -> StereoConfig:
    return StereoConfig(
        section.baseline_m,
        section.baseline_m * (1.0 + section.baseline_error_percent / 100.0),
        math.radians(section.yaw_error_deg),
        math.radians(section.pitch_error_deg),
        math.radians(section.roll_error_deg),
    )


def sensors_config(sensors: Sensors) -> SensorsConfig:
    """Sensors next to the camera, and the faults of all."""
    return SensorsConfig(
        radar=LeadSensor(**in_si(sensors.lead)),
        gps=Gps(**in_si(sensors.gps)),
        light=LightSensor(**in_si(sensors.light)),
        sign_reach=sensors.sign_reach_m,
        scatterometer=None if sensors.scatterometer is None else ScatterometerConfig(**in_si(sensors.scatterometer)),
        faults=tuple(fault_of(written) for written in sensors.faults),
    )


def reports_config(scenario: ScenarioFile) -> ReportsConfig:
    """Senders of reports."""
    reports = scenario.sensors.reports
    return ReportsConfig(
        roadside=None if reports.roadside is None else _roadside(scenario, reports.roadside),
        vehicles=None if reports.vehicles is None else _radio(reports.vehicles),
        cameras=None if reports.cameras is None else _radio(reports.cameras),
    )


def _roadside(scenario: ScenarioFile, section: RoadsideReports) -> RoadsideSender:
    camera = None if section.camera is None else _mast(scenario, section.camera)
    return RoadsideSender(spacing=section.every_m, camera=camera, **in_si(section, "every_m", "camera"))


def _mast(scenario: ScenarioFile, section: RoadsideCamera) -> MastCamera:
    """A roadside camera, which is like the ego's where its section has no key."""
    place = {
        name: getattr(section, name) for name in type(section).model_fields.keys() & CameraSection.model_fields.keys()
    }
    alone = {"focal_length_px": None, "principal_point_px": None, "roll_deg": 0.0}
    camera = scenario.camera.model_copy(update={**place, **alone})
    return MastCamera(_camera(scenario, camera), method(scenario, section.estimator), section.right_of_route_m)


def _radio(section: VehicleReports | CameraReports) -> RadioSender:
    return RadioSender(reach=section.range_m, **in_si(section, "range_m"))
