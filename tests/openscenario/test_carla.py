"""Files for CARLA's ScenarioRunner, which mirrors the axes and counts to the right."""

from pathlib import Path

import pytest

from fogsim.errors import InputError, LeftOutWarning
from fogsim.openscenario import read_openscenario

from tests.openscenario.writing import (  # isort: skip
    CAR, DATA, PERSON, TIMED, TWO_LANES, after, changes_lane, event, follows, lane, linear, motion_at, run, speed,
    trajectory, world, write,
)  # fmt: skip


def _of_carla(file: Path) -> Path:
    text = file.read_text(encoding="utf-8")
    file.write_text(text.replace('description=""', 'description="CARLA:x"'), encoding="utf-8")
    return file


def test_lanes_and_offsets_are_counted_to_the_right(tmp_path: Path) -> None:
    moves = changes_lane(1, "time", 1.0).replace("AbsoluteTargetLane", 'RelativeTargetLane entityRef="Lead"')
    target = '<LaneOffsetTarget><AbsoluteTargetLaneOffset value="-0.5"/></LaneOffsetTarget>'
    aside = f'<LaneOffsetAction continuous="false"><LaneOffsetActionDynamics dynamicsShape="step"/>{target}'
    aside = f"<PrivateAction><LateralAction>{aside}</LaneOffsetAction></LateralAction></PrivateAction>"
    place = '<Position><RelativeLanePosition entityRef="Ego" dLane="1" ds="60" offset="0.5"/></Position>'
    begin = {"Ego": lane(30, -2), "Lead": f"{place}\n{speed(10)}"}
    events = event("moves", moves, after(1.0)) + event("aside", aside, after(4.0))
    file = write(tmp_path, {"Ego": CAR, "Lead": CAR}, begin, {"Lead": events}, after(6.0), road=TWO_LANES)
    steps = run(_of_carla(file))
    # The road lies along y = -20 m, and lane -1 in the middle of its first 3.5 m.
    places = [motion_at(steps, time, "Lead")[1] for time in (0.5, 3.5, 5.9)]
    assert places == pytest.approx([-21.75 - 0.5, -25.25, -25.25 + 0.5], abs=0.05)


def test_positions_in_catalogs_are_mirrored_once_their_parameters_have_values(tmp_path: Path) -> None:
    text = (DATA / "catalogs" / "trajectories.xosc").read_text(encoding="utf-8")
    text = text.replace('<RoadPosition roadId="7" s="150" t="-9"/>', '<WorldPosition x="150" y="$y"/>')
    text = text.replace('<RoadPosition roadId="7" s="150" t="9"/>', '<WorldPosition x="150" y="${$y - 18}" h="$h"/>')
    named = '<ParameterDeclaration name="{}" parameterType="double" value="{}"/>'
    declared = f"<ParameterDeclarations>{named.format('y', 9)}{named.format('h', 'wrong')}</ParameterDeclarations>"
    (tmp_path / "trajectories.xosc").write_text(text.replace("<Shape>", f"{declared}<Shape>"), encoding="utf-8")
    reference = '<TrajectoryRef><CatalogReference catalogName="Trajectories" entryName="across"/></TrajectoryRef>'
    begin = {"Ego": lane(30), "Ann": f"{world(150, 9)}\n{follows('', TIMED).replace(trajectory(''), reference)}"}
    file = _of_carla(write(tmp_path, {"Ego": CAR, "Ann": PERSON}, begin))
    with pytest.raises(InputError, match="expected a number for h, got 'wrong'"):
        read_openscenario(file)
    (tmp_path / "trajectories.xosc").write_text(
        text.replace("<Shape>", f"{declared.replace('wrong', '0')}<Shape>"), encoding="utf-8"
    )
    done = (one["do"].get("Ann", {}) for one in read_openscenario(file).data["timeline"])
    (points,) = [one["path"]["points"] for one in done if "path" in one]
    assert [point[1] for point in points] == [-9.0, 9.0]


def test_a_step_that_lasts_is_remarked(tmp_path: Path) -> None:
    slow = event("slow", speed(5, linear(50, "distance").replace("linear", "step")), after(1.0))
    file = _of_carla(write(tmp_path, {"Ego": CAR}, {"Ego": f"{lane(30)}\n{speed(10)}"}, {"Ego": slow}))
    with pytest.warns(LeftOutWarning, match=r"ScenarioRunner's action lasts for 50 \(distance\)"):
        read_openscenario(file)


def test_orientations_are_relative(tmp_path: Path) -> None:
    place = lane(400, 1).replace("/></Position>", '><Orientation h="0"/></LanePosition></Position>')
    begin = {"Ego": lane(30), "Far": f"{place}\n{speed(10)}"}
    steps = run(_of_carla(write(tmp_path, {"Ego": CAR, "Far": CAR}, begin, stop=after(2.0))))
    assert motion_at(steps, 1.9, "Far")[0] == pytest.approx(400.0 - 3.7 - 19.0, abs=0.2)
