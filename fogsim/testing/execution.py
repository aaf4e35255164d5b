"""One case: a run with its expectations evaluated."""

import time
import warnings
from pathlib import Path
from typing import Any

from fogsim.core.files.atomic import write_json
from fogsim.errors import UnplayedWarning
from fogsim.expectations import ExpectationWatch
from fogsim.metrics import RunMetrics, TrafficRunMetrics
from fogsim.scenario import Scenario, build
from fogsim.scenario.expect.schema import clauses_of
from fogsim.simulation.loop import run
from fogsim.simulation.traffic_run import run_traffic
from fogsim.study.execution import outcome_of
from fogsim.testing.results import finding_to_json


def check_case(scenario: Scenario, seed: int, sumo_outputs: Path | None = None) -> dict[str, Any]:
    """Run a case and return ``findings``, ``metrics`` and ``ending`` as JSON data."""
    standard, watch = build.safety_standard(scenario), ExpectationWatch(clauses_of(scenario.expect))
    ending = None
    with warnings.catch_warnings():
        # Expectations decide about events that were not played.
        warnings.simplefilter("ignore", UnplayedWarning)
        if scenario.traffic.has_ego:
            of_ego = RunMetrics(standard)
            for step in run(scenario, seed, sumo_outputs=sumo_outputs):
                of_ego.update(step)
                watch.update(step)
                ending = step.ending
            summary = of_ego.summary()
        else:
            of_traffic = TrafficRunMetrics(standard)
            for instant in run_traffic(scenario, seed, sumo_outputs):
                of_traffic.update(instant)
                watch.update(instant)
                ending = instant.ending
            summary = of_traffic.summary()
    findings = [finding_to_json(one) for one in watch.findings(summary.to_json())]
    return {"findings": findings, "metrics": summary.flat(), "ending": ending}


def check_to_file(scenario: Scenario, seed: int, result: Path) -> str | None:
    """Check a case and write the outcome to `result`; return what went wrong with the run, if anything."""
    begun = time.monotonic()
    outcome = outcome_of(lambda: check_case(scenario, seed, result.with_suffix("")))
    write_json(result, {**outcome, "duration_s": round(time.monotonic() - begun, 3)})
    return outcome.get("message")
