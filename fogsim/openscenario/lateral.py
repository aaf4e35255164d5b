"""Actions across lanes: changes of lane, places within lanes, and moves of vehicles that drive against a lane."""

import math
from collections.abc import Mapping
from typing import Any

from fogsim.openscenario.effects import SHAPES, ActionReader, Effect
from fogsim.openscenario.positions import sense
from fogsim.openscenario.xml_tree import Node
from fogsim.traffic.road.opendrive_lanes import Spot

_STEEPEST = {"linear": 1.0, "sinusoidal": 0.5 * math.pi, "cubic": 1.5}  # Greatest rate of a shape, over its mean
_STAY = 1e5  # Time for which a vehicle stays in the lane that it has changed to [s]
_LEAST = 0.05  # Lateral acceleration of a move within a lane [m/s²]


class LateralActions(ActionReader):
    """Reads actions across lanes."""

    def lane_change(self, action: Node, actor: str, effect: Effect) -> None:
        """`change_lane`: absolute, or relative to a vehicle; by time, distance or rate."""
        dynamics, target = action.one("LaneChangeActionDynamics"), action.one("LaneChangeTarget")
        if dynamics is None or target is None:
            self.findings.refuse(action, "expected LaneChangeActionDynamics and a LaneChangeTarget")
            return
        shape, by, value = self.dynamics(dynamics) or ("step", "time", 0.0)
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

    def lane_offset(self, action: Node, actor: str, effect: Effect) -> None:
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
            name, offset = self.other(to), offset + self._offset(to.get("entityRef"))
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

    def aside(self, action: Node, actor: str, effect: Effect) -> None:
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
            shape, by, value = self.dynamics(dynamics) or ("step", "time", 0.0)
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
            other, lanes = self.other(relative), int(self.findings.number(relative, "value"))
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
