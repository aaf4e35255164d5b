"""Tests that a change can touch are found from imports and names."""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).resolve().parents[2]
FOLDERS = {"scene", "units"}
NAMES = ("test_loop", "cli/test_cli", "docs/test_rooms", "docs/test_library_page", "vision/light/test_medians")
FOUND = [path for path in (CHECKOUT / "tests").glob("*/test_*.py") if path.parent.name in FOLDERS]
TESTS = [*(f"tests/{name}.py" for name in NAMES), *(path.relative_to(CHECKOUT).as_posix() for path in FOUND)]
"""Some of the tests, and all of two folders."""


@pytest.fixture(scope="module")
def affected() -> Callable[..., set[str]]:
    """Tests that changes of files touch."""
    tool = import_module("affected")
    checkout = tool.Checkout(CHECKOUT)
    return lambda *changed: set(tool.affected(set(changed), checkout, TESTS))


def test_a_module_touches_those_who_import_it_directly_or_not(affected: Callable[..., set[str]]) -> None:
    found = affected("fogsim/vision/light/medians.py")
    assert {"tests/vision/light/test_medians.py", "tests/test_loop.py", "tests/cli/test_cli.py"} <= found
    assert "tests/units/test_quantities.py" not in found
    assert "tests/docs/test_rooms.py" in found, "it reads all sources"
    assert "tests/units/test_quantities.py" in affected("fogsim/units/quantities.py")


def test_data_pages_and_fixtures_touch_those_who_name_them(affected: Callable[..., set[str]]) -> None:
    assert "tests/cli/test_cli.py" in affected("tests/data/grid/grid.net.xml")
    assert "tests/test_loop.py" in affected("fogsim/vision/data/airlight_slopes.npz")
    assert "tests/docs/test_library_page.py" in affected("docs/how_to/library.md")
    assert affected("tests/scene/conftest.py") == {name for name in TESTS if name.startswith("tests/scene/")}
    assert affected("tests/units/test_quantities.py") == {"tests/units/test_quantities.py"}


def test_settings_of_the_suite_touch_all_and_nothing_touches_none(affected: Callable[..., set[str]]) -> None:
    assert affected("pyproject.toml") == set(TESTS)
    assert affected() == set()
