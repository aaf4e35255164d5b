"""The drawing of the rooms is of today, every module has its layer, and the walks lead through files that exist."""

import ast
import re
import tomllib
from pathlib import Path

import pytest

from tests.helpers.command import run_script

CHECKOUT = Path(__file__).resolve().parents[2]
PAGE = (CHECKOUT / "docs" / "explanation" / "code_layout.md").read_text(encoding="utf-8")
CONTRACTS = tomllib.loads((CHECKOUT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"][
    "contracts"
]

KERNEL = "kernel"
CONSTANTS_ONLY = CHECKOUT / "fogsim" / "render" / "shading" / "surfaces.py"
"""Kernels that take numbers of surfaces and of lamps' sides from where values define them."""


@pytest.mark.nightly
def test_the_drawing_is_of_today() -> None:
    done = run_script(CHECKOUT / "tools" / "rooms.py", "--check")
    assert done.returncode == 0, done.stderr


def test_every_module_has_its_layer() -> None:
    layered = [contract for contract in CONTRACTS if contract["type"] == "layers"]
    assert all(contract["exhaustive"] for contract in layered)
    # What contracts say of the packages at the top they say of all modules: none is loose.
    held = {container for contract in layered for container in contract["containers"]}
    assert {"fogsim", "fogsim_envs", "fogsim.vision", "fogsim.atmosphere", "fogsim.traffic"} <= held


def test_no_package_has_more_than_twenty_modules() -> None:
    for package in (CHECKOUT / "fogsim").rglob("__init__.py"):
        assert len([*package.parent.glob("*.py")]) <= 21, package.parent


def test_modules_of_kernels_import_no_values() -> None:
    """A module consists of kernels if its name says so, or if every function and method of it is decorated as one."""
    found = 0
    for path in (CHECKOUT / "fogsim").rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        if f"@{KERNEL}" not in text and not path.stem.endswith("_kernels"):
            continue
        tree = ast.parse(text)
        bodies = [tree.body, *(node.body for node in tree.body if isinstance(node, ast.ClassDef))]
        functions = [node for body in bodies for node in body if isinstance(node, ast.FunctionDef)]
        are_kernels = functions and all(KERNEL in map(ast.unparse, function.decorator_list) for function in functions)
        if (are_kernels or path.stem.endswith("_kernels")) and path != CONSTANTS_ONLY:
            imported = [node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
            assert not [name for name in imported if f"{name}.".startswith("fogsim.values.")], path
            found += 1
    assert found > 10


def test_the_walks_lead_through_files_that_are_there() -> None:
    walks = PAGE.partition("## Three walks")[2].partition("\n## ")[0]
    files = re.findall(r"\b([a-z_]+/[\w/]+\.py|loop\.py)", walks)
    assert len(files) > 30
    for file in files:
        assert any((CHECKOUT / "fogsim" / folder / file).exists() for folder in ("", "atmosphere")), file
