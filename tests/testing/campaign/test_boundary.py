"""The boundary between pass and fail against a closed form."""

import math

import numpy as np
import pytest
from matplotlib.contour import ContourSet
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.optimize import approx_fprime
from scipy.special import ndtr

from fogsim.conditions import Finding, FindingVerdict
from fogsim.scenario.variation.levels import parse_space
from fogsim.testing.campaign import drawing_plan
from fogsim.testing.campaign.boundary import Boundary, _loss, fit_boundary
from fogsim.testing.campaign.drawing_plan import Draws, FailureRate, Findings, Purpose, Space, batches, number_of
from fogsim.testing.campaign.outputs import _draw_boundary, rate_text
from fogsim.testing.results import CaseResult

FOG = "fog"
AXES = {
    FOG: {"loguniform": ["20 m", "1000 m"]},
    "speed": {"uniform": ["50 km/h", "130 km/h"]},
    "reaction": {"uniform": ["0.5 s", "2 s"]},
    "braking": {"uniform": [3, 9]},
}


def stopping_distance(speed, reaction, braking):
    return speed / 3.6 * reaction + (speed / 3.6) ** 2 / (2.0 * braking)


def declared() -> Space:
    return Space(
        {name: axis for name, written in AXES.items() if isinstance(axis := parse_space(name, written), Draws)}
    )


class Run:
    def __init__(self, values) -> None:
        self.levels = {name: str(value) for name, value in values.items()}


def result(values, failed: bool, margin: float | None = None) -> CaseResult:
    verdict = FindingVerdict.FAILED if failed else FindingVerdict.PASSED
    finding = Finding("safe", "always", verdict, "", "", None, None, "", margin)
    return CaseResult(Run(values), None, (finding,))  # type: ignore[arg-type]


def searched(seed: int, budget: int = 200, margin: float | None = None) -> Findings:
    """What a campaign finds; all cases pass with a margin if there is one."""
    found = Findings()
    plan = batches(declared(), seed, budget, "sobol", found)
    batch = next(plan)
    try:
        while True:
            results = []
            for one in batch:
                fog, *others = (number_of(str(value)) for value in one.values.values())
                failed = margin is None and fog < stopping_distance(*others)
                results.append(result(one.values, failed, margin))
            batch = plan.send(results)
    except StopIteration:
        return found


def errors(boundary: Boundary) -> NDArray[np.float64]:
    """Errors along lines of the visibility, as shares of its logarithmic range."""
    space, steps = declared(), np.linspace(0.0, 1.0, 201)
    axis = space.axes[FOG]
    found = []
    for place in np.random.default_rng(7).random((300, 4)):
        values = [one.on_axis(x) for one, x in zip(space.axes.values(), place.tolist(), strict=True)]
        true = axis.place(stopping_distance(*values[1:]))
        if 0.0 < true < 1.0:
            line = np.repeat(place[None], len(steps), axis=0)
            line[:, 0] = steps
            passes = boundary.latent(line)[0] > 0.0
            found.append(abs((steps[passes.argmax()] if passes.any() else 1.0) - true))
    assert len(found) > 150
    return np.array(found)


@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in (2, 3))])
def test_200_runs_give_the_boundary_within_2_percent_at_the_worst_line(seed: int) -> None:
    found = searched(seed)
    assert len(found.results) == 200
    assert errors(found.boundary).max() < 0.02


def test_gradient_of_the_likelihood() -> None:
    places = np.random.default_rng(0).random((24, 2))
    signs = np.where(places.sum(axis=1) < 1.0, -1.0, 1.0)
    parameters = np.log([8.0, 0.6, 1.5])
    numeric = approx_fprime(parameters, lambda one: _loss(one, places, signs)[0], 1e-5)
    assert _loss(parameters, places, signs)[1] == pytest.approx(numeric, rel=1e-3, abs=1e-4)


def test_batches_depend_on_seed_and_results_alone() -> None:
    first, again, other = searched(1, 64), searched(1, 64), searched(2, 64)
    assert first.drawn == again.drawn != other.drawn
    assert math.isclose(sum(one.has_failed for one in first.results[32:]) / 32, 0.5, abs_tol=0.25)


@pytest.mark.parametrize("budget", [400, 401, 640])
def test_without_failures_half_of_the_cases_for_the_rate_remain_for_it(budget: int) -> None:
    found = searched(1, budget, margin=0.5)
    assert len(found.results) == budget
    for_rate = sum(one.purpose is Purpose.RATE for one in found.drawn)
    assert 2 * for_rate >= budget - 200
    assert rate_text(found) == f"no failure rate: too few cases failed: effectively 0 of {for_rate}"


def test_a_rate_that_plain_draws_contradict_is_not_given(monkeypatch: pytest.MonkeyPatch) -> None:
    """All plain draws pass here: 0 … 0.036 of the cases fail, with 90 %."""
    for low, high, is_given in ((0.01, 0.03, True), (0.1, 0.3, False)):
        rate = FailureRate(0.02, low, high, 100.0, 200)
        monkeypatch.setattr(drawing_plan, "failure_rate", lambda *_, rate=rate: rate)
        text = rate_text(searched(1, 400, margin=0.5))
        if is_given:
            assert "90 % interval: 0.01 … 0.036; 0.02 (0.01 … 0.03) if the search has found every kind" in text
            assert text.endswith("0 of 82 drawn from the distributions alone failed)")
        else:
            assert text.startswith(
                "no failure rate: the search gives 0.1 … 0.3, but cases drawn from the distributions"
            )


def test_dashed_lines_are_where_one_outcome_is_95_percent_certain() -> None:
    """Outcomes that also depend on noise: the latent function is known well, and each outcome is not."""
    space = Space({name: declared().axes[name] for name in (FOG, "speed")})
    generator = np.random.default_rng(3)
    places = generator.random((200, 2))
    boundary = fit_boundary(places, generator.random(200) < ndtr(3.0 - 6.0 * places[:, 0]))
    panel = Figure().subplots()
    middles = {name: axis.quantile(0.5) for name, axis in space.axes.items()}
    _draw_boundary(panel, space, boundary, middles, (FOG, "speed"))
    dashed = [line for line in panel.collections if isinstance(line, ContourSet) and not line.filled][1:]
    assert len(dashed) == 2
    for line, share in zip(dashed, (0.05, 0.95), strict=True):
        corners = np.vstack([path.vertices for path in line.get_paths()])
        on_axes = [[axis.place(v) for v in column] for axis, column in zip(space.axes.values(), corners.T, strict=True)]
        assert boundary.failure(np.array(on_axes).T) == pytest.approx(share, abs=0.01)
