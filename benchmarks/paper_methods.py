"""Every method of the published papers in the shipped scenario that has what it needs, as a user runs it.

Nothing is prepared: calibrations of the camera are made on the first run. Errors are |V_est − V| / V of valid
estimates, V the visibility ahead; `coverage` is the share of them whose 90 % interval holds V. `gallen2014_halo` shows
whether there is fog and gives a bound, not a visibility: `bounds` is the share of frames with a bound and no estimate,
`bounds_hold` the share of those that hold V, 10 % aside.
"""

from harness import Row, lines_of, mean, parse_options, publish

import fogsim
from fogsim.metrics.estimation import Errors
from fogsim.units import extinction_from_visibility

SCENARIOS = {
    "papers_by_day": ("negru2013", "zhu2015", "huang2015_rough", "huang2015_lead", "huang2015", "belaroussi2015"),
    "rural_night_alone": ("gallen2014_veil",),
    "rural_night_oncoming": ("gallen2014", "gallen2014_halo"),
}


def records(name: str, seeds: int) -> list[Row]:
    """One record for each method of a scenario."""
    errors = {method: Errors() for method in SCENARIOS[name]}
    bounds: dict[str, list[bool]] = {method: [] for method in errors}
    scenario = fogsim.load_scenario(name)
    for seed in range(seeds):
        for step in fogsim.run(scenario, seed=seed):
            truth = step.truth.visibility_ahead
            k = extinction_from_visibility(truth)
            for one in step.estimates:
                if one.method not in errors:
                    continue
                errors[one.method].asked += 1
                if one.valid:
                    errors[one.method].judge(truth, one.visibility, *one.visibility_interval)
                elif one.bounds is not None:
                    bounds[one.method].append(0.9 * one.bounds.least <= k <= 1.1 * one.bounds.most)
    return [
        {"method": method, "scenario": name, **_judged(errors[method], bounds[method])} for method in SCENARIOS[name]
    ]


def _judged(errors: Errors, bounds: list[bool]) -> Row:
    found = errors.result()
    names = ("count", "valid_share", "median_error_percent", "p95_error_percent", "coverage_share")
    share = len(bounds) / errors.asked if errors.asked else 0.0
    return {**{name: found[name] for name in names}, "bounds_share": share, "bounds_hold": mean(bounds)}


def docs_table(found: list[Row]) -> list[str]:
    """Lines of the table of docs/explanation/estimators.md."""
    rows = []
    for one in found:
        error = "–"
        if one["median_error_percent"] is not None:
            error = f"{one['median_error_percent']:.1f}/{one['p95_error_percent']:.1f}"
        valid, *others = (
            "–" if one[key] is None else f"{100.0 * one[key]:.0f}"
            for key in ("valid_share", "coverage_share", "bounds_share", "bounds_hold")
        )
        name = f"[{one['scenario']}](../../scenarios/{one['scenario']}/README.md)"
        rows.append((f"`{one['method']}`", name, str(one["count"]), valid, error, *others))
    heads = ("method", "scenario", "frames", "valid, %", "median/p95, %", "90 % intervals hold, %")
    return lines_of((*heads, "bound alone, %", "bounds hold, %"), rows)


def main() -> None:
    """Measure and print."""
    docs = ("explanation/estimators.md", "paper methods")
    given = parse_options(__doc__, docs=docs, seeds=(3, "runs of each scenario"))
    found = [record for name in SCENARIOS for record in records(name, given.seeds)]
    publish(given, found, docs_table)


if __name__ == "__main__":
    main()
