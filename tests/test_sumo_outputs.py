"""What SUMO writes by itself goes into the run's directory, whatever its files say."""

import shutil
from pathlib import Path
from xml.etree import ElementTree as ET

import pyarrow.parquet as pq
import pytest

import fogsim
from fogsim.errors import InputError
from fogsim.recorders import RunDirectory, recover_run
from fogsim.scenario import override, scenario_from_config
from fogsim.simulation.recording import record_run
from fogsim.study.execution import run_to_file
from fogsim.traffic.sumo.output_folder import OutputFolder

GRID = Path(__file__).parent / "data" / "grid"
DETECTORS = """<additional>
  <inductionLoop id="loop" lane="A0A1_0" pos="10" period="5" file="loop.xml"/>
  <edgeData id="edges" file="../edges.xml" period="5"/>
</additional>"""
CONFIG = """<configuration>
  <net-file value="grid.net.xml"/><route-files value="grid.trips.xml"/><additional-files value="more/loop.add.xml"/>
  <output-prefix value="elsewhere/mine_"/><fcd-output value="fcd.xml"/><fcd-output.acceleration value="true"/>
  <tripinfo-output value="{absolute}"/><precision value="6"/>
  <device.ssm.probability value="1"/><device.ssm.file value="ssm.xml"/>
</configuration>"""
WRITTEN = ["mine_edges.xml", "mine_fcd.xml", "mine_loop.xml", "mine_ssm.xml", "mine_trips.xml"]
SETTINGS = ("duration_s=12", "clocks.traffic_step_s=0.5", "clocks.camera_period_s=0.5", "fog.visibility_m=100")
NO_FRAMES = ("renderer=none", "estimators=[]")

Source = tuple[fogsim.Scenario, Path]


@pytest.fixture
def town(tmp_path: Path) -> Source:
    """A SUMO configuration that asks for outputs, and its folder."""
    folder = tmp_path / "source"
    (folder / "more").mkdir(parents=True)
    for name in ("grid.net.xml", "grid.trips.xml"):
        shutil.copy(GRID / name, folder)
    (folder / "more" / "loop.add.xml").write_text(DETECTORS)
    config = folder / "town.sumocfg"
    config.write_text(CONFIG.format(absolute=folder / "trips.xml"))
    return scenario_from_config(config, "veh5", [*SETTINGS, *NO_FRAMES]), folder


def content(folder: Path) -> dict[str, int]:
    return {str(path.relative_to(folder)): path.stat().st_mtime_ns for path in folder.rglob("*")}


def fcd(path: Path) -> dict[tuple[float, str], dict[str, str]]:
    """Vehicles of SUMO's own table, by time and id."""
    steps = ET.parse(path).getroot().iter("timestep")  # noqa: S314 - SUMO has just written it
    return {(round(float(step.attrib["time"]), 3), v.attrib["id"]): v.attrib for step in steps for v in step}


def test_two_seeds_leave_two_sets_of_outputs_and_the_source_untouched(town: Source, tmp_path: Path) -> None:
    scenario, folder = town
    before = content(folder)
    found = []
    for seed in (1, 2):
        # SUMO would put the time in place of the folder's name.
        out = tmp_path / "TIME" / f"seed{seed}"
        done = record_run(scenario, seed, out, recorders=("table", "trajectories"))
        assert "sumo_outputs" in done.files
        assert sorted(path.name for path in (out / "sumo_outputs").iterdir()) == WRITTEN
        assert sorted(path.name for path in out.iterdir()) == sorted(done.files)
        found.append(out)
    assert content(folder) == before
    first, second = (fcd(out / "sumo_outputs" / "mine_fcd.xml") for out in found)
    assert first != second
    _check_trajectories(found[0] / "trajectories.parquet", first)


def _check_trajectories(path: Path, sumos: dict[tuple[float, str], dict[str, str]]) -> None:
    """All vehicles are where SUMO has them, but for those that change lane, and as fast."""
    compared = 0
    for row in pq.read_table(path).to_pylist():
        there = sumos[round(row["timestep_time"] - 0.5, 3), row["vehicle_id"]]
        assert row["vehicle_lane"] == there["lane"]
        names = {"speed": 1e-5, "acceleration": 1e-5, "slope": 1e-5, "angle": 1e-3, "x": 1e-5, "y": 1e-5}
        for name, tolerance in names.items():
            assert row[f"vehicle_{name}"] == pytest.approx(float(there[name]), abs=tolerance)
        compared += 1
    assert compared > 200


def test_in_python_they_are_kept_where_a_folder_is_named_and_else_warned_of(town: Source, tmp_path: Path) -> None:
    scenario, folder = town
    before = content(folder)
    for _ in fogsim.run(override(scenario, ["duration_s=1"]), 1, sumo_outputs=tmp_path / "kept"):
        pass
    assert sorted(path.name for path in (tmp_path / "kept").iterdir()) == WRITTEN
    with pytest.warns(UserWarning, match=r"SUMO writes mine_edges\.xml, .*will not be kept"):
        next(fogsim.run(scenario, 1))
    assert content(folder) == before


def test_each_run_of_a_study_has_its_own(town: Source, tmp_path: Path) -> None:
    short = override(town[0], ["duration_s=1"])
    assert [run_to_file(short, seed, tmp_path / f"run{seed}.json") for seed in (1, 2)] == [None, None]
    for seed in (1, 2):
        assert sorted(path.name for path in (tmp_path / f"run{seed}").iterdir()) == WRITTEN


def test_a_run_without_outputs_leaves_no_folder(tmp_path: Path) -> None:
    scenario = scenario_from_config(GRID / "grid.sumocfg", "veh5", [*SETTINGS, *NO_FRAMES, "duration_s=1"])
    done = record_run(scenario, 1, tmp_path, recorders=("table",))
    assert done.files == ("manifest.json", "metrics.json", "steps.parquet")
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(done.files)


def test_trip_statistics_that_a_configuration_asks_for_are_written(
    town: Source, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    scenario, folder = town
    asked = '<statistic-output value="stat.xml"/><duration-log.statistics value="true"/>'
    files = '<net-file value="grid.net.xml"/><route-files value="grid.trips.xml"/>'
    (folder / "town.sumocfg").write_text(f"<configuration>{files}{asked}</configuration>")
    record_run(scenario, 1, tmp_path / "run", recorders=("table",))
    statistics = ET.parse(tmp_path / "run" / "sumo_outputs" / "stat.xml")  # noqa: S314 - SUMO has just written it
    assert statistics.find("vehicleTripStatistics") is not None
    assert capfd.readouterr().out == ""


def test_options_of_a_scenario_bring_outputs_and_earlier_ones_give_way(tmp_path: Path) -> None:
    scenario = scenario_from_config(
        GRID / "grid.sumocfg",
        "veh5",
        [*SETTINGS, *NO_FRAMES, "duration_s=1", "traffic.sumo_options.summary-output=s.xml"],
    )
    record_run(scenario, 1, tmp_path, recorders=("table",))
    assert [path.name for path in (tmp_path / "sumo_outputs").iterdir()] == ["s.xml"]
    again = override(scenario, ["traffic.sumo_options={}"])
    assert "sumo_outputs" not in record_run(again, 1, tmp_path, recorders=("table",), overwrite=True).files
    assert not (tmp_path / "sumo_outputs").exists()


def test_a_folder_that_sumo_cannot_write_to_is_told_in_its_words_without_our_detours(town: Source) -> None:
    scenario, folder = town
    lost = override(scenario, ["traffic.sumo_options.summary-output=nowhere/s.xml"])
    with pytest.raises(fogsim.SimulationError, match=r"output file 'nowhere/mine_s\.xml' \(No such file"):
        next(fogsim.run(lost, 1, sumo_outputs=folder / "out"))
    (folder / "file").touch()
    with pytest.raises(InputError, match=r"cannot write SUMO's outputs into .*file/out: Not a directory"):
        next(fogsim.run(scenario, 1, sumo_outputs=folder / "file" / "out"))


def test_outputs_of_one_name_from_different_folders_are_refused(town: Source) -> None:
    scenario, folder = town
    both = override(scenario, ["traffic.sumo_options.edgedata-output=edges.xml"])
    with pytest.raises(fogsim.SimulationError, match=r"several outputs into one file: mine_edges\.xml\."):
        next(fogsim.run(both, 1, sumo_outputs=folder / "out"))
    with pytest.warns(UserWarning, match="will not be kept"):
        next(fogsim.run(both, 1))


def test_a_run_that_was_killed_leaves_its_outputs_to_be_recovered(tmp_path: Path) -> None:
    (tmp_path / "unfinished").mkdir()
    (tmp_path / "unfinished" / "manifest.json").write_text('{"status": "running"}')
    (tmp_path / "sumo_outputs.part").mkdir()
    (tmp_path / "sumo_outputs.part" / "fcd.xml").write_text("<fcd-export>")
    assert recover_run(tmp_path) == ["manifest.json", "sumo_outputs"]
    assert [path.name for path in (tmp_path / "sumo_outputs").iterdir()] == ["fcd.xml"]
    # They may be replaced: the manifest names them.
    RunDirectory(tmp_path, overwrite=True).close()


def test_a_folder_of_somebody_elses_is_not_touched(tmp_path: Path) -> None:
    (tmp_path / "sumo_outputs").mkdir()
    with pytest.raises(InputError, match="sumo_outputs is not of an earlier run"):
        RunDirectory(tmp_path, overwrite=True)


def test_files_that_sumo_could_not_write_to_their_end_are_told(tmp_path: Path) -> None:
    texts = {
        "whole": "<a><b/></a>\n",
        "empty": '<?xml version="1.0"?>\n<a x="1"/>',
        "cut": "<a><b/>",
        "nothing": "",
        "half": "<a><b/></",
    }
    folder = OutputFolder(tmp_path)
    folder.open()
    for name, text in texts.items():
        (tmp_path / f"{name}.xml").write_text(text)
    with pytest.warns(UserWarning, match=r"all of cut\.xml, half\.xml, nothing\.xml in .*disk full"):
        folder.close()


def test_a_configuration_deep_below_links_writes_into_the_runs_folder(town: Source, tmp_path: Path) -> None:
    folder, out = town[1] / "a", tmp_path / "out"
    deep = folder.joinpath(*"a" * 45)
    trap = deep.joinpath(*[".."] * 40, *out.parts[1:]).resolve()
    deep.mkdir(parents=True)
    trap.parent.mkdir(parents=True)
    trap.symlink_to(folder)
    text = (town[1] / "town.sumocfg").read_text().replace(str(town[1] / "trips.xml"), f"{deep}/trips.xml")
    (town[1] / "town.sumocfg").write_text(text)
    for _ in fogsim.run(override(town[0], ["duration_s=1"]), 1, sumo_outputs=out):
        pass
    assert (out / "mine_trips.xml").is_file()
    assert not (folder / "mine_trips.xml").exists()
