"""Actions as blocks of FogSim's timeline."""

import math
from typing import Any

from fogsim.openscenario.environment import Vehicle, environment_of
from fogsim.openscenario.lateral import SHAPES, STEEPEST, Effect, LateralActions
from fogsim.openscenario.positions import from_there_on
from fogsim.openscenario.shapes import Place, positions_of, sampled, shape_of
from fogsim.openscenario.triggers import NEAR
from fogsim.openscenario.xml_tree import HARMLESS, REFUSED, Node, NodeError, handlers
from fogsim.units import KMH_PER_MPS

LAMPS = {  # Of each type of light
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
_UNLIT = ("licensePlateIllumination", "reversingLights", "specialPurposeLights")
_AT_THE_END = 1.5  # Distance at which the end of a trajectory is reached [m]
_AT_THE_GAP, _AT_THE_HEADWAY, _AT_THE_SPEED = 0.1, 0.02, 0.1
"""Differences from a distance [m], a time gap [s] and another's speed [m/s] up to which these count as reached."""
DISPLACEMENTS = ("any", "leadingReferencedEntity", "trailingReferencedEntity")  # By the one at a distance


class Actions(LateralActions):
    """Reads all actions."""

    def take(self, action: Node, actors: list[str], effect: Effect) -> None:
        """Add an action (``PrivateAction``, ``GlobalAction``, or their parent) of some actors to an effect."""
        for one in action.all():
            if one.tag.removesuffix("Action") in _GROUPS:
                self.take(one, actors, effect)
            elif one.tag in _GLOBAL:
                with one.refusing():
                    ACTIONS[one.tag](self, one, effect)
            elif one.tag in HARMLESS:
                one.remark(HARMLESS[one.tag], is_whole=True)
            elif one.tag not in ACTIONS:
                message = REFUSED.get(one.tag, "FogSim does not know this element here")
                one.refuse(f"{message}; actions are {', '.join(ACTIONS)}")
            elif not actors:
                one.refuse("no vehicle does it: the Actors of the maneuver group name no entity")
            else:
                self._private(one, actors, effect, _ORDERS.get(action.tag, set()))

    def _private(self, action: Node, actors: list[str], effect: Effect, orders: set[str]) -> None:
        for actor in actors:
            across = actor in self.positions.against and action.tag in _ACROSS
            with action.refusing():
                is_led = across or (actor in self.positions.paths and action.tag == "SynchronizeAction")
                if actor in self.positions.off_lanes and not is_led and action.tag not in _ANYWHERE:
                    raise ValueError(f"{actor} is on no lane, or turned on one: {', '.join(_ANYWHERE)} move it")
                if effect.do.get(actor, {}).keys() & orders:
                    raise ValueError(f"another action of this event orders the motion of {actor} as well")
                if actor in self.vehicles:
                    (Actions.aside if across else ACTIONS[action.tag])(self, action, actor, effect)
                else:
                    # The group of the action is refused.
                    action.see()

    def override_controller_value_action(self, action: Node, _: Effect) -> None:
        """Nothing while inactive."""
        if any(input_.flag("active", "false") for input_ in action.all()):
            raise ValueError("speeds and lanes are ordered, not pedals; write active=false")

    def parameter_action(self, action: Node, effect: Effect) -> None:
        """Nothing that can be seen: what conditions on a parameter or variable compare."""
        name = action.get("parameterRef") or action.get("variableRef")
        effect.sets[name] = action.need("SetAction").get("value")

    variable_action = parameter_action

    def entity_action(self, action: Node, effect: Effect) -> None:
        """`path` to the place where a vehicle comes onto the road, and there it stands; or `leave`."""
        name, change = action.get("entityRef"), action.need("AddEntityAction", "DeleteEntityAction")
        if name not in self.vehicles or name == self.vehicles.ego:
            raise ValueError(f"expected a vehicle other than the ego, got {name!r}")
        if change.tag == "DeleteEntityAction":
            effect.add(name, leave=True)
            return
        position = change.need("Position")
        if self.positions.refers_to(position):
            message = "in a story, where others are by then is not known; give a place on the map"
            raise ValueError(f"AddEntityAction: {message}")
        x, y, heading, along = self.positions.point(position)
        degrees = math.degrees(heading if heading is not None else along or 0.0)
        vehicle = self.vehicles[name]
        path = {"points": [[x, y, degrees]], "ahead_m": vehicle.front, "speed_kmh": 0.0, "stays": bool(vehicle.body)}
        if "path" not in effect.do.get(name, {}):
            # A trajectory of the same event begins there.
            effect.add(name, path=path)
        effect.once_there[name] = {"speed": {"to_kmh": 0.0, "shape": "step"}, **vehicle.lamps}

    def environment_action(self, action: Node, effect: Effect) -> None:
        """`fog` and `light`."""
        read = environment_of(action, self.positions.catalogs, self.positions.lanes)
        if read.box is not None:
            action.refuse("a box of fog may stand in Init alone; later the fog changes everywhere")
        elif read.visibility is not None:
            effect.add("fog", visibility_m=read.visibility)
        if read.illuminance is not None:
            effect.add("light", illuminance_lx=float(f"{read.illuminance:.4g}"))

    def speed_action(self, action: Node, actor: str, effect: Effect) -> None:
        """`speed`: absolute, or relative to a vehicle at that moment, or continuously; by time or rate."""
        dynamics, target = action.one("SpeedActionDynamics"), action.need("SpeedActionTarget")
        to = target.need("AbsoluteTargetSpeed", "RelativeTargetSpeed")
        speed = {**self._target(to, actor), **(self._pace(dynamics, actor, effect) if dynamics else {"shape": "step"})}
        if "rate_mps2" in speed and "to_kmh" in speed:
            own, final = f"{self.vehicles[actor].called}.speed", speed["to_kmh"] / KMH_PER_MPS
            effect.ends.append(f"{own} > {final - NEAR:.9g} m/s and {own} < {final + NEAR:.9g} m/s")
        effect.has_unknown_end |= "rate_mps2" in speed and not {"to_kmh", "continuous"} & speed.keys()
        effect.is_endless |= "continuous" in speed
        # At a rate of 0 a speed stays as it is.
        held = {"like": self.vehicles[actor].named, "shape": "step"}
        effect.add(actor, speed=held if speed.get("rate_mps2") == 0.0 else speed)

    def speed_profile_action(self, action: Node, actor: str, effect: Effect) -> None:
        """`speed` by its `profile`; without a time as fast as `DynamicConstraints` or the vehicle allow."""
        vehicle, limits = self.vehicles[actor], action.one("DynamicConstraints")
        entries = action.all("SpeedProfileEntry")
        if action.get("entityRef") or not entries:
            raise ValueError("expected SpeedProfileEntry elements whose speeds are absolute, without entityRef")
        action.word("followingMode", ("position", "follow"))
        profile: list[tuple[float, float]] = []
        for entry in entries:
            speed, time = self._possible(entry, "speed", actor), entry.number("time", -1.0)
            last, before = profile[-1] if profile else (0.0, speed)
            if time < 0.0:
                up, down = (_most(vehicle, limits, way) for way in ("acceleration", "deceleration"))
                if not profile and (up < vehicle.acceleration or down < vehicle.deceleration):
                    entry.refuse("time: how long DynamicConstraints let the first one take depends on the speed then")
                time = abs(speed - before) / (up if speed > before else down)
            # SUMO counts milliseconds.
            time = max(time, 0.001 * bool(profile))
            self.check_able(entry, actor, speed - before, time)
            profile.append((last + time, speed))
        effect.lasts = max(effect.lasts, profile[-1][0])
        effect.add(actor, speed={"profile": [[time, speed * KMH_PER_MPS] for time, speed in profile]})

    def check_able(self, node: Node, actor: str, change: float, time: float, shape: str = "linear") -> None:
        """Refuse a change of speed [m/s] that is faster than a vehicle can [s]."""
        vehicle, needed = self.vehicles[actor], STEEPEST[shape] * abs(change) / (time or math.inf)
        most = vehicle.acceleration if change > 0.0 else vehicle.deceleration
        if needed > 1.001 * most and not vehicle.body:
            does = f"{actor} {'speeds up' if change > 0.0 else 'brakes'} by {most:g} m/s² at most (Performance)"
            node.refuse(f"{does}, but would have to by {needed:.3g} m/s²")

    def _possible(self, node: Node, key: str, actor: str) -> float:
        """A speed to which a vehicle can come [m/s]; any other is refused."""
        value, top = node.number(key), self.vehicles[actor].top_speed
        if value < 0.0:
            node.refuse(f"{key}: expected 0 or more, got {value:g}: vehicles do not drive backwards")
        if value > top:
            node.refuse(f"{key}: {actor} drives at most {top:g} m/s (Performance@maxSpeed), got {value:g}")
        return max(value, 0.0)

    def _target(self, to: Node, actor: str) -> dict[str, Any]:
        if to.tag == "AbsoluteTargetSpeed":
            return {"to_kmh": self._possible(to, "value", actor) * KMH_PER_MPS}
        value = to.number("value")
        how = to.word("speedTargetValueType", ("delta", "factor"))
        share = {"factor": value} if how == "factor" else {"plus_kmh": value * KMH_PER_MPS}
        follows = {"continuous": True} if to.flag("continuous", "false") else {}
        return {"like": self.vehicles.of(to).named, **share, **follows}

    def _pace(self, dynamics: Node, actor: str, effect: Effect) -> dict[str, Any]:
        shape, by, value = self.dynamics(dynamics) or ("step", "", 0.0)
        if by == "distance":
            raise NodeError(dynamics, "dynamicsDimension: speeds change by time or rate")
        if by == "time":
            effect.lasts = max(effect.lasts, value)
        vehicle = self.vehicles[actor]
        able = f"{actor} speeds up by {vehicle.acceleration:g} m/s² at most and brakes by {vehicle.deceleration:g}"
        if by == "rate" and value > max(vehicle.acceleration, vehicle.deceleration):
            dynamics.refuse(f"value: {able} (Performance), got {value:g}")
        elif by == "rate" and value > min(vehicle.acceleration, vehicle.deceleration):
            dynamics.remark(f"value: {able} (Performance), got {value:g}: one way takes longer")
        # A rate is the greatest, and FogSim's the mean one.
        pace = {"time": {"over_s": value}, "rate": {"rate_mps2": value / STEEPEST.get(shape, 1.0)}}.get(by, {})
        return {"shape": SHAPES[shape], **pace}

    def light_state_action(self, action: Node, actor: str, effect: Effect) -> None:
        """`lamps`; a flashing lamp is an indicator, or on."""
        light, state = action.need("LightType").need("VehicleLight"), action.need("LightState")
        mode, kind = state.word("mode", ("on", "off", "flashing")), light.word("vehicleLightType", (*LAMPS, *_UNLIT))
        if action.number("transitionTime", 0.0):
            action.refuse("transitionTime: lamps are lit at once; write 0")
        if mode == "flashing" and not all("indicator" in one for one in LAMPS.get(kind, ())):
            state.refuse("mode: indicators flash, and no other lamp does")
        if kind in _UNLIT:
            light.remark(f"vehicles have no {kind}", is_whole=True)
        else:
            effect.add(actor, lamps=dict.fromkeys(LAMPS[kind], "off" if mode == "off" else "on"))

    def longitudinal_distance_action(self, action: Node, actor: str, effect: Effect) -> None:
        """`follow`, by `timeGap` or `distance`, of a vehicle ahead, for good or until it is reached; or a place."""
        headway, distance, is_between_bumpers = self.gap(action)
        if id(action) in self.positions.at_once:
            return
        if action.word("displacement", DISPLACEMENTS, "any") == DISPLACEMENTS[1]:
            raise ValueError("displacement: while it drives, a vehicle keeps a distance to one ahead, not behind")
        is_kept, other, own = action.flag("continuous"), self.vehicles.of(action), self.vehicles[actor]
        further = 0.0 if is_between_bumpers else own.front + other.rear
        effect.is_endless |= is_kept
        limits = action.one("DynamicConstraints")
        if limits is not None:
            limits.remark(HARMLESS[limits.tag], is_whole=True)
        if not is_kept:
            if effect.is_at_start:
                raise ValueError("continuous: in Init a distance with DynamicConstraints is kept; write true")
            if limits is None:
                message = "without DynamicConstraints it is there at once, as in Init; write these, or continuous=true"
                raise ValueError(f"continuous: while a vehicle drives, it comes to a distance in time; {message}")
            pair = f"{own.called}, {other.called}"
            signal, wanted, near, unit = f"gap({pair})", distance - further, _AT_THE_GAP, "m"
            if headway:
                signal, wanted, near, unit = f"headway({pair}, {further:g} m)", headway, _AT_THE_HEADWAY, "s"
            parts = (signal, wanted, near, unit), (f"speed_difference({pair})", 0.0, _AT_THE_SPEED, "m/s")
            reached = " and ".join(f"{s} > {v - n:.9g} {u} and {s} < {v + n:.9g} {u}" for s, v, n, u in parts)
            effect.ends.append(reached)
            effect.reached[actor] = reached
        effect.add(actor, follow={"vehicle": other.named, "headway_s": headway, "gap_m": distance - further})

    def synchronize_action(self, action: Node, actor: str, effect: Effect) -> None:
        """`arrive`: at its target when another vehicle is at its own, each on its way or trajectory from `Init` on."""
        master, final = self.vehicles.of(action, "masterEntityRef"), action.one("FinalSpeed")
        place, begins = self._on_the_way(action.need("TargetPosition"), actor)
        its_place, its_begins = self._on_the_way(action.need("TargetPositionMaster"), master.name)
        arrive = {"vehicle": master.named, "distance_m": place - begins, "its_distance_m": its_place - its_begins}
        speed = final.one("AbsoluteSpeed", "RelativeSpeedToMaster") if final else None
        if speed is not None:
            value, is_relative = speed.number("value"), speed.tag != "AbsoluteSpeed"
            is_factor = is_relative and speed.word("speedTargetValueType", ("delta", "factor")) == "factor"
            arrive["to_kmh"] = 0.0 if is_factor else value * KMH_PER_MPS
            arrive["factor"] = value if is_factor else float(is_relative)
            for steady, key in (("Distance", "steady_m"), ("Time", "steady_s")):
                if (node := speed.one(f"Target{steady}SteadyState")) is not None:
                    arrive[key] = node.number(steady.lower())
        near = action.number("targetToleranceMaster", 0.0)
        effect.has_unknown_end |= master.named != "ego"
        effect.ends.append(f"ego.position >= {its_place - near + master.front:.3f} m")
        effect.add(actor, arrive=arrive)

    def _on_the_way(self, position: Node, vehicle: str) -> tuple[float, float]:
        """Where on a vehicle's way or path a position is, and where it begins [m]; ValueError unless that is behind."""
        if vehicle in self.positions.paths:
            return self.positions.along_path(position, vehicle), 0.0
        begins, way = self.spots.get(vehicle), self.positions.ways.get(vehicle, ())
        if begins is None or not way:
            raise ValueError(f"{vehicle} has no way along lanes")
        place, front = self.positions.along_way(position, way), self.vehicles[vehicle].front
        start = self.positions.lanes.along(begins, front, way).position - front
        if place <= start:
            raise ValueError(f"{position.tag}: it lies behind {vehicle}")
        return place, start

    def gap(self, action: Node) -> tuple[float, float, bool]:
        """Time gap [s] or distance [m], the other 0, and whether it is between bumpers; ValueError if none."""
        headway, distance = (action.number(key, 0.0) for key in ("timeGap", "distance"))
        if bool(action.get("timeGap")) == bool(action.get("distance")):
            raise ValueError("expected a timeGap or a distance")
        action.word("coordinateSystem", ("entity", "lane", "road"), "entity")
        return headway, distance, action.flag("freespace")

    def follow_trajectory_action(self, action: Node, actor: str, effect: Effect) -> None:
        """`path`: a trajectory, or the rest of it, by its times or at the vehicle's speed, on the lanes or off them."""
        shape = shape_of(self.positions.catalogs.need(action.one("TrajectoryRef") or action, "Trajectory"))
        positions = positions_of(shape)
        mode = action.one("TrajectoryFollowingMode") or action
        mode.word("followingMode", ("position", "follow"), "follow")
        has_times = action.within("TimeReference", "None") is None
        timing = action.within("TimeReference", "Timing") if has_times else None
        own = None if effect.is_at_start else self._own_places(positions, shape, actor)
        origin, places = own or ("map", [self.positions.point(one) for one in positions])
        points, times = sampled(shape, places, timing is not None)
        if any(len(one) == 2 for one in points) and len(points) > 1:
            points = [one[:2] for one in points]
        if (left_out := action.number("initialDistanceOffset", 0.0)) and timing:
            action.refuse("initialDistanceOffset: what has times is followed from its first vertex on; write 0")
        points, vehicle = from_there_on(points, left_out), self.vehicles[actor]
        path: dict[str, Any] = {"points": points, "ahead_m": vehicle.front, "origin": origin}
        path |= {"stays": True} if vehicle.body else {}
        if timing:
            scale, offset = timing.number("scale"), timing.number("offset")
            base = timing.word("domainAbsoluteRelative", ("absolute", "relative"))
            if base == "absolute" and not (effect.is_at_start or id(action) in self.positions.at_once):
                message = "in a story, times count from the beginning of the action; write relative"
                raise ValueError(f"domainAbsoluteRelative: {message}")
            path["at_s"] = [scale * time + offset for time in times]
            effect.lasts = max(effect.lasts, path["at_s"][-1])
        else:
            x, y = points[-1][:2]
            effect.has_unknown_end |= origin != "map" or math.dist(points[0][:2], (x, y)) < 2.0 * _AT_THE_END
            end = f"nearest_to({self.vehicles[actor].called}, {vehicle.front:g} m, {x:.3f} m, {y:.3f} m)"
            effect.ends.append(f"{end} < {_AT_THE_END} m")
            if effect.is_at_start:
                self.positions.paths[actor] = [(x, y) for x, y, *_ in points]
        effect.add(actor, path=path)

    def _own_places(self, positions: list[Node], shape: Node, actor: str) -> tuple[str, list[Place]] | None:
        """Places from the one that the actor itself has when it begins, and along which axes; None if not all are."""
        inner = [one for position in positions for one in position.all()]
        own = [one for one in inner if one.tag in _OWN_AXES and one.get("entityRef") == actor and not one.children]
        if own != inner or len({one.tag for one in inner}) != 1:
            return None
        axes = _OWN_AXES[inner[0].tag]
        if shape.tag.startswith("Clothoid") and axes == "place":
            return None
        return axes, [(one.number("dx"), one.number("dy"), None, None) for one in inner]

    def assign_route_action(self, action: Node, actor: str, effect: Effect) -> None:
        """The way through the waypoints, with changes of lane as needed, and then straight on; the ego's in `Init`."""
        self._drive(self.positions.route(action)[1], actor, effect)

    def acquire_position_action(self, action: Node, actor: str, effect: Effect) -> None:
        """The shortest way there, and then straight on; the ego's in `Init`."""
        edge, begins = self.positions.on_lanes(action.need("Position")).lane.edge, self._begin(actor).lane.edge
        self._drive(self.positions.lanes.way(begins, edge) if effect.is_at_start else (edge,), actor, effect)

    def _drive(self, edges: tuple[str, ...], actor: str, effect: Effect) -> None:
        if effect.is_at_start:
            effect.routes[actor] = edges
        elif actor == self.vehicles.ego:
            message = "along which positions count, is known from the beginning; write it in Init"
            raise ValueError(f"the ego's route, {message}")
        else:
            self.positions.rerouted.add(actor)
            effect.add(actor, take_route=[*edges, *self.positions.lanes.route(edges[-1])[1:]])


def _most(vehicle: Vehicle, limits: Node | None, way: str) -> float:
    """How hard a vehicle speeds up (`acceleration`) or brakes (`deceleration`) within its and other limits [m/s²]."""
    own: float = getattr(vehicle, way)
    most = limits.number(key := f"max{way.capitalize()}", own) if limits else own
    if limits and most <= 0.0:
        limits.refuse(f"{key}: expected more than 0, got {most:g}")
    return min(most, own) if most > 0.0 else own


ACTIONS = handlers(Actions, "action")
_GLOBAL = ("EnvironmentAction", "ParameterAction", "VariableAction", "EntityAction", "OverrideControllerValueAction")
_ACROSS = ("LaneChangeAction", "LaneOffsetAction")
_ANYWHERE = ("SpeedAction", "SpeedProfileAction", "FollowTrajectoryAction", "LightStateAction")
_ORDERS = {"LongitudinalAction": {"speed", "follow"}, "PrivateAction": {"arrive"}, "LateralAction": {"change_lane"}}
_OWN_AXES = {"RelativeWorldPosition": "place", "RelativeObjectPosition": "vehicle"}
_GROUPS = ("Private", "Global", "Controller", "Longitudinal", "Lateral", "Appearance", "Routing")
