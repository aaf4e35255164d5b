"""Small files of other people's kinds: each runs as it is meant, or is refused with the reason and the line."""

import contextlib
import re
import shutil
import warnings
from pathlib import Path

import numpy as np
import pytest

import fogsim
from fogsim.errors import InputError, LeftOutWarning
from fogsim.openscenario import read_openscenario
from fogsim.scenario import Scenario
from tests.openscenario.writing import CAR, CASES, DATA, QUIET, changed, lane, motion, run, speed_of, write


def _changed(tmp_path: Path, name: str, *texts: tuple[str, str]) -> Path:
    return changed(tmp_path, CASES / f"{name}.xosc", *texts)


def _loaded(file: Path) -> Scenario:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return fogsim.load_scenario(file, QUIET)


def test_a_declaration_uses_those_before_it_and_pi(tmp_path: Path) -> None:
    (step,) = run(CASES / "chain_of_parameters.xosc", "duration_s=0.1")[:1]
    (ego, speed), (lead, _) = (motion(step, name)[::2] for name in ("Ego", "Lead"))
    assert (speed, lead - ego) == (pytest.approx(20.0), pytest.approx(60.0, abs=0.01))
    file = _changed(tmp_path, "chain_of_parameters", ("${$SpeedKmh / 3.6}", "${10 * sqrt(pi * 4 / pi)}"))
    assert motion(run(file, "duration_s=0.1")[0], "Ego")[2] == pytest.approx(20.0)


def test_a_value_fits_one_group_of_constraints(tmp_path: Path) -> None:
    old = '<ConstraintGroup>\n<ValueConstraint rule="lessThan" value="$EgoSpeed"/>\n</ConstraintGroup>'
    group, one = "<ConstraintGroup>{}</ConstraintGroup>", '<ValueConstraint rule="{}" value="{}"/>'
    less = one.format("lessThan", 9)
    for constraints, is_held in [
        (group.format(one.format("lessThan", "$EgoSpeed")), True),
        (group.format(less), False),
        (group.format(less) + group.format(one.format("equalTo", "10.0")), True),
        (group.format(one.format("greaterThan", 5) + less), False),
    ]:
        file = _changed(tmp_path, "constraint_of_parameter", (old, constraints))
        if is_held:
            assert _loaded(file).traffic.ego == "Ego"
            continue
        told = r":6: /OpenSCENARIO/ParameterDeclarations/\S+\[LeadSpeed\]: value: its ConstraintGroup wants lessThan 9"
        with pytest.raises(InputError, match=told):
            _loaded(file)


def test_a_dollar_in_a_declaration_is_remarked() -> None:
    with pytest.warns(
        LeftOutWarning, match=r"(?s)5: /OpenSCENARIO/\S+\[\$who\]: a declaration has its name without \$"
    ):
        scenario = fogsim.load_scenario(CASES / "dollar_in_declaration.xosc", QUIET)
    assert next(entry for entry in scenario.timeline if entry.name == "brake").do.keys() == {"Lead"}


def test_an_act_with_empty_triggers_begins_at_once_and_is_not_stopped() -> None:
    speeds = [motion(step, "Lead")[2] for step in run(CASES / "empty_triggers.xosc", "duration_s=5.0")]
    assert speeds[30] == pytest.approx(speeds[0], abs=0.5)
    assert speeds[-1] < speeds[0] - 5.0


def test_a_hitch_without_a_trailer_is_nothing(tmp_path: Path) -> None:
    assert _loaded(CASES / "hitch_without_trailer.xosc").traffic.ego == "Ego"
    hitch = re.search(r"<TrailerHitch[^>]*/>", (CASES / "hitch_without_trailer.xosc").read_text(encoding="utf-8"))
    for trailer, is_none in (("", True), (' entityRef=""', True), (' entityRef="Lead"', False)):
        with_trailer = f"{hitch[0]}<Trailer><TrailerRef{trailer}/></Trailer>"
        file = _changed(tmp_path, "hitch_without_trailer", (hitch[0], with_trailer))
        if is_none:
            _loaded(file)
        else:
            with pytest.raises(InputError, match="Trailer: vehicles have no trailers"):
                _loaded(file)


def test_left_hand_traffic_is_refused() -> None:
    with pytest.raises(InputError, match=r"road_left\.xodr: road '7': rule=\"LHT\": expected right-hand traffic"):
        _loaded(CASES / "left_hand_road.xosc")


def test_a_vehicle_stands_along_its_lane_or_against_it_or_is_refused(tmp_path: Path) -> None:
    for position, is_along in [
        ('<LanePosition roadId="7" laneId="-1" s="500"><Orientation type="relative" h="6.28"/></LanePosition>', True),
        ('<LanePosition roadId="7" laneId="-1" s="500"><Orientation type="absolute" h="0"/></LanePosition>', True),
        ('<LanePosition roadId="7" laneId="1" s="500"><Orientation type="absolute" h="3.14"/></LanePosition>', True),
        ('<LanePosition roadId="7" laneId="1" s="500"><Orientation type="absolute" h="0"/></LanePosition>', None),
        ('<LanePosition roadId="7" laneId="1" s="500"><Orientation type="relative" h="3.14"/></LanePosition>', None),
        ('<RoadPosition roadId="7" t="1.7" s="500"><Orientation type="relative" h="3.14"/></RoadPosition>', True),
        ('<LanePosition roadId="7" laneId="-1" s="500"><Orientation type="relative" h="1.2"/></LanePosition>', False),
        ('<WorldPosition x="500" y="-1.7" h="0.9"/>', False),
        ('<WorldPosition x="500" y="1.7" h="3.1"/>', True),
        ('<RelativeLanePosition entityRef="Ego" dLane="0" ds="9"><Orientation p="1"/></RelativeLanePosition>', True),
    ]:
        text = (CASES / "turned_round.xosc").read_text(encoding="utf-8")
        begin = text.index('<LanePosition roadId="7" laneId="-1" s="500">')
        old = text[begin : text.index("</LanePosition>", begin) + len("</LanePosition>")]
        file = _changed(tmp_path, "turned_round", (old, position))
        if is_along or is_along is None:
            first = _loaded(file).timeline[0].name
            assert (first == "Init_off_the_lanes") == (is_along is None)
        else:
            with pytest.raises(InputError, match="h: vehicles stand, and drive, along their lanes"):
                _loaded(file)


def test_the_sun_is_in_lux(tmp_path: Path) -> None:
    for sun, lux in [
        ('intensity="0.85" azimuth="3" elevation="-0.2"', 0.85),
        ('intensity="0" azimuth="3" elevation="0.9"', 0.0),
        ('illuminance="900" azimuth="3" elevation="0.05"', 900.0),
        ('intensity="40" azimuth="3" elevation="0.9"', None),
        ('illuminance="0.85" azimuth="3" elevation="0.9"', None),
        ('illuminance="0.5" azimuth="3"', None),
    ]:
        file = _changed(tmp_path, "sun_between_0_and_1", ('intensity="0.85" azimuth="3" elevation="0.9"', sun))
        if lux is not None:
            assert _loaded(file).light.illuminance_lx == lux
        else:
            with pytest.raises(InputError, match=r"Sun: (intensity|illuminance): \S+ lx would be night at a sun of"):
                _loaded(file)


@pytest.mark.parametrize(("intensity", "lux"), [(1.0, 90_164.0), (0.5, 90_164.0 * (1.0 - 0.75 * 0.5**3.4))])
def test_an_intensity_up_to_1_by_day_is_a_share_of_the_sky(tmp_path: Path, intensity: float, lux: float) -> None:
    file = _changed(tmp_path, "sun_between_0_and_1", ('intensity="0.85"', f'intensity="{intensity}"'))
    with pytest.warns(
        LeftOutWarning, match=r"46: /OpenSCENARIO/\S+/Sun: intensity: \S+ lx would be night .* read as the share"
    ):
        scenario = fogsim.load_scenario(file, QUIET)
    assert scenario.light.illuminance_lx == pytest.approx(lux, rel=1e-3)


def test_an_unknown_cloud_cover_is_refused_with_those_that_there_are(tmp_path: Path) -> None:
    for new, message in [
        (
            'fractionalCloudCover="0.5"',
            "Weather: fractionalCloudCover: FogSim has no '0.5' here; known: zeroOktas, oneOk",
        ),
        ('cloudState="foggy"', "Weather: cloudState: FogSim has no 'foggy' here; known: free, cloudy, overcast, rainy"),
    ]:
        with pytest.raises(InputError, match=re.escape(message)):
            _loaded(_changed(tmp_path, "stop_with_two_delays", ('fractionalCloudCover="eightOktas"', new)))


def test_an_ego_that_only_a_controller_would_move_stands_with_a_warning(tmp_path: Path) -> None:
    controller = '<AssignControllerAction><Controller name="c"><Properties/></Controller></AssignControllerAction>'
    begin = {"Ego": f"{lane(30)}\n<PrivateAction><ControllerAction>{controller}</ControllerAction></PrivateAction>"}
    message = r"Ego has no SpeedAction in Init: it stands until the storyboard orders a speed"
    with pytest.warns(LeftOutWarning, match=message):
        read_openscenario(write(tmp_path, {"Ego": CAR}, begin, {}))


def test_files_of_carla_have_their_own_axes(tmp_path: Path) -> None:
    place = '<LanePosition roadId="7" laneId="-1" s="{}">\n</LanePosition>'
    texts = (
        (place.format(30), '<WorldPosition x="30" y="1.7" z="0.5" h="0"/>'),
        (place.format(90), '<RelativeWorldPosition entityRef="Ego" dx="40" dy="-0.4"/>'),
    )
    file = _changed(tmp_path, "sun_between_0_and_1", ('description="', 'description="CARLA:'), *texts)
    with pytest.warns(LeftOutWarning, match="read as the share"):
        step = run(file, "duration_s=0.1")[0]
    assert [float(step.traffic.position[row, 1]) for row in range(2)] == pytest.approx([-1.7, -1.3], abs=0.01)
    # To the right of the lane.
    shifted = (place.format(30), '<LanePosition roadId="7" laneId="-1" s="30" offset="0.5"/>')
    file = _changed(tmp_path, "sun_between_0_and_1", ('description="', 'description="CARLA:'), shifted)
    with pytest.warns(LeftOutWarning, match="read as the share"):
        moved = run(file, "duration_s=0.1")[0]
    assert float(moved.traffic.position[0, 1]) == pytest.approx(-1.75 - 0.5, abs=0.01)


@pytest.mark.parametrize("begins", [(70.0, 33.7 + 30.0 + 4.6), (10.0, 33.7 - 4.6 - 30.0 + 40.0)])
@pytest.mark.parametrize("continuous", ["true", "false"])
def test_an_initial_distance_is_a_place(tmp_path: Path, begins: tuple[float, float], continuous: str) -> None:
    ahead, behind = ("30", "70") if begins[0] > 30.0 else ("70", "10")
    texts = [('laneId="-1" s="30"', f'laneId="-1" s="{ahead}"'), ('laneId="-1" s="70"', f'laneId="-1" s="{behind}"')]
    texts = texts if begins[0] > 30.0 else texts[::-1]
    texts.append(('continuous="false"', f'continuous="{continuous}"'))
    file = _changed(tmp_path, "speed_and_distance_at_once", *texts)
    if continuous == "true" and begins[0] > 30.0:
        with pytest.raises(InputError, match="keeps a distance to a vehicle ahead; Ego is not ahead of Lead"):
            _loaded(file)
        return
    # 2 s at 15 m/s between bumpers.
    step = run(file, "duration_s=3.0")[-1]
    assert motion(step, "Lead")[::2] == pytest.approx((begins[1] + 15.0 * step.time, 15.0), abs=0.1)


def test_two_actions_of_an_event_on_the_same_motion_are_refused(tmp_path: Path) -> None:
    text = (CASES / "chain_of_parameters.xosc").read_text(encoding="utf-8")
    action = text[text.index('<Action name="brakeA">') : text.index("</Action>") + len("</Action>")]
    file = _changed(tmp_path, "chain_of_parameters", (action, action + action.replace("brakeA", "brakeB")))
    with pytest.raises(InputError, match=r"SpeedAction: another action of this event orders the motion of Lead"):
        _loaded(file)


def test_a_relative_speed_is_kept_while_the_other_changes_its_own(tmp_path: Path) -> None:
    for continuous, after in (("true", 5.0), ("false", 23.0)):
        # Ego's speed is told by that of Lead, which is told later, and brakes from 20 m/s to 2 m/s at 3 s.
        file = _changed(
            tmp_path,
            "chain_of_parameters",
            ('<AbsoluteTargetSpeed value="$Speed"/>', speed_of("Lead", 3, "delta", f'continuous="{continuous}"')),
            ('laneId="-1" s="30"', 'laneId="1" s="700"'),
        )
        steps = run(file, "duration_s=12.0")
        assert motion(steps[0], "Ego")[2] == pytest.approx(23.0)
        assert motion(steps[-1], "Ego")[2] == pytest.approx(after, abs=0.2)


def test_fog_thickens_in_steps() -> None:
    steps = run(CASES / "fog_thickens_in_steps.xosc", "duration_s=8.0")
    seen = [float(step.truth.visibility) for step in steps]
    changes = [(steps[i].time, seen[i]) for i in range(1, len(steps)) if not np.isclose(seen[i], seen[i - 1])]
    assert [visibility for _, visibility in changes] == pytest.approx([1000.0, 500.0, 250.0, 100.0])
    assert [time for time, _ in changes] == pytest.approx([1.0, 3.0, 5.0, 7.0], abs=0.21)


@pytest.mark.parametrize(
    ("position", "x"),
    [
        # s = 500 m on the lane that leads back, 3.7 m before the front bumper.
        ('<RelativeLanePosition entityRef="Ego" dLane="0" ds="20"/>', 520.0 - 3.7),
        ('<RelativeLanePosition entityRef="Ego" dLane="0" dsLane="20"/>', 480.0 - 3.7),
    ],
)
def test_ds_goes_by_the_road_and_ds_lane_by_the_entity(tmp_path: Path, position: str, x: float) -> None:
    place = '<LanePosition roadId="7" laneId="-1" s="{}">\n</LanePosition>'
    ego = (place.format(30), '<LanePosition roadId="7" laneId="1" s="500"/>')
    file = _changed(tmp_path, "hitch_without_trailer", ego, (place.format(90), position))
    assert motion(run(file, "duration_s=0.1")[0], "Lead")[0] == pytest.approx(x, abs=0.1)


def test_values_that_mean_something_else_are_refused(tmp_path: Path) -> None:
    linear = '<SpeedAction>\n<SpeedActionDynamics dynamicsShape="linear"'
    distance = '<LongitudinalDistanceAction entityRef="Led" timeGap="2" freespace="true" continuous="true"/>'
    at_3 = 'conditionEdge="none">\n<ByValueCondition>\n<SimulationTimeCondition value="3"'
    for old, new, told in [
        ('<AbsoluteTargetSpeed value="2"/>', '<AbsoluteTargetSpeed value="-2"/>', "vehicles do not drive backwards"),
        (linear, f"{distance}{linear}", r"LongitudinalDistanceAction\[Led\]: there is no vehicle 'Led'"),
        (at_3, at_3.replace("none", "falling"), "what has begun does not end again"),
        ('value="3" rule="greaterThan"', 'value="3" rule="notEqualTo"', "rule: FogSim has no 'notEqualTo' here"),
        ('frictionScaleFactor="1"', 'frictionScaleFactor="0.5"', "RoadCondition: roads are dry"),
        ('<Fog visualRange="200"/>', '<Precipitation precipitationType="rain" intensity="1"/>', "rain and snow are no"),
        (f'delay="0" {at_3}', f'delay="-1" {at_3}', "delay: expected 0 or more, got -1"),
        ('length="4.6"', 'length="-4.6"', "Dimensions: length: expected 0 or more, got -4.6"),
        ('<Center x="1.4" y="0"', '<Center x="1.4" y="0.5"', "Center: y: a body lies about its reference point"),
    ]:
        with pytest.raises(InputError, match=told):
            _loaded(_changed(tmp_path, "chain_of_parameters", (old, new)))


@pytest.mark.filterwarnings("ignore::fogsim.errors.LeftOutWarning")
def test_constraints_hold_for_the_values_that_a_catalog_is_given(tmp_path: Path) -> None:
    shutil.copytree(DATA, tmp_path, dirs_exist_ok=True)
    catalog = tmp_path / "catalogs" / "vehicles.xosc"
    old = '<ParameterDeclaration name="top_speed" parameterType="double" value="60"/>'
    constraint = '<ConstraintGroup><ValueConstraint rule="greaterThan" value="{}"/></ConstraintGroup>'
    text = catalog.read_text(encoding="utf-8")
    told = r"vehicles\.xosc:7: \S+: value: its ConstraintGroup wants .* got '40'"
    for least, expected in ((30, contextlib.nullcontext()), (50, pytest.raises(InputError, match=told))):
        declared = f"{old.removesuffix('/>')}>{constraint.format(least)}</ParameterDeclaration>"
        catalog.write_text(text.replace(old, declared), encoding="utf-8")
        with expected:
            read_openscenario(tmp_path / "everything.xosc")
