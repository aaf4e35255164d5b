"""What an event does, and actions across lanes: changes of lane, and places within lanes."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from fogsim.openscenario.parameters import is_of_carla
from fogsim.openscenario.positions import Positions, road_of, sense
from fogsim.openscenario.xml_tree import Node, NodeError
from fogsim.traffic.road.opendrive_lanes import Spot

# Shapes of dynamics, and the nearest one in FogSim
SHAPES = {"step": "step", "linear": "linear", "sinusoidal": "sinusoidal", "cubic": "sinusoidal"}
STEEPEST = {"linear": 1.0, "sinusoidal": 0.5 * math.pi, "cubic": 1.5}  # Greatest rate of a shape, over its mean
_STAY = 1e5  # Time for which a vehicle stays in the lane that it has changed to [s]
MOTION = {"speed", "follow", "arrive"}  # Keys of blocks that order a speed
_WAYS = {**dict.fromkeys(MOTION, "along"), "change_lane": "across", "path": "across"}
_TINY = 1e-9  # Lateral acceleration that is none [m/s²]
_LONGEST = 60.0  # Most time that a move across takes [s]


@dataclass
class Effect:
    """What an event does: timeline blocks by subject, their known duration [s], and conditions that end the rest."""

    do: dict[str, dict[str, Any]] = field(default_factory=dict)
    lasts: float = 0.0
    ends: list[str] = field(default_factory=list)
    routes: dict[str, tuple[str, ...]] = field(default_factory=dict)  # Edges through the waypoints of routes
    ends_itself: bool = False  # Only the run shows its duration.
    is_endless: bool = False  # Something else must end it.
    has_unknown_end: bool = False
    sets: dict[str, str] = field(default_factory=dict)  # Values of parameters and variables
    once_there: dict[str, dict[str, Any]] = field(default_factory=dict)  # For vehicles that it brings onto the road
    is_at_start: bool = False
    reached: dict[str, str] = field(default_factory=dict)  # When an actor keeps its speed again
    added: set[tuple[str, str]] = field(default_factory=set)  # Subjects and keys of its own blocks

    def add(self, subject: str, **blocks: Any) -> None:
        """Add an action of a subject."""
        self.added.update((subject, key) for key in blocks)
        mine = self.do.setdefault(subject, {})
        for key, block in blocks.items():
            mine[key] = {**mine.get(key, {}), **block} if key == "lamps" else block

    def part(self) -> "Effect":
        """Effect of one of several actions: it does all of it, and its end is its own; `join` adds the end."""
        new = replace(self, lasts=0.0, ends=[], ends_itself=False, is_endless=False, has_unknown_end=False)
        return replace(new, added=set())

    def join(self, part: "Effect") -> None:
        """Last as long as a part, too."""
        self.lasts, self.ends = max(self.lasts, part.lasts), [*self.ends, *part.ends]
        self.added |= part.added
        self.ends_itself |= part.ends_itself
        self.is_endless |= part.is_endless
        self.has_unknown_end |= part.has_unknown_end

    def wait_for_those_who_come(self) -> None:
        """Order of vehicles that it brings onto the road all but their path once they are there."""
        for subject, there in self.once_there.items():
            done = self.do[subject]
            rest = {key: done.pop(key) for key in [*done] if key != "path"}
            if MOTION & rest.keys():
                del there["speed"]
            if rest.get("speed", {}).get("shape") == "step" and "at_s" not in done["path"]:
                done["path"]["speed_kmh"] = rest["speed"].get("to_kmh", 0.0)
            Effect(do=self.once_there).add(subject, **rest)

    def moved(self) -> set[str]:
        """Subjects whose speed it orders."""
        return {subject for subject, done in self.do.items() if MOTION & done.keys()}

    def changes_speed(self, *subjects: str) -> bool:
        """Whether the speed of a subject (default: any) changes, or goes by another vehicle's, for some time."""
        done = [self.do.get(one, {}) for one in subjects or self.do]
        speeds = [one.get("speed", {}) for one in done]
        lasts = (bool({"continuous", "profile"} & {*one}) or one.get("shape", "step") != "step" for one in speeds)
        return any({"follow", "arrive"} & one.keys() for one in done) or any(lasts)

    def paths(self) -> set[str]:
        """Subjects that follow trajectories by its own blocks."""
        return {subject for subject, key in self.added if key == "path" and self.has_path(subject)}

    def ordered(self) -> set[tuple[str, str]]:
        """Subjects, and in which ways it orders each one's motion: ``along`` or ``across``, one order each."""
        found = {(subject, _WAYS[key]) for subject, key in self.added if key in _WAYS}
        return found | {(one, "along") for one in self.paths() if self.has_path(one, has_times=True)}

    def lasting(self) -> set[tuple[str, str]]:
        """Those that are ``ordered`` and take some time, or never end."""
        moving = {(one, "along") for one in self.do if self.changes_speed(one)}
        moving |= {(one, "across") for one in self.do if self.moves_across(one)}
        own = self.paths() if not self.is_endless else self.do.keys()
        return {(one, way) for one, way in self.ordered() if one in own or (one, way) in moving}

    def moves_across(self, subject: str) -> bool:
        """Whether a subject changes lane, or moves in its lane, for some time."""
        move = self.do.get(subject, {}).get("change_lane", {})
        return "distance_m" in move or move.get("duration_s", 0.0) > 0.0

    def has_path(self, subject: str, has_times: bool | None = None) -> bool:
        """Whether a subject follows a trajectory: any, one with times, or one without."""
        path = None if subject in self.once_there else self.do.get(subject, {}).get("path")
        return path is not None and has_times in (None, "at_s" in path)


@dataclass
class LateralActions:
    """Reads actions across lanes; `offsets` are where vehicles are in their lanes after the actions so far."""

    positions: Positions
    offsets: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.vehicles, self.spots = self.positions.vehicles, self.positions.spots

    def dynamics(self, node: Node) -> tuple[str, str, float] | None:
        """Shape, dimension and value of a change; None if it happens at once, whatever its dimension."""
        shape, by = node.word("dynamicsShape", tuple(SHAPES)), node.get("dynamicsDimension")
        value = node.number("value", 0.0 if shape == "step" else None, is_finite=by != "rate")
        if shape != "step":
            by = node.word("dynamicsDimension", ("time", "rate", "distance"))
        if shape == "step" and value and is_of_carla(self.positions.catalogs.root):
            node.remark(f"value: ScenarioRunner's action lasts for {value:g} ({by}); here a step is over at once")
        if value < 0.0 and by != "rate":
            node.refuse(f"value: expected 0 or more, got {value:g}")
        is_at_once = shape == "step" or math.isinf(value) or (value == 0.0 and by != "rate")
        return None if is_at_once else (shape, by, abs(value))

    def lane_change_action(self, action: Node, actor: str, effect: Effect) -> None:
        """`change_lane`: absolute, or relative to a vehicle; by time, distance or rate."""
        dynamics, to = self._parts(action)
        shape, by, value = self.dynamics(dynamics) or ("step", "time", 0.0)
        _name_curve(dynamics, shape)
        if by == "rate" and value == 0.0:
            dynamics.refuse("value: expected a rate above 0")
        begins = self._begin(actor)
        lanes = self._lanes(to, actor, begins)
        if by == "rate":
            value = STEEPEST[shape] * self._across(to, lanes, begins) / (value or 1.0)
        pace = {"distance_m": value} if by == "distance" else {"duration_s": _allowed(value)}
        effect.lasts = max(effect.lasts, pace.get("duration_s", 0.0))
        effect.ends_itself = by == "distance"
        offset = self.positions.leftward(sense(begins)) * action.number("targetLaneOffset", 0.0)
        if offset or self._offset(actor):
            pace["offset_m"] = self.offsets[actor] = begins.shifted(offset).offset
        effect.add(actor, change_lane={**lanes, "stay_s": _STAY, **pace})

    def lane_offset_action(self, action: Node, actor: str, effect: Effect) -> None:
        """`change_lane` with `offset_m`, along half a wave of a cosine, at `maxLateralAcc` at most."""
        (dynamics, to), begins = self._parts(action), self._begin(actor)
        offset, across, lanes = self.positions.leftward(sense(begins)) * to.number("value"), 0.0, {}
        if to.tag.startswith("Relative"):
            name, other = self.vehicles.of(to).named, self.spots.get(to.get("entityRef"))
            offset += self._offset(to.get("entityRef"))
            if other and other.lane != begins.lane:
                lanes, across = {"to_lane_of": name}, begins.lane.width * abs(other.lane.index - begins.lane.index)
        lasts = self._offset_time(dynamics, across + abs(offset - self._offset(actor)))
        self.offsets[actor] = begins.shifted(offset).offset
        effect.is_endless |= action.flag("continuous")
        self._move(actor, effect, offset, lasts, lanes)

    def aside(self, action: Node, actor: str, effect: Effect) -> None:
        """`change_lane` of a vehicle that drives against a lane: from its path to a lane, as they lie at first."""
        (dynamics, to), base = self._parts(action), self.positions.against[actor]
        is_change, value = action.tag == "LaneChangeAction", to.number("value")
        x, y, heading = self.positions.off_lanes[actor]
        spot = self.spots.get(to.get("entityRef")) if to.tag.startswith("Relative") else base
        if spot is None:
            message = "give a lane, or one by a vehicle that drives along its own"
            raise ValueError(f"{actor} drives against its lane: {message}")
        offset = action.number("targetLaneOffset", 0.0) if is_change else value
        offset *= self.positions.leftward(sense(spot))
        if to.tag == "RelativeTargetLane":
            spot = self.positions.lanes.beside(spot, int(value))
        elif is_change:
            road = self.positions.lanes.roads.get(road_of(base))
            spot = self.positions.lanes.on_lane(road_of(base), f"{value:g}", road.nearest(x, y) if road else 0.0)
        to_x, to_y, _ = self.positions.lanes.foot(spot.lane, x, y).shifted(offset).world
        across = (to_y - y) * math.cos(heading) - (to_x - x) * math.sin(heading)
        if is_change:
            shape, by, value = self.dynamics(dynamics) or ("step", "time", 0.0)
            _name_curve(dynamics, shape)
            if by == "distance":
                raise ValueError(f"dynamicsDimension: {actor} drives against its lane; give a time or rate")
            lasts = value if by == "time" else STEEPEST[shape] * abs(across) / (value or 1.0)
        else:
            lasts = self._offset_time(dynamics, abs(across - self.offsets.get(actor, 0.0)))
            effect.is_endless |= action.flag("continuous")
        self.offsets[actor] = across
        self._move(actor, effect, across, lasts, {})

    def _parts(self, action: Node) -> tuple[Node, Node]:
        """Dynamics and target of an action; NodeError unless both are there."""
        kind = action.tag.removesuffix("Action")
        kinds = [f"{which}Target{kind.replace('Change', '')}" for which in ("Absolute", "Relative")]
        return action.need(f"{action.tag}Dynamics"), action.need(f"{kind}Target").need(*kinds)

    def _begin(self, actor: str) -> Spot:
        if actor not in self.spots:
            raise ValueError(f"{actor} has no place on a lane in Init")
        return self.spots[actor]

    def _offset(self, vehicle: str) -> float:
        """Where a vehicle is in its lane after the actions so far, to the left of its middle [m]."""
        begins = self.spots.get(vehicle)
        return self.offsets.get(vehicle, begins.offset if begins else 0.0)

    def _move(self, actor: str, effect: Effect, offset: float, lasts: float, lanes: Mapping[str, Any]) -> None:
        effect.lasts = max(effect.lasts, lasts)
        move = {"lanes": 0, "stay_s": _STAY, "offset_m": offset, "duration_s": _allowed(lasts)}
        effect.add(actor, change_lane={**lanes, **move})

    def _offset_time(self, dynamics: Node, across: float) -> float:
        """Time that so wide a move [m] takes along half a wave of a cosine at `maxLateralAcc` at most [s]."""
        shape = dynamics.word("dynamicsShape", tuple(SHAPES))
        most = dynamics.number("maxLateralAcc", math.inf, is_finite=False)
        _name_curve(dynamics, shape)
        return 0.0 if shape == "step" or not across else math.pi * math.sqrt(0.5 * across / max(most, _TINY))

    def _across(self, to: Node, lanes: Mapping[str, Any], begins: Spot) -> float:
        """Way across of a change of lane, by the lanes on which the vehicles begin [m]."""
        if "to" in lanes:
            index = lanes["to"]
        else:
            index = self.spots.get(to.get("entityRef"), begins).lane.index + lanes["lanes"]
        return begins.lane.width * (1 if index == "oncoming" else max(abs(index - begins.lane.index), 1))

    def _lanes(self, to: Node, actor: str, begins: Spot) -> dict[str, Any]:
        if to.tag.startswith("Absolute"):
            return self._absolute_lane(to, begins, self.positions.ways.get(actor, (begins.lane.edge,)))
        other, name, lanes = self.vehicles.of(to).named, to.get("entityRef"), to.whole("value")
        if lanes > 0 and self._has_one_lane(self.spots.get(name)):
            return self._oncoming(to, lanes)
        return {"lanes": lanes} if name == actor else {"to_lane_of": other, "lanes": lanes}

    def _absolute_lane(self, to: Node, begins: Spot, way: tuple[str, ...]) -> dict[str, Any]:
        """A lane by its number along the way; ValueError where none has it, or lanes at different places across."""
        lanes, wanted, road = self.positions.lanes.lanes, to.get("value"), road_of(begins)
        numbers = {one.index for one in lanes if one.edge in way for o in one.origins if o.rpartition("_")[2] == wanted}
        if len(numbers) == 1:
            return {"to": numbers.pop()}
        if not numbers and any(f"{road}_{wanted}" in one.origins for one in lanes):
            return self._oncoming(to, abs(int(wanted)))
        what = f"is the lane {' or '.join(map(str, sorted(numbers)))} from the right, by road" if numbers else "is none"
        raise ValueError(f"AbsoluteTargetLane: lane {wanted!r} {what} on the way from road {road!r}")

    def _oncoming(self, to: Node, number: int) -> dict[str, Any]:
        if number != 1:
            raise NodeError(to, "of the oncoming lanes, vehicles drive on the nearest; write 1 or -1")
        self.positions.with_oncoming = True
        return {"to": "oncoming"}

    def _has_one_lane(self, spot: Spot | None) -> bool:
        """Whether a road has one lane each way, so that the lane to the left is that of oncoming traffic."""
        road = road_of(spot)
        there = {name for one in self.positions.lanes.lanes for name in one.origins if name.startswith(f"{road}_")}
        return there == {f"{road}_1", f"{road}_-1"}


def _name_curve(dynamics: Node, shape: str) -> None:
    if shape == "linear":
        dynamics.remark("dynamicsShape: vehicles move across along a smooth curve; linear is read as sinusoidal")


def _allowed(time: float) -> float:
    if time > _LONGEST:
        raise ValueError(f"a move across takes {_LONGEST:g} s at most, but this one would take {time:.4g} s")
    return time
