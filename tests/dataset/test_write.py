"""Data sets on disk: what they hold, that they can be continued, and what is refused."""

import functools
import hashlib
import json
import os
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from early_motorway import EARLY, ROUTES

import fogsim
from fogsim.dataset import read_png
from fogsim.dataset.directory import LAYERS, DatasetDirectory
from fogsim.dataset.write import identity, input_digests
from fogsim.errors import InputError
from fogsim.scenario import Scenario, scenario_from_config

PAGE = Path(__file__).resolve().parents[2] / "docs" / "how_to" / "dataset.md"
FRAMES, EVERY = 5, 2
"""A run of 0.5 s has the steps 0 … 5, of which 0, 2 and 4 are taken: the second run begins with frame 3."""


def small(*overrides: str) -> Scenario:
    settings = (EARLY, "camera.width=96", "camera.height=72", "duration_s=0.5", "fog.visibility_m=120", *overrides)
    return fogsim.load_scenario("motorway_fog_bank", settings)


def contents(directory: Path) -> dict[str, bytes]:
    return {p.relative_to(directory).as_posix(): p.read_bytes() for p in sorted(directory.rglob("*")) if p.is_file()}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("dataset") / "whole"
    done = fogsim.write_dataset(small(), out, FRAMES, seed=4, every=EVERY)
    assert (done.frames, done.written, done.complete, done.directory) == (FRAMES, FRAMES, True, out)
    return out


def test_every_file_is_there_and_of_one_size(whole: Path) -> None:
    names = set(contents(whole))
    expected = {f"{layer}/{n:06d}.png" for layer in LAYERS for n in range(FRAMES)}
    expected |= {f"records/{n:06d}.json" for n in range(FRAMES)} | {"annotations.json", "dataset.json"}
    assert names == expected
    types = dict.fromkeys(LAYERS, "uint16") | dict.fromkeys(("frames", "semantic", "sign_map", "signs"), "uint8")
    for layer in LAYERS:
        image = read_png(whole / layer / "000004.png")
        assert (image.shape[:2], str(image.dtype)) == ((72, 96), types[layer])


def test_frames_are_those_of_the_runs(whole: Path) -> None:
    steps = [s for seed in (4, 5) for s in fogsim.run(small(), seed) if s.index % EVERY == 0][:FRAMES]
    images = json.loads((whole / "annotations.json").read_text(encoding="utf-8"))["images"]
    assert [(i["seed"], i["step"]) for i in images] == [(4, 0), (4, 2), (4, 4), (5, 0), (5, 2)]
    for step, image in zip(steps, images, strict=True):
        assert np.array_equal(read_png(whole / image["file_name"]), step.observation.image)
        assert image["visibility_m"] == pytest.approx(120.0)
        assert image["speed_mps"] == step.observation.speed
        assert image["camera"]["told"]["focal_length_px"] == image["camera"]["true"]["focal_length_px"]


def test_the_coco_file_hangs_together(whole: Path) -> None:
    coco = json.loads((whole / "annotations.json").read_text(encoding="utf-8"))
    categories = {c["id"]: c["name"] for c in coco["categories"]}
    images = {i["id"]: i for i in coco["images"]}
    assert [a["id"] for a in coco["annotations"]] == list(range(1, len(coco["annotations"]) + 1))
    assert categories[5] == "car"
    assert coco["info"]["complete"] is True
    for annotation in coco["annotations"]:
        image = images[annotation["image_id"]]
        x, y, width, height = annotation["bbox"]
        assert 0 <= x < x + width <= image["width"]
        assert 0 <= y < y + height <= image["height"]
        mask = read_png(whole / image["instance_file"]) == annotation["instance"]
        assert mask.sum() == annotation["area"]
        assert np.all(read_png(whole / image["semantic_file"])[mask] == annotation["category_id"])


def test_an_interrupted_data_set_is_continued_to_the_same_bytes(whole: Path, tmp_path: Path) -> None:
    stop_after = 3

    def interrupt(frames: int) -> None:
        if frames == stop_after:
            raise KeyboardInterrupt

    first = fogsim.write_dataset(small(), tmp_path, FRAMES, seed=4, every=EVERY, watch=interrupt)
    assert (first.frames, first.written, first.complete) == (stop_after, stop_after, False)
    partial = json.loads((tmp_path / "annotations.json").read_text(encoding="utf-8"))
    assert (partial["info"]["complete"], len(partial["images"])) == (False, stop_after)
    second = fogsim.write_dataset(small(), tmp_path, FRAMES, seed=4, every=EVERY)
    assert (second.frames, second.written, second.complete) == (FRAMES, FRAMES - stop_after, True)
    assert contents(tmp_path) == contents(whole)


def test_what_was_lost_or_never_finished_is_made_again_and_more_can_be_had(whole: Path, tmp_path: Path) -> None:
    fogsim.write_dataset(small(), tmp_path, 4, seed=4, every=EVERY)
    (tmp_path / "depth" / "000001.png").unlink()
    (tmp_path / "records" / "000002.json").unlink()
    (tmp_path / "records" / "000000.json").write_text('{"image": {"run": ')
    (tmp_path / "frames" / "000003.png.part").write_bytes(b"torn")
    again = fogsim.write_dataset(small(), tmp_path, FRAMES, seed=np.int64(4), every=np.int64(EVERY))
    assert again.written == 4
    (tmp_path / "frames" / "000003.png.part").unlink()
    assert contents(tmp_path) == contents(whole)


def test_another_data_set_is_refused(whole: Path) -> None:
    before = contents(whole)
    with pytest.raises(InputError, match="holds another data set: seed is 4 there, and 5 was asked for"):
        fogsim.write_dataset(small(), whole, FRAMES, seed=5, every=EVERY)
    with pytest.raises(InputError, match=r"scenario\.fog\.visibility_m is 120\.0 there, and 90\.0 was asked for"):
        fogsim.write_dataset(small("fog.visibility_m=90"), whole, FRAMES, seed=4, every=EVERY)
    with pytest.raises(InputError, match="every is 2 there"):
        fogsim.write_dataset(small(), whole, FRAMES, seed=4)
    with pytest.raises(InputError, match="holds 5 frames already, more than the 3 asked for"):
        fogsim.write_dataset(small(), whole, 3, seed=4, every=EVERY)
    assert contents(whole) == before


def test_a_data_set_is_not_continued_with_other_inputs(tmp_path: Path) -> None:
    folder = Path(shutil.copytree(small().directory, tmp_path / "mine"))
    shutil.copy(ROUTES, folder / "motorway.rou.xml")
    settings = ("camera.width=96", "camera.height=72", "duration_s=0.5", "fog.visibility_m=120")
    load = functools.partial(fogsim.load_scenario, str(folder), settings)
    out = tmp_path / "data"
    assert [fogsim.write_dataset(load(), out, 2).written for _ in range(2)] == [2, 0]
    before = contents(out)
    (routes,) = (folder / path for path in load().traffic.routes)
    routes.write_text(routes.read_text(encoding="utf-8") + "<!-- changed -->", encoding="utf-8")
    with pytest.raises(InputError, match=rf"holds another data set: inputs\.{routes.name} is .* there"):
        fogsim.write_dataset(load(), out, 3)
    assert contents(out) == before


def test_a_data_set_without_frames_is_begun_again_with_mended_inputs(tmp_path: Path) -> None:
    mine = {"seed": 1}
    with DatasetDirectory(tmp_path, {"seed": 0}):
        pass
    with DatasetDirectory(tmp_path, mine):
        assert json.loads((tmp_path / "dataset.json").read_text(encoding="utf-8")) == mine
    (tmp_path / "frames" / "000000.png").touch()
    with pytest.raises(InputError, match="holds another data set: seed is 1 there"):
        DatasetDirectory(tmp_path, {"seed": 0})
    (tmp_path / "frames" / "000000.png").unlink()
    (tmp_path / "dataset.json").write_text('{"name": "of another tool"}', encoding="utf-8")
    with pytest.raises(InputError, match="holds another data set: name is "):
        DatasetDirectory(tmp_path, mine)
    assert "another tool" in (tmp_path / "dataset.json").read_text(encoding="utf-8")


def test_own_methods_are_part_of_the_identity(tmp_path: Path) -> None:
    folder = Path(shutil.copytree(small().directory, tmp_path / "mine"))
    method = folder / "own_lamps.py"
    found = []
    for lamps in range(2):
        method.write_text(f"class Lit:\n    def lamps(self, *_): return {lamps}\n", encoding="utf-8")
        scenario = fogsim.load_scenario(str(folder), ["lighting=own_lamps:Lit"])
        found.append(identity(scenario, 0, 1)["versions"]["own_lamps:Lit"])
    assert found[0] != found[1]


def test_inputs_of_one_name_in_several_folders_all_count(tmp_path: Path) -> None:
    grid = Path(__file__).resolve().parents[1] / "data" / "grid"
    folder = Path(shutil.copytree(grid, tmp_path / "grid"))
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "more.add.xml").write_text("<additional/>", encoding="utf-8")
    config = folder / "grid.sumocfg"
    more = f'<additional-files value="{tmp_path}/a/more.add.xml,{tmp_path}/b/more.add.xml"/>'
    config.write_text(config.read_text(encoding="utf-8").replace("</input>", f"{more}</input>"), encoding="utf-8")
    found = [input_digests(scenario_from_config(config, "veh18", ["fog.visibility_m=120"]))]
    for name in ("a", "b"):
        (tmp_path / name / "more.add.xml").write_text("<additional></additional>", encoding="utf-8")
        found.append(input_digests(scenario_from_config(config, "veh18", ["fog.visibility_m=120"])))
    assert len({digests["more.add.xml"] for digests in found}) == 3


def test_its_manifest_names_every_input_and_version(whole: Path) -> None:
    written = json.loads((whole / "dataset.json").read_text(encoding="utf-8"))
    scenario = small()
    files = [scenario.traffic.net, *scenario.traffic.routes, *scenario.traffic.additional]
    digests = {Path(f).name: hashlib.sha256((scenario.directory / str(f)).read_bytes()).hexdigest() for f in files}
    assert written["inputs"] == digests
    assert {"fogsim", "libsumo", "numpy", "python"} <= set(written["versions"])


def test_files_of_a_sumo_configuration_are_inputs() -> None:
    grid = Path(__file__).resolve().parents[1] / "data" / "grid"
    scenario = scenario_from_config(grid / "grid.sumocfg", "veh18", ["fog.visibility_m=120"])
    assert sorted(input_digests(scenario)) == ["grid.net.xml", "grid.sumocfg", "grid.trips.xml"]


@pytest.mark.parametrize("place", ["frames/000000.png", "records/000000.json", "annotations.json"])
def test_files_of_others_in_folders_of_these_names_are_not_replaced(tmp_path: Path, place: str) -> None:
    (tmp_path / place).parent.mkdir(exist_ok=True)
    (tmp_path / place).write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match="holds files that are no data set of FogSim's"):
        fogsim.write_dataset(small(), tmp_path, 1)
    assert contents(tmp_path) == {place: b"mine"}


def test_a_foreign_file_in_the_place_of_a_missing_frame_is_not_replaced(whole: Path, tmp_path: Path) -> None:
    out = Path(shutil.copytree(whole, tmp_path / "data"))
    (out / "depth" / "000005.png").write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match=r"depth/000005\.png is there and is not what this data set has there"):
        fogsim.write_dataset(small(), out, FRAMES + 1, seed=4, every=EVERY)
    assert (out / "depth" / "000005.png").read_text(encoding="utf-8") == "mine"


def test_a_data_set_has_one_writer(tmp_path: Path) -> None:
    with DatasetDirectory(tmp_path, {}), pytest.raises(InputError, match=f"process {os.getpid()} on .* is writing"):
        DatasetDirectory(tmp_path, {})
    DatasetDirectory(tmp_path, {}).close()


def test_foreign_files_and_impossible_numbers_are_refused(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match=r"no data set of FogSim's \(thesis\.tex"):
        fogsim.write_dataset(small(), tmp_path, 1)
    with pytest.raises(InputError, match=r"--out .*thesis\.tex is not a folder"):
        fogsim.write_dataset(small(), tmp_path / "thesis.tex", 1)
    for wrong in ({"frames": 0}, {"frames": 1, "every": 0}, {"frames": 1, "seed": -1}):
        with pytest.raises(InputError, match="must be a whole number ≥ "):
            fogsim.write_dataset(small(), tmp_path / "new", **wrong)
    assert not (tmp_path / "new").exists()
    assert (tmp_path / "thesis.tex").read_text(encoding="utf-8") == "mine"


@pytest.mark.nightly
def test_the_example_of_the_docs_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (example,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    names: dict[str, object] = {}
    exec(compile(example, str(PAGE), "exec"), names)  # noqa: S102 - the docs' own example
    written, distance = names["written"], names["distance"]
    # The fourth frame is the run's step 15, the last one of the loop its step 20.
    assert written.shape == distance.shape
    assert len(list((tmp_path / "small_frames" / "frames").iterdir())) == 4
