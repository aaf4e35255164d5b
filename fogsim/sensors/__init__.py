"""What a vehicle measures next to its camera."""

from fogsim.sensors.faults import (
    check_sign_ids,
    faulty_fix,
    faulty_lead,
    faulty_lead_sensor,
    faulty_scattering,
    faulty_signs,
)
from fogsim.sensors.gps import Fix, Gps, measure_fix
from fogsim.sensors.lead import LeadSensor, RadarShadow, measure_lead
from fogsim.sensors.scatterometer import Scatterometer
from fogsim.sensors.signs import signs_ahead

__all__ = [
    "Fix",
    "Gps",
    "LeadSensor",
    "RadarShadow",
    "Scatterometer",
    "check_sign_ids",
    "faulty_fix",
    "faulty_lead",
    "faulty_lead_sensor",
    "faulty_scattering",
    "faulty_signs",
    "measure_fix",
    "measure_lead",
    "signs_ahead",
]
