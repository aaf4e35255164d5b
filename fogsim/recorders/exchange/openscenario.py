"""What a run was as an OpenSCENARIO file: who drove where and when, the fog and the light of day."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from xml.sax.saxutils import quoteattr

from fogsim.files.atomic import write_text
from fogsim.recorders.protocol import Derived
from fogsim.values import Step, TrafficStep
from fogsim.values.traffic import BOX, PEDESTRIAN

REFERENCE_SHARE = 0.28
"""Where the middle of a body is ahead of the rear axle, the reference point, as a share of its length [-]."""

CHANGE = 0.01
"""Change of the visibility that becomes an event of its own, as a share [-]."""

FARTHEST = 100_000.0
"""Visibility that stands for clear air, which the format cannot express [m]."""

_CATEGORIES = {"car": "car", "van": "van", "truck": "truck", "bus": "bus", "motorcycle": "motorbike"}

_OTHERS = {
    BOX: ("MiscObject", "miscObjectCategory", "obstacle"),
    PEDESTRIAN: ("Pedestrian", "pedestrianCategory", "pedestrian"),
}
_MASS = 75.0  # of what is no vehicle, for the format asks for one [kg]


@dataclass
class _Track:
    """A vehicle: its body, and its reference point over time."""

    kind: str
    size: tuple[float, float, float]
    first_speed: float
    vertices: list[tuple[float, float, float, float, float]] = field(default_factory=list)


class OpenScenarioRecorder:
    """Writes ``scenario.xosc`` (OpenSCENARIO XML 1.2) when the run is over.

    Each vehicle follows its trajectory, with the time of each camera period; visibility at the camera is
    ``visualRange``, again whenever it has changed by a hundredth. Roads are not written.
    """

    def __init__(self, path: Path, title: str) -> None:
        self._path = path
        self._title = title
        self._tracks: dict[str, _Track] = {}
        self._visibility: list[tuple[float, float]] = []
        self._ego = ""
        self._end = 0.0
        self._open = True

    def record(self, step: TrafficStep, _derived: Derived | None = None) -> None:
        """Take in who is where."""
        if self._visibility and step.time <= self._end:
            return
        traffic, self._end = step.traffic, step.time
        for row, name in enumerate(traffic.ids):
            length = float(traffic.length[row])
            size = (length, float(traffic.width[row]), float(traffic.height[row]))
            track = self._tracks.setdefault(name, _Track(traffic.types[row], size, float(traffic.speed[row])))
            x, y, z = map(float, traffic.position[row])
            heading, back = float(traffic.heading[row]), (0.5 + REFERENCE_SHARE) * length
            place = (x - back * math.cos(heading), y - back * math.sin(heading), z)
            track.vertices.append((step.time, *place, heading))
        now = min(step.truth.visibility, FARTHEST)
        if not self._visibility or abs(now / self._visibility[-1][1] - 1.0) > CHANGE:
            self._visibility.append((step.time, now))
        if isinstance(step, Step):
            self._ego = traffic.ids[step.ego]

    def close(self, complete: bool) -> None:
        """Write the file."""
        if self._open:
            write_text(self._path, "\n".join(self._lines(complete)) + "\n")
            self._open = False

    def _lines(self, complete: bool) -> Iterator[str]:
        told = f"{self._title}: a run of FogSim" + ("" if complete else ", cut short")
        yield '<?xml version="1.0" encoding="UTF-8"?>'
        yield "<OpenSCENARIO>"
        # No clock: equal runs give equal bytes.
        yield _tag("FileHeader", revMajor=1, revMinor=2, date="2000-01-01T00:00:00", description=told, author="FogSim")
        yield "<CatalogLocations/>"
        yield "<RoadNetwork/>"
        yield "<Entities>"
        for name, track in self._tracks.items():
            yield from self._entity(name, track)
        yield "</Entities>"
        yield "<Storyboard>"
        yield from self._init()
        yield '<Story name="run"><Act name="run">'
        for name, track in self._tracks.items():
            yield from _group(name, [name], [_trajectory_event(name, track)])
        changes = [_fog_event(time, visibility) for time, visibility in self._visibility[1:]]
        if changes:
            yield from _group("fog", [], changes)
        yield _start(0.0)
        yield "</Act></Story>"
        yield _trigger("StopTrigger", self._end)
        yield "</Storyboard>"
        yield "</OpenSCENARIO>"

    def _entity(self, name: str, track: _Track) -> Iterator[str]:
        length, width, height = track.size
        axle = {"maxSteering": 0.5, "wheelDiameter": 0.6, "trackWidth": f"{0.85 * width:.3f}", "positionZ": 0.3}
        yield f"<ScenarioObject name={quoteattr(name)}>"
        centre = _tag("Center", x=f"{REFERENCE_SHARE * length:.4f}", y=0, z=f"{0.5 * height:.4f}")
        sides = _tag("Dimensions", width=f"{width:.4f}", length=f"{length:.4f}", height=f"{height:.4f}")
        if track.kind in _OTHERS:
            tag, category, value = _OTHERS[track.kind]
            yield _opening(tag, name=track.kind, mass=_MASS, **{category: value})
            yield f"<BoundingBox>{centre}{sides}</BoundingBox></{tag}>"
            yield "</ScenarioObject>"
            return
        yield _opening("Vehicle", name=track.kind, vehicleCategory=_CATEGORIES.get(track.kind, "car"))
        yield f"<BoundingBox>{centre}{sides}</BoundingBox>"
        yield _tag("Performance", maxSpeed=70, maxAcceleration=10, maxDeceleration=10)
        yield "<Axles>"
        yield _tag("FrontAxle", **axle, positionX=f"{2 * REFERENCE_SHARE * length:.4f}")
        yield _tag("RearAxle", **axle, positionX=0)
        yield "</Axles>"
        properties = _tag("Property", name="type", value="ego_vehicle") if name == self._ego else ""
        yield f"<Properties>{properties}</Properties>"
        yield "</Vehicle>"
        yield "</ScenarioObject>"

    def _init(self) -> Iterator[str]:
        yield "<Init><Actions>"
        for _, visibility in self._visibility[:1]:
            yield f"<GlobalAction>{_environment(visibility)}</GlobalAction>"
        for name, track in self._tracks.items():
            yield f"<Private entityRef={quoteattr(name)}>"
            yield f"<PrivateAction><TeleportAction>{_position(track.vertices[0])}</TeleportAction></PrivateAction>"
            yield "<PrivateAction><LongitudinalAction><SpeedAction>"
            yield _tag("SpeedActionDynamics", dynamicsShape="step", dynamicsDimension="time", value=0)
            speed = _tag("AbsoluteTargetSpeed", value=f"{track.first_speed:.4f}")
            yield f"<SpeedActionTarget>{speed}</SpeedActionTarget>"
            yield "</SpeedAction></LongitudinalAction></PrivateAction>"
            yield "</Private>"
        yield "</Actions></Init>"


def _group(name: str, actors: list[str], events: list[str]) -> Iterator[str]:
    yield _opening("ManeuverGroup", name=name, maximumExecutionCount=1)
    told = "".join(_tag("EntityRef", entityRef=actor) for actor in actors)
    yield f'<Actors selectTriggeringEntities="false">{told}</Actors>'
    yield f"<Maneuver name={quoteattr(name)}>"
    yield from events
    yield "</Maneuver>"
    yield "</ManeuverGroup>"


def _event(name: str, action: str, time: float) -> str:
    opening = _opening("Event", name=name, priority="parallel", maximumExecutionCount=1)
    return f"{opening}<Action name={quoteattr(name)}>{action}</Action>{_start(time)}</Event>"


def _trajectory_event(name: str, track: _Track) -> str:
    # A polyline has two vertices at least.
    points = track.vertices if len(track.vertices) > 1 else 2 * track.vertices
    vertices = "".join(f'<Vertex time="{point[0]:.3f}">{_position(point)}</Vertex>' for point in points)
    opening = _opening("Trajectory", name=name, closed="false")
    action = (
        f"<PrivateAction><RoutingAction><FollowTrajectoryAction>"
        f"<TrajectoryRef>{opening}<Shape><Polyline>{vertices}</Polyline></Shape></Trajectory></TrajectoryRef>"
        f"<TimeReference>{_tag('Timing', domainAbsoluteRelative='absolute', scale=1, offset=0)}</TimeReference>"
        f"{_tag('TrajectoryFollowingMode', followingMode='position')}"
        f"</FollowTrajectoryAction></RoutingAction></PrivateAction>"
    )
    return _event(f"{name} drives", action, track.vertices[0][0])


def _fog_event(time: float, visibility: float) -> str:
    return _event(f"fog at {time:g} s", f"<GlobalAction>{_environment(visibility)}</GlobalAction>", time)


def _environment(visibility: float) -> str:
    fog = _tag("Fog", visualRange=f"{visibility:.6g}")
    return f'<EnvironmentAction><Environment name="fog"><Weather>{fog}</Weather></Environment></EnvironmentAction>'


def _position(vertex: tuple[float, float, float, float, float]) -> str:
    _, x, y, z, heading = vertex
    return f"<Position>{_tag('WorldPosition', x=f'{x:.4f}', y=f'{y:.4f}', z=f'{z:.4f}', h=f'{heading:.5f}')}</Position>"


def _start(time: float) -> str:
    return _trigger("StartTrigger", time)


def _trigger(tag: str, time: float) -> str:
    condition = _tag("SimulationTimeCondition", value=f"{time:.3f}", rule="greaterOrEqual")
    opening = _opening("Condition", name=f"at {time:g} s", delay=0, conditionEdge="none")
    return (
        f"<{tag}><ConditionGroup>{opening}<ByValueCondition>{condition}</ByValueCondition>"
        f"</Condition></ConditionGroup></{tag}>"
    )


def _opening(element: str, /, **attributes: object) -> str:
    return f"<{element}{_told(attributes)}>"


def _tag(element: str, /, **attributes: object) -> str:
    return f"<{element}{_told(attributes)}/>"


def _told(attributes: Mapping[str, object]) -> str:
    return "".join(f" {key}={quoteattr(str(value))}" for key, value in attributes.items())
