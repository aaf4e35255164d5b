"""What a reader of the pages has at hand: a SUMO simulation, photographs, a video, a scenario and a camera file."""

import functools
import json
import re
import shlex
import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import sumo
from early_motorway import ROUTES
from flat_road import Road, photograph, scan
from PIL import Image

from fogsim.offline.camera_file import load_calibration
from fogsim.recorders.video import Encoder, encoder_command
from fogsim.scenario import catalogue
from tests.helpers.camera_files import camera_yaml
from tests.helpers.command import run_python

CHECKOUT = Path(__file__).resolve().parents[2]
TUTORIALS = sorted((CHECKOUT / "docs" / "tutorial").glob("*.md"))
PLUGIN = (CHECKOUT / "docs" / "how_to" / "plugin.md").read_text(encoding="utf-8")
CONTROLLER = (CHECKOUT / "docs" / "how_to" / "own_controller.md").read_text(encoding="utf-8")
SCENARIOS = (CHECKOUT / "docs" / "reference" / "scenarios.md").read_text(encoding="utf-8")
VISIBILITY, SAMPLES = 80.0, 2

TRIPS = """<routes>
    <trip id="veh17" depart="0" departPos="50" from="B0A0" to="B0A0"/>
    <trip id="veh18" depart="1" departPos="20" from="B0A0" to="B0A0" departSpeed="8"/>
</routes>
"""
CAMERA = camera_yaml((640, 480), 576.9, None, 1.38, 2.0)

Run = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder of the user's, with my/town.sumocfg."""
    shutil.copytree(CHECKOUT / "tests" / "data" / "grid", tmp_path / "my")
    (tmp_path / "my" / "grid.sumocfg").rename(tmp_path / "my" / "town.sumocfg")
    (tmp_path / "my" / "grid.trips.xml").write_text(TRIPS, encoding="utf-8")
    return tmp_path


@pytest.fixture
def python(folder: Path) -> Run:
    """Run Python code as a script of the user's, in that folder."""

    return functools.partial(run_python, "-c", cwd=folder, environment={"COLUMNS": "200", "NO_COLOR": "1"}, check=False)


@pytest.fixture
def early_motorway(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Copy of the file of the scenario motorway_fog_bank, in a folder where it begins early."""
    file = catalogue()["motorway_fog_bank"]
    folder = Path(shutil.copytree(file.parent, tmp_path_factory.mktemp("scenarios") / file.parent.name))
    shutil.copy(ROUTES, folder / "motorway.rou.xml")
    return folder / file.name


@pytest.fixture
def readers_folder(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Makes a folder with what the text of a page speaks of."""

    def make(page: str) -> Path:
        made = shutil.copytree(folder, tmp_path_factory.mktemp("reader") / "home")
        if "camera.yaml" in page:
            (calibration,) = re.findall(r"```yaml\n(width: .*?)```", page, re.DOTALL) or (CAMERA,)
            put_pictures(made, calibration)
        if "scenarios/studies/" in page:
            shutil.copytree(CHECKOUT / "scenarios", made / "scenarios")
        put_printed(made, page)
        if "tests/data/openscenario" in page:
            shutil.copytree(CHECKOUT / "tests" / "data" / "openscenario", made / "tests" / "data" / "openscenario")
        if "network.onnx" in page:
            shutil.copy(CHECKOUT / "tests" / "data" / "mean_network.onnx", made / "network.onnx")
        if "my/scenario.yaml" in page:
            put_scenario(made)
        return made

    return make


def put_printed(folder: Path, page: str) -> None:
    """Put files into a folder that a page prints; of those that it only names, the tutorials print one."""
    tutorials = "".join(one.read_text(encoding="utf-8") for one in TUTORIALS)
    for name in ("policies.yaml", "truck.fog.yaml", "own_brake.fog.yaml", "brakes.fog.yaml"):
        blocks = rf"```yaml\n(# [\w/]*{re.escape(name)}\n.*?)```"
        if name in page:
            for text in re.findall(blocks, page, re.DOTALL) or re.findall(blocks, tutorials, re.DOTALL)[:1]:
                (folder / text.split()[1]).write_text(text, encoding="utf-8")
    if "mine:EmergencyBrake" in page:
        (module,) = re.findall(r"```python\n(# mine.py\n.*?)```", CONTROLLER, re.DOTALL)
        (folder / "mine.py").write_text(module, encoding="utf-8")


def put_pictures(folder: Path, calibration: str) -> None:
    """Put camera.yaml and what that camera sees in fog into a folder: photographs, a depth map, a video."""
    (folder / "camera.yaml").write_text(calibration, encoding="utf-8")
    camera = load_calibration(folder / "camera.yaml").camera
    road = Road(VISIBILITY, camera=camera)
    luminance, length = scan(road, 1, SAMPLES)
    image = np.repeat(photograph(road, (luminance, length), 1)[..., None], 3, axis=2)
    (folder / "drive").mkdir()
    for name in ("photo.png", "photo.jpg", "day.png", "drive/0001.png", "drive/0002.png"):
        Image.fromarray(image).save(folder / name)
    np.save(folder / "depth.npy", np.minimum(length[::SAMPLES, ::SAMPLES], 1e4).astype(np.float32))
    for name in ("drive.mp4", "video.mp4"):
        encoder = Encoder(encoder_command(folder / name, 0.1, (camera.width, camera.height)))
        encoder.write(image.tobytes())
        encoder.finish()
    put_map(folder)


def put_map(folder: Path) -> None:
    """Put map.geojson with a sign, and drive.gpx that leads past it, into a folder."""
    place = {"type": "Point", "coordinates": [24.9, 60.2005]}
    signs = [{"type": "Feature", "geometry": place, "properties": {"kind": "stop"}}]
    (folder / "map.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": signs}), encoding="utf-8")
    points = [
        f'<trkpt lat="{60.2 + 1e-4 * second}" lon="24.9"><time>2026-05-04T07:08:0{second}Z</time></trkpt>'
        for second in range(9)
    ]
    (folder / "drive.gpx").write_text(f"<gpx><trk><trkseg>{''.join(points)}</trkseg></trk></gpx>", encoding="utf-8")


def put_scenario(folder: Path) -> None:
    """Put my/scenario.yaml, as the page on scenario files prints it, into a folder."""
    (text,) = re.findall(r"```yaml\n(name: .*?)```", SCENARIOS, re.DOTALL)
    (folder / "my" / "scenario.yaml").write_text(text, encoding="utf-8")
    shutil.copy(folder / "my" / "grid.net.xml", folder / "my" / "my.net.xml")
    (folder / "my" / "my.rou.xml").write_text(TRIPS.replace("veh18", "ego"), encoding="utf-8")


@pytest.fixture
def listening(folder: Path, free_port: Callable[[], int]) -> Iterator[int]:
    """Port of the SUMO that the page on the plug-in lets the user start."""
    (line,) = re.findall(r"^    (sumo -c .*)$", PLUGIN, re.MULTILINE)
    port = free_port()
    arguments = shlex.split(line.replace("8813", str(port)))[1:]
    program = Path(sumo.SUMO_HOME, "bin", "sumo")
    with subprocess.Popen([program, *arguments], cwd=folder, stdout=subprocess.DEVNULL) as process:
        try:
            yield port
        finally:
            process.kill()
