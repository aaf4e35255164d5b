"""Maps by name in a folder of the user's: OpenDRIVE files and SUMO networks."""

import contextlib
import re
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from fogsim.cli.app import app
from fogsim.core.files.readers import MAPS
from fogsim.errors import InputError, LeftOutWarning
from fogsim.openscenario import read_openscenario
from fogsim.traffic.road.netconvert import opendrive_net

from tests.openscenario.writing import (  # isort: skip
    CAR, PERSON, ROAD, TIMED, after, first_step, follows, group, lane, motion, on, polyline, run, speed, world, write,
)  # fmt: skip


@pytest.fixture
def maps(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The user's folder of maps, with a town."""
    (folder := tmp_path / "maps").mkdir()
    shutil.copy(ROAD, folder / "Town01.xodr")
    monkeypatch.setenv(MAPS, str(folder))
    return folder


def test_a_map_is_found_by_its_name(tmp_path: Path, maps: Path) -> None:
    begin = {"Ego": f"{lane(30)}\n{speed(5)}"}
    roads = [Path(road) for road in ("Town01", "Town01.xodr", "other/folder/Town01.xodr", "C:\\maps\\Town01.xodr")]
    found = [read_openscenario(write(tmp_path, {"Ego": CAR}, begin, road=road)).data for road in roads]
    assert found == [found[0]] * 4
    first = first_step(write(tmp_path, {"Ego": CAR}, begin, road=roads[0]))
    assert motion(first, "Ego")[:2] == pytest.approx((33.7, -1.75), abs=0.1)


def test_a_sumo_network_has_places_by_coordinates_alone(tmp_path: Path, maps: Path) -> None:
    net = re.sub(r'netOffset="[^"]*"', 'netOffset="0.00,-20.00"', opendrive_net(ROAD))
    moved = re.sub(r",(-?1\.750)", lambda y: f",{float(y[1]) - 20.0:.3f}", net)
    (maps / "Village.net.xml").write_text(moved, encoding="utf-8")
    here = '<Position><WorldPosition x="30" y="-1.75" h="0"/></Position>'
    first = first_step(write(tmp_path, {"Ego": CAR}, {"Ego": here}, road=Path("Village")))
    assert motion(first, "Ego")[:2] == pytest.approx((33.7, -21.75))
    # Beyond the lane, and in conditions, coordinates are the same.
    begin = {"Ego": f"{here}\n{speed(10)}", "Ann": world(60, -9, 'h="0"')}
    reach = group(on(f'<ReachPositionCondition tolerance="2">{world(50, -1.75)}</ReachPositionCondition>'))
    steps = run(write(tmp_path, {"Ego": CAR, "Ann": PERSON}, begin, stop=reach + after(5.0), road=Path("Village")))
    assert motion(steps[-1], "Ann")[:2] == pytest.approx((60.25, -29.0), abs=0.01)
    assert steps[-1].time == pytest.approx(1.9, abs=0.11)
    with pytest.raises(InputError, match="a map that is a SUMO network has no roads; write a WorldPosition"):
        read_openscenario(write(tmp_path, {"Ego": CAR}, {"Ego": lane(30)}, road=Path("Village")))


def test_of_roads_on_top_of_one_another_z_decides(tmp_path: Path, maps: Path) -> None:
    lane = '<lane id="bridge_0" index="0" speed="20" length="200" shape="0,-1.75,6 200,-1.75,6"/>'
    net = opendrive_net(ROAD).replace("</net>", f'<edge id="bridge">{lane}</edge></net>')
    (maps / "Levels.net.xml").write_text(net, encoding="utf-8")
    for z, is_bridge in (("0.2", False), ("5.5", True)):
        file = write(tmp_path, {"Ego": CAR}, {"Ego": world(30, -1.75, f'z="{z}"')}, road=Path("Levels"))
        [routes] = read_openscenario(file).data["traffic"]["routes"]
        assert ('edges="bridge"' in Path(routes).read_text(encoding="utf-8")) is is_bridge
    with pytest.raises(InputError, match=r"at \(30, -1\.75\) are roads 0\.0 m and 6\.0 m high; give z"):
        read_openscenario(write(tmp_path, {"Ego": CAR}, {"Ego": world(30, -1.75)}, road=Path("Levels")))


def test_a_lane_that_widens_is_remarked_where_it_is_elsewhere(tmp_path: Path) -> None:
    wide = ROAD.read_text(encoding="utf-8").replace('b="0" c="0" d="0"/>', 'b="0.005" c="0" d="0"/>')
    (tmp_path / "wide.xodr").write_text(wide, encoding="utf-8")
    for s, right in ((50, ""), (400, "1.0 m to the right")):
        file = write(tmp_path, {"Ego": CAR}, {"Ego": lane(s)}, road=tmp_path / "wide.xodr")
        with pytest.warns(LeftOutWarning, match=right) if right else contextlib.nullcontext():
            read_openscenario(file)


def test_maps_may_have_coordinates_of_utm(tmp_path: Path) -> None:
    x, y = 677000.0, 5400000.0
    text = ROAD.read_text(encoding="utf-8").replace('x="0" y="0"', f'x="{x}" y="{y}"')
    (road := tmp_path / "utm.xodr").write_text(text, encoding="utf-8")
    walks = follows(polyline((0, world(x + 60, y - 9)), (5, world(x + 65, y - 9))), TIMED)
    begin = {"Ego": f"{lane(30)}\n{speed(5)}", "Ann": walks}
    steps = run(write(tmp_path, {"Ego": CAR, "Ann": PERSON}, begin, stop=after(2.0), road=road))
    assert motion(steps[-1], "Ann")[:2] == pytest.approx((x + 62.25, y - 9.0), abs=0.11)


def test_a_missing_map_is_told_with_what_is_there(tmp_path: Path, maps: Path) -> None:
    file = write(tmp_path, {"Ego": CAR}, {"Ego": lane(30)}, road=Path("Town02"))
    with pytest.raises(InputError) as refused:
        read_openscenario(file)
    told = f"RoadNetwork/LogicFile: there is no map 'Town02' in {maps}; did you mean 'Town01.xodr'? Known: Town01.xodr"
    assert told in str(refused.value)
    (maps / "Town01.xodr").unlink()
    with pytest.raises(InputError, match=r"it contains no \.xodr or \.net\.xml file"):
        read_openscenario(file)


def test_the_command_line_names_the_folder(tmp_path: Path, maps: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(MAPS)
    file = write(tmp_path, {"Ego": CAR}, {"Ego": lane(30)}, road=Path("Town01"))
    without = CliRunner().invoke(app, ["validate", str(file)])
    assert without.exit_code == 2
    assert "a map in a folder that --maps names" in " ".join(without.output.split())
    assert CliRunner().invoke(app, ["validate", str(file), "--maps", str(maps)]).exit_code == 0
