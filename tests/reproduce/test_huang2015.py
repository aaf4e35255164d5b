"""huang2015's evaluation on our frames, in a part that is quick."""

import math

import numpy as np
import pytest

from fogsim.calibration.staged_road import road_renderer
from fogsim.cli import reproduce as reproduce_module
from fogsim.estimators.huang2015_ratios import image_confidence
from fogsim.reproduce import REPRODUCTIONS, Reproduction
from fogsim.reproduce import huang2015_published as published
from fogsim.reproduce.huang2015 import reproduce
from fogsim.reproduce.huang2015_chase import Chase
from fogsim.reproduce.huang2015_plan import CAMERA, LAST, VARIANTS, VEHICLE, Case, Plan

PART = Plan(
    methods=(100.0, 500.0),
    ratios=(150.0,),
    tracks=(100.0,),
    references=(100.0,),
    intervals={5.0: (100.0,), 20.0: (100.0,)},
    starts=(25.0, 50.0),
    drives=1,
)


@pytest.fixture(scope="module")
def done() -> Reproduction:
    told = []
    done = reproduce(PART, watch=lambda step, total: told.append((step, total)))
    assert told == [(step, told[0][1]) for step in range(told[0][1] + 1)]
    return done


def found(done: Reproduction, table: str, variant: str, **more) -> list[dict]:
    wanted = {"table": table, "variant": variant, **more}
    return [dict(r) for r in done.records if all(r[key] == value for key, value in wanted.items())]


def test_all_of_the_thesis_is_run_unless_told_otherwise() -> None:
    plan = Plan()
    assert "huang2015" in REPRODUCTIONS
    assert plan.methods == (50.0, 100.0, 200.0, 350.0, 400.0, 500.0)
    assert plan.starts == (25.0, 30.0, 35.0, 40.0, 50.0, 60.0, 70.0)
    assert list(plan.intervals) == [1.25, 2.5, 3.75, 5.0, 7.5, 10.0, 15.0, 20.0, 30.0, 40.0]
    assert Case(100.0, "published").frames == [25.0 + 5.0 * i for i in range(14)]
    assert Case(100.0, "published", 1.25).frames[1] == 26.25
    assert Case(100.0, "published", back=True).frames[0] == LAST


def test_printed_first_estimates_are_ten_to_twenty_rows_low_with_the_camera_of_eq_4_11() -> None:
    off = [
        1.5 * CAMERA.row_distance * (1.0 / first - 1.0 / true)
        for true, (first, _) in published.TABLE_4_1.items()
        if isinstance(first, float)
    ]
    assert [round(rows) for rows in off] == [15, 11, 18, 20, 12]


def test_the_six_tables_stand_beside_the_thesis(done) -> None:
    numbers = [table.title.split()[1].strip(":,") for table in done.all_tables]
    assert numbers[:6] == ["4.1", "4.2", "4.3", "5.1", "5.2", "5.3"]
    assert [table.title.split(" of ")[0] for table in done.all_tables[6:]] == ["Sweeps", "Repairs"]
    for table in done.all_tables:
        assert {len(row) for row in table.rows} == {len(table.rows[0])}
    assert done.all_tables[2].rows[1][:2] == ("100", "95")
    assert done.all_tables[1].rows[1][2].startswith("84.9 | ")
    assert done.table == done.all_tables[0].rows


def test_corrected_reaches_the_truth_where_published_does_not(done) -> None:
    corrected = [r for t in ("4.1", "4.3", "5.2", "5.3") for r in found(done, t, "corrected")]
    errors = np.abs([r["found_m"] / r["visibility_m"] - 1.0 for r in corrected])
    assert np.median(errors) < 0.02
    assert np.max(errors) < 0.06
    published = [abs(r["found_m"] / r["visibility_m"] - 1.0) for r in found(done, "4.3", "published", way="noisy")]
    assert np.max(published) > np.max(errors)


def test_as_published_is_about_as_near_as_the_thesis(done) -> None:
    (mid,) = found(done, "4.3", "published", way="away", visibility_m=100.0)
    assert mid["thesis_m"] == 95.0
    assert mid["found_m"] == pytest.approx(100.0, rel=0.3)


def test_a_longer_track_is_surer(done) -> None:
    (short,) = found(done, "5.1", "corrected", track_share=0.2)
    (long,) = found(done, "5.1", "corrected", track_share=0.6)
    assert short["deviation_rel"] > long["deviation_rel"] > 0.0
    assert [row[1].split(" | ")[0] for row in done.all_tables[3].rows[1:3]] == ["106", "99"]


def test_the_picture_shows_patches_and_curves(done) -> None:
    rows, cols, channels = done.picture.shape
    assert (cols, channels) == (1280, 3)
    assert rows > 400
    assert np.ptp(done.picture[: rows // 3]) > 150


def test_confidence_is_of_the_estimate() -> None:
    k = math.log(20.0) / 150.0
    assert image_confidence(k, np.array([0.0, 150.0])) == pytest.approx([1.0, 1.0 / 400.0])


def test_the_chase_shows_each_range_once_in_every_fog_wanted() -> None:
    chase = Chase(CAMERA, VEHICLE, range_deviation=0.0)
    with road_renderer() as renderer:
        seen = list(chase.seen(renderer, {25.0: (100.0, 500.0), 30.0: (100.0,)}, np.random.default_rng(0)))
    assert [(ahead, list(views)) for ahead, views in seen] == [(25.0, [100.0, 500.0]), (30.0, [100.0])]
    dense, thin = seen[0][1].values()
    foot = round(CAMERA.horizon_row + CAMERA.row_distance / 25.0)
    body = (slice(foot - 200, foot - 100), slice(300, 500))
    assert dense.image[body].mean() > thin.image[body].mean() + 20.0
    assert dense.lead.distance == 25.0
    assert seen[1][1][100.0].time == 1.0


def test_the_command_prints_all_tables(done, capsys, monkeypatch) -> None:
    monkeypatch.setattr(reproduce_module.stdout, "_width", 200)
    reproduce_module._show(done, as_json=False)
    told = capsys.readouterr().out
    for table in done.all_tables:
        assert table.title in told
    assert set(VARIANTS) == {r["variant"] for r in done.records}
