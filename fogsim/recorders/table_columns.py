"""Columns of ``steps.parquet``: those of a run about an ego, and those of traffic alone."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic

import numpy as np
import pyarrow as pa

from fogsim.recorders.protocol import DERIVED_QUANTITIES, AnyStep_contra, Derived
from fogsim.units import finite_or_none, visibility_from_extinction
from fogsim.values import Estimate, Leader, LeadMeasurement, Step, TrafficStep

_PLACES = (100.0, 200.0, 400.0)
"""Distances ahead along the route whose fog has columns of its own [m]."""

_CLEAR_AIR = 100_000.0
"""Visibility from which on the truth counts as clear air [m]."""


@dataclass(frozen=True, slots=True)
class Column(Generic[AnyStep_contra]):
    """One column of the table."""

    name: str  # Its name, which ends in its unit
    kind: Any  # Its type
    meaning: str  # One line on it, stored in the file
    # Takes it from a step and what was derived from it; None is stored as null
    value: Callable[[AnyStep_contra, Derived], object]


def table_columns(methods: Sequence[str]) -> list[Column[Step]]:
    """List the columns of the table for given estimators, in their order."""
    columns: list[Column[Step]] = [*_CLOCK_COLUMNS, *_EGO_COLUMNS, *_NEAR_COLUMNS, *_EVENT_COLUMNS]
    columns += [*map(_derived_column, DERIVED_QUANTITIES), *_FOG_COLUMNS]
    columns += [column for distance in _PLACES for column in _place_columns(distance)]
    columns += _FAULT_COLUMNS
    for method in methods:
        columns += _estimator_columns(method)
    return columns


def traffic_table_columns() -> list[Column[TrafficStep]]:
    """List the columns of the table of traffic alone, in their order."""
    return [*_CLOCK_COLUMNS, *_NETWORK_COLUMNS, *_EVENT_COLUMNS, *_METERED_COLUMNS]


def _ego(name: str) -> Callable[[Step, Derived], object]:
    return lambda step, _: float(getattr(step.traffic, name)[step.ego])


def _position(axis: int) -> Callable[[Step, Derived], object]:
    return lambda step, _: float(step.traffic.position[step.ego, axis])


def _of_leader(value: Callable[[Leader], object]) -> Callable[[Step, Derived], object]:
    return lambda step, _: None if step.leader is None else value(step.leader)


def _of_lead(value: Callable[[LeadMeasurement], float]) -> Callable[[Step, Derived], object]:
    return lambda step, _: None if step.observation.lead is None else value(step.observation.lead)


def _believed(share: float) -> Callable[[Step, Derived], object]:
    return lambda step, _: step.belief.visibility_quantile(share)


def _denser_fog(step: Step, _: Derived) -> float | None:
    return None if step.belief.denser is None else step.belief.denser.distance


def _believed_at(distance: float, share: float) -> Callable[[Step, Derived], object]:
    def believed(step: Step, _: Derived) -> float | None:
        profile = step.belief.profile
        return None if profile is None else profile.visibility_quantile(distance, share)

    return believed


def _true_at(distance: float) -> Callable[[Step, Derived], object]:
    def true(step: Step, _: Derived) -> float | None:
        profile = step.truth.profile
        if profile is None or not profile.distance.size or distance > profile.distance[-1]:
            return None
        visibility = profile.visibility_quantile(distance, 0.5)
        return visibility if visibility < _CLEAR_AIR else None

    return true


def _place_columns(distance: float) -> list[Column[Step]]:
    """Columns of the fog at a distance ahead along the route."""
    name, place = f"visibility_{distance:.0f}_m_ahead", f"{distance:.0f} m ahead along the route"
    believed = ((0.5, "", "median of the belief"), (0.05, "_low", "5 % quantile"), (0.95, "_high", "95 % quantile"))
    number = pa.float64()
    return [
        Column(f"true_{name}_m", number, f"at the place {place}; null for clear air", _true_at(distance)),
        *(
            Column(f"believed_{name}{end}_m", number, f"{what} at the place {place}", _believed_at(distance, share))
            for share, end, what in believed
        ),
    ]


def _derived_column(name: str) -> Column[Step]:
    return Column(name, pa.float64(), DERIVED_QUANTITIES[name], lambda _, derived: derived[name])


def _estimator_columns(method: str) -> list[Column[Step]]:
    def of_estimate(value: Callable[[Estimate], object]) -> Callable[[Step, Derived], object]:
        return lambda step, _: next((value(e) for e in step.estimates if e.method == method), None)

    def if_valid(value: Callable[[Estimate], float]) -> Callable[[Step, Derived], object]:
        return of_estimate(lambda estimate: finite_or_none(value(estimate)) if estimate.valid else None)

    number = pa.float64()
    return [
        Column(f"{method}_valid", pa.bool_(), "whether the estimate is valid", of_estimate(lambda e: e.valid)),
        Column(
            f"{method}_extinction_per_m",
            number,
            "estimated extinction coefficient",
            if_valid(lambda e: e.extinction),
        ),
        Column(
            f"{method}_standard_deviation_per_m",
            number,
            "its standard deviation as the method gives it",
            if_valid(lambda e: e.standard_deviation),
        ),
        Column(
            f"{method}_visibility_m",
            number,
            "estimated meteorological visibility; null for clear air",
            if_valid(lambda e: e.visibility),
        ),
    ]


def lowest_advice(step: TrafficStep) -> float:
    """Lowest advice in force at a step, to anybody and anywhere [m/s]; ``inf`` for none."""
    command = step.command
    stretches = (advice.speed for advice in command.stretches)
    return min((command.advice.speed, *stretches, *command.advised_speeds.values()))


def _mean_speed(step: TrafficStep) -> float | None:
    return float(step.traffic.speed.mean()) if len(step.traffic.ids) else None


def least_visibility(step: TrafficStep) -> float | None:
    """Least true visibility at the eyes of any driver [m]; None for clear air, or without any."""
    extinctions = step.truth.vehicle_extinctions
    if extinctions is None or not len(extinctions):
        return None
    return finite_or_none(visibility_from_extinction(float(extinctions.max())))


_CLOCK_COLUMNS: tuple[Column[TrafficStep], ...] = (
    Column("index", pa.int64(), "number of the camera period, from 0", lambda step, _: step.index),
    Column("time_s", pa.float64(), "simulated time", lambda step, _: step.time),
)
_EGO_COLUMNS: tuple[Column[Step], ...] = (
    Column("route_position_m", pa.float64(), "distance along the route", lambda step, _: step.route_position),
    Column("x_m", pa.float64(), "east, middle of the front bumper", _position(0)),
    Column("y_m", pa.float64(), "north, middle of the front bumper", _position(1)),
    Column("heading_rad", pa.float64(), "counterclockwise from east", _ego("heading")),
    Column("speed_mps", pa.float64(), "speed of the ego", _ego("speed")),
    Column("acceleration_mps2", pa.float64(), "acceleration of the ego", _ego("acceleration")),
    Column(
        "speed_limit_mps",
        pa.float64(),
        "speed limit; null off the lanes",
        lambda step, _: finite_or_none(step.speed_limit),
    ),
    Column(
        "off_lanes",
        pa.bool_(),
        "whether the ego is off the lanes: parked next to them, or put there by another simulator",
        lambda step, _: bool(step.traffic.off_lanes[step.ego]),
    ),
    Column(
        "advised_speed_mps",
        pa.float64(),
        "advice in force; null for none",
        lambda step, _: finite_or_none(step.command.advice.speed),
    ),
    Column(
        "lamps",
        pa.int32(),
        "lit lamps of the ego, bits of Lamp",
        lambda step, _: int(step.traffic.lamps[step.ego]),
    ),
    Column(
        "warning",
        pa.string(),
        "what the driver is warned of: camera_degraded, fog_ahead or cannot_see; null for nothing",
        lambda step, _: step.command.warning,
    ),
)
_NEAR_COLUMNS: tuple[Column[Step], ...] = (
    Column("n_vehicles", pa.int32(), "vehicles near the ego, itself included", lambda step, _: len(step.traffic.ids)),
    Column("leader_id", pa.string(), "vehicle ahead", _of_leader(lambda leader: leader.vehicle_id)),
    Column("leader_gap_m", pa.float64(), "true gap to it", _of_leader(lambda leader: leader.gap)),
    Column("leader_speed_mps", pa.float64(), "its true speed", _of_leader(lambda leader: leader.speed)),
)
_EVENT_COLUMNS: tuple[Column[TrafficStep], ...] = (
    Column("collisions", pa.int32(), "collisions new in this period", lambda step, _: len(step.collisions)),
    Column(
        "ending",
        pa.string(),
        "why the run is over",
        lambda step, _: None if step.ending is None else step.ending.value,
    ),
)
_FOG_COLUMNS: tuple[Column[Step], ...] = (
    Column("true_extinction_per_m", pa.float64(), "at the camera", lambda step, _: step.truth.extinction),
    Column(
        "true_visibility_m",
        pa.float64(),
        "at the camera; null for clear air",
        lambda step, _: finite_or_none(step.truth.visibility),
    ),
    Column(
        "true_visibility_ahead_m",
        pa.float64(),
        "of the fog ahead; null for clear air",
        lambda step, _: finite_or_none(step.truth.visibility_ahead),
    ),
    Column("believed_visibility_m", pa.float64(), "median of the belief", _believed(0.5)),
    Column("believed_visibility_low_m", pa.float64(), "5 % quantile of the belief", _believed(0.05)),
    Column("believed_visibility_high_m", pa.float64(), "95 % quantile of the belief", _believed(0.95)),
    Column("denser_fog_m", pa.float64(), "believed distance to denser fog ahead; null for none", _denser_fog),
    Column(
        "measured_lead_distance_m",
        pa.float64(),
        "gap by the range sensor",
        _of_lead(lambda lead: lead.distance),
    ),
    Column(
        "measured_lead_relative_speed_mps",
        pa.float64(),
        "lead's speed minus own by the range sensor",
        _of_lead(lambda lead: lead.relative_speed),
    ),
)
_FAULT_COLUMNS: tuple[Column[Step], ...] = (
    Column(
        "sensor_faults",
        pa.string(),
        "faults of sensors in force, with commas between; null for none",
        lambda step, _: ", ".join(fault.name for fault in step.truth.faults) or None,
    ),
)
_NETWORK_COLUMNS: tuple[Column[TrafficStep], ...] = (
    Column("n_vehicles", pa.int32(), "vehicles in the network", lambda step, _: len(step.traffic.ids)),
    Column("mean_speed_mps", pa.float64(), "their mean speed; null without any", lambda step, _: _mean_speed(step)),
    Column(
        "advised_speed_mps",
        pa.float64(),
        "lowest advice in force anywhere; null for none",
        lambda step, _: finite_or_none(lowest_advice(step)),
    ),
    Column(
        "n_advised",
        pa.int32(),
        "vehicles whose drivers have heard an advice in force",
        lambda step, _: int(np.isfinite(step.traffic.advised_speed).sum()),
    ),
)
_METERED_COLUMNS: tuple[Column[TrafficStep], ...] = (
    Column(
        "true_extinction_per_m",
        pa.float64(),
        "at the visibility meter at the road that sees least",
        lambda step, _: step.truth.extinction,
    ),
    Column(
        "true_visibility_m",
        pa.float64(),
        "at the same meter; null for clear air",
        lambda step, _: finite_or_none(step.truth.visibility),
    ),
    Column(
        "least_visibility_m",
        pa.float64(),
        "least at the eyes of any driver; null for clear air, or without any",
        lambda step, _: least_visibility(step),
    ),
)
