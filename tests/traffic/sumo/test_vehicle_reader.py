"""Reading as little as possible gives what reading everything gives."""

from pathlib import Path
from typing import Any

import numpy as np

from fogsim.traffic.appearance import body_kind, lamps_from_signals, paint
from fogsim.traffic.sumo.libsumo_link import LibsumoLink
from fogsim.traffic.sumo.nearby_vehicles import NearbyVehicles
from fogsim.traffic.sumo.vehicle_reader import OTHERS_LAMPS, SubscribedReader, VehicleReader
from fogsim.values import Lamp, TrafficState
from tests.traffic.common import CROWD, MOTORWAY


def begun(link: LibsumoLink) -> Any:
    api = link.begin(CROWD)
    while "ego" not in api.vehicle.getIDList():
        link.step()
    return api


def read_everything(api: Any, ego_lamps: Lamp, radius: float) -> TrafficState:
    """Every vehicle asked for everything, one value at a time."""
    get = api.vehicle
    here = np.array(get.getPosition3D("ego"))
    offsets = {v: np.array(get.getPosition3D(v)) - here for v in get.getIDList()}
    ids = tuple(v for v, offset in offsets.items() if np.hypot(offset[0], offset[1]) <= radius)
    lamps = [int(OTHERS_LAMPS) | lamps_from_signals(get.getSignals(v)) for v in ids]
    ego = ids.index("ego")
    lamps[ego] = int(ego_lamps) | (lamps[ego] & int(Lamp.STOP))
    return TrafficState(
        time=api.simulation.getTime(),
        ids=ids,
        types=tuple(body_kind(get.getVehicleClass(v)) for v in ids),
        position=np.array([get.getPosition3D(v) for v in ids]),
        heading=np.array([np.radians(90.0 - get.getAngle(v)) for v in ids]),
        speed=np.array([get.getSpeed(v) for v in ids]),
        acceleration=np.array([get.getAcceleration(v) for v in ids]),
        length=np.array([get.getLength(v) for v in ids]),
        width=np.array([get.getWidth(v) for v in ids]),
        height=np.array([get.getHeight(v) for v in ids]),
        lane=tuple(get.getLaneID(v) for v in ids),
        lamps=np.array(lamps, dtype=np.int32),
        paint=np.array([paint(v, get.getColor(v)) for v in ids]),
        grade=np.array([np.radians(get.getSlope(v)) for v in ids]),
        free_speed=np.array([min(get.getAllowedSpeed(v), get.getMaxSpeed(v)) for v in ids]),
    )


def assert_same(one: TrafficState, other: TrafficState) -> None:
    for name in TrafficState.__slots__:
        mine, expected = getattr(one, name), getattr(other, name)
        if isinstance(expected, np.ndarray):
            assert mine.dtype == expected.dtype, name
            np.testing.assert_array_equal(mine, expected, err_msg=name)
        else:
            assert mine == expected, name


def test_reading_those_near_gives_what_reading_everything_gives(link: LibsumoLink) -> None:
    """With a table of bodies that grows on the way."""
    api = begun(link)
    readers = {radius: VehicleReader(api, "ego", radius) for radius in (60.0, 6000.0)}
    met: dict[float, set[str]] = {radius: set() for radius in readers}
    for step in range(600):
        link.step()
        for radius, reader in readers.items():
            state = reader.state(Lamp.LOW_BEAM)
            met[radius].update(state.ids)
            if step % 6 == 0:
                assert_same(state, read_everything(api, Lamp.LOW_BEAM, radius))
    assert len(met[60.0]) > len(readers[60.0].state(Lamp.LOW_BEAM).ids)
    assert len(met[6000.0]) > max(64, len(state.ids))


def test_slopes_are_read_wherever_the_road_is_not_level(link: LibsumoLink, tmp_path: Path) -> None:
    """From the level into a sag."""
    (tmp_path / "few.rou.xml").write_text(
        '<routes><vType id="c" sigma="0"/><route id="r" edges="road"/>'
        '<vehicle id="ego" type="c" route="r" depart="0" departPos="250" departSpeed="25"/>'
        '<vehicle id="v" type="c" route="r" depart="0" departPos="280" departSpeed="25"/></routes>',
        encoding="utf-8",
    )
    net = MOTORWAY.parent / "graded_motorway" / "graded.net.xml"
    files = ("--net-file", str(net), "--route-files", str(tmp_path / "few.rou.xml"), "--step-length", "0.1")
    api = link.begin([*files, "--no-step-log", "true"])
    link.step()
    reader = VehicleReader(api, "ego", 100.0)
    asked, slope = list[str](), reader._slope
    reader._slope = lambda vehicle: asked.append(vehicle) or slope(vehicle)
    subscribed = SubscribedReader(api, "ego", 100.0)
    seen = []
    for _ in range(150):
        state = reader.state(Lamp.NONE)
        assert_same(state, read_everything(api, Lamp.NONE, 100.0))
        assert_same(state, subscribed.state(Lamp.NONE))
        seen.append(float(state.grade[state.ids.index("ego")]))
        link.step()
    assert min(seen) == 0.0
    assert max(seen) > 0.015
    # On the level nobody is asked but at the first look.
    assert len(asked) < 2 * len(seen) - 20


def test_a_vehicle_far_away_is_not_asked_again_at_once(link: LibsumoLink) -> None:
    api = begun(link)
    nearness = NearbyVehicles(api, "ego", 100.0)
    nearness.find()
    asked, position = list[str](), nearness._position
    nearness._position = lambda vehicle: asked.append(vehicle) or position(vehicle)
    link.step()
    ids, _ = nearness.find()
    assert set(ids) <= set(asked)
    assert len(set(asked)) < 0.5 * api.vehicle.getIDCount()


def test_an_ego_that_is_moved_by_hand_finds_its_new_neighbours(link: LibsumoLink) -> None:
    api = begun(link)
    reader = VehicleReader(api, "ego", 200.0)
    before = reader.state(Lamp.NONE)
    api.vehicle.moveTo("ego", "exit_1", 700.0)
    link.step()
    state = reader.state(Lamp.NONE)
    assert_same(state, read_everything(api, Lamp.NONE, 200.0))
    assert state.position[state.ids.index("ego"), 0] - before.position[before.ids.index("ego"), 0] > 1000.0


def test_a_vehicle_that_is_moved_by_hand_is_found_within_a_second(link: LibsumoLink) -> None:
    api = begun(link)
    reader = VehicleReader(api, "ego", 100.0)
    near = reader.state(Lamp.NONE).ids
    far = next(v for v in api.vehicle.getIDList() if v not in near and api.vehicle.getRoadID(v) == "opposite")
    anywhere, any_angle, off_the_road = -1, -1073741824.0, 2  # as SUMO's moveToXY names them
    for _ in range(11):
        x, y = api.vehicle.getPosition("ego")
        api.vehicle.moveToXY(far, "", anywhere, x, y + 40.0, any_angle, off_the_road)
        link.step()
        found = far in reader.state(Lamp.NONE).ids
    assert found
