"""Messages about the fog from vehicles with cameras to others."""

from fogsim.simulation.ego.fog_reports import place_seen
from fogsim.values import Estimate, FogReport, Step

_SURE = 0.5
"""Relative deviation beyond which an extinction is not sent [-]."""


def camera_messages(step: Step) -> tuple[tuple[str, FogReport], ...]:
    """What the ego and the other equipped vehicles see in their pictures, with their ids.

    A message carries the surest estimate of one image, not a belief: a vehicle that believes others' messages and
    forwards them would receive its own as news. It applies to the middle of the road on which the fog was seen.
    """
    seen = [(step.traffic.ids[step.ego], step.route_position, step.estimates)]
    seen += [(one.vehicle_id, one.place, one.estimates) for one in step.equipped]
    reports = ((vehicle, _report(vehicle, place, estimates, step)) for vehicle, place, estimates in seen)
    return tuple((vehicle, report) for vehicle, report in reports if report is not None)


def _report(vehicle: str, place: float, estimates: tuple[Estimate, ...], step: Step) -> FogReport | None:
    valid = [one for one in estimates if one.valid and one.standard_deviation < _SURE * one.extinction]
    if not valid:
        return None
    surest = min(valid, key=lambda one: one.standard_deviation / one.extinction)
    deviation = surest.standard_deviation / surest.extinction
    seen = place_seen(place, surest)
    return FogReport(f"camera of {vehicle}", step.index, seen, step.time, surest.extinction, deviation)
