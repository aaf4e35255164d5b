"""Actions as blocks of FogSim's timeline."""

import inspect
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from fogsim.openscenario.effects import SHAPES, Effect
from fogsim.openscenario.elements import HARMLESS, REFUSED
from fogsim.openscenario.environment import environment_of
from fogsim.openscenario.lateral import LateralActions
from fogsim.openscenario.triggers import NEAR
from fogsim.openscenario.xml_tree import Node
from fogsim.units import KMH_PER_MPS

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
_AT_THE_END = 1.5  # Distance at which the end of a trajectory is reached [m]
DISPLACEMENTS = ("any", "leadingReferencedEntity", "trailingReferencedEntity")
"""Where a vehicle is to be, seen from the one to which it keeps a distance."""


@dataclass
class Actions(LateralActions):
    """Reads all actions."""

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
                (Actions.aside if across else _PRIVATE[action.tag])(self, action, actor, effect)
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
        return {"like": self.other(relative), **share, **follows}

    def held(self, actor: str) -> dict[str, Any]:
        """The order to keep the speed of that moment."""
        return {"like": self.called(actor).strip('"'), "shape": "step"}

    def _pace(self, dynamics: Node, effect: Effect) -> dict[str, Any]:
        message = self.dynamics(dynamics)
        if message is None:
            return {"shape": "step"}
        shape, by, value = message
        if by == "distance":
            self.findings.refuse(dynamics, "dynamicsDimension: speeds change by time or rate")
            return {}
        if by == "time":
            effect.lasts = max(effect.lasts, value)
        return {"shape": SHAPES[shape], "over_s" if by == "time" else "rate_mps2": value}

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
        follow = {"vehicle": self.other(action), "headway_s": headway, "gap_m": distance - further}
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
        """The way through the waypoints, with changes of lane as needed, and then straight on; the ego's in `Init`."""
        self._drive(self.positions.route(action)[1], actor, effect)

    def _acquire(self, action: Node, actor: str, effect: Effect) -> None:
        """The shortest way there, and then straight on; the ego's in `Init`."""
        position, begins = action.one("Position"), self.positions.entities.get(actor)
        spot = None if position is None else self.positions.spot(position)
        if begins is None or spot is None:
            raise ValueError("expected a Position, and a vehicle that has one")
        edge, lanes = spot.lane.edge, self.positions.lanes
        self._drive(lanes.way(begins.lane.edge, edge) if effect.is_at_start else (edge,), actor, effect)

    def _drive(self, edges: tuple[str, ...], actor: str, effect: Effect) -> None:
        """Give a vehicle its way, at the beginning or later."""
        if effect.is_at_start:
            effect.routes[actor] = edges
        elif self.called(actor) == "ego":
            raise ValueError(
                "the ego's route, along which positions count, is known from the beginning; write it in Init"
            )
        else:
            self.positions.rerouted.add(actor)
            onward = self.positions.lanes.route(edges[-1])[1:]
            effect.add(actor, take_route=[*edges, *onward])


_PRIVATE: Mapping[str, Callable[[Actions, Node, str, Effect], None]] = {
    "SpeedAction": Actions._speed,
    "SpeedProfileAction": Actions._speed_profile,
    "LaneChangeAction": Actions.lane_change,
    "LaneOffsetAction": Actions.lane_offset,
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
