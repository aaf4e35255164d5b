"""Elements of an XML file: their lines and paths, what was read of them, and what FogSim cannot do of them."""

import contextlib
import math
import re
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from fogsim.core.files.xml_reader import XmlFile
from fogsim.errors import InputError, LeftOutWarning, shown, suggest


def _by_name(reasons: Mapping[str, str]) -> dict[str, str]:
    return {name: reason for names, reason in reasons.items() for name in names.split()}


HARMLESS: Mapping[str, str] = _by_name(
    {
        "FileHeader@author FileHeader@date FileHeader@revMinor License": "who wrote the file, and when",
        "SceneGraphFile DomeImage DomeFile Vehicle@model3d": "a model or picture for drawing; FogSim draws its own",
        "Properties Property File CustomContent": "free-form properties, meant for another simulator",
        "Axles FrontAxle RearAxle AdditionalAxle Vehicle@mass": "lanes and accelerations say how a vehicle moves",
        "Performance@maxAccelerationRate Performance@maxDecelerationRate": "changes of speed have shapes of their own",
        "TrailerHitch TrailerCoupler": "nothing without a trailer",
        "Vehicle@role Pedestrian@role": "who has another role moves alike",
        "Pedestrian@mass Pedestrian@model Pedestrian@model3d MiscObject@mass MiscObject@model3d": "persons have "
        "figures of FogSim's, and everything else is a box",
        "ParameterDeclaration@parameterType VariableDeclaration@variableType": "a value is checked where it is used",
        "MonitorDeclarations MonitorDeclaration": "nothing may use them",
        "UsedArea": "the whole network is there",
        "Condition@name": "a label",
        "ObjectController Controller AssignControllerAction ActivateControllerAction": "programs of "
        "other simulators; the ego's driver and adviser are FogSim's, all others do what the storyboard orders",
        "BrakePercent BrakeForce AutomaticGear ManualGear Throttle@value Throttle@maxRate Brake@value Clutch@value "
        "Clutch@maxRate ParkingBrake@value SteeringWheel@value SteeringWheel@maxRate SteeringWheel@maxTorque "
        "Gear@number": "nothing while inactive",
        "TimeOfDay@animation": "in minutes the sun hardly moves",
        "Sun@azimuth": "daylight is the illuminance of the ground, without shadows",
        "SynchronizeAction@targetTolerance": "it arrives where and when it is to, within a step",
        "Wind": "even fog does not drift, and boxes of fog stand still",
        "Weather@atmosphericPressure Weather@temperature": "FogSim's light and fog do not depend on them",
        "WorldPosition@p WorldPosition@r RelativeWorldPosition@dz RelativeObjectPosition@dz "
        "Orientation@p Orientation@r": "these follow from the road",
        "SpeedActionDynamics@followingMode LaneChangeActionDynamics@followingMode": "dynamics are followed exactly",
        "DynamicConstraints": "FogSim's law of following has limits of its own",
        "Color ColorRgb ColorCmyk": "lamps have the colours that the law requires",
        "LightState@flashingOnDuration LightState@flashingOffDuration": "indicators flash as the law requires",
        "TimeHeadwayCondition@alongRoute TimeToCollisionCondition@alongRoute": "times are of distances along the road",
    }
)
"""Elements and attributes that could not change a run, and why."""

REFUSED: Mapping[str, str] = _by_name(
    {
        "OpenScenario": "the root is written OpenSCENARIO",
        "ExternalObjectReference ScenarioObjectTemplate EntityDistribution EntityDistributionEntry": "entities are "
        "vehicles, persons and things that the file describes one by one",
        "RandomRouteAction": "who has no route goes straight on",
        "LateralDistanceAction": "where vehicles are in their lanes does not depend on others",
        "VisibilityAction SensorReferenceSet SensorReference": "everything can be seen that the fog does not hide",
        "AnimationAction AnimationType AnimationState AnimationFile ComponentAnimation VehicleComponent "
        "UserDefinedComponent PedestrianAnimation PedestrianGesture UserDefinedAnimation": "nothing moves on a body",
        "UserDefinedLight LightState@luminousIntensity": "lamps shine as their type does",
        "Trailer@name TrailerAction ConnectTrailerAction DisconnectTrailerAction": "vehicles have no trailers",
        "InfrastructureAction TrafficSignalAction TrafficSignalControllerAction TrafficSignalStateAction "
        "TrafficSignalController Phase TrafficSignalState TrafficSignalGroupState TrafficSignalCondition "
        "TrafficSignalControllerCondition": "lights follow the network",
        "TrafficAction TrafficSourceAction TrafficSinkAction TrafficSwarmAction TrafficAreaAction TrafficStopAction "
        "CentralObject InitialSpeedRange TrafficDefinition TrafficDistribution TrafficDistributionEntry TrafficArea "
        "RoadRange RoadCursor Lane Polygon VehicleCategoryDistribution VehicleCategoryDistributionEntry "
        "VehicleRoleDistribution VehicleRoleDistributionEntry ControllerDistribution ControllerDistributionEntry "
        "DirectionOfTravelDistribution": "there is no traffic but the entities",
        "ModifyAction Rule AddValue MultiplyByValue SetMonitorAction": "values are set, not changed by others",
        "UserDefinedAction CustomCommandAction UserDefinedValueCondition UserDefinedDistribution": "its meaning is "
        "another simulator's",
        "GeoPosition": "places are by lane, by road, in the map's metres, or by an entity",
        "OffroadCondition AngleCondition RelativeAngleCondition RelativeClearanceCondition "
        "RelativeLaneRange TimeOfDayCondition": "FogSim has no such condition",
        "DistanceCondition@routingAlgorithm RelativeDistanceCondition@routingAlgorithm "
        "TimeHeadwayCondition@routingAlgorithm TimeToCollisionCondition@routingAlgorithm": "distances are along the "
        "ego's route",
        "ByType@objectType": "name the entities",
    }
)
"""Elements and attributes that change the meaning of a file and that FogSim does not do, and what it does instead."""


_MOST_BYTES, MOST_ELEMENTS = 20_000_000, 500_000  # of a file
_FROM_ZERO = {  # Attributes that the format lets be no less
    *("delay", "duration", "time", "tolerance", "targetToleranceMaster", "distance", "timeGap", "pathS"),
    *("length", "width", "height", "maxSpeed", "maxAcceleration", "maxDeceleration", "maxLateralAcc"),
    *("illuminance", "intensity", "precipitationIntensity", "frictionScaleFactor", "visualRange"),
}
_NAMESPACES = ("xmlns", "xml:", "xsi:")


def sumo_name(name: str) -> str:
    """Name with what SUMO's ids cannot hold, such as blanks, escaped as in addresses of the web."""
    return re.sub(r"[^\w.:#@\-]", lambda found: f"%{ord(found[0]):02X}", name)


@dataclass
class Findings:
    """Lines about what FogSim cannot do of a file and its catalogs, and about what it leaves out; each once."""

    refused: dict[str, None] = field(default_factory=dict)
    remarks: dict[str, None] = field(default_factory=dict)

    def close(self, path: Path) -> None:
        """Report all findings; InputError if FogSim cannot do something."""
        if self.refused:
            raise InputError("\n".join(self.refused))
        if self.remarks:
            message = "\n".join(f"  {line.removeprefix(f'{path}:')}" for line in self.remarks)
            warnings.warn(f"{path}: left out, or read otherwise than written:\n{message}", LeftOutWarning, stacklevel=2)


class NodeError(ValueError):
    """What FogSim cannot do, at an element."""

    def __init__(self, node: "Node", message: str) -> None:
        super().__init__(message)
        self.node = node


@dataclass(slots=True)
class Node:
    """An element; `is_read` and `read` record whether it and which of its attributes were used (names always are)."""

    tag: str
    attributes: dict[str, str]
    file: Path
    line: int
    label: str = ""  # Its tag with its name in brackets
    above: "Node | None" = field(default=None, repr=False, compare=False)
    findings: Findings = field(default_factory=Findings, repr=False, compare=False)
    children: list["Node"] = field(default_factory=list)
    is_read: bool = False
    read: set[str] = field(default_factory=lambda: {"name"})

    @property
    def path(self) -> str:
        """Path of the element, ``/OpenSCENARIO/Storyboard/Story[name]``."""
        return f"{self.above.path if self.above else ''}/{self.label}"

    @property
    def where(self) -> str:
        """File, line and path."""
        return f"{self.file}:{self.line}: {self.path}"

    @property
    def name(self) -> str:
        """Name of the element, "" without one."""
        return self.attributes.get("name", "")

    def get(self, key: str, default: str = "") -> str:
        """Value of an attribute; references to entities are as SUMO names these."""
        self.is_read = True
        self.read.add(key)
        value = self.attributes.get(key, default).strip()
        return sumo_name(value) if key in ("entityRef", "masterEntityRef") else value

    def number(self, key: str, default: float | None = None, *, is_finite: bool = True) -> float:
        """Number of an attribute; an invalid one, or a missing one without default, becomes a finding."""
        text = self.get(key)
        if not text and default is not None:
            return default
        with contextlib.suppress(ValueError):
            value = float(text)
            is_endless = not is_finite and "inf" in text.lower()
            if math.isfinite(value) or (is_endless and not math.isnan(value)):
                if value < 0.0 and key in _FROM_ZERO:
                    self.refuse(f"{key}: expected 0 or more, got {value:g}", is_whole=False)
                return value
        self.refuse(f"expected a number for {key}, got {shown(text or 'nothing')}", is_whole=False)
        return 0.0

    def whole(self, key: str) -> int:
        """Whole number of an attribute; any other becomes a finding."""
        value = self.number(key)
        if not value.is_integer():
            self.refuse(f"{key}: expected a whole number, got {value:g}", is_whole=False)
        return int(value)

    def word(self, key: str, allowed: tuple[str, ...], default: str = "") -> str:
        """Word of an attribute; one that is not allowed becomes a finding."""
        text = self.get(key) or default
        if text in allowed:
            return text
        fault = f"FogSim has no {shown(text)} here; {suggest(text, allowed)}"
        missing = f"this attribute is missing; expected {' or '.join(allowed)}"
        self.refuse(f"{key}: {fault if text else missing}", is_whole=False)
        return allowed[0]

    def flag(self, key: str, default: str = "") -> bool:
        """Truth value of an attribute, in large or small letters, or as 1 or 0; any other becomes a finding."""
        text = {"1": "true", "0": "false"}.get(self.get(key), self.get(key).lower()) or default
        if text not in ("true", "false"):
            self.refuse(f"{key}: expected true or false, got {shown(text or 'nothing')}", is_whole=False)
        return text == "true"

    def all(self, *tags: str) -> list["Node"]:
        """Child elements with one of these tags, or all."""
        found = [child for child in self.children if child.tag in tags or not tags]
        for one in (self, *found):
            one.is_read = True
        return found

    def one(self, *tags: str) -> "Node | None":
        """The child element with one of these tags, or the first of all; a second one becomes a finding."""
        found = self.all(*tags)
        if tags and len(found) > 1:
            found[1].refuse(f"expected one {' or '.join(tags)} in {self.label}, got {len(found)}")
        return next(iter(found), None)

    def need(self, *tags: str) -> "Node":
        """First child element with one of these tags; NodeError without one."""
        found = self.one(*tags)
        if found is None:
            inside = ", ".join(dict.fromkeys(child.tag for child in self.children))
            raise NodeError(self, f"expected {' or '.join(tags)} inside, got {shown(inside) if inside else 'nothing'}")
        return found

    def some(self, *tags: str) -> list["Node"]:
        """Child elements with one of these tags; NodeError without one."""
        return self.all(*tags) or [self.need(*tags)]

    def within(self, *path: str) -> "Node | None":
        """Element at the end of a path of tags."""
        node: Node | None = self
        for tag in path:
            node = None if node is None else node.one(tag)
        return node

    def copy(self, findings: Findings | None = None) -> "Node":
        """An independent copy of it and all its descendants, with the same parent; what it finds goes to `findings`."""
        to = findings or self.findings
        new = replace(self, attributes=dict(self.attributes), read=set(self.read), findings=to)
        new.children = [child.copy(to) for child in self.children]
        for child in new.children:
            child.above = new
        return new

    def walk(self) -> Iterator["Node"]:
        """The element and all its descendants."""
        yield self
        for child in self.children:
            yield from child.walk()

    def refuse(self, message: str, *, is_whole: bool = True) -> None:
        """Record what FogSim cannot do, of the element as a whole or of something about it."""
        self.findings.refused.setdefault(f"{self.where}: {message}")
        self.see(is_whole=is_whole)

    def remark(self, message: str, *, is_whole: bool = False) -> None:
        """Record how the element is read, where a user might expect something else, or that it is left out whole."""
        self.findings.remarks.setdefault(f"{self.where}: {message}")
        self.see(is_whole=is_whole)

    def see(self, *, is_whole: bool = True) -> None:
        """Mark the element and its descendants as read, so that it is reported once."""
        for one in self.walk() if is_whole else ():
            one.is_read = True
            one.read.update(one.attributes)

    @contextlib.contextmanager
    def refusing(self) -> Iterator[None]:
        """Refuse the element, or the one that the error names, for a ValueError."""
        try:
            yield
        except ValueError as error:
            getattr(error, "node", self).refuse(str(error))
            self.see()

    def check_read(self) -> None:
        """Refuse elements and attributes that were not read, unless they are harmless."""
        if self.tag in HARMLESS:
            return
        if not self.is_read:
            self.refuse(REFUSED.get(self.tag, "FogSim does not know this element here"))
            return
        for key in sorted(self.attributes.keys() - self.read):
            name = f"{self.tag}@{key}"
            if name not in HARMLESS and not key.startswith(_NAMESPACES):
                message = REFUSED.get(name, "FogSim does not know this attribute here")
                self.refuse(f"{key}={shown(self.attributes[key])}: {message}", is_whole=False)
        for child in self.children:
            child.check_read()


def handlers(reader: type, kind: str) -> dict[str, Callable[..., Any]]:
    """Methods that read elements of a kind, by tag: ``lane_change_action`` reads each ``LaneChangeAction``."""
    named = ((name.split("_"), method) for one in reversed(reader.mro()) for name, method in vars(one).items())
    return {"".join(map(str.capitalize, words)): method for words, method in named if words[-1] == kind}


def read_xml(path: Path, findings: Findings | None = None) -> Node:
    """Read a file; nothing outside it is loaded, and document types raise InputError."""
    builder = _Builder(path, findings or Findings())
    builder.file.read_all(builder, _MOST_BYTES, MOST_ELEMENTS)
    return builder.root.children[0]


class _Builder:
    is_done = False

    def __init__(self, path: Path, findings: Findings) -> None:
        self.file = XmlFile(path)
        self.root = Node("", {}, path, 1, findings=findings)
        self._open = [self.root]

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        above = self._open[-1]
        name = attributes.get("name") or attributes.get("entityRef")
        label = f"{tag}[{name}]" if name else tag
        parent = above if above.tag else None
        above.children.append(Node(tag, attributes, above.file, self.file.line, label, parent, above.findings))
        self._open.append(above.children[-1])

    def end(self, _: str) -> None:
        self._open.pop()
