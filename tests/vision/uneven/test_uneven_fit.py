"""Fog that varies along the road, on strips drawn by Koschmieder's law with a known optical depth."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from fogsim.vision.lines.horizon import Horizon
from fogsim.vision.lines.road_course import RoadCourse, unseen_course
from fogsim.vision.lines.road_course_kernels import KNOTS, PIECES
from fogsim.vision.strips.course_geometry import course_geometry
from fogsim.vision.strips.joint_fit import fit_own
from fogsim.vision.strips.strip_curves import StripCurves
from fogsim.vision.uneven.fog_evidence import NODES, UNEVENNESS, fog_nodes
from fogsim.vision.uneven.hidden_course import HiddenCourse
from fogsim.vision.uneven.uneven_fit import fit_uneven
from fogsim.vision.uneven.uneven_kernels import depth_at, distance_at_depth, extinction_at
from tests.vision.strips import koschmieder_strips
from tests.vision.strips.koschmieder_strips import AIRLIGHT, CAMERA, GEOMETRY, NOISE, curves, fit_lanes

PRIOR = koschmieder_strips.PRIOR._replace(shift_deviation=0.2)
"""The road's lines tell the horizon; without them a bank may be a horizon that lies lower."""

UNSEEN = unseen_course(CAMERA, Horizon(CAMERA.horizon_row, 0.2))
LEVEL = replace(UNSEEN, ahead=UNSEEN.ahead._replace(covariance=np.diag([0.04, *np.full(PIECES, 1e-16)])))
"""Lines that nobody sees, and lines that show the road to be level as far as it is seen."""

Depth = Callable[[np.ndarray], np.ndarray]


def drawn(depth: Depth, seed: int = 0, road: float = 60.0) -> StripCurves:
    """Strips of even albedo behind fog of a given optical depth over the path."""
    rng = np.random.default_rng(seed)
    steps = (np.arange(400) + 0.5) / 200.0 - 1.0
    rows = (GEOMETRY.below + GEOMETRY.half * steps[:, None])[:, None, :]
    path = GEOMETRY.path / np.maximum(rows, 1e-9)
    share = np.where(rows > 0, np.exp(-depth(path)), 0.0).mean(axis=0)
    seen = AIRLIGHT + (road - AIRLIGHT) * share
    variance = np.full(seen.shape, NOISE**2)
    return StripCurves(seen + rng.normal(0.0, NOISE, seen.shape), variance, np.full(seen.shape, 2.0))


def bank(start: float, clear: float = 0.0015, dense: float = 0.05, edge: float = 40.0) -> Depth:
    """A bank that is half as dense as inside at a distance."""

    def depth(path: np.ndarray) -> np.ndarray:
        inside = np.clip(path - start + 0.5 * edge, 0.0, edge)
        return clear * path + (dense - clear) * (0.5 * inside**2 / edge + np.maximum(path - start - 0.5 * edge, 0.0))

    return depth


def fitted(seen: StripCurves, course: RoadCourse = LEVEL):
    own, even = fit_own(seen, GEOMETRY, (PRIOR,)), fit_lanes(seen, GEOMETRY, (PRIOR,))
    return fit_uneven(seen, GEOMETRY, PRIOR, own, even, HiddenCourse(GEOMETRY, CAMERA, course))


@pytest.mark.parametrize("extinction", [0.002, 0.01, 0.03, 0.06])
def test_even_fog_stays_what_it_is(extinction):
    for seed in range(4):
        seen = curves(extinction, seed)
        found = fitted(seen)
        assert found.even > 0.5
        assert found.denser is None
        assert found.fit.extinction == pytest.approx(fit_lanes(seen, GEOMETRY, (PRIOR,)).extinction, rel=0.05)


@pytest.mark.parametrize("start", [60.0, 90.0, 120.0])
def test_a_bank_ahead_is_found_where_it_begins(start):
    found = fitted(drawn(bank(start)))
    assert found.even < 0.1
    assert found.denser is not None
    assert found.denser[0] == pytest.approx(start, abs=0.25 * start)
    assert found.denser[2] > 0.02
    # Where 95 % of the light is lost, and the mean extinction up to there.
    sight = start + (np.log(20.0) - 0.0015 * start) / 0.05
    assert found.fit.extinction == pytest.approx(np.log(20.0) / sight, rel=0.12)
    # Nor is it a crest that lines do not show.
    unseen = fitted(drawn(bank(start)), UNSEEN)
    assert unseen.even < 0.1
    assert unseen.denser is not None


def test_the_optical_depth_is_that_of_the_fog_within_its_deviations():
    wavy = lambda path: 0.012 * path + 0.25 * (1.0 - np.cos(path / 25.0))  # noqa: E731 - a curve, named once
    off = []
    for seed in range(6):
        found = fitted(drawn(wavy, seed))
        told = found.depth < 2.5
        off += ((found.depth - wavy(found.distance)) / np.hypot(found.deviation, 0.05 * found.depth))[told].tolist()
    assert np.mean(np.abs(off) < 1.645) > 0.8


def over_a_sag(extinction: float, curvature: float, begins: float, seed: int) -> StripCurves:
    """Strips of a road that is level up to a distance, and sags from there on, in even fog."""
    sag = np.where(np.array(KNOTS[:-1]) >= begins, curvature, 0.0)
    laid = course_geometry(GEOMETRY, CAMERA, replace(UNSEEN, sag=sag))
    rng = np.random.default_rng(seed)
    seen = AIRLIGHT + (60.0 - AIRLIGHT) * np.exp(-extinction * laid.path / laid.below)
    variance = np.full(seen.shape, NOISE**2)
    return StripCurves(seen + rng.normal(0.0, NOISE, seen.shape), variance, np.full(seen.shape, 2.0))


@pytest.mark.parametrize(
    ("begins", "curvature"),
    [(40.0, 1.0 / 8800.0), (80.0, -1.0 / 13000.0), (120.0, 1.0 / 8800.0), (120.0, -1.0 / 13000.0)],
)
def test_a_sag_or_crest_that_lines_do_not_show_is_no_uneven_fog(begins, curvature):
    found = fitted(over_a_sag(0.015, curvature, begins, 1), UNSEEN)
    assert found.even > 0.9
    assert found.denser is None
    assert found.fit.extinction == pytest.approx(0.015, abs=2.5 * found.fit.extinction_deviation)
    assert found.fit.extinction_deviation < 0.1 * 0.015


def test_where_lines_show_a_level_road_no_sag_explains_what_is_seen():
    seen = over_a_sag(0.015, 1.0 / 4000.0, 40.0, 1)
    assert fitted(seen, UNSEEN).even > 0.9
    assert fitted(seen, LEVEL).even < 0.1


def test_neither_fog_that_thins_ahead_nor_an_obstacle_in_one_lane_is_a_bank():
    thins = lambda path: 0.03 * np.minimum(path, 50.0) + 0.004 * np.maximum(path - 50.0, 0.0)  # noqa: E731 - likewise
    found = fitted(drawn(thins))
    assert found.even < 0.1
    assert found.denser is None
    assert found.fit.extinction < 0.026
    seen = curves(0.002, 3)
    hidden = GEOMETRY.distance > 60.0
    seen.luminance[0, hidden] = 70.0 + 40.0 * (np.arange(hidden.sum()) % 3)
    assert fitted(seen).denser is None


def test_optical_depth_over_nodes_is_the_integral_of_straight_pieces():
    nodes, logs = np.array([0.0, 10.0, 30.0, 70.0]), np.log([0.01, 0.03, 0.02, 0.05])
    path = np.linspace(0.0, 100.0, 100_001)
    extinction = np.interp(path, nodes, np.exp(logs))
    depths = np.concatenate([[0.0], np.cumsum(0.5 * (extinction[1:] + extinction[:-1]) * np.diff(path))])
    for distance in (5.0, 10.0, 42.0, 70.0, 93.0):
        depth, gradient = depth_at(nodes, logs, distance)
        assert depth == pytest.approx(np.interp(distance, path, depths), rel=1e-6)
        assert distance_at_depth(nodes, logs, depth) == pytest.approx(distance, rel=1e-9)
        assert extinction_at(nodes, logs, distance) == pytest.approx(np.interp(distance, path, extinction), rel=1e-6)
        for node in range(4):
            step = np.where(np.arange(4) == node, 1e-6, 0.0)
            up, down = (depth_at(nodes, logs + sign * step, distance)[0] for sign in (1.0, -1.0))
            assert gradient[node] == pytest.approx((up - down) / 2e-6, abs=1e-6)


def test_the_prior_of_ln_k_is_a_covariance_that_forgets_with_distance():
    for deviation, length in UNEVENNESS:
        fog = fog_nodes(deviation, length, len(NODES))
        covariance = np.linalg.inv(fog.precision)
        assert np.linalg.slogdet(covariance)[1] == pytest.approx(fog.log_determinant, abs=1e-6)
        spread = np.sqrt(covariance[0, 0] - 2.0 * covariance[0, 1:] + np.diag(covariance)[1:])
        assert (np.diff(spread[:6]) > 0.0).all()
        assert spread.max() < 1.6 * deviation
