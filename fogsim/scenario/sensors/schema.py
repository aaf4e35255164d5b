"""The block of a scenario file about the ego's sensors next to the camera, and about the faults of all of them."""

from typing import Annotated

from pydantic import Field

from fogsim.scenario.section import Distance, Length, Number, Section, Time
from fogsim.scenario.sensors.faults import AnyFault
from fogsim.scenario.sensors.reports import Reports


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
