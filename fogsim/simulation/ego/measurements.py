"""What the ego's sensors next to its camera measure, faults included."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere import extinction
from fogsim.core.randomness import Streams
from fogsim.sensors import (
    Fix,
    RadarShadow,
    Scatterometer,
    faulty_fix,
    faulty_lead,
    faulty_lead_sensor,
    faulty_scattering,
    faulty_signs,
    measure_fix,
    measure_lead,
    signs_ahead,
)
from fogsim.sensors.lead import HEIGHT
from fogsim.simulation.run_config import SensorsConfig
from fogsim.values import FogField, LeadMeasurement, RunningFault, SignMap, SignSighting, Structure, TrafficSnapshot
from fogsim.values.fault import Where
from fogsim.values.traffic import rear_of

Faults = Sequence[RunningFault]

_BUMPER_HEIGHT = 0.6
"""Height of the scatterometer above the road, at the front bumper [m]."""


class EgoSensors:
    """Radar, satellite positioning, sign map and scatterometer of an ego."""

    def __init__(self, sensors: SensorsConfig) -> None:
        self._sensors, own = sensors, sensors.scatterometer
        self._scatterometer = (
            None
            if own is None
            else Scatterometer(own.relative_deviation, own.calibration_deviation, own.averaging_time)
        )
        self._shadow = RadarShadow(())

    def reset(self, streams: Streams) -> None:
        """Begin a run."""
        if self._scatterometer is not None:
            self._scatterometer.reset(streams.scatterometer)

    def enter_road(self, structures: Sequence[Structure]) -> None:
        """Let the radar reach only what is not behind these."""
        self._shadow = RadarShadow(structures)

    def lead(self, snapshot: TrafficSnapshot, faults: Faults, streams: Streams) -> LeadMeasurement | None:
        """The vehicle ahead by radar."""
        speed, radar = float(snapshot.state.speed[snapshot.ego]), faulty_lead_sensor(self._sensors.radar, faults)
        share = self._share_of_reach(snapshot) if self._shadow else 1.0
        measured = measure_lead(snapshot.leader, speed, radar, streams.sensors, _bearing(snapshot), share)
        return faulty_lead(measured, faults)

    def _share_of_reach(self, snapshot: TrafficSnapshot) -> float:
        """What stands between the ego's front bumper and its leader's rear leaves of the radar's reach [-]."""
        rear = _rear(snapshot)
        if rear is None:
            return 1.0
        return self._shadow.share_of_reach(snapshot.state.position[snapshot.ego] + (0.0, 0.0, HEIGHT), rear)

    def signs(
        self, snapshot: TrafficSnapshot, known: SignMap, faults: Faults, streams: Streams
    ) -> tuple[SignSighting, ...]:
        """Signs ahead by the map, from where the vehicle takes itself to be."""
        state, ego = snapshot.state, snapshot.ego
        fix = measure_fix(state.position[ego], float(state.heading[ego]), self._sensors.gps, streams.gps)
        measured: Fix | None = faulty_fix(fix, faults)
        if measured is None:
            return ()
        known = faulty_signs(known, (fault.kind for fault in faults), Where.MAP)
        grade = float(state.grade[ego])
        return signs_ahead(known, measured.position, measured.heading, self._sensors.sign_reach, grade=grade)

    def scattering(self, snapshot: TrafficSnapshot, fog: FogField, time: float, faults: Faults) -> float | None:
        """Extinction coefficient at the front bumper as the scatterometer measures it [1/m]; None without one.

        Takes `time` [s].
        """
        if self._scatterometer is None:
            return None
        place = snapshot.state.position[snapshot.ego] + np.array([0.0, 0.0, _BUMPER_HEIGHT])
        return faulty_scattering(self._scatterometer.measure(float(extinction(fog, place)), time), faults)


def _rear(snapshot: TrafficSnapshot) -> NDArray[np.float64] | None:
    """Ends and middle of the leader's rear (3, 3), where a radar meets it [m]; None if that is not read."""
    state, leader = snapshot.state, snapshot.leader
    if leader is None or leader.vehicle_id not in state.ids:
        return None
    row = state.ids.index(leader.vehicle_id)
    middle, heading = rear_of(state, row)
    left = np.array([-math.sin(heading), math.cos(heading), 0.0])
    aside = np.array([-0.5, 0.0, 0.5])[:, None] * float(state.width[row])
    rear: NDArray[np.float64] = middle + aside * left + (0.0, 0.0, HEIGHT)
    return rear


def _bearing(snapshot: TrafficSnapshot) -> float:
    """Angle from the ego's axis to the middle of the leader's rear [rad]; 0 if that is not read."""
    state, ego, leader = snapshot.state, snapshot.ego, snapshot.leader
    if leader is None or leader.vehicle_id not in state.ids:
        return 0.0
    row, own = state.ids.index(leader.vehicle_id), float(state.heading[ego])
    x, y, _ = (rear_of(state, row)[0] - state.position[ego]).tolist()
    return math.atan2(y * math.cos(own) - x * math.sin(own), max(x * math.cos(own) + y * math.sin(own), 0.0))
