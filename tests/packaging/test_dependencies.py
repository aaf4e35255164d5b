"""What the packages import is what an installation of them brings along."""

import re
import sys
import tomllib
from importlib.metadata import packages_distributions, requires
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

CHECKOUT = Path(__file__).resolve().parents[2]
OWN = {"fogsim", "fogsim_envs"}
BROUGHT_ALONG = {"OpenGL": "pyrender", "llvmlite": "numba", "pydantic_core": "pydantic"}
"""Imports that a dependency pins to what it works with, and that one."""
OPTIONAL = {
    "minari": ("rl", "minari"),
    "onnx": ("onnx", "onnx"),
    "onnxruntime": ("onnx", "onnxruntime"),
    "openodd": ("odd", "openodd-py"),
    "osi3": ("osi", "osi-python"),
    "pettingzoo": ("rl", "pettingzoo"),
    "ray": ("ray", "ray"),
    "stable_baselines3": ("rl", "stable-baselines3"),
}
"""Imports that only some of the work needs: the extra that brings each along, and the distribution."""


def imported(path: Path) -> set[str]:
    return set(
        re.findall(r"^ *(?:import|from(?=[\w. ]* import\b)) (\w+)", path.read_text(encoding="utf-8"), re.MULTILINE)
    )


def names_of(requirements: list[str]) -> set[str]:
    return {re.split(r"[<>=!~\[; ]", one)[0].lower() for one in requirements}


def test_every_import_is_a_declared_dependency_and_every_dependency_is_imported() -> None:
    project = tomllib.loads((CHECKOUT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    declared = names_of(project["dependencies"])
    sources = [*(CHECKOUT / "fogsim").rglob("*.py"), *(CHECKOUT / "envs").rglob("*.py")]
    names = set().union(*map(imported, sources)) - OWN - set(sys.stdlib_module_names)
    assert set(OPTIONAL) <= names
    for extra, distribution in OPTIONAL.values():
        assert distribution in names_of(project["optional-dependencies"][extra])
    # pytest itself imports its plug-in, so that it is there whenever that is.
    names -= {*OPTIONAL, "pytest"}
    distributions = packages_distributions()
    needed = {BROUGHT_ALONG.get(name, distributions[name][0].lower().replace("_", "-")) for name in names}
    assert needed == declared


def brought_along(name: str, extras: frozenset[str], seen: set[tuple[str, frozenset[str]]]) -> set[str]:
    """Names of what an installation of a distribution brings along here, itself left out."""
    found: set[str] = set()
    seen.add((name, extras))
    for line in requires(name) or []:
        one = Requirement(line)
        if one.marker and not any(one.marker.evaluate({"extra": extra}) for extra in (*extras, "")):
            continue
        needed, asked = canonicalize_name(one.name), frozenset(one.extras)
        found.add(needed)
        if (needed, asked) not in seen:
            found |= brought_along(needed, asked, seen)
    return found


def test_the_page_says_why_each_package_is_there() -> None:
    page = (CHECKOUT / "docs" / "explanation" / "dependencies.md").read_text(encoding="utf-8")
    listed = [row.split("|")[1] for row in page.splitlines() if row.startswith("| ")][2:]
    names = {name.strip(" *"): "**" in cell for cell in listed for name in cell.split(",")}
    project = tomllib.loads((CHECKOUT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert {name for name, own in names.items() if own} == names_of(project["dependencies"])
    # Another version of a dependency may need less.
    assert brought_along("fogsim", frozenset(), set()) - set(names) == set()
