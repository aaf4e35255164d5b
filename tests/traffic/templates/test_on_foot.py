"""Persons on roads by template: where those whom a scenario places go, and who strikes them unseen."""

from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

import fogsim
from fogsim.errors import InputError
from fogsim.scenario import override
from fogsim.traffic.templates import ROAD_TEMPLATES, Footfall, Layout, PlacementError, Walker
from fogsim.traffic.templates.on_foot import walkers_text, zebra_places
from fogsim.values import Ending

ROAD = ROAD_TEMPLATES["straight"](length=700.0, footways=True, zebra_crossings=(400.0,)).layout()  # type: ignore[call-arg]
STREETS = ROAD_TEMPLATES["crossing"](footways=True).layout()  # type: ignore[call-arg]


def way_of(layout: Layout, walker: Walker) -> tuple[str, float, str, float]:
    """From where to where a person walks."""
    text = ET.fromstring(f"<r>{''.join(walkers_text(layout, [walker], Footfall()))}</r>")  # noqa: S314 - our own
    person, walk = text.find("person"), text.find(".//walk")
    assert person is not None
    assert walk is not None
    ends = (walk.get("from"), walk.get("to"))
    return str(ends[0]), float(person.get("departPos") or 0), str(ends[1]), float(walk.get("arrivalPos") or 0)


def test_persons_walk_on_or_cross() -> None:
    for walker, way in [
        (Walker("p", position=300.0), ("same_way", 300.0, "same_way.1", 297.0)),
        (Walker("p", position=300.0, is_left=True), ("oncoming.1", 97.0, "oncoming", 0.0)),
        (Walker("p", position=390.0, crosses_at=400.0), ("same_way", 390.0, "oncoming.1", 15.0)),
        (Walker("p", position=390.0, is_left=True, crosses_at=405.0), ("oncoming.1", 7.0, "same_way", 382.0)),
        (Walker("p", position=423.0, crosses_at=400.0), ("same_way.1", 20.0, "oncoming", 282.0)),
    ]:
        found = way_of(ROAD, walker)
        assert (found[0], found[2]) == (way[0], way[2])
        assert (found[1], found[3]) == pytest.approx((way[1], way[3]), abs=0.02)


def test_crossings_of_streets_have_places_along_every_way() -> None:
    assert sorted(zebra_places(STREETS, "same_way").values()) == pytest.approx([292.0, 308.0], abs=0.5)
    assert way_of(STREETS, Walker("p", position=280.0, crosses_at=292.0))[2] == "same_way.back"


def test_persons_who_cannot_walk_so_are_refused() -> None:
    for layout, walker, told in [
        (ROAD_TEMPLATES["straight"]().layout(), Walker("p"), "the road has none; give road.footways: true"),
        (ROAD, Walker("p", crosses_at=200.0), "no crossing at 200 m; there are some at 400 m"),
        (ROAD, Walker("p", way="ramp"), "the road has no way 'ramp'; it has same_way, oncoming"),
        (ROAD, Walker("p", position=900.0), "must begin within 0 … 700 m of its way, got 900 m"),
        (STREETS, Walker("p", crosses_at=308.0), "cannot cross there without another crossing before it"),
    ]:
        with pytest.raises(PlacementError, match="p: ") as refused:
            walkers_text(layout, [walker], Footfall())
        assert told in str(refused.value)


TEXT = """
name: struck
duration: 12 s
renderer: none
estimators: []
advice: none
lighting: low_beam
road: {template: straight, length: 700 m, footways: true, zebra_crossings: [400 m]}
actors:
  ego: {position: 300 m, speed: 90 km/h}
  child: {type: person, position: 397 m, waits: true, crosses_at: 400 m}
fog: {visibility: 20 m}
timeline:
  - {name: steps_out, when: time > 0.05 s, do: {child: {walk: {speed: 5 km/h}}}}
expect:
  hidden: {eventually: "happened(steps_out) and gap(ego, child) < 20 m and ttc(ego, child) < 1 s"}
  safe: {never: child.collision}
"""


@pytest.fixture
def scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("FOGSIM_CACHE_DIR", str(tmp_path / "cache"))
    file = tmp_path / "struck.yaml"
    file.write_text(TEXT, encoding="utf-8")
    return file


def test_who_steps_out_of_the_fog_is_struck_and_it_is_a_collision(scenario: Path) -> None:
    loaded = fogsim.load_scenario(scenario)
    assert override(loaded, []).actors == loaded.actors  # as they are written out
    steps = list(fogsim.run(loaded, seed=1))
    (hit,) = steps[-1].collisions
    assert (hit.collider, hit.victim) == ("ego", "child")
    assert hit.impact_speed > 20.0
    assert steps[-1].ending is Ending.COLLISION
    there = {step.time: step.traffic.persons for step in steps}
    assert {persons.ids for persons in there.values()} == {("child",)}
    assert steps[0].traffic.persons.speed[0] < 0.01


def test_mistakes_about_persons_are_told(scenario: Path) -> None:
    for old, new, told in [
        ("waits: true", "wait: true", "actors.child.wait: unknown key; did you mean 'waits'"),
        ("waits: true", "lane: 1", "a person has no lane; "),
        ("speed: 90 km/h}", "side: left}", "a car has no side; "),
        ("type: person", "type: persn", "unknown type 'persn'"),
        ("{walk: {speed: 5 km/h}}", "{brake: {to: 0 km/h}}", "child is a person, who can walk and nothing else"),
        ("{child: {walk", "{ego: {walk", "ego is a vehicle, and only persons walk; "),
        ("never: child.collision", "never: chid.collision", "did you mean 'child'"),
        ("fog:", "demand: {persons: {along: 60 km/h}}\nfog:", "demand.persons.along: the unit 'km/h' does not fit"),
        (
            "footways: true, zebra_crossings: [400 m]",
            "limit: 80 km/h",
            "struck.yaml:11: actors.child: a person needs a footway",
        ),
    ]:
        assert old in TEXT
        scenario.write_text(TEXT.replace(old, new), encoding="utf-8")
        with pytest.raises(InputError) as refused:
            fogsim.load_scenario(scenario)
        assert told in str(refused.value)
    plain = TEXT.replace(", zebra_crossings: [400 m]", "").replace(", crosses_at: 400 m", "")
    scenario.write_text(plain.replace("fog:", "demand: {persons: {across: 60 persons/h}}\nfog:"), encoding="utf-8")
    with pytest.raises(InputError, match=r"demand.persons.across_pph: .*give road.footways: true and road.zebra_cross"):
        fogsim.load_scenario(scenario)
