"""What each estimator says while a sensor is faulty, and what is believed after some seconds of it.

The ego drives on the motorway in even fog, behind another car; after some seconds of good frames one fault is in force
for five. `valid` is the share of frames in which the method says something, `error` the median of (V_est − V) / V of
these, `outside` their share whose 90 % interval of k does not hold the truth. `low` … `high` is the 90 % interval of
the belief at the fault's end by this method alone, over all seeds from the lowest to the highest; a method is `fooled`
if the belief of any seed leaves the truth out.
"""

import argparse
import inspect
import math
from collections.abc import Iterator

import numpy as np
from harness import Row, lines_of, median, parse_options, progress, publish

import fogsim
from fogsim.estimators import ESTIMATORS
from fogsim.fusion import make
from fogsim.values import Belief, Step
from fogsim.values.estimate import NORMAL_90_PERCENT, Estimate

FAULTS = {
    "none": "",
    "blackout": "fault: blackout",
    "frozen, new times": "fault: frozen",
    "frozen, old time": "fault: frozen, time_stamp: exposure",
    "half of frames dropped": "fault: dropped_frames, share: 50 %",
    "latency 0.6 s": "fault: latency, delay: 0.6 s",
    "latency 0.6 s, new times": "fault: latency, delay: 0.6 s, time_stamp: delivery",
    "dirt on 10 % of the glass": "fault: dirty_lens",
    "dirt on 30 %, 4 mm": "fault: dirty_lens, coverage: 30 %, diameter: 4 mm",
    "drops on 15 %": "fault: wet_lens",
    "drops on 30 %, 5 mm": "fault: wet_lens, coverage: 30 %, diameter: 5 mm",
    "sun 8° up": "fault: glare",
    "sun 15° aside, dirty glass": "fault: glare, azimuth: 15 deg, haze: 10",
    "pitch + 0.5°": "fault: calibration, pitch: 0.5 deg",
    "pitch + 2°": "fault: calibration, pitch: 2 deg",
    "pitch + 2°, stated as unsure": "fault: calibration, pitch: 2 deg",
    "roll + 2°": "fault: calibration, roll: 2 deg",
    "focal length + 5 %": "fault: calibration, focal_length: 5 %",
    "radar lost": "fault: dropout",
    "radar + 5 m": "fault: bias, distance: 5 m",
    "radar noise × 10": "fault: noise",
}
UNSURE = {"pitch + 2°, stated as unsure"}
"""Methods with the `pitch_deviation` [rad] of a pitch that is not known well, as far as they have that parameter."""

UNSURE_PITCH = 0.01
METHODS = ("joint_road", "negru2013", "zhu2015", "huang2015_rough", "huang2015_lead", "lead_contrast")
PARAMETERS = {method: inspect.signature(ESTIMATORS[method]).parameters for method in METHODS}

SETTLED = 1.0
"""How much of a fault is not counted yet [s]."""


def steps(name: str, seed: int, asked: argparse.Namespace) -> Iterator[Step]:
    """Steps of a drive with a fault."""
    faults = f"[{{{FAULTS[name]}, at: {asked.seconds} s, for: {asked.seconds} s}}]" if FAULTS[name] else "[]"
    parameters = f"{{pitch_deviation: {UNSURE_PITCH}}}" if name in UNSURE else "{}"
    written = [
        f"{{method: {method}, parameters: {parameters if 'pitch_deviation' in PARAMETERS[method] else '{}'}}}"
        for method in asked.methods
    ]
    scenario = fogsim.load_scenario(
        "motorway_fog_bank",
        [
            f"fog={{visibility_m: {asked.visibility}}}",
            f"sensors.faults={faults}",
            f"estimators=[{', '.join(written)}]",
            "clocks={camera_period_s: 0.2, decision_period_s: 1.0}",
            f"duration_s={2.0 * asked.seconds}",
        ],
    )
    return fogsim.run(scenario, seed)


def holds_truth(estimate: Estimate, extinction: float) -> bool:
    """Whether the 90 % interval of an estimate holds the true extinction coefficient."""
    return abs(estimate.extinction - extinction) <= NORMAL_90_PERCENT * estimate.standard_deviation


def measure(name: str, asked: argparse.Namespace) -> list[Row]:
    """Records of a fault, one for each method."""
    methods = asked.methods
    said: dict[str, list[Estimate]] = {method: [] for method in methods}
    beliefs: dict[str, list[Belief]] = {method: [] for method in methods}
    extinction = math.log(20.0) / asked.visibility
    for seed in range(1, asked.seeds + 1):
        fusions = {method: make("grid_filter") for method in methods}
        last: dict[str, Belief] = {}
        for step in steps(name, seed, asked):
            if step.time >= 2.0 * asked.seconds:
                break
            for method, estimate in zip(methods, step.estimates, strict=True):
                last[method] = fusions[method].update([estimate], step.time)
                if step.time >= asked.seconds + SETTLED:
                    said[method].append(estimate)
        for method in methods:
            beliefs[method].append(last[method])
    return [record(name, method, said[method], beliefs[method], extinction) for method in methods]


def record(fault: str, method: str, estimates: list[Estimate], beliefs: list[Belief], extinction: float) -> Row:
    """What a method said during a fault, in figures."""
    valid = [one for one in estimates if one.valid]
    truth = math.log(20.0) / extinction
    intervals = [belief.visibility_quantiles((0.05, 0.95)) for belief in beliefs]
    return {
        "fault": fault,
        "method": method,
        "frames": len(estimates),
        "valid_pct": 100.0 * len(valid) / len(estimates),
        "error_pct": median([100.0 * (one.visibility / truth - 1.0) for one in valid]),
        "outside_pct": 100.0 * float(np.mean([not holds_truth(one, extinction) for one in valid])) if valid else None,
        "low_m": min(low for low, _ in intervals),
        "high_m": max(high for _, high in intervals),
        "fooled": any(not low <= truth <= high for low, high in intervals),
    }


def cell(one: Row) -> str:
    """A record in a cell of the table: how often valid and how far off, then the belief."""
    error = one["error_pct"]
    off = "" if error is None else "clear" if error > 900 else f"{round(error):+d} %".replace("+0", "0")
    said = f"{one['valid_pct']:.0f} %, {off}" if off else "silent"
    belief = f"{one['low_m']:.0f}–{one['high_m']:.0f}" if one["high_m"] < 3000 else f"over {one['low_m']:.0f}"
    return f"{said}; {'**' + belief + '**' if one['fooled'] else belief}"


def table(records: list[Row]) -> list[str]:
    """Faults by methods."""
    methods = list(dict.fromkeys(one["method"] for one in records))
    cells = {(one["fault"], one["method"]): cell(one) for one in records}
    faults = dict.fromkeys(one["fault"] for one in records)
    rows = [(fault, *(cells[fault, method] for method in methods)) for fault in faults]
    return lines_of(("fault", *(f"`{method}`" for method in methods)), rows)


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        docs=("reference/sensors.md", "sensor faults"),
        faults=(list(FAULTS), "only these", FAULTS),
        methods=(list(METHODS), "estimators", METHODS),
        seeds=(3, "drives for each fault"),
        visibility=(150.0, "visibility [m]"),
        seconds=(5.0, "time without the fault, and time with it [s]"),
    )
    records = [one for name in progress(given.faults, "faults") for one in measure(name, given)]
    publish(given, records, table)


if __name__ == "__main__":
    main()
