"""The table of targets says what it measured, and "met" follows from its numbers; how good they are is not judged."""

import ast
import json
from pathlib import Path
from typing import Any

import pytest

from tests.helpers.command import run_script

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = ROOT / "benchmarks" / "estimator_targets.py"
PICTURES = sorted((ROOT / "tests" / "pictures").glob("*.py"))

FIELDS = {
    "target", "cell", "images", "valid_share", "unit", "median", "p95", "right_share", "target_median", "target_p95",
    "target_right_share", "met", "coverage", "worst_cell", "command",
}  # fmt: skip


@pytest.fixture(scope="module")
def keep(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("targets") / "kept"


@pytest.fixture(scope="module")
def records(keep: Path) -> list[dict[str, Any]]:
    done = run_script(PROGRAM, "--json", "--images", "1", "--keep", keep)
    assert done.returncode == 0, done.stderr
    found: list[dict[str, Any]] = json.loads(done.stdout)
    return found


@pytest.mark.nightly
def test_every_target_has_its_cells(records: list[dict[str, Any]]) -> None:
    cells = {(one["target"], one["cell"]) for one in records}
    assert len(cells) == len(records)
    for part in ("single frame", "drift", "vehicle at 25 m", "vanishing-point", "four classes", "tracked", "signs"):
        assert any(part in target for target, _ in cells), part
    assert sum("vanishing-point" in target for target, _ in cells) > 32
    assert {cell for target, cell in cells if "four classes" in target} >= {"dense", "moderate", "low", "none"}
    assert all(set(one) == FIELDS for one in records)


@pytest.mark.nightly
def test_kept_rows_give_the_same_again_and_belong_to_their_seed(keep: Path, records: list[dict[str, Any]]) -> None:
    assert json.loads(run_script(PROGRAM, "--json", "--images", "1", "--keep", keep).stdout) == records
    other = run_script(PROGRAM, "--images", "1", "--keep", keep, "--seed", "1")
    assert other.returncode != 0
    assert "other settings" in other.stderr
    table = run_script(PROGRAM, "--images", "1", "--keep", keep).stdout.splitlines()
    assert len(table) == 2 + len(records)
    assert all(line.count("|") == table[0].count("|") for line in table)


def test_no_image_is_too_few() -> None:
    done = run_script(PROGRAM, "--images", "0")
    assert done.returncode == 2
    assert "at least 1" in done.stderr


@pytest.fixture
def tables(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(PROGRAM.parent))
    import estimator_targets

    return estimator_targets


def rows(errors: list[float | None], group: str = "V 30 m") -> list[dict[str, Any]]:
    valid = [error is not None for error in errors]
    return [
        {"valid": ok, "error": error, "covered": ok or None, "within": {"V": group}}
        for ok, error in zip(valid, errors, strict=True)
    ]


def test_a_record_holds_errors_against_the_target(tables: Any) -> None:
    for errors, met in [
        ([2.9] * 40, True),
        ([3.1] * 40, False),
        ([1.0] * 30 + [9.0] * 10, False),
        ([1.0] * 39 + [900.0], True),
        ([None, None], False),
        ([1.0] + [None] * 9, True),
    ]:
        one = tables.record(tables.Target("all", "%", 3.0, 8.0), "cell", rows(errors), "python it.py")
        assert one["met"] is met
        assert one["images"] == len(errors)
        assert one["valid_share"] == round(sum(error is not None for error in errors) / len(errors), 3)


def test_a_share_is_held_against_the_least_share(tables: Any) -> None:
    target = tables.Target("all", "right", right_share=0.95)
    assert tables.record(target, "cell", rows([0.0] * 19 + [1.0]), "")["met"] is True
    assert tables.record(target, "cell", rows([0.0] * 18 + [1.0] * 2), "")["met"] is False


def test_the_worst_group_is_named(tables: Any) -> None:
    mixed = rows([1.0] * 9) + rows([2.0] * 3, "60 m") + rows([50.0], "90 m")
    assert tables.worst(mixed, as_share=False) == "V 60 m: 2.0 / 2.0 (n = 3)"
    assert tables.worst(rows([1.0] * 9), as_share=False) is None


def test_pictures_share_nothing_with_the_renderer() -> None:
    for path in PICTURES:
        tree = ast.parse(path.read_text(encoding="utf-8"))
        named = {node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
        named |= {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
        assert {name for name in named if name.startswith("fogsim")} <= {"fogsim.values"}
