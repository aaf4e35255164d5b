"""What a vehicle measures beside its camera."""

from fogsim.sensors.lead import LeadSensor, measure_lead
from fogsim.sensors.signs import signs_ahead

__all__ = ["LeadSensor", "measure_lead", "signs_ahead"]
