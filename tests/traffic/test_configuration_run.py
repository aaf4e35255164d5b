"""A SUMO configuration of somebody else's: junctions, traffic lights, and what can go wrong with an ego in it."""

import contextlib
from pathlib import Path

import numpy as np
import pytest

import fogsim
from fogsim.scenario import build, scenario_from_config
from fogsim.traffic import Traffic, libsumo_traffic
from fogsim.values import Command, Ending, TrafficSnapshot
from tests.traffic.common import DATA, configured, seen

GRID = DATA / "grid"
EGO = "veh18"


def town(config: Path = GRID / "grid.sumocfg", ego: str = EGO) -> Traffic:
    # Whoever is named: what becomes of an ego that never comes is tried here too.
    scenario = scenario_from_config(config, ego, ["fog.visibility_m=120"], others_add_vehicles=True)
    return libsumo_traffic(build.traffic_setup(scenario))


def seen_to_the_end(traffic: Traffic) -> list[TrafficSnapshot]:
    snapshots = []
    for _ in range(3000):
        traffic.advance(Command())
        snapshot = traffic.observe()
        if snapshot is None:
            return snapshots
        snapshots.append(snapshot)
    pytest.fail("the ego never left the network")


def test_the_net_is_drawn_and_the_route_is_as_long_as_the_way_across_its_junctions() -> None:
    with contextlib.closing(town()) as traffic:
        traffic.start(1)
        network, _ = traffic.network()
        snapshots = seen_to_the_end(traffic)
    assert {"C0B0_0", "C0B0_1"} <= {lane.lane_id for lane in network.lanes}
    assert np.linalg.norm(np.diff(network.route, axis=0), axis=1).sum() == pytest.approx(590, abs=30)
    position = np.array([s.route_position for s in snapshots])
    way = np.linalg.norm(np.diff([s.state.position[s.ego] for s in snapshots], axis=0), axis=1).sum()
    assert any(s.state.lane[s.ego].startswith(":") for s in snapshots)
    assert position[-1] - position[0] == pytest.approx(way, rel=0.02)
    # The last step is within one step's way of the end; lanes of a curve differ by some metres.
    assert position[-1] == pytest.approx(snapshots[0].route_length, abs=5.0)


@pytest.mark.parametrize(("taken_on", "ending"), [("ew1", Ending.ARRIVED), ("we2", Ending.LEFT_NETWORK)])
def test_an_ego_arrives_at_its_place_and_not_where_it_is_taken_away(
    tmp_path: Path, taken_on: str, ending: Ending
) -> None:
    """It arrives at 100 m of its last edge; SUMO reports one that a vaporizer takes as arrived, too."""
    demand = """<routes><route id="r" edges="we1 we2 ew2"/><vType id="t" sigma="0" lcOpposite="0"/>
    <vehicle id="ego" type="t" route="r" depart="0" departPos="50" departSpeed="20" arrivalPos="100"/></routes>"""
    (tmp_path / "gone.add.xml").write_text(f'<a><vaporizer id="{taken_on}" begin="0" end="200"/></a>')
    net = DATA / "sumo_cases" / "overtaking_lights.net.xml"
    path = configured(tmp_path, net, demand, additional="gone.add.xml")
    settings = ("renderer=none", "estimators=[]", "fog.visibility_m=5000", "duration_s=200")
    *_, last = fogsim.run(scenario_from_config(path, "ego", settings), seed=1)
    assert last.ending is ending


def configuration(folder: Path, *options: str, routes: str | Path = GRID / "grid.trips.xml") -> Path:
    return configured(folder, GRID / "grid.net.xml", routes, *options)


def test_a_configuration_with_a_port_and_a_seed_of_its_own_runs_as_one_without(tmp_path: Path) -> None:
    """It neither listens for a client nor asks the clock for random numbers."""

    def states(simulation: Traffic) -> list[tuple[str, ...]]:
        found = []
        simulation.start(1)
        for _ in range(2):
            snapshot = seen(simulation)
            found.append((*snapshot.state.ids, *map(str, snapshot.state.position[snapshot.ego])))
            simulation.start(2)
        simulation.close()
        return found

    own = '<remote-port value="8813"/><num-clients value="2"/><random value="true"/>'
    with pytest.warns(UserWarning, match=r"mine\.sumocfg: (remote-port=8813|random=true) is left out") as told:
        listening = town(configuration(tmp_path, own))
    assert len(told) == 2
    assert states(listening) == states(town())


def test_a_teleport_takes_the_ego_off_the_road(tmp_path: Path) -> None:
    """It waits at a red light, longer than this configuration lets anybody wait."""
    with contextlib.closing(town(configuration(tmp_path, '<time-to-teleport value="3"/>'))) as impatient:
        impatient.start(1)
        last = seen_to_the_end(impatient)[-1]
    assert last.state.speed[last.ego] == pytest.approx(0.0, abs=0.1)
    assert last.route_position < last.route_length - 100.0


def test_the_ego_may_appear_late_in_a_simulation_that_begins_late(tmp_path: Path) -> None:
    """The time that is waited for it counts from the beginning, not from SUMO's zero."""
    routes = '<routes><trip id="veh" depart="90010" from="C0B0" to="B0A0"/></routes>'
    with contextlib.closing(town(configuration(tmp_path, '<begin value="90000"/>', routes=routes), "veh")) as late:
        late.start(1)
        assert seen(late).state.time == pytest.approx(90010, abs=0.2)
