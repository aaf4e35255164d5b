"""How near the surrogate of camera and estimators of fogsim/FogAdvisoryFast-v2 comes to the real ones.

Episodes of fogsim/FogAdvisory-v2 are run with frames, half of them by the built-in rule, half without advice. Errors of
the first estimator that answers are compared with those that the surrogate draws for the same fog, light and times: by
the share of valid estimates, and by the largest distance between the two distributions of ln(estimated / true k)
(Kolmogorov-Smirnov), for each light and each class of visibility with 30 estimates or more.
"""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from harness import Row, lines_of, parse_options, publish
from numpy.typing import NDArray
from scipy.stats import ks_2samp, norm

from fogsim.simulation.advised_driving import AdvisedDriving
from fogsim.simulation.loop import ClosedLoop
from fogsim.units import visibility_from_extinction
from fogsim.values import Command, Estimate, Step
from fogsim_envs.task.observation import first_valid_estimate
from fogsim_envs.task.sampling import MOTORWAY_2, EpisodeChoice, EpisodeSource
from fogsim_envs.task.surrogate import (
    LIGHTS,
    MEASURED_2,
    EstimatorSurrogate,
    SurrogateTable,
    light_class,
    relative_extinction,
)

EDGES = (0.0, 30.0, 45.0, 65.0, 95.0, 140.0, 210.0, 330.0, 600.0, 1500.0, np.inf)
QUANTILES = 33
FEWEST = 30
SIZE = ("camera.width=160", "camera.height=120")


class Record(NamedTuple):
    """One estimate next to the truth."""

    extinction: float
    illuminance: float
    estimate: Estimate


@dataclass(frozen=True)
class Cell:
    """Estimates of one light and class of visibility."""

    valid: NDArray[np.bool_]
    after_valid: NDArray[np.bool_]
    zero: NDArray[np.bool_]
    error: NDArray[np.float64]
    deviation: NDArray[np.float64]
    none_deviation: NDArray[np.float64]


def episodes(number: int, split: str) -> Iterator[list[Record]]:
    """Run episodes with frames."""
    source, rng = EpisodeSource(None, None, None, SIZE, split, MOTORWAY_2), np.random.default_rng(0)
    for index in range(number):
        seed, drawn = source.draw(rng, EpisodeChoice())
        config = drawn.scenario.run_config()
        policy, light = AdvisedDriving(config.advice, config.periods.decision_frames), config.world.illuminance
        with ClosedLoop(config) as loop:
            step = loop.start(seed)
            run = [_record(step, light)]
            while step.ending is None:
                step = loop.advance(policy.decide(step) if index % 2 else Command())
                run.append(_record(step, light))
        yield run


def _record(step: Step, illuminance: float) -> Record:
    """The first valid estimate of a step, if there is one."""
    estimate = first_valid_estimate(step.estimates) or step.estimates[0]
    return Record(step.truth.extinction_ahead, illuminance, estimate)


def redrawn(runs: list[list[Record]], table: SurrogateTable) -> list[list[Record]]:
    """The same episodes as the surrogate would have them."""
    surrogate, drawn = EstimatorSurrogate(table), []
    for index, run in enumerate(runs):
        surrogate.reset(np.random.default_rng((1, index)))
        drawn.append([Record(k, light, surrogate.estimate(k, light)) for k, light, _ in run])
    return drawn


def cells(runs: list[list[Record]]) -> dict[tuple[int, int], Cell]:
    """Estimates by light and class of visibility."""
    found: dict[tuple[int, int], list[tuple[Record, bool]]] = {}
    for run in runs:
        for before, record in itertools.pairwise([run[0], *run]):
            column = int(np.searchsorted(EDGES[1:-1], visibility_from_extinction(record.extinction)))
            found.setdefault((light_class(record.illuminance), column), []).append((record, before.estimate.valid))
    return {key: _cell(records) for key, records in found.items()}


def _cell(records: list[tuple[Record, bool]]) -> Cell:
    valid = [(record.extinction, record.estimate) for record, _ in records if record.estimate.valid]
    seen = [(k, one) for k, one in valid if one.extinction > 0.0]
    return Cell(
        valid=np.array([record.estimate.valid for record, _ in records]),
        after_valid=np.array([was for _, was in records]),
        zero=np.array([one.extinction == 0.0 for _, one in valid], dtype=bool),
        error=np.array([relative_extinction(one.extinction, k) for k, one in seen]),
        deviation=np.array([np.log(one.standard_deviation / one.extinction) for _, one in seen]),
        none_deviation=np.array([np.log(one.standard_deviation) for _, one in valid if one.extinction == 0.0]),
    )


def fit(runs: list[list[Record]], method: str) -> SurrogateTable:
    """Table of what was measured."""
    found, shape = cells(runs), (len(LIGHTS), len(EDGES) - 1)
    stays, becomes, none = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    error, deviation, without = (np.zeros((*shape, QUANTILES)) for _ in range(3))
    for light, column in itertools.product(*map(range, shape)):
        cell = found.get((light, column)) or _nearest(found, light, column)
        stays[light, column] = _share(cell.valid[cell.after_valid], cell.valid)
        becomes[light, column] = _share(cell.valid[~cell.after_valid], cell.valid)
        none[light, column] = _share(cell.zero, cell.zero)
        error[light, column] = _quantiles(cell.error, 0.0)
        deviation[light, column] = _quantiles(cell.deviation, 0.0)
        without[light, column] = _quantiles(cell.none_deviation, -5.0)
    episode, persistence = _persistence(runs)
    edges = np.array([1.0, *EDGES[1:-1], 1e6])
    return SurrogateTable(method, edges, stays, becomes, none, error, deviation, without, episode, persistence)


def _nearest(found: dict[tuple[int, int], Cell], light: int, column: int) -> Cell:
    """The cell of the nearest visibility in this light; there is one."""
    return found[min((key for key in found if key[0] == light), key=lambda key: abs(key[1] - column))]


def _share(some: NDArray[np.bool_], otherwise: NDArray[np.bool_]) -> float:
    known = some if len(some) else otherwise
    return float(known.mean()) if len(known) else 0.0


def _quantiles(values: NDArray[np.float64], otherwise: float) -> NDArray[np.float64]:
    if not len(values):
        return np.full(QUANTILES, otherwise)
    return np.asarray(np.quantile(values, np.linspace(0.0, 1.0, QUANTILES)))


def _persistence(runs: list[list[Record]]) -> tuple[float, float]:
    """Share of an error's variance that stays for an episode, and correlation of the rest at one step."""
    scores = list(_normal_scores(runs))
    total = float(np.mean([value**2 for run in scores for value in run]))
    far = [a * b for run in scores for a, b in zip(run, run[40:], strict=False)]
    near = [a * b for run in scores for a, b in itertools.pairwise(run)]
    episode = min(max(float(np.mean(far)) / total, 0.0), 0.95)
    return episode, min(max((float(np.mean(near)) / total - episode) / (1.0 - episode), 0.0), 0.99)


def _normal_scores(runs: list[list[Record]]) -> Iterator[list[float]]:
    """Errors of each episode as values of a normal distribution, by their rank in their cell."""
    found = {key: np.sort(cell.error) for key, cell in cells(runs).items()}
    for run in runs:
        scores = []
        for k, light, one in run:
            if one.valid and one.extinction > 0.0:
                column = int(np.searchsorted(EDGES[1:-1], visibility_from_extinction(k)))
                ranked = found[light_class(light), column]
                share = (np.searchsorted(ranked, relative_extinction(one.extinction, k)) + 0.5) / (len(ranked) + 1)
                scores.append(float(norm.ppf(share)))
        if len(scores) > 1:
            yield scores


def compare(real: list[list[Record]], drawn: list[list[Record]]) -> list[Row]:
    """A record for each light and class of visibility."""
    records, ours = [], cells(drawn)
    for (light, column), cell in sorted(cells(real).items()):
        if len(cell.valid) < FEWEST:
            continue
        other = ours[light, column]
        both = len(cell.error) >= FEWEST and len(other.error) >= FEWEST
        records.append(
            {
                "light": LIGHTS[light],
                "visibility_from_m": EDGES[column],
                "visibility_to_m": None if np.isinf(EDGES[column + 1]) else EDGES[column + 1],
                "estimates": len(cell.valid),
                "valid_share": round(float(cell.valid.mean()), 3),
                "surrogate_valid_share": round(float(other.valid.mean()), 3),
                "median_error": round(float(np.median(cell.error)), 3) if both else None,
                "surrogate_median_error": round(float(np.median(other.error)), 3) if both else None,
                "distance": round(float(ks_2samp(cell.error, other.error).statistic), 3) if both else None,
            }
        )
    return records


def shown(record: Row) -> tuple[str, ...]:
    """A record in cells of the docs' table."""
    above, far = record["visibility_to_m"], record["distance"]
    ratio = (
        "–"
        if far is None
        else " / ".join(f"{math.exp(record[k]):.2f}" for k in ("median_error", "surrogate_median_error"))
    )
    return (
        record["light"],
        f"{record['visibility_from_m']:.0f} … " + ("∞" if above is None else f"{above:.0f}") + " m",
        str(record["estimates"]),
        f"{100 * record['valid_share']:.0f} / {100 * record['surrogate_valid_share']:.0f} %",
        ratio,
        "–" if far is None else f"{far:.2f}",
    )


def main() -> None:
    """Run it from the command line."""
    given = parse_options(
        __doc__,
        docs=("reference/environments.md", "surrogate"),
        episodes=(60, "how many"),
        split=("test", "of which", ("train", "test")),
        fit=(False, "write the table again, by the split train"),
    )
    runs = list(episodes(given.episodes, "train" if given.fit else given.split))
    if given.fit:
        MEASURED_2.write_text(fit(runs, "first_valid").as_json() + "\n", encoding="utf-8")
    records = compare(runs, redrawn(runs, SurrogateTable.load(MEASURED_2)))
    ratio = "median k / true k: real / drawn"
    heads = ("light", "visibility ahead", "estimates", "valid: real / drawn", ratio, "KS distance")
    publish(given, records, docs=lambda records: lines_of(heads, map(shown, records)))


if __name__ == "__main__":
    main()
