"""Vehicles off the lanes: parked, waiting as taxis, or moved beside the road by another simulator."""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

import fogsim
from fogsim.errors import InputError, SimulationError
from fogsim.metrics.run_metrics import RunMetrics
from fogsim.scenario import Scenario, build, scenario_from_config
from fogsim.simulation.recording import record_run
from fogsim.traffic.sumo.libsumo_link import load_libsumo
from fogsim.values import Command, SpeedAdvice, Step, Stretch, StretchAdvice
from fogsim.values.script import ChangeLane, Depart
from tests.helpers.attached import libsumo_in_town, traci_in_town
from tests.traffic.common import DATA, configured, driven, even, running

CASES = DATA / "off_lanes"
BLIND = ("renderer=none", "estimators=[]", "fog.visibility_m=120")
LANE, BAY, VERGE = -1.6, -4.8, -9.0  # north of the lane, of the places beside it, and of where the ego is put [m]
LIMIT = 22.0


def scenario(name: str, ego: str, duration: float = 60.0, *settings: str) -> Scenario:
    return scenario_from_config(CASES / f"{name}.sumocfg", ego, [*BLIND, f"duration_s={duration}", *settings])


@pytest.fixture(scope="module")
def parked() -> list[Step]:
    return list(fogsim.run(scenario("park", "ego")))


def off(step: Step) -> bool:
    return bool(step.traffic.off_lanes[step.ego])


def spells(steps: Sequence[Step]) -> list[tuple[bool, list[Step]]]:
    """Steps on and off the lanes in turn."""
    return [(is_off, list(some)) for is_off, some in itertools.groupby(steps, off)]


def test_a_parked_ego_keeps_its_place_without_limit_and_leader_and_drives_on(parked: list[Step]) -> None:
    (_, before), (is_off, there), (_, after) = spells(parked)
    assert is_off
    assert len(there) == 149  # of 15 s
    assert {step.route_position for step in there} == {before[-1].route_position}
    assert {step.speed_limit for step in there} == {math.inf}
    assert {step.leader for step in there} == {None}
    assert {float(step.traffic.acceleration[step.ego]) for step in there} == {0.0}
    assert {round(float(step.traffic.position[step.ego, 1]), 6) for step in there} == {BAY}
    assert {step.speed_limit for step in before + after} == {LIMIT}
    positions = np.array([step.route_position for step in parked])
    assert (np.diff(positions) >= 0.0).all()
    # From place to place as far as it drives, to the very end.
    assert after[-1].route_position == pytest.approx(after[-1].traffic.position[after[-1].ego, 0], abs=0.2)
    assert len(parked) == 601
    # Others are flagged where they park.
    last = parked[-1].traffic
    flags = dict(zip(last.ids, last.off_lanes.tolist(), strict=True))
    assert flags == {"behind": False, "ego": False, "parked1": True, "parked2": True}
    assert [lane == "" for lane in last.lane] == last.off_lanes.tolist()


def test_metrics_leave_parked_vehicles_out(tmp_path: Path) -> None:
    # The others park elsewhere, so that the ego has the same place with and without them.
    text = (CASES / "park.rou.xml").read_text(encoding="utf-8").replace('"pa" duration="1000"', '"pb" duration="1000"')
    additional = (CASES / "park.add.xml").read_text(encoding="utf-8")
    area = '<parkingArea id="pb" lane="we1_0" startPos="300" endPos="360" roadsideCapacity="6"/></additional>'
    (tmp_path / "park.add.xml").write_text(additional.replace("</additional>", area), encoding="utf-8")
    found = []
    for routes in (text, "\n".join(row for row in text.splitlines() if "parked" not in row)):
        config = configured(tmp_path, CASES / "a.net.xml", routes, additional="park.add.xml")
        metrics = RunMetrics()
        for step in fogsim.run(scenario_from_config(config, "ego", [*BLIND, "duration_s=60"])):
            metrics.update(step)
        found.append(metrics.summary().values)
    with_parked, without = found
    assert with_parked["traffic_mean_vehicles"] == pytest.approx((45.0 + 56.0) / 60.0, rel=0.02)
    assert with_parked == without


def test_the_table_has_the_flag_and_no_limit_and_parked_vehicles_have_no_equipment(tmp_path: Path) -> None:
    equipped, steps = scenario("park", "ego", 20.0, "traffic.equipped=1.0"), list[Step]()
    record_run(equipped, 0, tmp_path / "run", recorders=["table"], watch=steps.append)
    assert {one.vehicle_id for step in steps for one in step.equipped} == {"behind"}
    rows = pq.read_table(tmp_path / "run" / "steps.parquet", columns=["off_lanes", "speed_limit_mps"]).to_pylist()
    assert {(row["off_lanes"], row["speed_limit_mps"]) for row in rows} == {(False, LIMIT), (True, None)}


def test_a_taxi_waits_takes_a_passenger_and_waits_again() -> None:
    steps = list(fogsim.run(scenario("taxi", "cab", 80.0)))
    assert len(steps) == 801
    # It waits off the lanes, for the call and for whoever gets in and out.
    assert [is_off for is_off, _ in spells(steps)] == [False, True] * 3
    coming, carrying, arrived = (some for _, some in spells(steps)[2::2] + spells(steps)[5:])
    assert {step.traffic.persons.ids for step in coming} == {("p0",)}  # at the roadside, on no lane either
    assert {step.traffic.persons.ids for step in carrying} == {()}
    assert coming[-1].route_position == pytest.approx(300.0, abs=1.0)
    assert carrying[-1].route_position == pytest.approx(700.0, abs=1.0)
    assert {step.route_position for step in arrived} == {carrying[-1].route_position}


ARGUMENTS = ("-c", str(CASES / "two.sumocfg"), "--step-length", "0.1", "--no-step-log", "--end", "100")


@pytest.fixture
def connection(sumo_process: Callable[..., Any]) -> Iterator[Any]:
    with traci_in_town(sumo_process, ARGUMENTS) as connected:
        yield connected


@pytest.fixture
def in_process() -> Iterator[Any]:
    with libsumo_in_town(ARGUMENTS) as library:
        yield library


@pytest.mark.parametrize("simulation", ["in_process", "connection"])
def test_an_ego_that_is_moved_beside_the_road_stays_where_it_is_put(
    simulation: str, request: pytest.FixtureRequest
) -> None:
    """An outer simulator drives it, from 5 s to 10 s beside the road."""
    api, steps = request.getfixturevalue(simulation), list[Step]()
    with fogsim.attach(api, ego="ego", visibility=120.0, settings=BLIND[:2]) as session:
        for number in range(150):
            if "ego" in api.vehicle.getIDList():
                y = VERGE if 50 <= number < 100 else LANE
                api.vehicle.moveToXY("ego", "", -1, 20.0 + 1.2 * number, y, 90.0, 2)
            api.simulationStep()
            step = session.observe()
            if step is not None:
                session.advise(step, Command(advice=SpeedAdvice(9.0), advised_speeds={"lorry": 5.0}))
                steps.append(step)
    (_, before), (is_off, there), (_, after) = spells(steps)
    assert is_off
    assert len(there) == 50
    assert {step.route_position for step in there} == {before[-1].route_position}
    assert {(step.speed_limit, step.leader) for step in there} == {(math.inf, None)}
    own = [(step.traffic.position[step.ego, :2].tolist(), float(step.traffic.grade[step.ego])) for step in there]
    assert own == [([pytest.approx(20.0 + 1.2 * number), VERGE], 0.0) for number in range(50, 100)]
    assert all(step.traffic.ids == ("ego", "lorry") for step in there)
    assert after[0].route_position == pytest.approx(20.0 + 1.2 * 100)


def test_others_that_are_moved_beside_the_road_are_read_over_a_connection(connection: Any) -> None:
    with fogsim.attach(connection, ego="ego", visibility=120.0, settings=BLIND[:2]) as session:
        for number in range(40):
            if number >= 20:
                connection.vehicle.moveToXY("lorry", "", -1, 90.0, VERGE, 90.0, 2)
            connection.simulationStep()
            step = session.observe()
    assert step is not None
    assert step.traffic.ids == ("ego", "lorry")
    assert step.traffic.off_lanes.tolist() == [False, True]
    assert step.traffic.position[1, :2].tolist() == [90.0, VERGE]
    assert step.leader is None


@pytest.mark.parametrize("away", [20.0, 300.0])
@pytest.mark.parametrize("simulation", ["in_process", "connection"])
def test_others_may_come_beside_the_road_in_dense_fog(
    simulation: str, away: float, request: pytest.FixtureRequest
) -> None:
    """An outer simulator adds one, which is never on a lane; SUMO is asked for nothing that breaks it down."""
    api = request.getfixturevalue(simulation)
    advised = StretchAdvice(8.0, Stretch(0.0, 500.0))
    with fogsim.attach(api, ego="ego", visibility=30.0, settings=BLIND[:2]) as session:
        api.vehicle.add("late", "r", typeID="car", depart="triggered")
        for number in range(40):
            api.vehicle.moveToXY("late", "", -1, 90.0 + number, -away, 90.0, 2)
            api.simulationStep()
            if (step := session.observe()) is not None:
                session.advise(step, Command(stretches=(advised,)))
    assert step is not None
    assert step.traffic.ids == ("ego", "late", "lorry")
    assert step.traffic.position[1].tolist() == [129.0, -away, 0.0]


def test_advice_waits_until_a_vehicle_is_back_on_a_lane() -> None:
    command = Command(advice=SpeedAdvice(6.0), advised_speeds={"parked1": 6.0}, advice_reach=math.inf)
    with running(build.traffic_setup(scenario("park", "ego")), even(60.0), seed=0) as traffic:
        # Nor does a script change a lane, or let a vehicle depart, next to a parked one.
        asked = ChangeLane("parked1", 1), Depart("new", like="parked1", gap=30.0, speed=5.0)
        assert traffic.begin(asked) == asked
        speeds = [float(one.state.speed[one.ego]) for one in driven(traffic, 600, command)]
        get = load_libsumo().vehicle
        assert 0.0 < get.getMaxSpeed("parked1") <= get.getMaxSpeed("behind") <= 60.0
    assert speeds[400] == pytest.approx(0.0)
    assert speeds[-1] == pytest.approx(6.0, abs=0.1)


def test_mesoscopic_simulations_are_refused_in_one_line(tmp_path: Path) -> None:
    config = configured(tmp_path, CASES / "a.net.xml", CASES / "two.rou.xml", '<mesosim value="on"/>')
    told = r"mesosim: vehicles of a mesoscopic simulation have no positions in lanes[^\n]*$"
    with pytest.raises(InputError, match=told):
        scenario_from_config(config, "ego", BLIND)
    with pytest.raises(InputError, match=told.removeprefix("mesosim: ")):
        scenario("two", "ego", 60.0, "traffic.sumo_options.mesosim=true")
    with libsumo_in_town([*ARGUMENTS, "--mesosim", "1"]) as library, pytest.raises(SimulationError, match=told):
        fogsim.attach(library, ego="ego", visibility=120.0)
