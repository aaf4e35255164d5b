"""Actions as blocks of FogSim's timeline."""

import inspect
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from fogsim.openscenario.catalogs import Catalogs
from fogsim.openscenario.elements import HARMLESS, REFUSED
from fogsim.openscenario.entities import Vehicle
from fogsim.openscenario.environment import environment_of
from fogsim.openscenario.findings import Findings
from fogsim.openscenario.positions import Positions, sense
from fogsim.openscenario.triggers import NEAR
from fogsim.openscenario.xml_tree import Node
from fogsim.traffic.road.opendrive_lanes import Spot
from fogsim.units import KMH_PER_MPS

SHAPES = {"step": "step", "linear": "linear", "sinusoidal": "sinusoidal", "cubic": "sinusoidal"}
"""Shapes of dynamics, and the nearest one in FogSim."""

LAMPS = {
    "daytimeRunningLights": ("daytime",),
    "lowBeam": ("low_beam",),
    "highBeam": ("high_beam",),
    "fogLights": ("front_fog", "rear_fog"),
    "fogLightsFront": ("front_fog",),
    "fogLightsRear": ("rear_fog",),
    "brakeLights": ("stop",),
    "indicatorLeft": ("indicator_left",),
    "indicatorRight": ("indicator_right",),
    "warningLights": ("indicator_left", "indicator_right"),
}
"""Lamps of each type of light."""

_UNLIT = ("licensePlateIllumination", "reversingLights", "specialPurposeLights")
_STEEPEST = {"linear": 1.0, "sinusoidal": 0.5 * math.pi, "cubic": 1.5}  # Greatest rate of a shape, over its mean
_STAY = 1e5  # Time for which a vehicle stays in the lane that it has changed to [s]
_AT_THE_END = 1.5  # Distance at which the end of a trajectory is reached [m]
_LEAST = 0.05  # Lateral acceleration of a move within a lane [m/s²]
DISPLACEMENTS = ("any", "leadingReferencedEntity", "trailingReferencedEntity")
"""Where a vehicle is to be, seen from the one to which it keeps a distance."""


@dataclass
class Effect:
    """What an event does: timeline blocks by subject, their known duration [s], and conditions that end the rest.

    `routes` are edges through the waypoints of a vehicle's route, and `sets` values of parameters and variables. It
    `ends_itself` if only the run shows its duration, `is_endless` if something else must end it, and `has_unknown_end`
    if nothing shows it. `is_at_start` in ``Init``. Vehicles that it brings onto the road do what `once_there` has.
    """

    do: dict[str, dict[str, Any]] = field(default_factory=dict)
    lasts: float = 0.0
    ends: list[str] = field(default_factory=list)
    routes: dict[str, tuple[str, ...]] = field(default_factory=dict)
    ends_itself: bool = False
    is_endless: bool = False
    has_unknown_end: bool = False
    sets: dict[str, str] = field(default_factory=dict)
    once_there: dict[str, dict[str, Any]] = field(default_factory=dict)
    is_at_start: bool = False

    def add(self, subject: str, **blocks: Any) -> None:
        """Add an action of a subject."""
        mine = self.do.setdefault(subject, {})
        for key, block in blocks.items():
            mine[key] = {**mine.get(key, {}), **block} if key == "lamps" else block

    def changes_speed(self, subject: str) -> bool:
        """Whether a subject's speed changes, or goes by another vehicle's, for some time."""
        speed = self.do.get(subject, {}).get("speed", {})
        is_gradual = "continuous" in speed or "profile" in speed or speed.get("shape", "step") != "step"
        return "follow" in self.do.get(subject, {}) or is_gradual


@dataclass
class Actions:
    """Reads actions; `called` gives a vehicle's name in conditions.

    `offsets` are where vehicles are in their lanes after the actions so far, in the file's order.
    """

    vehicles: Mapping[str, Vehicle]
    catalogs: Catalogs
    positions: Positions
    called: Callable[[str], str]
    offsets: dict[str, float] = field(default_factory=dict)

    @property
    def findings(self) -> Findings:
        """Receives what cannot be done."""
        return self.catalogs.findings

    def take(self, action: Node, actors: list[str], effect: Effect) -> None:
        """Add an action (``PrivateAction``, ``GlobalAction``, or their parent) of some actors to an effect."""
        for one in action.all():
            if one.tag in _GROUPS:
                self.take(one, actors, effect)
            elif one.tag == "EnvironmentAction":
                self._environment(one, effect)
            elif one.tag == "OverrideControllerValueAction":
                if any(self.findings.flag(input_, "active", "false") for input_ in one.all()):
                    self.findings.refuse(one, "speeds and lanes are ordered, not pedals; write active=false")
            elif one.tag in _GLOBAL:
                try:
                    _GLOBAL[one.tag](self, one, effect)
                except ValueError as error:
                    self.findings.refuse(one, str(error))
            elif one.tag in HARMLESS:
                self.findings.leave_out(one, HARMLESS[one.tag])
            elif one.tag not in _PRIVATE:
                message = REFUSED.get(one.tag, "FogSim does not know this element here")
                self.findings.refuse(one, f"{message}; actions are {', '.join(ACTIONS)}")
            else:
                self._private(one, _ORDERS.get(action.tag, set()), actors, effect)

    def _private(self, action: Node, orders: set[str], actors: list[str], effect: Effect) -> None:
        if not actors:
            self.findings.refuse(action, "no vehicle does it: the Actors of the maneuver group name no entity")
        for actor in actors:
            across = actor in self.positions.against and action.tag in _ACROSS
            if actor in self.positions.off_lanes and not across and action.tag not in _ANYWHERE:
                self.findings.refuse(action, f"{actor} is on no lane, or turned on one: {', '.join(_ANYWHERE)} move it")
                continue
            if effect.do.get(actor, {}).keys() & orders:
                self.findings.refuse(action, f"another action of this event orders the motion of {actor} as well")
            try:
                (Actions._aside if across else _PRIVATE[action.tag])(self, action, actor, effect)
            except ValueError as error:
                self.findings.refuse(action, str(error))

    def _set(self, action: Node, effect: Effect) -> None:
        """Nothing that can be seen: what conditions on a parameter or variable compare."""
        to, name = action.one("SetAction"), action.get("parameterRef") or action.get("variableRef")
        if to is None:
            raise ValueError("expected a SetAction: values are set, not changed by others")
        effect.sets[name] = to.get("value")

    def _entity(self, action: Node, effect: Effect) -> None:
        """`path` to the place where a vehicle comes onto the road, and there it stands; or `leave`."""
        name, position = action.get("entityRef"), action.within("AddEntityAction", "Position")
        if name not in self.vehicles or self.called(name) == "ego":
            raise ValueError(f"expected a vehicle other than the ego, got {name!r}")
        if position is None:
            if action.one("DeleteEntityAction") is None:
                raise ValueError("expected an AddEntityAction with a Position, or a DeleteEntityAction")
            effect.add(name, leave=True)
            return
        if self.positions.refers_to(position):
            raise ValueError(
                "AddEntityAction: in a story, where others are by then is not known; give a place on the map"
            )
        x, y, heading, along = self.positions.point(position)
        degrees = math.degrees(heading if heading is not None else along or 0.0)
        vehicle = self.vehicles[name]
        path = {"points": [[x, y, degrees]], "ahead_m": vehicle.front, "speed_kmh": 0.0, "stays": bool(vehicle.body)}
        effect.add(name, path=path)
        effect.once_there[name] = {"speed": {"to_kmh": 0.0, "shape": "step"}}

    def _environment(self, action: Node, effect: Effect) -> None:
        read = environment_of(action, self.catalogs, self.positions.lanes)
        if read.box is not None:
            self.findings.refuse(action, "a box of fog may stand in Init alone; later the fog changes everywhere")
        elif read.visibility is not None:
            effect.add("fog", visibility_m=read.visibility)
        if read.illuminance is not None:
            effect.add("light", illuminance_lx=float(f"{read.illuminance:.4g}"))

    def _speed(self, action: Node, actor: str, effect: Effect) -> None:
        """`speed`: absolute, or relative to a vehicle at that moment, or continuously; by time or rate."""
        dynamics, target = action.one("SpeedActionDynamics"), action.one("SpeedActionTarget")
        message = {} if target is None else self._target(target)
        if not message:
            self.findings.refuse(
                action, "expected a SpeedActionTarget with an AbsoluteTargetSpeed or RelativeTargetSpeed"
            )
            return
        speed = {**message, **(self._pace(dynamics, effect) if dynamics else {"shape": "step"})}
        if "rate_mps2" in speed and "to_kmh" in speed:
            own, to = f"{self.called(actor)}.speed", speed["to_kmh"] / KMH_PER_MPS
            effect.ends.append(f"{own} > {to - NEAR:.9g} m/s and {own} < {to + NEAR:.9g} m/s")
        effect.is_endless |= "continuous" in speed
        # At a rate of 0 a speed stays as it is.
        effect.add(actor, speed=self.held(actor) if speed.get("rate_mps2") == 0.0 else speed)

    def _speed_profile(self, action: Node, actor: str, effect: Effect) -> None:
        """`speed` by its `profile`; without a time as fast as `DynamicConstraints` or the vehicle allow."""
        vehicle, limits, entries = (
            self.vehicles[actor],
            action.one("DynamicConstraints"),
            action.all("SpeedProfileEntry"),
        )
        if action.get("entityRef") or not entries:
            raise ValueError("expected SpeedProfileEntry elements whose speeds are absolute, without entityRef")
        self.findings.word(action, "followingMode", ("position", "follow"))
        profile: list[tuple[float, float]] = []
        for entry in entries:
            speed, time = self.findings.number(entry, "speed"), self.findings.number(entry, "time", -1.0)
            before, last = profile[-1][::-1] if profile else (speed, 0.0)
            if time < 0.0:
                way, own = (
                    ("Acceleration", vehicle.acceleration) if speed > before else ("Deceleration", vehicle.deceleration)
                )
                time = abs(speed - before) / (self.findings.number(limits, f"max{way}", own) if limits else own)
            # SUMO counts milliseconds.
            profile.append((last + max(time, 0.001 * bool(profile)), speed))
        effect.lasts = max(effect.lasts, profile[-1][0])
        effect.add(actor, speed={"profile": [[time, speed * KMH_PER_MPS] for time, speed in profile]})

    def _target(self, target: Node) -> dict[str, Any]:
        absolute, relative = target.one("AbsoluteTargetSpeed"), target.one("RelativeTargetSpeed")
        if absolute is not None:
            if (speed := self.findings.number(absolute, "value")) < 0.0:
                self.findings.refuse(
                    absolute, f"value: expected 0 or more, got {speed:g}: vehicles do not drive backwards"
                )
            return {"to_kmh": max(speed, 0.0) * KMH_PER_MPS}
        if relative is None:
            return {}
        value = self.findings.number(relative, "value")
        how = self.findings.word(relative, "speedTargetValueType", ("delta", "factor"))
        share = {"factor": value} if how == "factor" else {"plus_kmh": value * KMH_PER_MPS}
        follows = {"continuous": True} if self.findings.flag(relative, "continuous", "false") else {}
        return {"like": self._other(relative), **share, **follows}

    def _other(self, node: Node) -> str:
        """The vehicle that an element refers to, as the timeline names it."""
        name = node.get("entityRef")
        if name not in self.vehicles:
            self.findings.refuse(node, f"there is no vehicle {name!r}")
        return self.called(name).strip('"')

    def held(self, actor: str) -> dict[str, Any]:
        """The order to keep the speed of that moment."""
        return {"like": self.called(actor).strip('"'), "shape": "step"}

    def _pace(self, dynamics: Node, effect: Effect) -> dict[str, Any]:
        message = self._dynamics(dynamics)
        if message is None:
            return {"shape": "step"}
        shape, by, value = message
        if by == "distance":
            self.findings.refuse(dynamics, "dynamicsDimension: speeds change by time or rate")
            return {}
        if by == "time":
            effect.lasts = max(effect.lasts, value)
        return {"shape": SHAPES[shape], "over_s" if by == "time" else "rate_mps2": value}

    def _dynamics(self, node: Node) -> tuple[str, str, float] | None:
        """Shape, dimension and value of a change; None if it happens at once, whatever its dimension."""
        shape, by = self.findings.word(node, "dynamicsShape", tuple(SHAPES)), node.get("dynamicsDimension")
        value = self.findings.number(node, "value", 0.0 if shape == "step" else None, is_finite=by != "rate")
        if shape != "step":
            by = self.findings.word(node, "dynamicsDimension", ("time", "rate", "distance"))
        is_at_once = shape == "step" or math.isinf(value) or (value == 0.0 and by != "rate")
        return None if is_at_once else (shape, by, abs(value))

    def _lane_change(self, action: Node, actor: str, effect: Effect) -> None:
        """`change_lane`: absolute, or relative to a vehicle; by time, distance or rate."""
        dynamics, target = action.one("LaneChangeActionDynamics"), action.one("LaneChangeTarget")
        if dynamics is None or target is None:
            self.findings.refuse(action, "expected LaneChangeActionDynamics and a LaneChangeTarget")
            return
        shape, by, value = self._dynamics(dynamics) or ("step", "time", 0.0)
        if by == "rate" and value == 0.0:
            self.findings.refuse(dynamics, "value: expected a rate above 0")
        lanes, begins = self._lanes(target, actor), self.positions.entities.get(actor)
        if begins is None:
            raise ValueError(f"{actor} has no place on a lane in Init")
        if lanes is None:
            return
        if by == "rate":
            value = _STEEPEST[shape] * self._across(target, lanes, begins) / (value or 1.0)
        pace = {"distance_m": value} if by == "distance" else {"duration_s": min(value, 60.0)}
        effect.lasts = max(effect.lasts, pace.get("duration_s", 0.0))
        effect.ends_itself = by == "distance"
        offset = sense(begins) * self.findings.number(action, "targetLaneOffset", 0.0)
        if offset or self._offset(actor):
            pace["offset_m"] = self.offsets[actor] = begins.shifted(offset).offset
        effect.add(actor, change_lane={**lanes, "stay_s": _STAY, **pace})

    def _offset(self, vehicle: str) -> float:
        """Where a vehicle is in its lane after the actions so far, to the left of its middle [m]."""
        begins = self.positions.entities.get(vehicle)
        return self.offsets.get(vehicle, begins.offset if begins else 0.0)

    def _lane_offset(self, action: Node, actor: str, effect: Effect) -> None:
        """`change_lane` with `offset_m`, along half a wave of a cosine, at `maxLateralAcc` at most."""
        dynamics, target = action.one("LaneOffsetActionDynamics"), action.one("LaneOffsetTarget")
        to = target.one("AbsoluteTargetLaneOffset", "RelativeTargetLaneOffset") if target else None
        begins = self.positions.entities.get(actor)
        if dynamics is None or to is None or begins is None:
            raise ValueError("expected LaneOffsetActionDynamics and a LaneOffsetTarget, and a vehicle that has a place")
        offset = sense(begins) * self.findings.number(to, "value")
        lanes: dict[str, Any] = {"lanes": 0}
        other = self.positions.entities.get(to.get("entityRef")) if to.tag.startswith("Relative") else begins
        if to.tag.startswith("Relative"):
            name, offset = self._other(to), offset + self._offset(to.get("entityRef"))
            if other and other.lane != begins.lane:
                lanes = {"to_lane_of": name, **lanes}
        across = abs(offset - self._offset(actor))
        if other and "to_lane_of" in lanes:
            across += begins.lane.width * abs(other.lane.index - begins.lane.index)
        lasts = self._offset_time(dynamics, across)
        self.offsets[actor] = begins.shifted(offset).offset
        effect.lasts = max(effect.lasts, lasts)
        effect.is_endless |= self.findings.flag(action, "continuous")
        effect.add(actor, change_lane={**lanes, "stay_s": _STAY, "offset_m": offset, "duration_s": min(lasts, 60.0)})

    def _aside(self, action: Node, actor: str, effect: Effect) -> None:
        """`change_lane` of a vehicle that drives against a lane: from its path to a lane, as they lie at first."""
        dynamics, target = action.one(f"{action.tag}Dynamics"), action.one(f"{action.tag[:-6]}Target")
        to = next(iter(target.all()), None) if target else None
        base = self.positions.against[actor]
        if dynamics is None or to is None:
            raise ValueError(f"expected {action.tag}Dynamics and a {action.tag[:-6]}Target")
        spot = self.positions.entities.get(to.get("entityRef")) if to.tag.startswith("Relative") else base
        if spot is None:
            raise ValueError(
                f"{actor} drives against its lane: give a lane, or one by a vehicle that drives along its own"
            )
        value = self.findings.number(to, "value")
        offset = sense(spot) * self.findings.number(action, "targetLaneOffset", 0.0)
        if to.tag.endswith("Offset"):
            offset = sense(spot) * value
        elif to.tag == "RelativeTargetLane":
            spot = self.positions.lanes.beside(spot, int(value))
        else:
            road = base.lane.origins[0].rpartition("_")[0]
            spot = next(
                (Spot(one, 0.0) for one in self.positions.lanes.lanes if f"{road}_{value:g}" in one.origins), spot
            )
        x, y, heading = self.positions.off_lanes[actor]
        to_x, to_y, _ = self.positions.lanes.foot(spot.lane, x, y).shifted(offset).world
        aside = (to_y - y) * math.cos(heading) - (to_x - x) * math.sin(heading)
        if action.tag == "LaneOffsetAction":
            lasts = self._offset_time(dynamics, abs(aside - self.offsets.get(actor, 0.0)))
            effect.is_endless |= self.findings.flag(action, "continuous")
        else:
            shape, by, value = self._dynamics(dynamics) or ("step", "time", 0.0)
            if by == "distance":
                raise ValueError(f"dynamicsDimension: {actor} drives against its lane; give a time or rate")
            lasts = value if by == "time" else _STEEPEST[shape] * abs(aside) / (value or 1.0)
        self.offsets[actor], effect.lasts = aside, max(effect.lasts, lasts)
        effect.add(actor, change_lane={"lanes": 0, "stay_s": _STAY, "offset_m": aside, "duration_s": min(lasts, 60.0)})

    def _offset_time(self, dynamics: Node, across: float) -> float:
        """Time that so wide a move [m] takes along half a wave of a cosine at `maxLateralAcc` at most [s]."""
        shape = self.findings.word(dynamics, "dynamicsShape", tuple(SHAPES))
        most = self.findings.number(dynamics, "maxLateralAcc", math.inf, is_finite=False)
        return 0.0 if shape == "step" else math.pi * math.sqrt(0.5 * across / max(most, _LEAST))

    def _across(self, target: Node, lanes: Mapping[str, Any], begins: Spot) -> float:
        """Way across of a change of lane, by the lanes on which the vehicles begin [m]."""
        relative = target.one("RelativeTargetLane")
        other = self.positions.entities.get(relative.get("entityRef")) if relative else None
        to = lanes["to"] if "to" in lanes else (other or begins).lane.index + lanes["lanes"]
        return begins.lane.width * (1 if to == "oncoming" else max(abs(to - begins.lane.index), 1))

    def _lanes(self, target: Node, actor: str) -> dict[str, Any] | None:
        absolute, relative = target.one("AbsoluteTargetLane"), target.one("RelativeTargetLane")
        begins = self.positions.entities.get(actor)
        if relative is not None:
            other, lanes = self._other(relative), int(self.findings.number(relative, "value"))
            if lanes > 0 and self._has_one_lane(self.positions.entities.get(relative.get("entityRef"))):
                return self._oncoming(relative, lanes)
            return {"lanes": lanes} if relative.get("entityRef") == actor else {"to_lane_of": other, "lanes": lanes}
        if absolute is None or begins is None:
            self.findings.refuse(target, "expected an AbsoluteTargetLane or RelativeTargetLane")
            return None
        wanted = absolute.get("value")
        return self._absolute_lane(absolute, wanted, begins, self.positions.ways.get(actor, (begins.lane.edge,)))

    def _absolute_lane(self, node: Node, wanted: str, begins: Spot, way: tuple[str, ...]) -> dict[str, Any]:
        """A lane by its number along the way; ValueError where none has it, or lanes at different places across."""
        lanes = self.positions.lanes.lanes
        numbers = {one.index for one in lanes if one.edge in way for o in one.origins if o.rpartition("_")[2] == wanted}
        if len(numbers) == 1:
            return {"to": numbers.pop()}
        road = (begins.lane.origins or ("",))[0].rpartition("_")[0]
        if not numbers and any(f"{road}_{wanted}" in one.origins for one in lanes):
            return self._oncoming(node, abs(int(wanted)))
        what = f"is the lane {' or '.join(map(str, sorted(numbers)))} from the right, by road" if numbers else "is none"
        raise ValueError(f"AbsoluteTargetLane: lane {wanted!r} {what} on the way from road {road!r}")

    def _oncoming(self, node: Node, number: int) -> dict[str, Any]:
        if number != 1:
            self.findings.refuse(node, "of the oncoming lanes, vehicles drive on the nearest; write 1 or -1")
        self.positions.with_oncoming = True
        return {"to": "oncoming"}

    def _has_one_lane(self, spot: Spot | None) -> bool:
        """Whether a road has one lane each way, so that the lane to the left is that of oncoming traffic."""
        road = spot.lane.origins[0].rpartition("_")[0] if spot and spot.lane.origins else ""
        there = {name for one in self.positions.lanes.lanes for name in one.origins if name.startswith(f"{road}_")}
        return there == {f"{road}_1", f"{road}_-1"}

    def _lights(self, action: Node, actor: str, effect: Effect) -> None:
        """`lamps`; a flashing lamp is an indicator, or on."""
        light, state = action.within("LightType", "VehicleLight"), action.one("LightState")
        if light is None or state is None:
            self.findings.refuse(action, "expected a LightType with a VehicleLight, and a LightState")
            return
        mode = self.findings.word(state, "mode", ("on", "off", "flashing"))
        if self.findings.number(action, "transitionTime", 0.0):
            self.findings.refuse(action, "transitionTime: lamps are lit at once; write 0")
        kind = light.get("vehicleLightType")
        if mode == "flashing" and not all("indicator" in one for one in LAMPS.get(kind, ())):
            self.findings.refuse(state, "mode: indicators flash, and no other lamp does")
        if kind in _UNLIT:
            self.findings.leave_out(light, f"vehicles have no {kind}")
            return
        if kind not in LAMPS:
            self.findings.refuse(light, f"unknown light {kind!r}; known: {', '.join((*LAMPS, *_UNLIT))}")
            return
        effect.add(actor, lamps=dict.fromkeys(LAMPS[kind], "off" if mode == "off" else "on"))

    def _keep_distance(self, action: Node, actor: str, effect: Effect) -> None:
        """`follow`, by `timeGap` or `distance`, `continuous`, of a vehicle ahead; in `Init` also the place at once."""
        headway, distance, is_between_bumpers = self.gap(action)
        if self.findings.word(action, "displacement", DISPLACEMENTS, "any") == DISPLACEMENTS[1]:
            raise ValueError("displacement: while it drives, a vehicle keeps a distance to one ahead, not behind")
        if not self.findings.flag(action, "continuous"):
            raise ValueError("continuous: while a vehicle drives, a distance, once reached, is kept; write true")
        effect.is_endless = True
        other = self.vehicles.get(action.get("entityRef"))
        further = 0.0 if is_between_bumpers or other is None else self.vehicles[actor].front + other.rear
        follow = {"vehicle": self._other(action), "headway_s": headway, "gap_m": distance - further}
        effect.add(actor, follow=follow)

    def _synchronize(self, action: Node, actor: str, effect: Effect) -> None:
        """`arrive`: at its target when another vehicle is at its own, each on the way that it has from `Init` on."""
        master, final = action.get("masterEntityRef"), action.one("FinalSpeed")
        own, other = action.one("TargetPosition"), action.one("TargetPositionMaster")
        if master not in self.vehicles or own is None or other is None:
            raise ValueError(f"expected TargetPosition, TargetPositionMaster and a vehicle, got {master!r}")
        (place, begins), (its_place, its_begins) = self._on_the_way(own, actor), self._on_the_way(other, master)
        name = self.called(master).strip('"')
        arrive = {"vehicle": name, "distance_m": place - begins, "its_distance_m": its_place - its_begins}
        speed = final.one("AbsoluteSpeed", "RelativeSpeedToMaster") if final else None
        if speed is not None:
            value = self.findings.number(speed, "value")
            how = (
                "delta"
                if speed.tag == "AbsoluteSpeed"
                else self.findings.word(speed, "speedTargetValueType", ("delta", "factor"))
            )
            arrive["to_kmh"] = 0.0 if how == "factor" else value * KMH_PER_MPS
            arrive["factor"] = value if how == "factor" else float(speed.tag != "AbsoluteSpeed")
        near = self.findings.number(action, "targetToleranceMaster", 0.0)
        effect.has_unknown_end = name != "ego"
        effect.ends.append(f"ego.position >= {its_place - near + self.vehicles[master].front:.3f} m")
        effect.add(actor, arrive=arrive)

    def _on_the_way(self, position: Node, vehicle: str) -> tuple[float, float]:
        """Where on a vehicle's way a position is, and where it begins [m]; ValueError unless that is behind."""
        begins, way = self.positions.entities.get(vehicle), self.positions.ways.get(vehicle, ())
        if begins is None or not way:
            raise ValueError(f"{vehicle} has no way along lanes")
        place, front = self.positions.along_way(position, way), self.vehicles[vehicle].front
        start = self.positions.lanes.along(begins, front, way).position - front
        if place <= start:
            raise ValueError(f"{position.tag}: it lies behind {vehicle}")
        return place, start

    def gap(self, action: Node) -> tuple[float, float, bool]:
        """Time gap [s] or distance [m], the other 0, and whether it is between bumpers; ValueError if none."""
        headway, distance = (self.findings.number(action, key, 0.0) for key in ("timeGap", "distance"))
        if bool(action.get("timeGap")) == bool(action.get("distance")):
            raise ValueError("expected a timeGap or a distance")
        self.findings.word(action, "coordinateSystem", ("entity", "lane", "road"), "entity")
        return headway, distance, self.findings.flag(action, "freespace")

    def _trajectory(self, action: Node, actor: str, effect: Effect) -> None:
        """`path`: a polyline, by its times or at the vehicle's speed, on the lanes or off them."""
        holder = action.one("TrajectoryRef") or action
        reference = holder.one("CatalogReference")
        trajectory = self.catalogs.entry(reference) if reference else holder.one("Trajectory")
        polyline = trajectory.within("Shape", "Polyline") if trajectory else None
        if trajectory is None or polyline is None:
            raise ValueError("expected a Trajectory with a Polyline")
        self.findings.word(
            action.one("TrajectoryFollowingMode") or action, "followingMode", ("position", "follow"), "follow"
        )
        reference_time, vertices = action.one("TimeReference"), polyline.all("Vertex")
        timing = reference_time.one("Timing", "None") if reference_time else None
        places = [place for one in vertices for place in one.all("Position")]
        origin, points = self._own_points(places, actor, effect) or ("map", [self._point(place) for place in places])
        if any(len(one) == 2 for one in points) and len(points) > 1:
            points = [one[:2] for one in points]
        path: dict[str, Any] = {"points": points, "ahead_m": self.vehicles[actor].front, "origin": origin}
        path |= {"stays": True} if self.vehicles[actor].body else {}
        if timing and timing.tag == "Timing":
            scale, offset = self.findings.number(timing, "scale"), self.findings.number(timing, "offset")
            base = self.findings.word(timing, "domainAbsoluteRelative", ("absolute", "relative"))
            if base == "absolute" and not effect.is_at_start:
                raise ValueError("domainAbsoluteRelative: in a story, times count from the beginning of the action")
            path["at_s"] = [scale * self.findings.number(one, "time") + offset for one in vertices]
            effect.lasts = max(effect.lasts, path["at_s"][-1])
        else:
            for one in vertices:
                one.get("time")
            (x, y), front = points[-1][:2], self.vehicles[actor].front
            effect.has_unknown_end = origin != "map" or math.dist(points[0][:2], (x, y)) < 2.0 * _AT_THE_END
            end = f"distance_to({self.called(actor)}, {front:g} m, {x:.3f} m, {y:.3f} m)"
            effect.ends.append(f"{end} < {_AT_THE_END} m")
        if self.findings.flag(trajectory, "closed"):
            raise ValueError("closed: write the first vertex again as the last one, and false")
        if reference:
            self.findings.look_for_unread(trajectory)
        effect.add(actor, path=path)

    def _point(self, place: Node) -> list[float]:
        x, y, heading, _ = self.positions.point(place)
        return [x, y] if heading is None else [x, y, math.degrees(heading)]

    def _own_points(self, places: list[Node], actor: str, effect: Effect) -> tuple[str, list[list[float]]] | None:
        """Points from the place that the actor itself has when it begins, and along which axes; None if not all are."""
        inner = [one for place in places for one in place.all()]
        kinds = {one.tag for one in inner if one.get("entityRef") == actor and not one.children}
        if effect.is_at_start or len(kinds) != 1 or any(one.tag not in kinds for one in inner):
            return None
        origin = {"RelativeWorldPosition": "place", "RelativeObjectPosition": "vehicle"}.get(kinds.pop())
        if origin is None:
            return None
        return origin, [[self.findings.number(one, key) for key in ("dx", "dy")] for one in inner]

    def _assign_route(self, action: Node, actor: str, effect: Effect) -> None:
        """In `Init`: the way through the waypoints, with changes of lane that it needs, and then straight on."""
        effect.routes[actor] = self.positions.route(action)[1]

    def _acquire(self, action: Node, actor: str, effect: Effect) -> None:
        """In `Init`: the shortest way there, and then straight on."""
        position, begins = action.one("Position"), self.positions.entities.get(actor)
        spot = None if position is None else self.positions.spot(position)
        if begins is None or spot is None:
            raise ValueError("expected a Position, and a vehicle that has one")
        effect.routes[actor] = self.positions.lanes.way(begins.lane.edge, spot.lane.edge)


_PRIVATE: Mapping[str, Callable[[Actions, Node, str, Effect], None]] = {
    "SpeedAction": Actions._speed,
    "SpeedProfileAction": Actions._speed_profile,
    "LaneChangeAction": Actions._lane_change,
    "LaneOffsetAction": Actions._lane_offset,
    "LightStateAction": Actions._lights,
    "LongitudinalDistanceAction": Actions._keep_distance,
    "SynchronizeAction": Actions._synchronize,
    "FollowTrajectoryAction": Actions._trajectory,
    "AssignRouteAction": Actions._assign_route,
    "AcquirePositionAction": Actions._acquire,
}
_ACROSS = ("LaneChangeAction", "LaneOffsetAction")
_ANYWHERE = ("SpeedAction", "SpeedProfileAction", "FollowTrajectoryAction", "LightStateAction")
_GLOBAL: Mapping[str, Callable[[Actions, Node, Effect], None]] = {
    "ParameterAction": Actions._set,
    "VariableAction": Actions._set,
    "EntityAction": Actions._entity,
}
_ORDERS = {"LongitudinalAction": {"speed", "follow"}, "PrivateAction": {"arrive"}, "LateralAction": {"change_lane"}}
_GROUPS = [
    f"{kind}Action" for kind in ("Private", "Global", "Controller", "Longitudinal", "Lateral", "Appearance", "Routing")
]
ACTIONS: Mapping[str, str] = {
    "EnvironmentAction": "`fog` and `light`.",
    **{tag: inspect.getdoc(action) or "" for tag, action in _GLOBAL.items()},
    **{tag: inspect.getdoc(action) or "" for tag, action in _PRIVATE.items()},
}
"""Actions that are read, and their translation."""
