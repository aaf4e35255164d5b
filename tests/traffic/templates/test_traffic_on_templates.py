"""Traffic on every template: SUMO says nothing against the files, and nobody collides in clear air."""

from pathlib import Path
from xml.etree import ElementTree as ET

from fogsim.traffic.templates import (
    ROAD_TEMPLATES,
    Actor,
    Demand,
    Footfall,
    Relation,
    Walker,
    cuts_around,
    net_text,
    place_actors,
    routes_text,
    usual_mix,
)
from tests.traffic.templates.common import play

FLOWS = tuple((way, 0.1) for way in ("same_way", "oncoming", "ramp", "north", "south"))


ON_FOOT = ("rural", "crossing")


def test_sumo_plays_it_without_a_warning(tmp_path: Path) -> None:
    for name, on_foot in [*((name, False) for name in ROAD_TEMPLATES), *((n, True) for n in ON_FOOT)]:
        template = ROAD_TEMPLATES[name](**({"footways": True} if on_foot else {}))  # type: ignore[arg-type]
        slow = Actor("slow", "truck", place=Relation("ego", 40.0), speed=8.0)
        broken_down = Actor("broken_down", "van", place=60.0, stands=True, lane=-1)
        standing = [broken_down] if name in ("motorway", "ramp") else []
        placed = place_actors((Actor("ego", place=120.0, speed=10.0), slow, *standing))
        layout = template.layout(cuts_around(placed, template.free_length))
        # Who must let persons go first as well waits longer.
        share = 0.3 if on_foot else 1.0
        flows = tuple((way, share * rate) for way, rate in FLOWS if layout.way(way))
        demand = Demand(flows, usual_mix(name))
        walkers = [Walker("child", position=200.0, crosses_at=292.0)] if name == "crossing" else [Walker("child")]
        on_feet = (walkers, Footfall(0.01, 0.01, 60.0)) if on_foot else ((), Footfall())
        files = net_text(layout.net), routes_text(layout, demand, placed, *on_feet)
        strict = ["--collision.action", "warn", "--collision.check-junctions", "true", "--time-to-teleport", "30"]
        assert play(tmp_path, *files, "--end", "60", "--step-length", "0.2", *strict) == ""


def test_persons_are_there_from_the_beginning_and_come_by_the_seed(tmp_path: Path) -> None:
    layout = ROAD_TEMPLATES["crossing"](footways=True, lights=True).layout()  # type: ignore[call-arg]
    text = routes_text(layout, Demand((), usual_mix("crossing")), (), (), Footfall(0.05, 0.05, 60.0))
    told = list[list[tuple[str, str, str]]]()
    for seed in "112":
        play(tmp_path, net_text(layout.net), text, "--end", "60", "--fcd-output", "fcd.xml", "--seed", seed)
        persons = ET.parse(tmp_path / "fcd.xml").getroot().iter("person")  # noqa: S314 - our own file
        told.append([(one.get("id") or "", one.get("x") or "", one.get("edge") or "") for one in persons])
    same, again, other = told
    assert same == again != other
    assert len({edge for _, _, edge in same if edge.startswith(":middle_c")}) > 1
    # 0.05/s of 1.39 m/s make 0.036/m on each of four footways of 600 m.
    assert 60 <= sum("walks." in name for name in {name for name, _, _ in same}) <= 100
