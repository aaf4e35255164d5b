"""Methods in two fogs: that of Koschmieder they read, that of photons over dark land they read too long."""

import pytest

from fogsim.reproduce import Reproduction
from fogsim.reproduce.airlight import CHASE_METHODS, ROAD_METHODS, Plan, reproduce

PLAN = Plan(albedos=(None, 0.1, 0.8), visibilities=(100.0,), heights=(1.3,), drives=1)


@pytest.fixture(scope="module")
def done() -> Reproduction:
    told = []
    done = reproduce(PLAN, watch=lambda step, total: told.append((step, total)))
    assert told == [(0, 2), (1, 2), (2, 2)]
    return done


def read(done: Reproduction, method: str, albedo: float | None) -> float | None:
    found = [one["read_m"] for one in done.records if (one["method"], one["ground_albedo"]) == (method, albedo)]
    assert len(found) == 1
    return found[0]


@pytest.mark.parametrize("method", [*ROAD_METHODS, *CHASE_METHODS])
def test_in_koschmieders_fog_and_over_snow_methods_read_what_there_is(done: Reproduction, method: str) -> None:
    assert read(done, method, None) == pytest.approx(100.0, rel=0.06)
    assert read(done, method, 0.8) == pytest.approx(100.0, rel=0.13)


@pytest.mark.parametrize("method", ROAD_METHODS[:-2])
def test_over_dark_land_published_methods_read_too_long(done: Reproduction, method: str) -> None:
    told = read(done, method, 0.1)
    assert told > 120.0


def test_over_dark_land_the_joint_fit_with_even_airlight_reads_too_long_or_says_nothing(done: Reproduction) -> None:
    told = read(done, ROAD_METHODS[-2], 0.1)
    assert told is None or told > 120.0


@pytest.mark.parametrize("method", ["joint_road", *CHASE_METHODS])
def test_over_dark_land_those_that_reckon_with_it_do_not(done: Reproduction, method: str) -> None:
    assert read(done, method, 0.1) == pytest.approx(100.0, rel=0.15)


def test_contrast_of_the_vehicle_ahead_is_taken_to_the_airlight_of_its_rows_over_snow_too(done: Reproduction) -> None:
    found = [one for one in done.records if (one["method"], one["ground_albedo"]) == (CHASE_METHODS[0], 0.8)]
    assert found[0]["bias_pct"] == pytest.approx(0.0, abs=4.0)
    assert found[0]["interval_coverage"] == 1.0


def test_the_table_has_a_row_for_each_method_and_fog(done: Reproduction) -> None:
    heading, *rows = done.table
    assert heading == ("method", "fog", "100 m")
    assert len(rows) == 3 * (len(ROAD_METHODS) + len(CHASE_METHODS))
    assert done.picture.shape[2] == 3
