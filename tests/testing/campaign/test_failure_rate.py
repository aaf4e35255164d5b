"""The failure rate by importance sampling against closed forms; plain Monte Carlo finds no failure at all."""

import numpy as np
import pytest
from scipy.stats import chi2, norm

from fogsim.testing.campaign.drawing_plan import (
    FailureRate,
    Findings,
    PlainRate,
    failure_rate,
    first_proposal,
    next_proposal,
)

RATE, RUNS, LEVEL = 1e-4, 2000, 250
DIRECTION = np.array([1.0, 0.6, -1.0, 0.4]) / np.linalg.norm([1.0, 0.6, -1.0, 0.4])

MARGINS = {
    "plane": lambda u: -norm.ppf(RATE) - u @ DIRECTION,
    "plane, alike beyond": lambda u: np.maximum(-norm.ppf(RATE) - u @ DIRECTION, -0.01),
    "sphere": lambda u: np.sqrt(chi2.isf(RATE, 4)) - np.linalg.norm(u, axis=1),
    "two sides": lambda u: -norm.ppf(RATE / 2) - np.abs(u @ DIRECTION),
}


def estimated(margin, seed: int) -> FailureRate:
    generator, proposal, used = np.random.default_rng(seed), first_proposal(4), 0
    while not proposal.is_final and used < RUNS // 2:
        places = proposal.draw(generator, LEVEL)
        proposal, used = next_proposal(proposal, places, margin(places)), used + LEVEL
    places = proposal.draw(generator, RUNS - used)
    return failure_rate(proposal, places, margin(places))


@pytest.mark.parametrize(
    "shape",
    [
        "plane, alike beyond",
        *(pytest.param(one, marks=pytest.mark.nightly) for one in ("plane", "sphere", "two sides")),
    ],
)
def test_a_rate_of_one_in_ten_thousand(shape: str) -> None:
    found = [estimated(MARGINS[shape], seed) for seed in range(100)]
    known = [one for one in found if one.is_known]
    assert len(known) >= 90, "elsewhere no rate is given"
    assert np.mean([RATE / 2 < one.rate < 2 * RATE for one in known]) >= 0.95
    assert np.mean([one.low <= RATE <= one.high for one in known]) >= 0.9


def test_the_interval_holds_where_a_second_kind_of_failure_is_missed() -> None:
    """No margin leads to the second kind, whose rate is three times that of the first."""
    across = np.array([0.6, -1.0, -0.4, 1.0])
    across -= (across @ DIRECTION) * DIRECTION
    aside = norm.isf(3.0 * RATE) * np.linalg.norm(across)
    generator, truth = np.random.default_rng(0), 4.0 * RATE - 3.0 * RATE**2

    def margin(places):
        return np.where(places @ across > aside, -1.0, np.maximum(MARGINS["plane"](places), -1.0))

    searched, stated = [], []
    for seed in range(40):
        rate, plain = estimated(margin, seed), margin(generator.standard_normal((250, 4)))
        found = Findings(rate=rate, plain=PlainRate(int((plain <= 0.0).sum()), len(plain)))
        if rate.is_known:
            searched.append(rate.low <= truth <= rate.high)
            stated.append(found.rate_interval[0] <= truth <= found.rate_interval[1])
    assert len(stated) >= 15
    assert np.mean(searched) <= 0.2
    assert np.mean(stated) >= 0.9


def test_without_failures_there_is_no_rate() -> None:
    found = estimated(lambda u: np.full(len(u), 1.0), 0)
    assert not found.is_known
    assert (found.rate, found.low, found.high) == (0.0, 0.0, 1.0)
