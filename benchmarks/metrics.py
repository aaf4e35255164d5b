"""Cost of a run's metrics, as a share of the run itself.

A straight road with three lanes carries a number of vehicles on 10 km, or they wander through a town (both of
``benchmarks/traffic.py``); all of them are read, in fog of 100 m by day. The loop goes round as `fogsim.run` does;
after each step `RunMetrics.update` takes it in, and with ``--profiles`` `RunProfiles.update` before it, as in a study.
Both are timed in the same run, in blocks of 80 steps: ``share`` is the median of the blocks' ratios of metrics to
everything else, a quarter of them lie below ``share_low``, a quarter above ``share_high``.

``frames`` says what is run: ``none`` is without frames at 2 Hz (the cheapest run that a study can have),
``small`` draws 160 × 120 pixels at 2 Hz by the processor, with an estimator; ``none_10_hz`` is without frames at SUMO's
own step, where nothing is left out between two steps that are measured. Times are the processor's [ms].

    python benchmarks/metrics.py [--json] [--network town] [--vehicles 100 …] [--seconds 200] [--block 80]
        [--profiles] [--profile]

``--profile`` shows where the metrics' time goes, by metric.
"""

import itertools
import statistics
import tempfile
from pathlib import Path

from harness import Row, parse_options, publish
from traffic import CONFIGURATIONS, timed

from fogsim.metrics import METRICS, RunMetrics
from fogsim.scenario.loading import clock_settings, scenario_from_config
from fogsim.simulation.loop import run
from fogsim.study.profiles import RunProfiles
from fogsim.values import Step

FRAMELESS = (
    *("renderer=none", "estimators=[]", "advice={method: stopping_sight_distance, informed_by: truth}"),
    "lighting={method: fog_lamp_rules, informed_by: truth}",
)
BLOCK = 80
"""Steps in a block: what is gathered before vehicles are counted comes once or twice in each."""
RUNS = {
    "none": (0.5, FRAMELESS),
    "small": (0.5, ("renderer=cpu", "camera.width=160", "camera.height=120", "estimators=[joint_road]")),
    "none_10_hz": (0.1, FRAMELESS),
}
"""Camera period [s] and settings of each kind of run."""


def measure(network: str, frames: str, vehicles: int, seconds: float, size: int, *, profiled: bool) -> Row:
    """One record of so many seconds of simulated time, in blocks of so many steps."""
    period, settings = RUNS[frames]
    blocks: list[tuple[float, float]] = []
    with tempfile.TemporaryDirectory() as folder:
        config = CONFIGURATIONS[network](Path(folder), vehicles)
        told = ["fog.visibility_m=100", "traffic.reading_radius_m=6000", f"duration_s={seconds}", *settings]
        scenario = scenario_from_config(config, "ego", [*clock_settings(0.1, period, period), *told])
        profiles = [RunProfiles()] if profiled else []
        metrics = RunMetrics(watchers=profiles)
        steps = run(scenario, 1)
        last = [next(steps)]

        def go_on() -> None:
            last[0] = next(steps)

        def watch() -> None:
            for watcher in (*profiles, metrics):
                watcher.update(last[0])

        watch()

        while last[0].ending is None:
            others = own = 0.0
            for _ in range(size):
                if last[0].ending is None:
                    others += timed(go_on)
                    own += timed(watch)
            blocks.append((others / size, own / size))
        steps.close()
    # The first block has what is made once.
    others, own = zip(*blocks[1:], strict=True)
    low, middle, high = statistics.quantiles([b / a for a, b in zip(others, own, strict=True)], n=4)
    return {
        "network": network,
        "frames": frames,
        "vehicles": vehicles,
        "vehicles_read": len(last[0].traffic.ids),
        "ms_step": round(statistics.median(others), 3),
        "ms_metrics": round(statistics.median(own), 4),
        "share": round(middle, 4),
        "share_low": round(low, 4),
        "share_high": round(high, 4),
        "blocks": len(blocks) - 1,
    }


def by_metric(network: str, vehicles: int) -> dict[str, float]:
    """Milliseconds that each metric alone takes for a step, the following of vehicles included."""
    with tempfile.TemporaryDirectory() as folder:
        told = ["fog.visibility_m=100", "traffic.reading_radius_m=6000", "duration_s=20", *RUNS["none"][1]]
        config = CONFIGURATIONS[network](Path(folder), vehicles)
        steps: list[Step] = list(run(scenario_from_config(config, "ego", [*clock_settings(0.1, 0.1, 0.1), *told]), 1))
    costs = {}
    for name in METRICS:
        metrics = RunMetrics(names=[name])
        costs[name] = round(sum(timed(lambda s=s, m=metrics: m.update(s)) for s in steps) / len(steps), 4)
    return costs


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        network=("motorway", "where they drive", CONFIGURATIONS),
        vehicles=([100], "vehicles"),
        frames=(list(RUNS), "which runs", RUNS),
        seconds=(200.0, "simulated time of each run"),
        block=(BLOCK, "steps in a block"),
        profiles=(False, "with the profiles that a study keeps"),
        profile=(False, "tell the cost of each metric alone"),
    )
    if given.profile:
        publish(given, [{"vehicles": n, **by_metric(given.network, n)} for n in given.vehicles])
        return
    cases = itertools.product(given.vehicles, given.frames)
    fixed = (given.seconds, given.block)
    publish(given, [measure(given.network, kind, n, *fixed, profiled=given.profiles) for n, kind in cases])


if __name__ == "__main__":
    main()
