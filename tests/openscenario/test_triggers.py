"""Triggers as conditions of FogSim's language, and what else of a file becomes what."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fogsim.errors import InputError, LeftOutWarning
from fogsim.openscenario import read_openscenario
from fogsim.openscenario.parameters import evaluated
from fogsim.scenario.loading import load_scenario
from tests.openscenario.writing import CAR, DATA, changed, entry, lane, world, write

STANDS = '<Condition name="stands" delay="0" conditionEdge="none">'
STAND_STILL = '<StandStillCondition duration="0.5"/>'

pytestmark = pytest.mark.filterwarnings("ignore::fogsim.errors.LeftOutWarning")


LEAD = (DATA / "slow_lead.xosc").read_text(encoding="utf-8")


@pytest.fixture
def read(tmp_path: Path) -> Callable[..., dict[str, Any]]:
    """Data of the slow lead vehicle's file with some texts in place of others."""

    def reading(*texts: tuple[str, str]) -> dict[str, Any]:
        file = changed(tmp_path, DATA / "slow_lead.xosc", *texts)
        # What is made of it is a scenario that FogSim takes.
        load_scenario(file, ["renderer=none", "estimators=[]"])
        return read_openscenario(file).data

    return reading


def _between(first: str, last: str, after: str = "") -> str:
    """Part of the file, both ends included."""
    begin = LEAD.index(first, LEAD.index(after))
    return LEAD[begin : LEAD.index(last, begin) + len(last)]


def test_conditions(read: Callable[..., dict[str, Any]]) -> None:
    apart = (
        '<RelativeDistanceCondition entityRef="Lead" relativeDistanceType="{}" value="20" freespace="{}" rule="{}"/>'
    )
    reach = '<ReachPositionCondition tolerance="2">{}</ReachPositionCondition>'
    far = '<DistanceCondition value="50" freespace="false" {}>{}</DistanceCondition>'
    near = '<Position><RelativeObjectPosition entityRef="Lead" dx="2" dy="0"/></Position>'
    there = '<Position><RoadPosition roadId="7" s="200" t="-5"/></Position>'
    for condition, told in [
        ('<SpeedCondition value="3" rule="lessThan"/>', "ego.speed < 3 m/s"),
        ('<AccelerationCondition value="-2" rule="lessOrEqual"/>', "ego.acceleration <= -2 m/s²"),
        ('<RelativeSpeedCondition entityRef="Lead" value="1" rule="lessThan"/>', "speed_difference(ego, Lead) < 1 m/s"),
        ('<AccelerationCondition value="2" rule="greaterThan"/>', "ego.acceleration > 2 m/s² or ego.acceleration < -2"),
        ('<AccelerationCondition direction="longitudinal" value="2" rule="lessThan"/>', "ego.acceleration < 2 m/s²"),
        ('<TraveledDistanceCondition value="30"/>', "ego.driven >= 30 m"),
        # Rear axles: 3.8 m behind the ego's front bumper, 7 m behind the lead's.
        (apart.format("longitudinal", "false", "lessThan"), "distance_along(ego, Lead, 3.8 m, 7 m) < 20 m"),
        (apart.format("cartesianDistance", "false", "greaterThan"), "distance(ego, Lead, 3.8 m, 7 m) > 20 m"),
        (apart.format("euclidianDistance", "true", "greaterThan"), "clearance(ego, Lead) > 20 m"),
        ('<SpeedCondition value="0" rule="equalTo"/>', "ego.speed > -0.05 m/s and ego.speed < 0.05 m/s"),
        (
            '<TimeHeadwayCondition entityRef="Lead" value="1" freespace="true" rule="lessThan"/>',
            "headway(ego, Lead, 0 m) < 1 s",
        ),
        (reach.format(lane(200, -2)), "nearest_to(ego, 3.8 m, 300.000 m, -25.250 m) <= 2 m"),
        (reach.format(world(300, 40, 'h="1"')), "nearest_to(ego, 3.8 m, 300.000 m, 40.000 m) <= 2 m"),
        (far.format('rule="lessThan"', near), "distance(ego, Lead, 3.8 m, 5 m) < 50 m"),
        (far.format('rule="greaterThan"', there), "distance_to(ego, 3.8 m, 300.000 m, -25.000 m) > 50 m"),
        (
            far.format('alongRoute="true" rule="greaterThan"', there),
            "ego.position < 153.671 m or ego.position > 253.671 m",
        ),
        ('<CollisionCondition><EntityRef entityRef="Lead"/></CollisionCondition>', "collision(ego, Lead)"),
        ('<CollisionCondition><ByType type="vehicle"/></CollisionCondition>', "ego.collision"),
    ]:
        assert told in read((STAND_STILL, condition))["end_when"]


def test_edges(read: Callable[..., dict[str, Any]]) -> None:
    rises, falls = "ego.speed falls below 3 m/s", "(ego.speed < 3 m/s) delayed 0.001 s and not (ego.speed < 3 m/s)"
    less, stands = '<SpeedCondition value="3" rule="lessThan"/>', "(ego.speed < 0.1 m/s for 0.5 s)"
    at_most = less.replace("lessThan", "lessOrEqual")
    for condition, edge, told in [
        (less, "rising", rises),
        (less, "falling", falls),
        (less, "risingOrFalling", f"({rises}) or ({falls})"),
        # At equality it is one of the comparison as written.
        (at_most, "rising", "(not (ego.speed <= 3 m/s)) delayed 0.001 s and (ego.speed <= 3 m/s)"),
        (at_most, "falling", "ego.speed rises above 3 m/s"),
        # One of more than a comparison compares with one step before.
        (STAND_STILL, "rising", f"(not {stands}) delayed 0.001 s and {stands}"),
    ]:
        assert told in read((STAND_STILL, condition), (STANDS, STANDS.replace("none", edge)))["end_when"]


def test_an_edge_is_one_of_all_triggering_entities_together(read: Callable[..., dict[str, Any]]) -> None:
    one = '<EntityRef entityRef="Ego"/></TriggeringEntities><EntityCondition>'
    old = _between('<TriggeringEntities triggeringEntitiesRule="', STAND_STILL, STANDS)
    new = f'<TriggeringEntities triggeringEntitiesRule="all"><EntityRef entityRef="Lead"/>{one}'
    new, edge = f'{new}<SpeedCondition value="1" rule="lessThan"/>', (STANDS, STANDS.replace("none", "rising"))
    both = "(Lead.speed < 1 m/s and ego.speed < 1 m/s)"
    assert f"(not {both}) delayed 0.001 s and {both}" in read((old, new), edge)["end_when"]
    # The first of any to rise is known although another's value may be unknown.
    each = "Lead.speed falls below 1 m/s or ego.speed falls below 1 m/s"
    assert each in read((old, new.replace('"all"', '"any"')), edge)["end_when"]


def test_a_stop_trigger_of_a_time_is_the_duration(read: Callable[..., dict[str, Any]]) -> None:
    group = _between('<ConditionGroup>\n        <Condition name="stands"', "</ConditionGroup>")
    data = read((group, ""))
    assert data["duration_s"] == 40.0
    assert "end_when" not in data
    # Files write such a time for none.
    assert read((group, ""), ('value="40" rule', 'value="10000000" rule'))["duration_s"] == 1e6
    less = ('value="40" rule="greaterThan"', 'value="40" rule="lessThan"')
    assert read((group, ""), less)["end_when"] == "time < 40 s"


def test_an_act_that_is_stopped_keeps_back_its_events(read: Callable[..., dict[str, Any]]) -> None:
    stop = (
        '<StopTrigger><ConditionGroup><Condition name="c" delay="1" conditionEdge="none"><ByEntityCondition>'
        '<TriggeringEntities triggeringEntitiesRule="all"><EntityRef entityRef="Ego"/><EntityRef entityRef="Lead"/>'
        '</TriggeringEntities><EntityCondition><SpeedCondition value="1" rule="lessThan"/></EntityCondition>'
        "</ByEntityCondition></Condition></ConditionGroup></StopTrigger></Act>"
    )
    data = read(("</Act>", stop))
    assert entry(data, "brake")["when"].endswith("and not happened(stop_1)")
    assert entry(data, "stop_1") == {
        "name": "stop_1",
        "when": "ego.speed < 1 m/s and Lead.speed < 1 m/s",
        "delay_s": 1.0,
        "do": {},
    }


@pytest.mark.parametrize(
    ("action", "told"),
    [
        (
            '<SpeedAction><SpeedActionDynamics dynamicsShape="cubic" value="4" dynamicsDimension="time"/>'
            '<SpeedActionTarget><RelativeTargetSpeed entityRef="Lead" value="2" speedTargetValueType="delta"/>'
            "</SpeedActionTarget></SpeedAction>",
            {"speed": {"like": "Lead", "plus_kmh": 7.2, "shape": "sinusoidal", "over_s": 4.0}},
        ),
        (
            '<LongitudinalDistanceAction entityRef="Lead" timeGap="1.5" freespace="true" continuous="true"/>',
            {"follow": {"vehicle": "Lead", "headway_s": 1.5, "gap_m": 0.0}},
        ),
    ],
)
def test_actions(read: Callable[..., dict[str, Any]], action: str, told: dict[str, Any]) -> None:
    old = _between("<SpeedAction>", "</SpeedAction>", '<Event name="brake"')
    for written in (action, action.replace("cubic", "sinusoidal")):
        assert entry(read((old, written)), "brake")["do"] == {"Ego": told}


def test_lanes_by_number_or_beside(read: Callable[..., dict[str, Any]]) -> None:
    old = _between("<LongitudinalAction>", "</LongitudinalAction>", '<Event name="brake"')
    change = (
        '<LateralAction><LaneChangeAction><LaneChangeActionDynamics dynamicsShape="linear" value="2.5" '
        'dynamicsDimension="time"/><LaneChangeTarget>{}</LaneChangeTarget></LaneChangeAction></LateralAction>'
    )
    for target, told in (
        ('<AbsoluteTargetLane value="-1"/>', {"to": 1}),
        ('<RelativeTargetLane entityRef="Ego" value="1"/>', {"lanes": 1}),
        ('<RelativeTargetLane entityRef="Lead" value="1"/>', {"to_lane_of": "Lead", "lanes": 1}),
    ):
        change_lane = entry(read((old, change.format(target))), "brake")["do"]["Ego"]["change_lane"]
        assert change_lane == {**told, "stay_s": 1e5, "duration_s": 2.5}


def test_night_may_fall_while_a_run_lasts(tmp_path: Path) -> None:
    fog, time = '<Weather><Fog visualRange="60"/></Weather>', 'animation="false" dateTime="2026-11-20T23:00:00+01:00"'
    file = changed(tmp_path, DATA / "cut_in_in_fog.xosc", (fog, f"<TimeOfDay {time}/>{fog}"))
    light = entry(read_openscenario(file).data, "thicker_fog")["do"]["light"]
    assert 1e-5 < light["illuminance_lx"] < 1e-2


def test_clouds_alone_are_named_as_left_out(tmp_path: Path) -> None:
    file = write(tmp_path, {"Ego": CAR}, {"Ego": lane(30)})
    sun = '<Weather><Sun illuminance="20000" azimuth="0" elevation="0.9"/>'
    clouds = file.read_text(encoding="utf-8").replace(sun, '<Weather fractionalCloudCover="sixOktas">')
    file.write_text(clouds, encoding="utf-8")
    with pytest.warns(LeftOutWarning, match="clouds without a TimeOfDay, or a Sun's elevation"):
        assert "light" not in read_openscenario(file).data


def test_entries_of_catalogs_and_their_parameters_are_there(tmp_path: Path) -> None:
    for name, old, new, told in [
        ("cut_in_in_fog", 'entryName="saloon"', 'entryName="coach"', "unknown entry 'coach' of Vehicles; known: saloo"),
        ("everything", 'Ref="top_speed"', 'Ref="topspeed"', "no parameter 'topspeed'; did you mean 'top_speed'"),
    ]:
        with pytest.raises(InputError, match=told):
            read_openscenario(changed(tmp_path, DATA / f"{name}.xosc", (old, new)))


def test_expressions() -> None:
    known = {"speed": "72", "is_wet": "true", "name": "lorry"}
    for text, value in (
        ("$name", "lorry"),
        ("${$speed / 3.6}", "20"),
        ("${round($speed / 7) + sqrt(4)}", "12"),
        ("${not $is_wet}", "false"),
        ("${$speed > 50 and 1 < 2}", "true"),
        ("v${2 * 3}", "v6"),
        ("${-pow(2, 3) % 5}", "2"),
    ):
        assert evaluated(text, known) == value
    for text in (
        "$sped",
        "${__import__('os')}",
        "${$name + 1}",
        "${1 +}",
        "${(1).real}",
        "${'a' * 9}",
        "${pow(-8, 0.5)}",
        f"${{{'9' * 400}}}",
    ):
        with pytest.raises(ValueError, match=r"parameter|expression|evaluate|domain"):
            evaluated(text, known)
