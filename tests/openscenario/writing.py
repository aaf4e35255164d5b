"""Small OpenSCENARIO files on a country road of 800 m along x, with a lane of 3.5 m each way, and their runs."""

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import fogsim
from fogsim.values import Step

DATA = Path(__file__).parents[1] / "data" / "openscenario"
CASES = DATA / "cases"
ROAD, TWO_LANES = CASES / "road.xodr", DATA / "two_lanes.xodr"
QUIET = ["renderer=none", "estimators=[]", "drivers.see_through_fog=true"]

CAR = (
    '<Vehicle name="car" vehicleCategory="car"><BoundingBox><Center x="1.4" y="0" z="0.75"/>'
    '<Dimensions width="1.9" length="4.6" height="1.5"/></BoundingBox>'
    '<Performance maxSpeed="60" maxDeceleration="9" maxAcceleration="4"/><Axles/></Vehicle>'
)
"""A car whose front bumper is 3.7 m ahead of its reference point, the middle of the rear axle."""


def box(tag: str, kind: str, length: float, width: float, height: float) -> str:
    """A ``MiscObject`` or ``Pedestrian`` whose reference point is its middle."""
    attribute = "pedestrianCategory" if tag == "Pedestrian" else "miscObjectCategory"
    return (
        f'<{tag} name="thing" mass="20" {attribute}="{kind}"><BoundingBox><Center x="0" y="0" z="{0.5 * height}"/>'
        f'<Dimensions width="{width}" length="{length}" height="{height}"/></BoundingBox></{tag}>'
    )


PERSON = box("Pedestrian", "pedestrian", 0.5, 0.6, 1.8)
HEADER = (
    '<?xml version="1.0"?><OpenSCENARIO><FileHeader revMajor="1" revMinor="2" date="2026-01-01T00:00:00" '
    'description="" author=""/>'
)
TIMED = '<Timing domainAbsoluteRelative="relative" scale="1" offset="0"/>'
AT_ONCE = 'dynamicsShape="step" value="0" dynamicsDimension="time"'


def lane(s: float, number: int = -1, more: str = "") -> str:
    """Position on a lane of the road."""
    return f'<Position><LanePosition roadId="7" laneId="{number}" s="{s}" {more}/></Position>'


def world(x: float, y: float, more: str = "") -> str:
    return f'<Position><WorldPosition x="{x}" y="{y}" {more}/></Position>'


def after(time: float, delay: float = 0.0) -> str:
    """Group of one condition on the time [s]."""
    return (
        f'<ConditionGroup><Condition name="t" delay="{delay}" conditionEdge="none"><ByValueCondition>'
        f'<SimulationTimeCondition value="{time}" rule="greaterThan"/></ByValueCondition></Condition></ConditionGroup>'
    )


def linear(value: float, dimension: str = "time") -> str:
    return f'dynamicsShape="linear" value="{value}" dynamicsDimension="{dimension}"'


def speed(target: float | str, dynamics: str = AT_ONCE) -> str:
    """Action that changes a speed to a value [m/s] or a target."""
    to = target if isinstance(target, str) else f'<AbsoluteTargetSpeed value="{target}"/>'
    return (
        f"<PrivateAction><LongitudinalAction><SpeedAction><SpeedActionDynamics {dynamics}/><SpeedActionTarget>{to}"
        "</SpeedActionTarget></SpeedAction></LongitudinalAction></PrivateAction>"
    )


def speed_of(other: str, value: float = 1, kind: str = "factor", more: str = "") -> str:
    """Target of a speed relative to another vehicle's."""
    return f'<RelativeTargetSpeed entityRef="{other}" value="{value}" speedTargetValueType="{kind}" {more}/>'


def profile(*entries: tuple[float | None, float], limits: str = "") -> str:
    """Action that drives through speeds [m/s] after times [s]."""
    inner = "".join(f'<SpeedProfileEntry time="{time}" speed="{value}"/>' for time, value in entries)
    return (
        '<PrivateAction><LongitudinalAction><SpeedProfileAction followingMode="position">'
        f"{limits}{inner}</SpeedProfileAction></LongitudinalAction></PrivateAction>"
    ).replace(' time="None"', "")


def polyline(*vertices: tuple[float | None, str]) -> str:
    """Shape through positions at times [s]."""
    line = "".join(f'<Vertex time="{time}">{place}</Vertex>' for time, place in vertices)
    return f"<Polyline>{line}</Polyline>".replace(' time="None"', "")


def trajectory(shape: str) -> str:
    return f'<TrajectoryRef><Trajectory name="t" closed="false"><Shape>{shape}</Shape></Trajectory></TrajectoryRef>'


def follows(shape: str, reference: str = "<None/>", more: str = "") -> str:
    """Action that follows a trajectory."""
    return (
        f"<PrivateAction><RoutingAction><FollowTrajectoryAction{more}>{trajectory(shape)}<TimeReference>{reference}"
        '</TimeReference><TrajectoryFollowingMode followingMode="position"/></FollowTrajectoryAction></RoutingAction>'
        "</PrivateAction>"
    )


def on(test: str, who: str = "Ego", delay: float = 0.0, edge: str = "none") -> str:
    """Condition on a vehicle."""
    return (
        f'<Condition name="c" delay="{delay}" conditionEdge="{edge}"><ByEntityCondition><TriggeringEntities '
        f'triggeringEntitiesRule="any"><EntityRef entityRef="{who}"/></TriggeringEntities><EntityCondition>{test}'
        "</EntityCondition></ByEntityCondition></Condition>"
    )


def event(name: str, action: str, start: str, count: int = 1) -> str:
    """Event of one action, and its trigger's groups."""
    return (
        f'<Event name="{name}" priority="override" maximumExecutionCount="{count}"><Action name="{name} action">'
        f"{action}</Action><StartTrigger>{start}</StartTrigger></Event>"
    )


def write(
    folder: Path,
    entities: dict[str, str],
    begin: dict[str, str],
    story: dict[str, str] | None = None,
    stop: str = "",
    visibility: float = 200.0,
    road: Path = ROAD,
) -> Path:
    """Write a file: descriptions of entities, their initial positions and actions, and events by actor."""
    objects = "".join(f'<ScenarioObject name="{name}">{what}</ScenarioObject>' for name, what in entities.items())
    private = "".join(
        f'<Private entityRef="{name}">'
        + "".join(
            part
            if part.startswith("<PrivateAction")
            else f"<PrivateAction><TeleportAction>{part}</TeleportAction></PrivateAction>"
            for part in written.split("\n")
        )
        + "</Private>"
        for name, written in begin.items()
    )
    groups = "".join(
        f'<ManeuverGroup name="of {name}" maximumExecutionCount="1"><Actors selectTriggeringEntities="false">'
        f'<EntityRef entityRef="{name}"/></Actors><Maneuver name="m">{events}</Maneuver></ManeuverGroup>'
        for name, events in (story or {}).items()
    )
    act = (
        f'<Story name="s"><Act name="a">{groups}<StartTrigger>{after(0)}</StartTrigger></Act></Story>' if story else ""
    )
    file = folder / "small.xosc"
    file.write_text(
        f'{HEADER}<CatalogLocations><RouteCatalog><Directory path="."/></RouteCatalog>'
        f'</CatalogLocations><RoadNetwork><LogicFile filepath="{road}"/></RoadNetwork>'
        f"<Entities>{objects}</Entities><Storyboard><Init><Actions><GlobalAction><EnvironmentAction>"
        f'<Environment name="e"><Weather><Sun illuminance="20000" azimuth="0" elevation="0.9"/>'
        f'<Fog visualRange="{visibility}"/></Weather><RoadCondition frictionScaleFactor="1"/></Environment>'
        f"</EnvironmentAction></GlobalAction>{private}</Actions></Init>{act}"
        f"<StopTrigger>{stop or after(10)}</StopTrigger></Storyboard></OpenSCENARIO>",
        encoding="utf-8",
    )
    return file


def changed(folder: Path, source: Path, *texts: tuple[str, str]) -> Path:
    """Copy of a file and its folder in which some texts are replaced by others."""
    shutil.copytree(source.parent, folder, dirs_exist_ok=True)
    text = source.read_text(encoding="utf-8")
    for old, new in texts:
        assert old in text, old
        text = text.replace(old, new, 1)
    (file := folder / source.name).write_text(text, encoding="utf-8")
    return file


def run(file: Path, *settings: str) -> list[Step]:
    return list(fogsim.run(fogsim.load_scenario(file, [*QUIET, *settings])))


def first_step(file: Path) -> Step:
    return next(iter(fogsim.run(fogsim.load_scenario(file, QUIET))))


def row_of(step: Step, name: str) -> int:
    row = step.traffic.row(name)
    assert row is not None
    return row


def motion(step: Step, name: str) -> tuple[float, float, float]:
    """x and y of the front bumper [m] and speed [m/s]."""
    row = row_of(step, name)
    return (*map(float, step.traffic.position[row, :2]), float(step.traffic.speed[row]))


def motion_at(steps: Sequence[Step], time: float, name: str) -> tuple[float, float, float]:
    return motion(min(steps, key=lambda one: abs(one.time - time)), name)


def begun(steps: Sequence[Step]) -> dict[str, float]:
    """Times at which events last began [s], by name."""
    return {one.name: one.time for step in steps for one in step.begun if not one.is_over}


def entry(data: dict[str, Any], name: str) -> dict[str, Any]:
    """Entry of the timeline."""
    found: dict[str, Any] = next(entry for entry in data["timeline"] if entry["name"] == name)
    return found


def group(*conditions: str) -> str:
    return f"<ConditionGroup>{''.join(conditions)}</ConditionGroup>"


def state(kind: str, name: str, state: str, delay: float = 0.0) -> str:
    """A condition on the state of an element."""
    return (
        f'<Condition name="s" delay="{delay}" conditionEdge="none"><ByValueCondition><StoryboardElementStateCondition '
        f'storyboardElementType="{kind}" storyboardElementRef="{name}" state="{state}"/></ByValueCondition></Condition>'
    )


def over(name: str) -> str:
    """Group of one condition: an event is over."""
    return group(state("event", name, "completeState"))


def changes_lane(target: int, dimension: str, value: float) -> str:
    return (
        "<PrivateAction><LateralAction><LaneChangeAction><LaneChangeActionDynamics "
        f'dynamicsShape="cubic" dynamicsDimension="{dimension}" value="{value}"/><LaneChangeTarget>'
        f'<AbsoluteTargetLane value="{target}"/></LaneChangeTarget></LaneChangeAction></LateralAction></PrivateAction>'
    )
