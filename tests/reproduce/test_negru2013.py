"""negru2013's evaluation on our frames, and what the command says of it."""

import json
import math
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fogsim.calibration.staged_road import foggy_image, views
from fogsim.cli import app
from fogsim.reproduce import REPRODUCTIONS, Reproduction
from fogsim.reproduce.negru2013 import CAMERA, EXTINCTIONS, SCENES, reproduce
from fogsim.reproduce.road_sweeps import SETTINGS


@pytest.fixture(scope="module")
def done() -> Reproduction:
    told = []
    done = reproduce(1, watch=lambda step, total: told.append((step, total)))
    steps = len(SCENES) * len(EXTINCTIONS) + len(SETTINGS)
    assert told == [(step, steps) for step in range(steps + 1)]
    return done


def test_every_scene_and_density_of_the_paper_is_there(done) -> None:
    cases = [(record["scene"], record["extinction_per_m"]) for record in done.records]
    assert cases == [(scene, k) for scene in SCENES for k in EXTINCTIONS]
    assert (EXTINCTIONS[0], EXTINCTIONS[-1]) == (0.01, 0.15)
    assert len(done.table) == len(done.records) + 1
    assert {len(row) for row in done.table} == {len(done.table[0])}
    assert done.picture.shape == (515, 3 * 688, 3)


def test_truth_is_koschmieders(done) -> None:
    for record in done.records:
        assert record["visibility_m"] == pytest.approx(math.log(20.0) / record["extinction_per_m"])


def test_the_corrected_method_is_near_the_truth_wherever_it_tells(done) -> None:
    told = [record for record in done.records if record["corrected_visibility_m"] is not None]
    assert len(told) >= 0.9 * len(done.records)
    errors = np.abs([record["corrected_visibility_m"] / record["visibility_m"] - 1.0 for record in told])
    assert np.median(errors) < 0.025
    assert np.max(errors) < 0.1


def test_the_published_method_is_worse_but_no_nonsense(done) -> None:
    told = [record for record in done.records if record["published_visibility_m"] is not None]
    assert len(told) >= 0.8 * len(done.records)
    errors = np.abs([record["published_visibility_m"] / record["visibility_m"] - 1.0 for record in told])
    assert np.median(errors) < 0.10
    # One row is at most some 20 % of V here: k λ / 2 is 4.6 px at 300 m and 91 px at 20 m.
    assert np.max(errors) < 0.35


def test_the_airlight_fills_the_pixels_and_nothing_stands_on_the_empty_road() -> None:
    with views(CAMERA, (), trees=False) as (view, pose):
        image = foggy_image(view, pose, CAMERA, 0.05)
        above = slice(round(CAMERA.horizon_row) - 3)
        assert np.all(image[above] == 255)
        assert np.all(view.instance[above] == 0)
    with views(CAMERA, SCENES["trees and vehicles"][1], trees=True) as (view, _):
        assert {16, 17} <= set(np.unique(view.instance))
        assert np.any(view.instance[above] == 3)


@pytest.fixture
def command(monkeypatch, capsys, done):
    """Run the command in this process, the evaluation itself being done: exit code, stdout and stderr."""
    monkeypatch.setattr(REPRODUCTIONS, "_entries", {"negru2013": lambda **_: done})
    monkeypatch.setenv("COLUMNS", "200")

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["fogsim", "reproduce", *arguments])
        with pytest.raises(SystemExit) as ended:
            app.main()
        told = capsys.readouterr()
        return int(ended.value.code or 0), told.out, told.err

    return run


def test_the_command_prints_a_table_and_writes_a_picture(command, tmp_path: Path) -> None:
    code, out, _ = command("all", "--out", str(tmp_path / "new"))
    assert code == 0
    assert "empty road" in out
    assert "21 ms in the paper" in out
    with Image.open(tmp_path / "new" / "negru2013.png") as picture:
        assert picture.size == (3 * 688, 515)


def test_the_command_prints_records(command, done) -> None:
    code, out, _ = command("negru2013", "--json")
    assert code == 0
    assert [json.loads(line) for line in out.splitlines()] == [dict(record) for record in (*done.records, *done.sweeps)]


def test_unknown_papers_answer_with_the_nearest(command) -> None:
    code, _, err = command("negru2031")
    assert code == 2
    assert "did you mean 'negru2013'" in err
