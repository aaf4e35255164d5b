"""What faults do to radar, satellite positioning, signs and scatterometer."""

import dataclasses
import math
from collections.abc import Iterable

import numpy as np

from fogsim.errors import InputError, suggest
from fogsim.sensors.gps import Fix
from fogsim.sensors.lead import LeadSensor
from fogsim.values import LeadMeasurement, RunningFault, Sign, SignMap
from fogsim.values.fault import (
    FaultKind,
    Fouled,
    HeadingBias,
    LeadBias,
    LeadDropout,
    LeadNarrowView,
    LeadNoise,
    NoSignal,
    Outage,
    PositionBias,
    SignsMissing,
    SignsMoved,
    Where,
)


def faulty_lead_sensor(sensor: LeadSensor, faults: Iterable[RunningFault]) -> LeadSensor:
    """A radar as it is with faults."""
    for fault in faults:
        match fault.kind:
            case LeadNoise(factor):
                distance, speed = factor * sensor.distance_deviation, factor * sensor.speed_deviation
                sensor = dataclasses.replace(sensor, distance_deviation=distance, speed_deviation=speed)
            case LeadNarrowView(angle):
                sensor = dataclasses.replace(sensor, field_of_view=min(angle, sensor.field_of_view))
    return sensor


def faulty_lead(measured: LeadMeasurement | None, faults: Iterable[RunningFault]) -> LeadMeasurement | None:
    """What a radar with faults makes of what it measures; None if it has lost the vehicle ahead, or there is none."""
    for fault in faults:
        match fault.kind:
            case LeadDropout(share):
                # One number whether there is a vehicle ahead or not.
                measured = None if fault.rng.random() < share else measured
            case LeadBias(distance, relative_speed) if measured is not None:
                measured = LeadMeasurement(
                    max(measured.distance + distance, 0.0), measured.relative_speed + relative_speed
                )
    return measured


def faulty_fix(fix: Fix, faults: Iterable[RunningFault]) -> Fix | None:
    """Where a vehicle with faults takes itself to be; None if it does not know."""
    for fault in faults:
        match fault.kind:
            case PositionBias(east, north, along, left):
                fix = fix.displaced(along, left)
                fix = fix._replace(position=fix.position + np.array([east, north, 0.0]))
            case HeadingBias(angle):
                fix = fix._replace(heading=fix.heading + angle)
            case Outage():
                return None
    return fix


def faulty_scattering(measured: float, faults: Iterable[RunningFault]) -> float | None:
    """Extinction coefficient that a scatterometer with faults reports [1/m]; None if it reports nothing."""
    for fault in faults:
        match fault.kind:
            case Fouled(factor):
                measured *= factor
            case NoSignal():
                return None
    return measured


def faulty_signs(signs: SignMap, kinds: Iterable[FaultKind], where: Where) -> SignMap:
    """Signs of the world, or of a vehicle's map, with faults."""
    left = signs.signs
    for kind in kinds:
        match kind:
            case SignsMissing() if kind.where is where:
                left = tuple(sign for sign in left if kind.ids and sign.sign_id not in kind.ids)
            case SignsMoved() if kind.where is where:
                left = tuple(_moved(sign, kind) if not kind.ids or sign.sign_id in kind.ids else sign for sign in left)
    return SignMap(left)


def _moved(sign: Sign, by: SignsMoved) -> Sign:
    x, y, z = sign.position
    forward, aside = math.cos(sign.heading), math.sin(sign.heading)
    place = (x + by.along * forward - by.left * aside, y + by.along * aside + by.left * forward, z + by.up)
    return dataclasses.replace(sign, position=place)


def check_sign_ids(kinds: Iterable[FaultKind], signs: SignMap) -> None:
    """Refuse faults of signs that there are none of."""
    known = [sign.sign_id for sign in signs.signs]
    for kind in kinds:
        if isinstance(kind, SignsMissing | SignsMoved):
            for name in kind.ids:
                if name not in known:
                    raise InputError(f"sensors: {kind.name}: there is no sign {name!r}; {suggest(name, known)}")
