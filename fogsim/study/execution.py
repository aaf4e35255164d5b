"""One run of a study: its metrics as a row of plain values, and its profiles."""

import traceback
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from fogsim.core.files.atomic import write_json
from fogsim.errors import FogSimError, UnplayedWarning
from fogsim.metrics import MetricsOfRun, RunMetrics, TrafficRunMetrics
from fogsim.scenario import Scenario, build
from fogsim.simulation.ego.fog_reports import FogReports
from fogsim.simulation.ego.road_meters import RoadMeters
from fogsim.simulation.loop import run
from fogsim.simulation.traffic_run import TrafficRun, run_traffic
from fogsim.study.plan import StudyRun
from fogsim.study.profiles import RunProfiles
from fogsim.traffic import libsumo_traffic
from fogsim.values import Ending, TrafficStep

RunWatch = Callable[[StudyRun, str | None], None]
"""Called with each completed run, and its error."""

Work = Callable[[Scenario, int, Path], dict[str, Any]]
"""Runs a scenario with a seed, returns the content of the run's file, and leaves SUMO's outputs in a folder."""

PROCESS_DIED = "the process that ran it died"
"""Message for a run whose process died twice."""


class Engine(Protocol):
    """Processes of this machine (`fogsim.study.pool.ProcessPool`), a cluster (`fogsim.study.ray_cluster.RayCluster`).

    With any engine the files are the same, byte for byte; and completed runs are kept however it ends.
    """

    def run(self, runs: Sequence[StudyRun], folder: Path, watch: RunWatch) -> None:
        """Execute runs, each outcome into its `result_file`.

        Parameters
        ----------
        runs : sequence of StudyRun
            The runs to execute.
        folder : Path
            Folder of the results, one ``KEY.json`` each.
        watch : RunWatch
            Called with each completed run, in this process.
        """


def result_file(folder: Path, run: StudyRun) -> Path:
    """Path of a run's result in the folder of results."""
    return folder / f"{run.key}.json"


def measure_run(scenario: Scenario, seed: int, sumo_outputs: Path | None = None) -> dict[str, Any]:
    """Run a scenario and return its ``metrics`` (`RunSummary.flat`) and ``profiles`` (`RunProfiles.to_json`)."""
    profiles = RunProfiles()
    metrics, _ = watched_run(scenario, seed, [profiles.update], sumo_outputs, [profiles])
    return {"metrics": metrics, "profiles": profiles.to_json()}


def watched_run(
    scenario: Scenario,
    seed: int,
    watches: Sequence[Callable[[TrafficStep], object]],
    sumo_outputs: Path | None = None,
    profiles: Sequence[RunProfiles] = (),
) -> tuple[Mapping[str, str | int | float | None], Ending | None]:
    """Run a scenario; its metrics (`RunSummary.flat`) and why it ended. `watches` see the steps and the unplayed."""
    has_ego, ending = scenario.traffic.has_ego, None
    metrics: MetricsOfRun[Any] = RunMetrics(watchers=profiles) if has_ego else TrafficRunMetrics(watchers=profiles)
    steps: Iterable[TrafficStep] = (
        run(scenario, seed, sumo_outputs=sumo_outputs) if has_ego else run_traffic(scenario, seed, sumo_outputs)
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnplayedWarning)
        for step in steps:
            for watch in watches:
                watch(step)
            metrics.update(step)
            ending = step.ending
        return metrics.summary().flat(), ending


def build_without_running(scenario: Scenario) -> None:
    """Build the road, the fog and the meters of a run, without SUMO and users' code; InputError if they do not fit."""
    if not scenario.traffic.has_ego:
        TrafficRun(scenario).close()
        return
    planned = libsumo_traffic(build.traffic_setup(scenario)).planned_network()
    if planned is not None:
        road, _ = planned
        build.world_config(scenario).fog.along(road.route, road.structures)
        RoadMeters(build.sections_config(scenario), road.route, road.route_limits)
        FogReports(build.reports_config(scenario), road.route)


def run_outcome(scenario: Scenario, seed: int, sumo_outputs: Path) -> dict[str, Any]:
    """Run, and return the content of the run's file, which also reports failures."""
    return outcome_of(lambda: measure_run(scenario, seed, sumo_outputs))


def outcome_of(measure: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """Result of a run with its ``status``, or the ``message`` of its error, SystemExit included: other runs go on."""
    try:
        return {"status": "complete", **measure()}
    except KeyboardInterrupt:
        raise
    except FogSimError as error:
        return failure(str(error))
    except BaseException as error:  # noqa: BLE001 - it is reported as the outcome
        place = traceback.extract_tb(error.__traceback__)[-1]
        return failure(f"{type(error).__name__}: {error} ({Path(place.filename).name}:{place.lineno})")


def failure(message: str) -> dict[str, Any]:
    """Outcome of a failed run."""
    return {"status": "failed", "message": message}


def run_to_file(scenario: Scenario, seed: int, result: Path, work: Work = run_outcome) -> str | None:
    """Write a run's outcome to `result`, with SUMO's outputs in a folder of that name; return its error, if any."""
    outcome = work(scenario, seed, result.with_suffix(""))
    write_json(result, outcome)
    return outcome.get("message")
