"""Actors where they are said to be."""

import pytest

from fogsim.traffic.templates import Actor, PlacementError, Relation, check_placement, place_actors
from fogsim.traffic.templates.along_roads import Motorway
from fogsim.traffic.templates.placement import edge_at, way_length
from fogsim.traffic.templates.town_roads import Crossing

EGO = Actor("ego", place=200.0)


def positions(*actors: Actor) -> dict[str, float]:
    return {one.actor.name: one.position for one in place_actors(actors)}


def test_gaps_are_from_bumper_to_bumper() -> None:
    found = positions(
        Actor("last", place=Relation("ego", -20.0)),
        EGO,
        Actor("truck", "truck", place=Relation("ego", 60.0)),
        Actor("first", place=Relation("truck", 5.0)),
        Actor("beside", lane=1, place=Relation("ego", 0.0, is_beside=True)),
    )
    # Fronts; a car has 4.6 m, a truck 15.5 m.
    assert found == pytest.approx(
        {"ego": 200.0, "truck": 275.5, "first": 275.5 + 5.0 + 4.6, "last": 200.0 - 4.6 - 20.0, "beside": 200.0}
    )


def test_what_cannot_be_is_refused() -> None:
    for actor, told in [
        (Actor("a", place=Relation("eggo", 10.0)), "there is no actor 'eggo'; did you mean 'ego'"),
        (Actor("a", place=Relation("a", 10.0)), "is placed relative to itself, through a"),
        (Actor("a", way="oncoming", place=Relation("ego", 10.0)), "is on the way 'oncoming', and 'ego' on 'same_way'"),
        (Actor("a", way="ramp"), "the road has no way 'ramp'"),
        (Actor("a", place=3001.0), "must begin within 4.6 … 3000 m of its way, got 3001 m"),
        (Actor("a", place=300.0, lane=2), "there are lanes 0 to 1, got 2"),
        (Actor("a", place=202.0), "must begin at least 0.5 m from 'ego' in the same lane, got -2.6 m"),
    ]:
        with pytest.raises(PlacementError, match=told) as error:
            check_placement(place_actors((EGO, actor)), Motorway().layout())
        assert error.value.actor == "a"


def test_places_count_across_junctions() -> None:
    crossing = Crossing(length=600.0, lane_width=3.25)
    layout = crossing.layout()
    # Each road ends 3.25 + 6 m before the middle: 290.75 m, 18.5 m across, and as much again.
    assert edge_at(layout, "same_way", 250.0) == ("same_way", 250.0)
    assert edge_at(layout, "same_way", 300.0) == ("same_way", pytest.approx(290.75))  # nobody begins within
    assert edge_at(layout, "same_way", 320.0) == ("oncoming.back", pytest.approx(320.0 - 309.25))
    assert way_length(layout, "same_way") == pytest.approx(600.0)
