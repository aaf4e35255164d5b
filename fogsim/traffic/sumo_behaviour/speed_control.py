"""Where advice enters SUMO: the ego's as the speed that it drives, other drivers' as the top speed that they desire."""

import math
from collections.abc import Collection, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.core.kinematics import decelerated_speed
from fogsim.traffic.appearance import TRAINS
from fogsim.traffic.drivers.advice_hearing import AdviceHearing, Heard, advised_by_name, heard_since
from fogsim.traffic.drivers.events import Order
from fogsim.traffic.drivers.following import FollowingModel
from fogsim.traffic.drivers.sight import DriverSight, FogAccess, LeaderReach, drivers_visibility, leader_reach
from fogsim.traffic.drivers.speed_choice import (
    CHOICE_PERIOD,
    Compliance,
    DriverSetup,
    Unaffected,
    speed_by_compliance,
    speed_share,
)
from fogsim.traffic.setup import TrafficSetup
from fogsim.traffic.sumo.link import UNKNOWN, Api, getter, vehicle_getter, vehicle_getters
from fogsim.traffic.sumo.nearby_vehicles import positions_of
from fogsim.traffic.sumo.roster import Roster
from fogsim.traffic.sumo_behaviour.driver_table import Column, DriverTable
from fogsim.traffic.sumo_behaviour.headways import HeadwayControl, KeepingUp
from fogsim.traffic.sumo_behaviour.top_speeds import SpeedShareControl, TopSpeedControl
from fogsim.traffic.sumo_lanes.leaders import Leaders
from fogsim.traffic.sumo_lanes.vehicle_places import SumoVehiclePlaces
from fogsim.units import visibility_from_extinction
from fogsim.values import Command, Display


class _FogChoices:
    """Writes into the table what drivers choose."""

    def __init__(self, table: DriverTable, setup: DriverSetup, sight: DriverSight | None) -> None:
        self._table = table
        self._choice = setup.speed_choice
        plain = isinstance(self._choice, Unaffected) and set(table.kinds) == {FollowingModel()}
        self._sight = None if plain and setup.misjudgement == 0.0 else sight

    def update(self, rows: NDArray[np.intp], extinction: NDArray[np.float64]) -> None:
        """Choose where the fog is another than at the last choice (`rows` (n,) int, `extinction` (n,) [1/m])."""
        table = self._table
        changed = (extinction != table.values[rows, Column.EXTINCTION]).nonzero()[0]
        if not len(changed):
            return
        of, here = rows[changed], extinction[changed].tolist()
        # Mostly there are some twenty, which np.unique would take longer to sort.
        found = {k: self._choose_in(k) for k in dict.fromkeys(here)}
        kinds = table.values[of, Column.KIND].astype(np.intp).tolist()
        # The table's last columns.
        table.values[of, Column.EXTINCTION :] = [
            (*found[k][0], table.kinds[kind].top_speed(found[k][1])) for k, kind in zip(here, kinds, strict=True)
        ]

    def _choose_in(self, extinction: float) -> tuple[tuple[float, ...], LeaderReach]:
        """Columns `EXTINCTION` to `SHARE` in a fog, and how far away leaders are seen in it."""
        visibility = visibility_from_extinction(extinction)
        seen, reach = drivers_visibility(self._sight, visibility), leader_reach(self._sight, visibility)
        chosen = self._choice(seen), speed_share(self._choice, seen)
        return (extinction, seen, reach.by_body, reach.farthest, *chosen), reach


_SUMO_DRIVES = -1.0
_IMPOSED = 1 + 8 + 16 + 64
"""Speed mode of a vehicle whose speed is imposed: it hits no one, gives way and stops at red lights.

It regards neither the road's limit nor how hard its type may speed up and brake, which is seen to here.
"""
_IMPOSED_CLOSE = _IMPOSED - 1
"""That of one who follows as closely as the script says, and whose leader is watched here."""

_LEADER_RANGE = 200.0
"""Distance up to which a vehicle ahead is searched [m]."""

_SAME = 1e-6  # [m/s], [m/s²]


class SpeedControl:
    """Brings the ego to its advised speed and vehicles to scripted ones; remembers which, to free them again."""

    def __init__(self, api: Api, step_length: float) -> None:
        self._vehicles = api.vehicle
        names = ("getAcceleration", "getDecel", "getSpeedWithoutTraCI", "getSpeed", "getAllowedSpeed", "setSpeed")
        getters = [vehicle_getter(api, name) for name in names]
        self._acceleration, self._deceleration, self._planned, self._speed, self._allowed, self._set_speed = getters
        self._step_length = step_length
        self._leader = Leaders(api).within(_LEADER_RANGE)
        self._held: set[str] = set()
        self._modes: dict[str, int] = {}

    def apply(self, orders: Mapping[str, Order]) -> None:
        """Apply the orders of this step."""
        for vehicle, (target, deceleration) in orders.items():
            if math.isfinite(target):
                self._hold(vehicle, target, deceleration)
            elif vehicle in self._held:
                self._vehicles.setSpeed(vehicle, _SUMO_DRIVES)
                self._held.discard(vehicle)

    def impose(self, speeds: Mapping[str, float], close: Collection[str] = ()) -> None:
        """Give vehicles exact speeds after this step [m/s], as far as others on the road leave room for them.

        They speed up no faster than their type can, and brake as hard as it can in an emergency.
        """
        get = self._vehicles
        for vehicle, wanted in speeds.items():
            if math.isinf(wanted):
                self._free(vehicle)
                continue
            mode = _IMPOSED_CLOSE if vehicle in close else _IMPOSED
            self._modes.setdefault(vehicle, get.getSpeedMode(vehicle))
            if get.getSpeedMode(vehicle) != mode:
                get.setSpeedMode(vehicle, mode)
            now, step = get.getSpeed(vehicle), self._step_length
            if self._is_in_danger(vehicle) if vehicle in close else self._brakes_harder(vehicle):
                get.setSpeed(vehicle, _SUMO_DRIVES)
                continue
            lowest, highest = now - get.getEmergencyDecel(vehicle) * step, now + get.getAccel(vehicle) * step
            get.setSpeed(vehicle, max(min(wanted, highest), lowest, 0.0))

    def _brakes_harder(self, vehicle: str) -> bool:
        """Whether the driver would by himself brake harder than his type does but in an emergency."""
        get = self._vehicles
        hardest = get.getDecel(vehicle) * self._step_length
        return bool(get.getSpeedWithoutTraCI(vehicle) < get.getSpeed(vehicle) - hardest - _SAME)

    def _is_in_danger(self, vehicle: str) -> bool:
        """Whether a vehicle ahead is so near, or so slow, that the type's deceleration barely avoids a collision."""
        get = self._vehicles
        found = self._leader(vehicle, _LEADER_RANGE)
        if not found or not found[0]:
            return False
        # SUMO's gap leaves out the follower's minimum gap.
        gap = max(found[1] + get.getMinGap(vehicle), _SAME)
        approach = max(get.getSpeed(vehicle) - get.getSpeed(found[0]), 0.0)
        return bool(gap < 1.0 or approach**2 / (2.0 * gap) > get.getDecel(vehicle))

    def _free(self, vehicle: str) -> None:
        if vehicle in self._modes:
            self._vehicles.setSpeed(vehicle, _SUMO_DRIVES)
            self._vehicles.setSpeedMode(vehicle, self._modes.pop(vehicle))

    def release(self, present: Collection[str]) -> None:
        """Free all vehicles that are held."""
        for vehicle in self._held.intersection(present):
            self._vehicles.setSpeed(vehicle, _SUMO_DRIVES)
        self._held.clear()
        for vehicle in list(self._modes):
            if vehicle in present:
                self._free(vehicle)
        self._modes.clear()

    def _hold(self, vehicle: str, target: float, deceleration: float) -> None:
        self._held.add(vehicle)
        # Off the lanes there is nothing to be held to.
        limit = UNKNOWN if self._brakes_hard(vehicle) else float(self._allowed(vehicle))
        if limit == UNKNOWN:
            self._set_speed(vehicle, _SUMO_DRIVES)
            return
        # Advice does not make a driver faster than the road and the vehicle allow.
        allowed = min(target, limit)
        speed = self._speed(vehicle)
        self._set_speed(vehicle, decelerated_speed(speed, allowed, deceleration, self._step_length))

    def _brakes_hard(self, vehicle: str) -> bool:
        """Whether the driver brakes harder by himself, or would, than SUMO lets a vehicle whose speed is set.

        That is the type's ``decel``, and in an emergency a driver needs ``emergencyDecel``.
        """
        excess = -self._acceleration(vehicle) - self._deceleration(vehicle)
        if abs(excess) > _SAME:
            return bool(excess > 0.0)
        return bool(self._planned(vehicle) < self._speed(vehicle) - _SAME)


class SumoDesiredSpeeds:
    """Sets the speed and the headway of every vehicle but the ego by what its driver chooses, sees and is advised."""

    def __init__(
        self,
        api: Api,
        setup: TrafficSetup,
        fog: FogAccess,
        seed: int,
        roster: Roster,
        session: str,
        remote: bool = False,
    ) -> None:
        self._api = api
        self._position = vehicle_getter(api, "getPosition3D")
        self._departure = vehicle_getter(api, "getDeparture")
        self._allowed_speed, self._top_speed = (
            vehicle_getter(api, "getAllowedSpeed"),
            vehicle_getter(api, "getMaxSpeed"),
        )
        self._lane, self._speed_factor = vehicle_getter(api, "getLaneID"), vehicle_getter(api, "getSpeedFactor")
        self._lane_limit = getter(api, "lane", "getMaxSpeed")
        self._step = float(api.simulation.getDeltaT())
        self._compliance = {display: setup.drivers.compliance_with(display) for display in Display}
        self._fog = fog
        self._extinction = fog.minimum_extinction if fog.minimum_extinction == fog.maximum_extinction else None
        self._ego = setup.ego
        self._roster = roster
        table = self._table = DriverTable(api, setup.drivers, seed, session)
        self._choices = _FogChoices(table, setup.drivers, setup.sight)
        self._keeping_up = KeepingUp(api, table, setup.sight, remote)
        self._headways = HeadwayControl(api, table, setup.drivers.misjudgement, setup.sight)
        self._top_speeds = TopSpeedControl(api, table, table.top_speeds, setup.advice_deceleration, roster.time)
        self._shares = SpeedShareControl(api, table, setup.advice_deceleration, roster.time)
        self._hearing = AdviceHearing(SumoVehiclePlaces(api, setup.ego, roster))
        self._advised_since: Heard = {}
        self._heard: dict[str, float] = {}
        self._next, self._chosen = 0.0, self._roster.time
        self._mark = 0
        self._trains: set[str] = set()
        (self._type,) = vehicle_getters(api, remote, ("getTypeID",))
        self._types: dict[str, str] = {}

    @property
    def heard(self) -> Mapping[str, float]:
        """Lowest advice in force of those whom any has reached, followed or not, when they listened last [m/s]."""
        return self._heard

    def update(self, command: Command) -> None:
        """Let new drivers choose a speed, by a roster that is up to date, and all if it is time to choose again."""
        roster = self._roster
        time, present = roster.time, roster.present
        new, self._mark = roster.entered_since(self._mark)
        if new:
            entered = [v for v in new if v != self._ego and v in present]
            self._trains.difference_update(new)
            self._trains.update(v for v in entered if self._api.vehicle.getVehicleClass(v) in TRAINS)
            self._choose_on_entry([v for v in entered if v not in self._trains], command)
        if time >= self._next:
            elapsed, self._chosen = time - self._chosen, time
            self._next = time + CHOICE_PERIOD
            advised, self._heard = self._hearing.listen(command, elapsed), {}
            # In even fog and without advice, choices stay as they are, but for those who go by their leader.
            settled = self._extinction is not None and not advised and not self._advised_since
            self._advised_since = heard_since(advised, self._advised_since, time)
            others = self._drivers()
            if retyped := self._retyped(others):
                self._choose_on_entry(retyped, command)
            rows = self._table.rows(others)
            if settled:
                keepers = self._keeping_up.keepers(self._table.values[rows])
                self._update_choices([others[i] for i in keepers.tolist()], rows[keepers], advised)
            else:
                self._update_choices(others, rows, advised)
            self._headways.update(others, rows)
        self._top_speeds.update(time, present)
        self._shares.update(time, present)

    def _retyped(self, vehicles: Sequence[str]) -> list[str]:
        """Who has had another type since the last time: by a device (``toc``) or a user, which undoes what was set."""
        before, now = self._types, dict(zip(vehicles, map(self._type, vehicles), strict=True))
        self._types = now
        if now.items() <= before.items():
            return []
        # With the first change of what its type says a vehicle gets a type of its own, with its id after the name.
        changed = [v for v, name in now.items() if v in before and before[v] != name]
        return [v for v in changed if before[v].removesuffix(f"@{v}") != now[v].removesuffix(f"@{v}")]

    def _drivers(self) -> list[str]:
        """Everyone on the road but the ego and trains, which go by their signals."""
        # In SUMO's order, in which it finds them faster.
        return sorted(self._roster.present.difference(self._trains, () if self._ego is None else (self._ego,)))

    def _choose_on_entry(self, new: Sequence[str], command: Command) -> None:
        """Let new drivers choose; those who enter have driven in that fog before, past the signs with the advice."""
        self._table.reset(new)
        # Departures carry the time at which their step began. Other new vehicles were on the road already.
        since = self._roster.time - 1.5 * self._step
        entering = [v for v in new if self._departure(v) >= since]
        if entering:
            advised = self._hearing.enter(command, entering)
            for display, speeds in advised.items():
                self._advised_since.setdefault(display, {}).update(dict.fromkeys(speeds, -math.inf))
            rows = self._table.rows(entering)
            desired, shares = self._desired(entering, rows, advised)
            self._shares.set_at_entry(entering, rows, shares)
            self._top_speeds.set_at_entry(entering, rows, desired)
        if len(entering) < len(new):
            # They hear other advice than that to them by name when all listen again.
            others = [v for v in new if v not in set(entering)]
            self._update_choices(others, self._table.rows(others), advised_by_name(command))
        self._headways.update(new, self._table.rows(new))

    def _update_choices(self, ids: Sequence[str], rows: NDArray[np.intp], advised: Heard) -> None:
        if ids:
            desired, shares = self._desired(ids, rows, advised)
            self._shares.set_desired(ids, rows, shares)
            self._top_speeds.set_desired(ids, rows, desired)

    def _desired(
        self, ids: Sequence[str], rows: NDArray[np.intp], advised: Heard
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """What drivers desire: top speeds (n,) [m/s], shares of the speed in clear air."""
        self._choices.update(rows, self._extinctions(ids))
        values = self._table.values[rows]
        desired = np.minimum(values[:, Column.FACTOR] * values[:, Column.CHOICE], values[:, Column.LIMIT])
        desired, shares = np.minimum(desired, values[:, Column.TOP_SPEED]), values[:, Column.SHARE]
        keepers = self._keeping_up.keepers(values)
        if len(keepers):
            kept = self._keeping_up.kept_speeds([ids[i] for i in keepers], rows[keepers])
            in_clear_air = self._all_allowed([ids[i] for i in keepers]) / values[keepers, Column.SHARE_SET]
            desired[keepers] = np.maximum(desired[keepers], np.minimum(kept, values[keepers, Column.TOP_SPEED]))
            shares[keepers] = np.maximum(shares[keepers], np.minimum(kept / in_clear_air, 1.0))
        own = desired.copy()
        followed: set[int] = set()
        for display, speeds in advised.items():
            compliance = self._compliance[display]
            moved = values[:, Column.MOVED_FROM] < compliance.rate
            for i in self._reached(ids, values, compliance, speeds):
                if moved[i] and self._has_answered(ids[i], display):
                    wanted = self._advised(ids[i], int(rows[i]), float(own[i]), compliance, speeds[ids[i]])
                    # Of several, what makes the driver slowest counts.
                    desired[i] = min(float(desired[i]), wanted) if i in followed else wanted
                    followed.add(i)
        return desired, shares

    def _reached(
        self,
        ids: Sequence[str],
        values: NDArray[np.float64],
        compliance: Compliance,
        speeds: Mapping[str, float],
    ) -> list[int]:
        """Which of some vehicles an advice reaches, which is remembered: who is there, and gets what is said there."""
        gets = (values[:, Column.REACHED_FROM] < compliance.reached_share).nonzero()[0].tolist()
        reached = [i for i in gets if ids[i] in speeds]
        for vehicle in (ids[i] for i in reached):
            self._heard[vehicle] = min(speeds[vehicle], self._heard.get(vehicle, math.inf))
        return reached

    def _extinctions(self, ids: Sequence[str]) -> NDArray[np.float64]:
        """Extinction coefficients where vehicles are (n,) [1/m]."""
        if self._extinction is not None:
            return np.full(len(ids), self._extinction)
        return self._fog.extinction(positions_of(ids, self._position))

    def _has_answered(self, vehicle: str, display: Display) -> bool:
        """Whether the delay is over in which a driver does not follow yet what is heard somewhere."""
        time = self._roster.time
        since = self._advised_since.get(display, {}).get(vehicle, time)
        return time - since >= self._compliance[display].delay

    def _advised(self, vehicle: str, row: int, own: float, compliance: Compliance, advised: float) -> float:
        """Top speed [m/s] of a driver who follows advice."""
        visibility = float(self._table.values[row, Column.VISIBILITY])
        return speed_by_compliance(compliance, min(own, self._allowed(vehicle)), advised, visibility)

    def _all_allowed(self, ids: Sequence[str]) -> NDArray[np.float64]:
        """What the road allows drivers (n,) [m/s]; see `_allowed`."""
        both = zip(ids, map(self._allowed_speed, ids), map(self._top_speed, ids), strict=True)
        return np.array([allowed if UNKNOWN < allowed < top else self._allowed(v) for v, allowed, top in both])

    def _allowed(self, vehicle: str) -> float:
        """What the road allows a driver [m/s], whatever top speed the vehicle was given; ``inf`` off the lanes."""
        allowed = float(self._allowed_speed(vehicle))
        if allowed == UNKNOWN:
            return math.inf
        if allowed < self._top_speed(vehicle):
            return allowed
        # The top speed is the lower one, and SUMO gives only that.
        return float(self._lane_limit(self._lane(vehicle)) * self._speed_factor(vehicle))

    def release(self) -> None:
        """Withdraw from every vehicle on the road what was claimed of its top speed and headway."""
        ids = self._drivers()
        rows = self._table.rows(ids)
        self._top_speeds.release(ids, rows)
        self._shares.release(ids, rows)
        self._headways.release(ids, rows)
