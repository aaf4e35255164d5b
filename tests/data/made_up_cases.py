"""Tests whose cases are made up: no simulation is run for them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fogsim.core.files.atomic import write_json
from fogsim.scenario import Scenario
from fogsim.scenario.variation import NONE_FAILS, Verdict
from fogsim.study.execution import RunWatch, result_file
from fogsim.study.plan import StudyRun
from fogsim.testing.collection import FogTest

SCENARIO = Scenario.model_construct(name="made_up", description="Nothing in it is real.")


@dataclass
class MadeUpEngine:
    """Writes what a table says of each case, in this process."""

    told: Mapping[str, Mapping[str, Any]]
    ran: list[str] = field(default_factory=list)
    stop_after: int = 1000

    def run(self, runs: Sequence[StudyRun], folder: Path, watch: RunWatch) -> None:
        for run in runs:
            if len(self.ran) == self.stop_after:
                raise KeyboardInterrupt
            outcome = self.told[run.key]
            write_json(result_file(folder, run), {"duration_s": 1.5, **outcome})
            self.ran.append(run.key)
            watch(run, outcome.get("message"))


def finding(verdict: str, name: str = "safe", clause: str = "always", **rest: Any) -> dict[str, Any]:
    told = {"expected": "ego.ttc >= 1.5 s", "came": "1.2 s", "time": 34.5, "position": 812.0, "reason": ""}
    return {"name": name, "clause": clause, "verdict": verdict, **told, **rest}


def complete(*verdicts: str, **rest: Any) -> dict[str, Any]:
    """A run whose expectations e0, e1, … came out so."""
    names = [f"e{i}" for i in range(len(verdicts))]
    found = [finding(verdict, name, **rest) for name, verdict in zip(names, verdicts, strict=True)]
    return {"status": "complete", "findings": found, "metrics": {"collisions": 0}, "ending": "time"}


BROKEN = {"status": "failed", "message": "SUMO has ended <here>"}


def made_up_test(keys: Sequence[str], path: Path = Path("a.fog.yaml"), verdict: Verdict = NONE_FAILS) -> FogTest:
    """A test with a case for each key."""
    labels = [{"run": str(i)} if len(keys) > 1 else {} for i in range(len(keys))]
    runs = tuple(StudyRun(i, labels[i], i, SCENARIO, key) for i, key in enumerate(keys))
    return FogTest(path, "made_up", {"e0": f"{path}:7", "e1": f"{path}:8"}, runs, verdict)
