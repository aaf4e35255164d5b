"""The command line, in processes of its own where these are the subject."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import cv2
import imageio.v3 as imageio
import pytest
import typer
from early_motorway import EARLY
from pyarrow import parquet

from fogsim.cli.app import app
from fogsim.cli.scenario_options import chosen_scenario
from fogsim.scenario import catalogue
from tests.helpers.command import Command, run_command, run_python

FOGSIM = (sys.executable, "-m", "fogsim")
SMALL = ("--set", "camera.width=160", "--set", "camera.height=120", "--set", "duration_s=0.5", "--set", EARLY)
RARE = ("--set", "clocks.camera_period_s=1", "--set", "clocks.decision_period_s=1")
TOWN = str(Path(__file__).resolve().parents[1] / "data" / "grid" / "grid.sumocfg")
FILES = {"manifest.json", "metrics.json", "steps.parquet", "trajectories.parquet", "video.mp4", "report.html"}


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("run") / "out"
    assert run_command("run", "motorway_fog_bank", "--seed", "3", "--trajectories", "--out", str(out), *SMALL) == 0
    return out


def test_the_first_of_several_cases_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    chosen_scenario("patchy_fog", None, None, None, ["vary={strength: [0.7], run: 1 seed}"])
    assert not capsys.readouterr().err
    chosen_scenario("patchy_fog", None, None, None, None)
    assert "strength=0.4,run=0 is the first of 4 cases" in capsys.readouterr().err


def test_a_run_writes_everything(finished: Path) -> None:
    assert {p.name for p in finished.iterdir()} == FILES
    manifest = json.loads((finished / "manifest.json").read_text(encoding="utf-8"))
    assert (manifest["status"], manifest["seed"], manifest["ending"]) == ("complete", 3, "time")
    assert manifest["scenario"]["camera"]["width"] == 160
    assert {"fogsim", "libsumo", "numpy", "python"} <= set(manifest["versions"])
    assert str(Path.home()) not in json.dumps(manifest["scenario"])
    metrics = json.loads((finished / "metrics.json").read_text(encoding="utf-8"))
    assert metrics["complete"] is True


def test_steps_and_video_have_a_row_and_a_frame_for_each_camera_period(finished: Path) -> None:
    table = parquet.read_table(finished / "steps.parquet")
    assert table.column("time_s").to_pylist() == pytest.approx([0.1 * i for i in range(6)])
    video = imageio.improps(finished / "video.mp4", plugin="FFMPEG")
    assert video.shape[1:] == imageio.imread(finished / "video.mp4", plugin="FFMPEG", index=0).shape
    metadata = imageio.immeta(finished / "video.mp4", plugin="FFMPEG")
    assert metadata["fps"] == pytest.approx(10.0)
    assert metadata["duration"] == pytest.approx(0.6, abs=0.11)


def test_the_same_seed_writes_the_same_bytes_in_a_fresh_process(finished: Path, tmp_path: Path) -> None:
    out = ("--out", tmp_path / "b", "--no-report")
    done = run_python("-m", "fogsim", "run", "motorway_fog_bank", "--seed", "3", *out, *SMALL)
    assert "ended: time" in done.stdout
    for name in ("steps.parquet", "metrics.json", "video.mp4"):
        assert (finished / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name


def test_an_interrupted_run_leaves_readable_results_that_say_they_are_partial(tmp_path: Path) -> None:
    out = tmp_path / "out"
    size = ("--set", EARLY, "--set", "camera.width=160", "--set", "camera.height=120")
    line, pipe = [*FOGSIM, "run", "motorway_fog_bank", "--out", str(out), *size], subprocess.PIPE
    process = subprocess.Popen(line, stdout=pipe, stderr=pipe, text=True, start_new_session=True)
    partial = out / "unfinished" / "video.mp4.part"
    deadline = time.monotonic() + 120
    while not (partial.exists() and partial.stat().st_size > 0) and time.monotonic() < deadline:
        time.sleep(0.1)
    time.sleep(0.3)
    os.killpg(process.pid, signal.SIGINT)  # as Ctrl-C does: every process of the terminal's group
    stdout, stderr = process.communicate(timeout=60)
    assert process.returncode == 130, stderr
    assert "Traceback" not in stderr
    assert "partial" in stdout
    assert {p.name for p in out.iterdir()} == FILES - {"trajectories.parquet"}
    manifest = json.loads((out / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["status"] == "interrupted"
    assert json.loads((out / "metrics.json").read_text(encoding="utf-8"))["complete"] is False
    table = parquet.read_table(out / "steps.parquet")
    assert 0 < table.num_rows < 2001
    assert table.schema.metadata[b"fogsim.complete"] == b"false"
    assert imageio.imread(out / "video.mp4", plugin="FFMPEG", index=0).ndim == 3
    frames = cv2.VideoCapture(str(out / "video.mp4")).get(cv2.CAP_PROP_FRAME_COUNT)
    # Ctrl-C reaches ffmpeg too, which may be writing the last one.
    assert table.num_rows - 1 <= frames <= table.num_rows
    assert "PARTIAL" in (out / "report.html").read_text(encoding="utf-8")


def test_bad_input_ends_in_one_message_and_writes_nothing(tmp_path: Path, command: Command) -> None:
    for arguments, message in [
        (["run", "motorway_fog_bnk"], "did you mean 'motorway_fog_bank'?"),
        (["run", "motorway_fog_bank", "--set", "nonsense"], "expected key.path=value"),
        (["validate", "nowhere.yaml"], "there is no such scenario file"),
        (["run", TOWN], "is a SUMO configuration, not a scenario: run it with --sumocfg"),
        (["run", "--sumocfg", __file__, "--ego", "a", "--visibility", "80"], ":1: not XML"),
        (["run"], "expected either a scenario or --sumocfg FILE, got neither"),
        (["run", "motorway_fog_bank", "--sumocfg", TOWN], "got both"),
        (["run", "--sumocfg", TOWN, "--visibility", "120"], "--ego is missing"),
        (["run", "--sumocfg", TOWN, "--ego", "none", "--visibility", "120", "--video"], "--video shows what an ego's"),
        (["run", "--sumocfg", TOWN, "--ego", "veh18"], "--visibility is missing"),
        (["run", "emergency_brake_in_fog", "--video"], "--video shows frames, and renderer is none"),
        (["run", "--sumocfg", "no.sumocfg", "--ego", "a"], "there is no file 'no.sumocfg'"),
        (["validate", "motorway_fog_bank", "--maps", "nowhere"], "--maps nowhere is not a folder"),
        (["schema", "scenery"], "KIND: expected scenario or study, got 'scenery'"),
    ]:
        done = command(*arguments, cwd=tmp_path)
        assert done.returncode == 2
        assert message in done.stderr
        assert not list(tmp_path.iterdir())


def test_validate_tells_the_good_from_the_bad(tmp_path: Path, command: Command) -> None:
    folder = Path(shutil.copytree(catalogue()["motorway_fog_bank"].parent, tmp_path / "mine"))
    assert command("validate", str(folder), "motorway_fog_bank").returncode == 0
    bad, text = folder / "scenario.yaml", (folder / "scenario.yaml").read_text(encoding="utf-8")
    bad.write_text(text.replace("width: 640", "width: -1"), "utf-8")
    done = command("validate", str(folder), "nowhere.yaml", "/dev/zero", "motorway_fog_bank")
    assert done.returncode == 2
    for told in ("camera.width", "nowhere.yaml: there is no such scenario file", "/dev/zero: cannot be read"):
        assert told in done.stderr
    assert "fine: motorway_fog_bank" in done.stdout
    # What the files of SUMO do not have is found as well.
    bad.write_text(text.replace("vehicle: lead", "vehicle: leed"), "utf-8")
    assert "traffic.events.0.vehicle: there is no vehicle 'leed'" in command("validate", str(folder)).stderr


@pytest.mark.filterwarnings("default")  # printed, as in a process of its own
def test_any_sumo_configuration_runs_with_a_chosen_ego(tmp_path: Path, command: Command) -> None:
    """Also one that would listen for clients and take its seed from the clock: it is told, and does neither."""
    config = tmp_path / "mine.sumocfg"
    own = '<remote-port value="8813"/><num-clients value="2"/><random value="true"/>'
    text = Path(TOWN).read_text(encoding="utf-8").replace("grid.", f"{Path(TOWN).parent}/grid.")
    config.write_text(text.replace("</configuration>", f"{own}</configuration>"), encoding="utf-8")
    chosen = ("--sumocfg", str(config), "--ego", "veh18", "--visibility", "120", "--out", str(tmp_path / "out"))
    done = command("run", *chosen, *SMALL[:4], *RARE, "--set", "duration_s=600", "--no-video", "--no-report")
    assert done.returncode == 0, done.stderr
    assert "ended: arrived" in done.stdout
    assert [line.split("=")[0] for line in done.stderr.splitlines() if line.startswith("warning:")] == [
        f"warning: {config}: remote-port",
        f"warning: {config}: random",
    ]
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["scenario"]["traffic"]["config"] == "mine.sumocfg"
    speed = parquet.read_table(tmp_path / "out" / "steps.parquet").column("speed_mps").to_numpy()
    assert speed.min() < 0.1  # red lights
    assert speed.max() > 10.0


def test_list_names_scenarios_and_methods_also_those_of_installed_packages(
    tmp_path: Path, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    info = tmp_path / "road_fade-0.1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: road-fade\nVersion: 0.1.0\n")
    (info / "entry_points.txt").write_text("[fogsim.estimators]\nroad_fade = road_fade:RoadFade\n")
    monkeypatch.syspath_prepend(tmp_path)
    done = command("list")
    assert done.returncode == 0, done.stderr
    assert "scatterometer, road_fade" in done.stdout
    for name in ("motorway_fog_bank", "negru2013", "grid_filter", "stopping_sight_distance", "fog_lamp_rules"):
        assert name in done.stdout
    marked = {line.split()[0]: line.split()[1] for line in done.stdout.splitlines() if len(line.split()) > 1}
    assert (marked["rising_sun"], marked["graded_motorway"]) == ("test", "A")


def test_signs_are_written_as_geojson(tmp_path: Path, command: Command) -> None:
    out = tmp_path / "new" / "signs.geojson"
    done = command("signs", "motorway_fog_bank", "--out", str(out))
    assert done.returncode == 0, done.stderr
    assert "9 signs" in done.stdout
    content = json.loads(out.read_text(encoding="utf-8"))
    assert [f["properties"]["kind"] for f in content["features"]] == ["speed_limit"] * 9
    assert 110 in [round(f["properties"]["speed_limit_kmh"]) for f in content["features"]]


def test_doctor_finds_everything_here(command: Command) -> None:
    done = command("doctor")
    assert done.returncode == 0, done.stdout
    assert "OpenGL (EGL)" in done.stdout
    assert all(line.startswith("fine ") for line in done.stdout.splitlines())
    assert "…" not in done.stdout


@pytest.mark.parametrize("module", ["imageio_ffmpeg", "pyarrow"])
def test_doctor_reports_a_library_that_cannot_be_imported(module: str) -> None:
    code = f"import sys; sys.modules[{module!r}] = None; from fogsim.cli.doctor import examine; print(*examine())"
    done = run_python("-c", code)
    assert f"import of {module} halted" in done.stdout, done.stderr


def test_version_and_help(command: Command) -> None:
    assert command("--version").stdout.startswith("fogsim ")
    assert "KEY.PATH=VALUE" in command("run", "--help").stdout
    # Rich would read words in square brackets, such as units, as markup, and drop them.
    commands = typer.main.get_command(app).commands.values()  # type: ignore[attr-defined]  # a group has commands
    texts = [getattr(option, "help", None) or "" for one in commands for option in one.params]
    assert len(texts) > 100
    assert [text for text in texts if "[" in text] == []


def test_the_command_line_starts_without_what_only_its_commands_need() -> None:
    code = "import sys, fogsim.cli.app\nprint({'numpy', 'numba', 'cv2', 'pyarrow', 'matplotlib'} & {*sys.modules})"
    done = run_python("-c", code)
    assert done.stdout.strip() == "set()"
