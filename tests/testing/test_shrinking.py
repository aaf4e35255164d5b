"""The smallest case of a sweep that fails; whether a case fails is made up."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from early_motorway import ROUTES
from made_up_cases import complete

from fogsim.core.files.atomic import write_json
from fogsim.study.execution import RunWatch, result_file
from fogsim.study.plan import StudyRun
from fogsim.testing import collect, run_tests
from fogsim.testing.shrinking import shrink, smallest_case, smallest_text

SCENARIO = f"""
name: swept
traffic: {{net: {ROUTES.parents[2]}/scenarios/motorway_fog_bank/motorway.net.xml, routes: [{ROUTES}], ego: ego}}
fog: {{visibility: $visibility}}
light: {{illuminance_lx: $light}}
duration_s: $duration
expect:
  e0: {{always: ego.ttc > 1 s}}
vary:
  visibility: {{from: 200 m, to: 50 m, step: -50 m}}
  light: [10000, 5, 0]
  duration: [10, 20]
  run: 2 seeds
"""


@dataclass
class Pretending:
    """Says of each case what a rule says."""

    fails: Callable[[float, float, float, int], bool]
    ran: list[str] = field(default_factory=list)

    def run(self, runs: Sequence[StudyRun], folder: Path, watch: RunWatch) -> None:
        for run in runs:
            visibility, light, duration = (float(run.levels[n].split()[0]) for n in ("visibility", "light", "duration"))
            self.ran.append(",".join(run.levels.values()))
            verdict = "failed" if self.fails(visibility, light, duration, run.seed) else "passed"
            write_json(result_file(folder, run), {**complete(verdict), "duration_s": 0.0})
            watch(run, None)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    (tmp_path / "swept.fog.yaml").write_text(SCENARIO)
    return tmp_path / "swept.fog.yaml"


def test_names_that_do_not_matter_are_at_their_first_values_and_numbers_near_them(file: Path, tmp_path: Path) -> None:
    engine = Pretending(lambda visibility, light, _, __: visibility < 130.0 and light < 10.0)
    tests = collect([file])
    (outcome,) = run_tests(tests, tmp_path / "out", engine)
    assert len(engine.ran) == 4 * 3 * 2 * 2
    (judgement,) = outcome.judgements
    found = shrink(outcome, judgement, [], engine, tmp_path / "out" / "results")
    assert found.values["duration"] == "10"
    assert found.values["run"] == "0"
    nearest, passing = (float(one["visibility"].split()[0]) for one in (found.values, found.passes_at))
    assert 120.0 < nearest < 130.0 <= passing < 135.0
    assert 5.0 <= float(found.values["light"]) < 10.0 <= float(found.passes_at["light"])
    assert found.tried == len(engine.ran) - 48
    told = smallest_text(tests[0], found)
    assert f"no longer fails with visibility={found.passes_at['visibility']}, light=" in told
    again = told.partition(" --case ")[2].strip("'")
    (only,) = collect([file], case=again)[0].runs
    assert only.levels == found.values


def test_a_seed_stays_the_one_that_fails(file: Path, tmp_path: Path) -> None:
    engine = Pretending(lambda _, __, ___, seed: seed == 1)
    (outcome,) = run_tests(collect([file]), tmp_path / "out", engine)
    found = shrink(outcome, outcome.judgements[0], [], engine, tmp_path / "out" / "results")
    assert found.values == {"visibility": "200 m", "light": "10000", "duration": "10", "run": "1"}
    assert (found.passes_at, found.tried) == ({}, 0)


def test_only_what_did_pass_is_reported_as_passing() -> None:
    """Where there is no case, as on the left, or where it fails again with what others have become."""
    start, first = {"a": "8", "b": "8"}, {"a": "0", "b": "0"}
    without = smallest_case(start, first, first, {}, lambda one: float(one["a"]) >= 4.0 or None)
    assert (without.values, without.passes_at) == ({"a": "4", "b": "0"}, {})
    crossing = smallest_case(start, first, first, {}, lambda one: (float(one["a"]) > 5.0) != (float(one["b"]) < 5.0))
    assert crossing.passes_at
    for name, value in crossing.passes_at.items():
        moved = {**crossing.values, name: value}
        assert (float(moved["a"]) > 5.0) == (float(moved["b"]) < 5.0)


def test_a_run_that_went_wrong_did_not_pass(file: Path, tmp_path: Path) -> None:
    class Breaking(Pretending):
        def run(self, runs: Sequence[StudyRun], folder: Path, watch: RunWatch) -> None:
            def watch_broken(run: StudyRun, message: str | None) -> None:
                if run.levels["light"] == "10000":
                    write_json(result_file(folder, run), {"status": "failed", "message": "broken", "duration_s": 0.0})
                watch(run, message)

            super().run(runs, folder, watch_broken)

    engine = Breaking(lambda _, light, __, ___: light > 0.0)
    (outcome,) = run_tests(collect([file]), tmp_path / "out", engine)
    found = shrink(outcome, outcome.judgements[0], [], engine, tmp_path / "out" / "results")
    assert 9000.0 < float(found.values["light"]) < 10000.0
    assert found.passes_at == {}
