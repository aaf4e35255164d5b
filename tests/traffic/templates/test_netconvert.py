"""Networks that FogSim writes beside what SUMO's own netconvert makes of the same nodes, edges and connections."""

import subprocess
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import sumo

from fogsim.traffic.templates import ROAD_TEMPLATES, net_text
from fogsim.traffic.templates.alignment import Points
from fogsim.traffic.templates.net_plan import NetPlan
from fogsim.traffic.templates.net_writer import junctions

Link = tuple[str, str, str, str]
TURNS = {"r": 0, "R": 0, "s": 1, "L": 2, "l": 2}
PLANS = {
    **{name: ROAD_TEMPLATES[name]().layout((150.0,)).net for name in ("curve", "grade", "rural", "ramp")},
    "crossing": ROAD_TEMPLATES["crossing"]().layout().net,
    "lights": ROAD_TEMPLATES["crossing"](lights=True).layout().net,  # type: ignore[call-arg]
    "roundabout": ROAD_TEMPLATES["roundabout"]().layout().net,
    "crossing on foot": ROAD_TEMPLATES["crossing"](footways=True).layout().net,  # type: ignore[call-arg]
    "lights on foot": ROAD_TEMPLATES["crossing"](lights=True, footways=True).layout().net,  # type: ignore[call-arg]
    "rural on foot": ROAD_TEMPLATES["rural"](  # type: ignore[call-arg]
        footways=True, zebra_crossings=(300.0, 700.0)
    )
    .layout((150.0,))
    .net,
}


def converted(plan: NetPlan, folder: Path) -> ET.Element:
    """What netconvert makes of a plan."""
    netconvert = Path(sumo.SUMO_HOME) / "bin" / "netconvert"
    kinds = {True: "traffic_light", False: "priority"}
    nodes = [
        f'<node id="{node.name}" x="{x:.3f}" y="{y:.3f}" z="{z:.3f}" type="{kinds[node.has_signals]}" radius="4"/>'
        for node in junctions(plan)
        for x, y, z in [node.place]
    ]
    edges = [
        f'<edge id="{edge.name}" from="{edge.start}" to="{edge.end}" numLanes="{edge.lanes}" width="{edge.lane_width}"'
        f' speed="{edge.limit}" priority="{edge.priority}" spreadType="right" shape="{shape(edge.axis.points)}"'
        f' sidewalkWidth="{edge.footway or -1}"/>'
        for edge in plan.edges
    ]
    on_foot = int(any(edge.footway for edge in plan.edges))
    links = [
        f'<connection from="{link.source}" to="{link.target}" fromLane="{link.from_lane + on_foot}"'
        f' toLane="{link.to_lane + on_foot}"/>'
        for link in plan.links
    ] + [
        f'<crossing node="{zebra.node}" edges="{zebra.into} {zebra.away}" width="4" priority="true"/>'
        for zebra in plan.zebras
    ]
    files = [folder / name for name in ("n.xml", "e.xml", "c.xml")]
    for file, root, lines in zip(files, ("nodes", "edges", "connections"), (nodes, edges, links), strict=True):
        file.write_text(f"<{root}>{''.join(lines)}</{root}>", encoding="utf-8")
    inputs = [argument for pair in zip(("-n", "-e", "-x"), map(str, files), strict=True) for argument in pair]
    out = folder / "out.net.xml"
    keep = ("--no-turnarounds", "--offset.disable-normalization", "--output.original-names", "false")
    walked = ("--walkingareas", "true") if on_foot else ()
    subprocess.run([netconvert, *inputs, "-o", str(out), *keep, *walked], check=True, capture_output=True)
    return ET.parse(out).getroot()  # noqa: S314 - our own file


def shape(points: Points) -> str:
    return " ".join(f"{x:.3f},{y:.3f},{z:.3f}" for x, y, z in points.tolist())


def right_of_way(net: ET.Element) -> dict[Link, tuple[frozenset[Link], frozenset[Link], str | None, str | None]]:
    """By connection: those that it meets, those that it lets go first, whether it waits inside, and its turn."""
    by_lane: dict[str, list[ET.Element]] = {}
    names = names_on_foot(net)
    crossings = {one.get("id") for one in net.iter("edge") if one.get("function") == "crossing"}
    for one in net.iter("connection"):
        if (names.keys() & {one.get("from"), one.get("to")}) and one.get("to") not in crossings:
            continue  # those of persons that are no requests
        by_lane.setdefault(f"{one.get('from')}_{one.get('fromLane')}", []).append(one)
    found = {}
    for junction in net.iter("junction"):
        requests = list(junction.iter("request"))
        if not requests:
            continue
        lanes = (by_lane.get(lane, []) for lane in (junction.get("incLanes") or "").split())
        at = [one for lane in lanes for one in sorted(lane, key=lambda one: TURNS[one.get("dir") or ""])]
        parts = ([one.get(key) or "" for key in ("from", "to", "fromLane", "toLane")] for one in at)
        links = [tuple(names.get(part, part) for part in link) for link in parts]
        assert len(links) == len(requests)
        for link, one, request in zip(links, at, requests, strict=True):
            met, first = (
                frozenset(links[n] for n, bit in enumerate(reversed(request.get(key) or "")) if bit == "1")
                for key in ("foes", "response")
            )
            found[link] = met, first, request.get("cont"), (one.get("dir") or "").lower()
    return found


def names_on_foot(net: ET.Element) -> dict[str, str]:
    """Crossings and walking areas by the edges that they cross and join: they are numbered in any order."""
    names = {}
    for edge in net.iter("edge"):
        if edge.get("function") == "crossing":
            names[edge.get("id") or ""] = f"crossing {sorted((edge.get('crossingEdges') or '').split())}"
        elif edge.get("function") == "walkingarea":
            name = edge.get("id") or ""
            ends = [(one.get("from") or "", one.get("to") or "") for one in net.iter("connection")]
            joined = {one for pair in ends if name in pair for one in pair if not one.startswith(":")}
            names[name] = f"area {sorted(joined)}"
    return names


def points_of(lane: ET.Element) -> Points:
    points = [[float(number) for number in point.split(",")] for point in (lane.get("shape") or "").split()]
    return np.array([[*point, 0.0][:3] for point in points])


def off(line: Points, other: Points) -> float:
    """How far the points of a line lie beside another line at most [m], before and behind which none counts."""
    steps = np.diff(other, axis=0)
    share = np.einsum("pij,ij->pi", line[:, None] - other[None, :-1], steps) / np.sum(steps**2, axis=1)
    nearest = other[None, :-1] + np.clip(share, 0.0, 1.0)[..., None] * steps
    beside = np.min(np.linalg.norm(line[:, None] - nearest, axis=-1), axis=1)
    within = np.min(share, axis=1) < 1.0
    return float(np.max(beside[within & (np.max(share, axis=1) > 0.0)], initial=0.0))


def test_right_of_way_and_lanes_are_netconverts(tmp_path: Path) -> None:
    for plan in PLANS.values():
        ours = ET.fromstring(net_text(plan))  # noqa: S314 - our own text
        theirs = converted(plan, tmp_path)
        assert right_of_way(ours) == right_of_way(theirs)
        edges = ([edge for edge in net.iter("edge") if edge.get("function") is None] for net in (ours, theirs))
        lanes, others = (
            {lane.get("id"): points_of(lane) for edge in net for lane in edge.iter("lane")} for net in edges
        )
        assert lanes.keys() == others.keys()
        assert max(off(others[lane], line) for lane, line in lanes.items()) < 0.06
