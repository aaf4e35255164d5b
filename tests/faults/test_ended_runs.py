"""Runs that are told to end, or killed, at any moment."""

import json
import random
import signal
from pathlib import Path

import pytest
from pyarrow import ipc, parquet

from tests.faults.conftest import Nursery
from tests.faults.steps import STEPS

LONGEST = 0.4
"""Time within which a signal comes [s]; a command takes about as long on a quiet machine. What must hold holds at any
moment, so that no verdict depends on it."""

ROWS_OF_A_SECOND = 10
"""The clock of the table goes on by 0.1 s a row (see `nursery`)."""

NAMES = {"manifest.json", "metrics.json", "steps.parquet"}


def command(out: Path, *further: str) -> list[str]:
    return ["run", "motorway_fog_bank", "--out", str(out), "--no-video", "--no-report", *further]


def status(folder: Path) -> str:
    return json.loads((folder / "manifest.json").read_text(encoding="utf-8"))["status"]


def rows(file: Path) -> list[int]:
    """Numbers of its rows, of which none is missing."""
    index = parquet.read_table(file)["index"].to_pylist()
    assert index == list(range(len(index)))
    return index


def moments(seed: int) -> list[float]:
    chosen = random.Random(seed)  # noqa: S311 - moments, no secrets
    return [chosen.uniform(0.0, LONGEST) for _ in range(3)]


def earlier_results(out: Path) -> None:
    """Results of an earlier run, not all of which the next one writes."""
    out.mkdir()
    for name in (*NAMES, "report.html", "video.mp4"):
        (out / name).write_text("earlier", encoding="utf-8")


def has_only_earlier(out: Path) -> bool:
    """Whether all is of the earlier run; nothing is if it is not all."""
    earlier = {path.name for path in out.iterdir() if path.is_file() and path.read_bytes() == b"earlier"}
    assert not earlier or earlier == {*NAMES, "report.html", "video.mp4"}
    return bool(earlier)


@pytest.mark.parametrize("overwrite", [False, True])
def test_a_run_that_is_killed_loses_a_second_of_rows_at_most(nursery: Nursery, tmp_path: Path, overwrite: bool) -> None:
    # The first of them in the middle of its steps, the others at any moment.
    for number, moment in enumerate([0.0, *moments(11 + overwrite)]):
        out = tmp_path / str(number)
        if overwrite:
            earlier_results(out)
        hold = None if number else 25
        options = ["--overwrite"] if overwrite else []
        (ended,) = nursery.run(command(out, *options), signals=[(moment, signal.SIGKILL)], hold=hold)
        assert ended.code in {0, -signal.SIGKILL}, ended.said
        assert (ended.taken, (out / "unfinished").exists()) == (25, True) or number
        if not (out / "unfinished").exists():
            # It had not begun, or was over.
            if overwrite and ended.code:
                assert has_only_earlier(out) or status(out) == "complete"
            elif (out / "manifest.json").exists():
                assert status(out) == "complete"
            continue
        if not (out / "unfinished" / "manifest.json").exists():
            # All results were in their places, and only the folder was left.
            assert status(out) == "complete"
        elif status(out / "unfinished") == "running":
            assert not overwrite or has_only_earlier(out)
            (told,) = nursery.run(command(out))
            assert (told.code, "has died" in told.said) == (2, True)
        (recovered,) = nursery.run(["recover", str(out), "--overwrite"])
        assert recovered.code == 0, recovered.said
        assert {path.name for path in out.iterdir()} <= NAMES
        assert status(out) in {"dead", "complete"}
        index = rows(out / "steps.parquet") if (out / "steps.parquet").exists() else []
        assert ended.taken - len(index) <= ROWS_OF_A_SECOND


def test_rows_of_a_killed_run_can_be_read_as_they_are(nursery: Nursery, tmp_path: Path) -> None:
    nursery.run(command(tmp_path / "out"), signals=[(0.0, signal.SIGKILL)], hold=25)
    with ipc.open_stream(tmp_path / "out" / "unfinished" / "steps.arrows") as log:
        index = log.read_all()["index"].to_pylist()
    assert index == list(range(len(index)))
    assert 25 - ROWS_OF_A_SECOND <= len(index) <= 25
    (again,) = nursery.run(command(tmp_path / "out", "--overwrite"))
    assert again.code == 0
    assert {path.name for path in (tmp_path / "out").iterdir()} == NAMES


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_run_that_is_told_to_end_is_partial_at_any_moment(nursery: Nursery, tmp_path: Path, number: int) -> None:
    for attempt, moment in enumerate([0.0, *moments(int(number))]):
        out = tmp_path / str(attempt)
        again = [] if attempt % 2 else [(moment + 0.01, int(number))]
        hold = None if attempt else 25
        (ended,) = nursery.run(command(out), signals=[(moment, int(number)), *again], hold=hold)
        assert (ended.code, ended.taken) == (128 + number, 25) or attempt
        assert "Traceback" not in ended.said, ended.said
        if ended.code == 0:
            assert status(out) == "complete"
            continue
        assert ended.code == 128 + number, ended.said
        assert ended.said.endswith("interrupted\n")
        if out.exists():
            assert status(out) in {"interrupted", "complete"}
            assert {path.name for path in out.iterdir()} == NAMES
            index = rows(out / "steps.parquet")
            assert len(index) >= ended.taken
            assert len(index) == STEPS or status(out) == "interrupted"


def test_an_overwriting_run_that_is_ended_leaves_the_old_results_or_its_own(nursery: Nursery, tmp_path: Path) -> None:
    for attempt, moment in enumerate(moments(5)):
        out = tmp_path / str(attempt)
        earlier_results(out)
        nursery.run(command(out, "--overwrite"), signals=[(moment, int(signal.SIGTERM))])
        assert not (out / "unfinished").exists()
        if not has_only_earlier(out):
            assert {path.name for path in out.iterdir()} == NAMES
            assert status(out) in {"interrupted", "complete"}


def test_two_writers_of_one_directory_are_one(nursery: Nursery, tmp_path: Path) -> None:
    ended = nursery.run(command(tmp_path / "out"), command(tmp_path / "out"))
    loser, winner = sorted(ended, key=lambda one: one.code == 0)
    assert (loser.code, winner.code) == (2, 0)
    assert status(tmp_path / "out") == "complete"
    assert len(rows(tmp_path / "out" / "steps.parquet")) == STEPS
    # One that comes when the other is over finds its results instead.
    assert "is writing there; wait for its end" in loser.said or "holds results of an earlier run" in loser.said
