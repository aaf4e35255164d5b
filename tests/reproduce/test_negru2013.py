"""negru2013's evaluation on our frames, and what the command says of it."""

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fogsim.calibration.staged_road import foggy_image, views
from fogsim.errors import InputError
from fogsim.reproduce import REPRODUCTIONS, Reproduction
from fogsim.reproduce.negru2013 import CAMERA, EXTINCTIONS, SCENES, reproduce
from fogsim.reproduce.road_sweeps import SETTINGS
from tests.helpers.command import Command


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


def test_the_corrected_method_is_near_the_truth_wherever_it_tells(done) -> None:
    told = [record for record in done.records if record["corrected_visibility_m"] is not None]
    assert len(told) >= 0.9 * len(done.records)
    errors = np.abs([record["corrected_visibility_m"] / record["visibility_m"] - 1.0 for record in told])
    assert np.median(errors) < 0.025
    assert np.max(errors) < 0.1


def test_as_published_every_image_has_an_answer_and_some_are_far_off(done) -> None:
    found = [record["published_visibility_m"] for record in done.records]
    assert None not in found
    errors = np.abs([v / record["visibility_m"] - 1.0 for v, record in zip(found, done.records, strict=True)])
    assert np.median(errors) < 0.15
    # The row of least error need not be the inflection; nothing refuses its model.
    assert np.max(errors) > 0.5


def test_the_papers_times_are_compared_at_both_sizes(done) -> None:
    assert [(cell.paper, cell.row) for cell in done.cells] == [
        (21.0, "frame of 688×515 px"),
        (12.0, "frame of 512×383 px"),
    ]
    assert all(0.1 < cell.corrected < 1000.0 and 0.1 < cell.as_published < 1000.0 for cell in done.cells)


def test_one_figure_of_the_paper_needs_no_sweeps(done) -> None:
    alone = reproduce(table="figure 4")
    assert alone.records == done.records
    assert len(alone.all_tables) == 1
    with pytest.raises(InputError, match="unknown table '4'; known: figure 4"):
        reproduce(table="4")


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
def reproduced(command: Command, monkeypatch, done) -> Command:
    """Run the command in this process, the evaluation itself being done."""
    monkeypatch.setattr(REPRODUCTIONS, "_entries", {"negru2013": lambda **_: done})
    return partial(command, "reproduce")


def test_the_command_prints_a_table_and_writes_a_picture(reproduced, tmp_path: Path) -> None:
    code, out, _ = reproduced("all", "--out", str(tmp_path / "new"))
    assert code == 0
    assert "empty road" in out
    assert "2 published figures" in out
    with Image.open(tmp_path / "new" / "negru2013.png") as picture:
        assert picture.size == (3 * 688, 515)


def test_the_command_prints_records(reproduced, done) -> None:
    code, out, _ = reproduced("negru2013", "--json")
    assert code == 0
    lines = [json.loads(line) for line in out.splitlines()]
    assert [line["figure"] for line in lines if line.get("table") == "cells"] == [21.0, 12.0]
    assert lines[len(done.cells) :] == [dict(record) for record in (*done.records, *done.sweeps)]


def test_unknown_papers_answer_with_the_nearest(reproduced) -> None:
    code, _, err = reproduced("negru2031")
    assert code == 2
    assert "did you mean 'negru2013'" in err


def test_a_table_is_one_papers(reproduced) -> None:
    code, _, err = reproduced("all", "--table", "2")
    assert code == 2
    assert "--table 2 needs one paper, not all" in err
