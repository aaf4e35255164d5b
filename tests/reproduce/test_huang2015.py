"""huang2015's evaluation on our frames, in a part that is quick."""

import math

import numpy as np
import pytest

from fogsim.calibration.staged_road import road_renderer
from fogsim.errors import UnknownNameError
from fogsim.reproduce import Reproduction
from fogsim.reproduce.huang2015 import CAMERA, SAMPLES, VEHICLE, reproduce
from fogsim.reproduce.huang2015_chase import Chase
from fogsim.reproduce.huang2015_figures import LAST, TABLES, Case, figures, wanted_cases


@pytest.fixture(scope="module")
def done() -> Reproduction:
    steps = []
    done = reproduce(table="4.2", watch=lambda step, total: steps.append((step, total)))
    assert steps == [(step, steps[0][1]) for step in range(steps[0][1] + 1)]
    return done


def test_table_5_1_is_followed_as_far_as_its_longest_track() -> None:
    cases = wanted_cases(figures(TABLES), [])
    assert cases[Case(500.0)] == 275.0
    assert len([f for f in figures(["5.1"]) if math.isfinite(f.paper)]) == 24
    assert Case(100.0).frames() == [25.0 + 5.0 * i for i in range(14)]
    assert Case(100.0, 1.25).frames()[1] == 26.25
    assert Case(100.0, back=True).frames()[0] == LAST


def test_one_table_runs_alone_and_an_unknown_one_is_refused() -> None:
    assert {case.interval for case in wanted_cases(figures(["5.3"]), [])} == {5.0}
    with pytest.raises(UnknownNameError, match=r"4\.4"):
        reproduce(table="4.4")


def test_ratios_of_table_4_2_are_the_law_s(done) -> None:
    # Without noise, rounding of flat paint to 8 bits is left.
    assert len(done.cells) == 10
    for cell in done.cells:
        law = 100.0 * 20.0 ** (-2.0 * float(cell.row.split()[0]) / 150.0)
        assert cell.as_published == pytest.approx(law, rel=0.05)
        assert cell.corrected == pytest.approx(law, rel=0.01)


def test_records_hold_truth_estimate_and_deviation(done) -> None:
    for record in done.records:
        assert record["found_m"] == pytest.approx(record["visibility_m"], rel=0.1)
        assert 0.0 < record["deviation_rel"] < 0.3


def test_the_picture_shows_patches_and_curves(done) -> None:
    rows, cols, channels = done.picture.shape
    assert (cols, channels) == (1280, 3)
    assert rows > 400
    assert np.ptp(done.picture[: rows // 3]) > 150


def test_the_chase_shows_each_range_once_in_every_fog_wanted() -> None:
    chase = Chase(CAMERA, VEHICLE, range_deviation=0.0, samples=SAMPLES)
    with road_renderer() as renderer:
        seen = list(chase.seen(renderer, {25.0: (100.0, 500.0), 30.0: (100.0,)}, np.random.default_rng(0)))
    assert [(ahead, list(views)) for ahead, views in seen] == [(25.0, [100.0, 500.0]), (30.0, [100.0])]
    dense, thin = seen[0][1].values()
    foot = round(CAMERA.horizon_row + CAMERA.row_distance / 25.0)
    body = (slice(foot - 200, foot - 100), slice(300, 500))
    assert dense.image.shape == (600, 800, 3)
    assert dense.image[body].mean() > thin.image[body].mean() + 20.0
    assert dense.lead.distance == 25.0
    assert seen[1][1][100.0].time == 1.0
