"""The block of a scenario file about sensors next to the camera, faults of all, and fog reports from others."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from fogsim.estimators import ESTIMATORS
from fogsim.scenario.camera_schema import CalibrationErrors
from fogsim.scenario.section import (
    Distance,
    Length,
    Method,
    Number,
    Period,
    Place,
    Section,
    Share,
    Time,
    Whole,
    method_of,
)
from fogsim.scenario.sensors.faults import AnyFault

_HALF_A_MILE = 804.672


class ReportsFrom(Section):
    """Senders of fog reports."""

    delay_s: Time = 0.5
    """Time from a measurement to its arrival."""

    loss: Share = 0.0
    """Share of reports that do not arrive."""

    clock_deviation_s: Time = 0.0
    """Standard deviation of the senders' clocks from the receiver's; in one run each is off by the same."""


class MeasuredReports(ReportsFrom):
    """Senders that measure the fog where they are and report it to others."""

    deviation: Annotated[Number, Field(gt=0, le=2)] = 0.1
    """Standard deviation of a measurement of k, relative to it; a forward-scatter sensor has some 10 %."""

    wrong: Share = 0.0
    """Share of measurements that are of any visibility between 20 m and 5 km: droplets on the lens, spray, insects."""


class RoadsideCamera(Section):
    """A camera on a mast, looking along the road with the traffic; lens, sensor and exposure are the ego's `camera`."""

    estimator: Annotated[Method, method_of(ESTIMATORS)] = Method(method="joint_road")
    """Estimator that reads its images; one for the day, since a mast has no head lamps."""

    width: Whole = Field(default=320, ge=16, le=4096)
    """Columns of the image."""

    height: Whole = Field(default=240, ge=16, le=4096)
    """Rows of the image."""

    field_of_view_deg: Number = Field(default=58.0, ge=1, le=170)
    """Horizontal field of view."""

    mount_height_m: Annotated[Number, Field(ge=0.05, le=100)] = 6.0
    """Height of the camera above the road."""

    right_of_route_m: Annotated[Place, Field(ge=-100, le=100)] = 8.0
    """Distance of the mast to the right of the ego's route; negative for the left."""

    pitch_deg: Number = Field(default=2.0, ge=-45, le=45)
    """Pitch; positive looks down."""

    told: CalibrationErrors = CalibrationErrors()
    """Errors of the calibration that the estimator assumes."""


class RoadsideReports(MeasuredReports):
    """Visibility sensors next to the ego's route, as on California's Highway 99."""

    every_m: Length = _HALF_A_MILE
    """Distance from one to the next; half a mile there."""

    first_m: Distance = 0.0
    """Where the first one stands on the ego's route."""

    period_s: Period = 30.0
    """Time between two reports of one sensor."""

    delay_s: Time = 5.0
    """Time from a measurement to its arrival; an operator who must confirm it takes minutes."""

    camera: RoadsideCamera | None = None
    """A camera whose images are read, in place of a measurement with noise (`deviation`, `wrong`); `{}` will do."""

    @model_validator(mode="after")
    def _measured_or_seen(self) -> Self:
        # A resolved scenario has the defaults of both.
        fields = type(self).model_fields
        written = [key for key in ("deviation", "wrong") if getattr(self, key) != fields[key].default]
        if self.camera is not None and written:
            raise ValueError(
                f"{' and '.join(written)} is of sensors that measure with noise, and camera replaces them: its errors "
                f"are those of an estimator; leave out {' and '.join(written)} or camera"
            )
        return self


class VehicleReports(MeasuredReports):
    """Vehicles that measure the fog where they are, such as by a camera, and report it to those behind by radio."""

    equipped: Share = 0.05
    """Share of the vehicles that do."""

    range_m: Length = 500.0
    """Distance over which they are heard."""

    period_s: Period = 1.0
    """Time between two reports of one vehicle."""

    loss: Share = 0.1
    """Share of reports that do not arrive."""


class CameraReports(ReportsFrom):
    """Equipped vehicles (`traffic.equipped`), which report what their own cameras see to those behind by radio."""

    range_m: Length = 500.0
    """Distance over which they are heard."""

    period_s: Period = 1.0
    """Time between two reports of one vehicle."""

    loss: Share = 0.1
    """Share of reports that do not arrive."""


class Reports(Section):
    """Senders that report fog elsewhere to the ego; none by default. `fusion: field_filter` makes use of them."""

    roadside: RoadsideReports | None = None
    """Sensors next to the road."""

    vehicles: VehicleReports | None = None
    """Other vehicles on its road, whose measurement is the truth with noise."""

    cameras: CameraReports | None = None
    """Other vehicles on its road with a camera of their own; they send what their estimators say."""


class Lead(Section):
    """The radar that tracks the vehicle ahead."""

    reach_m: Length = 200.0
    """Distance up to which it tracks a vehicle."""

    distance_deviation_m: Annotated[Distance, Field(le=1000)] = 0.25
    """Standard deviation of its distance."""

    speed_deviation_mps: Annotated[Number, Field(ge=0, le=140)] = 0.1
    """Standard deviation of its relative speed."""

    field_of_view_deg: Annotated[Number, Field(ge=0.1, le=360)] = 360.0
    """Full horizontal angle within which it tracks a vehicle; long-range radars have about 10 to 20."""


class GpsSection(Section):
    """Satellite positioning, used to look up signs ahead in the map."""

    position_deviation_m: Annotated[Distance, Field(le=1000)] = 0.0
    """Standard deviation of the position, east and north."""

    heading_deviation_deg: Annotated[Number, Field(ge=0, le=180)] = 0.0
    """Standard deviation of the heading."""


class LightSensorSection(Section):
    """The light sensor behind the windscreen: the light of the sky, and by night whether others' lamps are ahead."""

    reach_m: Length = 400.0
    """Distance up to which it finds dipped head lamps in clear air; brighter ones farther, in fog all less far."""

    tail_reach_m: Length = 100.0
    """The same of tail lamps."""

    field_of_view_deg: Annotated[Number, Field(ge=0.1, le=180)] = 40.0
    """Full horizontal angle within which it looks for lamps."""


class ScatterometerSection(Section):
    """A forward-scatter visibility sensor at the ego's front, which measures the fog where the vehicle is.

    Vaisala's PWD22 has an accuracy of ± 10 % from 10 m to 10 km, a consistency of ± 5 %, and a value every 15 s (user's
    guide, table 21); the averaging time of one on a vehicle is an assumption.
    """

    relative_deviation: Annotated[Number, Field(ge=0, le=2)] = 0.05
    """Standard deviation of its values about their mean in such fog, relative to k."""

    calibration_deviation: Annotated[Number, Field(ge=0, le=2)] = 0.1
    """Standard deviation of its calibration, relative to k: one error for all of a run."""

    averaging_time_s: Time = 5.0
    """Time constant of its average, which fog and noise share."""


class Sensors(Section):
    """Sensors next to the camera."""

    lead: Lead = Lead()
    """The radar."""

    gps: GpsSection = GpsSection()
    """Satellite positioning."""

    light: LightSensorSection = LightSensorSection()
    """The light sensor, by which lighting policies go."""

    sign_reach_m: Length = 250.0
    """Distance up to which the map lists signs ahead."""

    scatterometer: ScatterometerSection | None = None
    """The forward-scatter visibility sensor on board; none if not given."""

    reports: Reports = Reports()
    """Reports from others about the fog where they are."""

    faults: tuple[AnyFault, ...] = ()
    """What is wrong with sensors, the camera among them, and when."""
