"""One run of a study: its metrics in a row of plain values."""

import warnings
from collections.abc import Mapping
from pathlib import Path

from fogsim.errors import FogSimError, UnplayedWarning
from fogsim.files.atomic import write_json
from fogsim.loop import run
from fogsim.metrics import RunMetrics
from fogsim.scenario import Scenario, build

Value = str | float | int | None
"""What a cell of the table holds."""


def run_metrics(scenario: Scenario, seed: int) -> dict[str, Value]:
    """Metrics of one run, flat: those of a method have its name before theirs, with a point between.

    Parameters
    ----------
    scenario : Scenario
        What is run.
    seed : int
        Its seed.
    """
    metrics = RunMetrics(build.safety_standard(scenario))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnplayedWarning)
        for step in run(scenario, seed):
            metrics.update(step)
    return dict(_flat(metrics.summary().to_json()))


def _flat(values: Mapping[str, object], prefix: str = "") -> list[tuple[str, Value]]:
    rows: list[tuple[str, Value]] = []
    for key, value in values.items():
        if isinstance(value, Mapping):
            rows += _flat(value, f"{prefix}{key}.")
        elif value is None or isinstance(value, str | int | float):
            rows.append((prefix + key, value))
    return rows


def run_to_file(scenario: Scenario, seed: int, result: Path) -> str | None:
    """Run, and write the metrics into a file; what goes wrong with the run is written there too.

    Parameters
    ----------
    scenario : Scenario
        What is run.
    seed : int
        Its seed.
    result : Path
        The file, written whole or not at all.

    Returns
    -------
    str or None
        What went wrong, if anything did.

    Raises
    ------
    OSError
        If the file cannot be written, as on a full disk.
    """
    try:
        found = {"status": "complete", "metrics": run_metrics(scenario, seed)}
    except FogSimError as error:
        found = {"status": "failed", "message": str(error)}
    except Exception as error:  # noqa: BLE001 - a broken run, of a user's own method perhaps, must not stop the others
        found = {"status": "failed", "message": f"{type(error).__name__}: {error}"}
    write_json(result, found)
    return str(found["message"]) if "message" in found else None
