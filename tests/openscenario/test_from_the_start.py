"""What vehicles do from Init on: speeds that change, trajectories on which they meet the ego, and offsets."""

from pathlib import Path

import pytest

from fogsim.errors import InputError, LeftOutWarning
from fogsim.openscenario import read_openscenario

from tests.openscenario.writing import (  # isort: skip
    CAR, HEADER, PERSON, ROAD, TIMED, after, begun, event, follows, group, lane, linear, motion, motion_at, on,
    polyline, profile, run, speed, trajectory, world, write,
)  # fmt: skip

EGO = f"{lane(30)}\n{speed(10)}"


def _reaches(place: str, tolerance: float, who: str = "Ego") -> str:
    return group(on(f'<ReachPositionCondition tolerance="{tolerance}">{place}</ReachPositionCondition>', who))


def test_a_speed_that_is_ordered_in_init_over_a_time_is_reached_then(tmp_path: Path) -> None:
    begin = {"Ego": f"{lane(30)}\n{profile((0, 5), (4, 15))}", "Lead": f"{lane(300)}\n{speed(8, linear(4))}"}
    # One off the lanes, too.
    begin["Far"] = world(150, -30, 'h="0"') + f"\n{speed(8, linear(2))}"
    steps = run(write(tmp_path, dict.fromkeys(begin, CAR), begin, stop=after(6.0)))
    for name, speeds in (("Ego", (5.0, 10.0, 15.0)), ("Lead", (0.0, 4.0, 8.0))):
        found = [motion_at(steps, time, name)[2] for time in (0.0, 2.0, 5.0)]
        assert found == pytest.approx(speeds, abs=0.4)
    assert motion_at(steps, 3.9, "Far")[2] == pytest.approx(8.0, abs=0.1)
    assert motion_at(steps, 3.9, "Far")[0] > 150.0 + 3.7 + 15.0
    where = _reaches('<Position><RelativeWorldPosition entityRef="Lead" dx="5" dy="0"/></Position>', 1)
    with pytest.raises(InputError, match="where Lead is by then is not known"):
        read_openscenario(write(tmp_path, dict.fromkeys(begin, CAR), begin, stop=where))


def test_the_ego_aims_for_its_speed_whatever_the_limits(tmp_path: Path) -> None:
    text, file = ROAD.read_text(encoding="utf-8"), tmp_path / "limits.xodr"
    kinds = "".join(f'<type s="{s}" type="town"><speed max="{fast}"/></type>' for s, fast in ((0, 14), (100, 30)))
    kinds += '<type s="300" type="town"><speed max="8"/></type>'
    file.write_text(text.replace("<planView>", f"{kinds}<planView>"), encoding="utf-8")
    steps = run(write(tmp_path, {"Ego": CAR}, {"Ego": f"{lane(30)}\n{speed(20)}"}, stop=after(20.0), road=file))
    assert [motion(step, "Ego")[2] for step in steps] == pytest.approx([20.0] * len(steps), abs=0.05)


@pytest.mark.parametrize(("begins", "fast"), [(speed(0, linear(1)), 0.0), (profile((0, 8)), 8.0)])
def test_the_ego_keeps_the_speed_to_which_it_comes_in_init(tmp_path: Path, begins: str, fast: float) -> None:
    steps = run(write(tmp_path, {"Ego": CAR}, {"Ego": f"{lane(30)}\n{begins}"}, stop=after(4.0)))
    assert motion_at(steps, 3.9, "Ego")[2] == pytest.approx(fast, abs=0.05)


@pytest.mark.parametrize("slows", [profile((0, 20), (4, 8)), f"{speed(20)}\n{speed(8, linear(4))}"])
def test_a_vehicle_may_slow_down_from_the_start(tmp_path: Path, slows: str) -> None:
    begin = {"Ego": EGO, "Lead": f"{lane(300)}\n{slows}"}
    steps = run(write(tmp_path, dict.fromkeys(begin, CAR), begin, stop=after(5.0)))
    found = [motion_at(steps, time, "Lead")[2] for time in (0.0, 2.0, 4.9)]
    assert found == pytest.approx([20.0, 14.0, 8.0], abs=0.3)
    with pytest.raises(InputError, match=r"Private\[Ego\].*: its driver aims for the speed that it comes to"):
        read_openscenario(write(tmp_path, {"Ego": CAR}, {"Ego": f"{lane(30)}\n{slows}"}))


NEAR = (
    '<RelativeDistanceCondition entityRef="Other" relativeDistanceType="longitudinal" value="0.1" freespace="false" '
    'rule="lessThan"/>'
)


@pytest.mark.parametrize(
    ("s", "stop", "time"),
    [
        # A distance that is driven counts on any road.
        (420, on('<TraveledDistanceCondition value="30"/>', "Other"), 3.0),
        # Reference points pass each other between two steps: they approach by 2 m a period, from 40 m.
        (70, on(NEAR), 2.0),
    ],
)
def test_an_oncoming_vehicle_ends_the_run(tmp_path: Path, s: float, stop: str, time: float) -> None:
    begin = {"Ego": EGO, "Other": f"{lane(s, 1)}\n{speed(10)}"}
    assert run(write(tmp_path, {"Ego": CAR, "Other": CAR}, begin, stop=group(stop)))[-1].time == pytest.approx(
        time, abs=0.11
    )


@pytest.mark.parametrize(
    ("y", "tolerance", "time"), [(-1.75, 0.2, 2.3), (-3.4, 0.2, 5.0), (-4.6, 2.0, 5.0), (-4.6, 3.0, 2.2)]
)
def test_a_position_is_reached_between_two_steps(tmp_path: Path, y: float, tolerance: float, time: float) -> None:
    reach = _reaches(world(120, y), tolerance) + after(5.0)
    steps = run(write(tmp_path, {"Ego": CAR}, {"Ego": f"{lane(30)}\n{speed(40)}"}, stop=reach))
    assert steps[-1].time == pytest.approx(time, abs=0.11)


@pytest.mark.parametrize("place", ["", f"{lane(118)}\n"])
def test_a_person_who_crosses_reaches_a_position_in_a_lane(tmp_path: Path, place: str) -> None:
    crosses = follows(polyline((0, world(120, -6)), (4, world(120, 2))), TIMED)
    begin, stop = {"Ego": EGO, "Ann": place + crosses}, _reaches(lane(120), 0.2, "Ann") + after(5.0)
    steps = run(write(tmp_path, {"Ego": CAR, "Ann": PERSON}, begin, stop=stop))
    assert steps[-1].time == pytest.approx(2.1, abs=0.21)


def test_a_trajectory_is_followed_from_an_offset_on(tmp_path: Path) -> None:
    line = polyline(*((None, world(x, y)) for x, y in ((100, 10), (160, 10), (160, 60))))
    begin = f"{lane(90, 1)}\n{speed(10)}\n" + follows(line, more=' initialDistanceOffset="70"')
    steps = run(write(tmp_path, {"Ego": CAR, "Other": CAR}, {"Ego": EGO, "Other": begin}, stop=after(2.0)))
    # 60 m and 10 m of the trajectory are left out; the front is 3.7 m ahead of the point that follows it.
    for time in (0.1, 1.0):
        expected = 160.0, 20.0 + 10.0 * time + 3.7
        assert motion_at(steps, time, "Other")[:2] == pytest.approx(expected, abs=0.02)
    with pytest.raises(InputError, match=r"initialDistanceOffset: the trajectory is no longer than 110.0 m"):
        read_openscenario(write(tmp_path, {"Ego": CAR}, {"Ego": begin.replace('"70"', '"110"')}))


def test_the_offset_of_one_that_drives_against_a_lane_is_kept(tmp_path: Path) -> None:
    place = '<Position><RelativeRoadPosition entityRef="Ego" ds="300" dt="0.5"><Orientation h="3.14159"/>'
    begin = {"Ego": EGO, "Other": f"{place}</RelativeRoadPosition></Position>\n{speed(10)}"}
    steps = run(write(tmp_path, {"Ego": CAR, "Other": CAR}, begin, stop=after(2.0)))
    assert motion_at(steps, 1.5, "Other")[1] == pytest.approx(-1.75 + 0.5, abs=0.01)


@pytest.mark.parametrize(
    "target", ['<TrajectoryPosition s="5">{}</TrajectoryPosition>', '<WorldPosition x="110" y="-1"/>']
)
def test_a_person_on_a_trajectory_meets_the_ego_at_a_steady_speed(tmp_path: Path, target: str) -> None:
    line = polyline(*((None, world(110, y)) for y in (-6, 6)))
    meets = (
        '<PrivateAction><SynchronizeAction masterEntityRef="Ego"><TargetPositionMaster><LanePosition roadId="7" '
        f'laneId="-1" s="100"/></TargetPositionMaster><TargetPosition>{target.format(trajectory(line))}'
        '</TargetPosition><FinalSpeed><AbsoluteSpeed value="1.5"><TargetDistanceSteadyState distance="3"/>'
        "</AbsoluteSpeed></FinalSpeed></SynchronizeAction></PrivateAction>"
    )
    begin, story = {"Ego": EGO, "Ann": follows(line)}, {"Ann": event("meet", meets, after(0))}
    steps = run(write(tmp_path, {"Ego": CAR, "Ann": PERSON}, begin, story, stop=after(8.0)))
    # The ego needs 7 s for its 70 m; 2 s before, the person has walked 2 m of 5 m and is as fast as it is there.
    (_, early, slow), (_, y, fast) = (motion_at(steps, time, "Ann") for time in (1.0, 5.1))
    assert (early, slow) == pytest.approx((-5.75, 0.0), abs=0.05)
    assert (y, fast) == pytest.approx((-5.75 + 2.0 + 0.15, 1.5), abs=0.1)
    assert "meet" in begun(steps)


def test_a_lane_against_its_route_counts_along_the_route(tmp_path: Path) -> None:
    points = "".join(f'<Waypoint routeStrategy="shortest">{lane(s, 1)}</Waypoint>' for s in (700, 100))
    place = (
        f'<Position><RoutePosition><RouteRef><Route name="r" closed="false">{points}</Route></RouteRef>'
        '<InRoutePosition><FromLaneCoordinates pathS="100" laneId="-1" laneOffset="0.3"/></InRoutePosition>'
        "</RoutePosition></Position>"
    )
    file = write(tmp_path, {"Ego": CAR, "Other": CAR}, {"Ego": EGO, "Other": place}, stop=after(1.0))
    with pytest.warns(match="lane -1 leads against the route; read as counted along it, which is lane 1"):
        steps = run(file)
    assert motion_at(steps, 0.0, "Other")[:2] == pytest.approx((600.0 - 3.7, 1.75 - 0.3), abs=0.01)


def test_places_may_be_relative_to_one_off_the_lanes(tmp_path: Path) -> None:
    ben = '<Position><RelativeObjectPosition entityRef="Ann" dx="2" dy="1"/></Position>'
    begin = {"Ego": EGO, "Ben": ben, "Ann": world(150, -9, 'h="1.5708"')}
    steps = run(write(tmp_path, {"Ego": CAR, "Ann": PERSON, "Ben": PERSON}, begin, stop=after(1.0)))
    assert motion_at(steps, 0.9, "Ben")[:2] == pytest.approx((149.0, -7.0 + 0.25), abs=0.01)


def test_the_moon_is_no_share_of_the_sky(tmp_path: Path) -> None:
    file = write(tmp_path, {"Ego": CAR}, {"Ego": EGO})
    file.write_text(file.read_text(encoding="utf-8").replace('illuminance="20000"', 'illuminance="0.1"'))
    with pytest.warns(match="0.1 lx would be night at a sun of 52°; read as a moon there"):
        assert read_openscenario(file).data["light"] == {"illuminance_lx": 0.1}


def test_an_environment_leaves_what_it_does_not_name(tmp_path: Path) -> None:
    file = write(tmp_path, {"Ego": CAR}, {"Ego": EGO}, visibility=80.0)
    light = (
        '<Environment name="l"><Weather><Sun illuminance="9000" azimuth="0" elevation="0.9"/></Weather></Environment>'
    )
    action = f"<GlobalAction><EnvironmentAction>{light}</EnvironmentAction></GlobalAction>"
    file.write_text(file.read_text(encoding="utf-8").replace("<Private ", f"{action}<Private "), encoding="utf-8")
    data = read_openscenario(file).data
    assert (data["fog"], data["light"]) == ({"visibility_m": 80.0}, {"illuminance_lx": 9000.0})


def test_an_elevation_in_degrees_is_refused(tmp_path: Path) -> None:
    file = write(tmp_path, {"Ego": CAR}, {"Ego": EGO})
    sun = 'illuminance="20000" azimuth="0" elevation="0.9"'
    text = file.read_text(encoding="utf-8").replace(sun, 'azimuth="0" elevation="45"')
    file.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="elevation: expected an angle in radians, from -pi to pi, got 45"):
        read_openscenario(file)


def test_files_written_on_windows_name_folders_with_backslashes(tmp_path: Path) -> None:
    (tmp_path / "maps").mkdir()
    file = write(tmp_path, {"Ego": CAR}, {"Ego": EGO})
    text = file.read_text(encoding="utf-8")
    road = text.split('LogicFile filepath="')[1].split('"')[0]
    (tmp_path / "maps" / "road.xodr").write_bytes(Path(road).read_bytes())
    entry = CAR.replace('name="car"', 'name="entry"')
    (tmp_path / "maps" / "cars.xosc").write_text(f'{HEADER}<Catalog name="cars">{entry}</Catalog></OpenSCENARIO>')
    folder = f'<VehicleCatalog><Directory path="..\\{tmp_path.name}\\maps"/></VehicleCatalog><RouteCatalog>'
    text = text.replace(road, ".\\maps\\road.xodr").replace("<RouteCatalog>", folder)
    file.write_text(text.replace(CAR, '<CatalogReference catalogName="cars" entryName="entry"/>'))
    assert read_openscenario(file).data["fog"]["visibility_m"] == pytest.approx(200.0)


def test_changes_of_speed_that_a_vehicle_cannot_do_are_refused_or_remarked(tmp_path: Path) -> None:
    begin, needs = (
        {"Ego": f"{lane(30)}\n{speed(10)}"},
        r"Ego speeds up by 4 m/s² at most \(Performance\), but would have",
    )
    fast = event("fast", profile((0, 10), (2, 20)), after(1.0))
    with pytest.raises(InputError, match=rf"SpeedProfileEntry: {needs} to by 5 m/s²"):
        read_openscenario(write(tmp_path, {"Ego": CAR}, begin, {"Ego": fast}))
    at_once = {"Ego": f"{lane(30)}\n{speed(10, linear(2))}"}
    with pytest.raises(InputError, match=rf"PrivateAction: {needs} to by 5 m/s²"):
        read_openscenario(write(tmp_path, {"Ego": CAR}, at_once))
    with pytest.warns(LeftOutWarning, match="brakes by 9 .* got 6: one way takes longer"):
        read_openscenario(
            write(tmp_path, {"Ego": CAR}, begin, {"Ego": event("six", speed(5, linear(6, "rate")), after(1))})
        )
