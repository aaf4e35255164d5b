"""Options with numbers that are none or out of range, and empty paths: refused by name, in every command."""

import math
from collections.abc import Callable, Iterator
from inspect import signature
from pathlib import Path
from typing import Any, get_args

import pytest
import typer
from typer.models import OptionInfo

from fogsim.cli import app
from tests.helpers.command import Command


def options(group: typer.Typer, *before: str) -> Iterator[tuple[tuple[str, ...], str, set[Any], float | None]]:
    """Command, name, types and largest value of every option of a group's commands."""
    for command in group.registered_commands:
        for parameter in signature(command.callback).parameters.values():
            kind, info = get_args(parameter.annotation)
            if isinstance(info, OptionInfo):
                # typer holds the first name of an annotation as the default.
                names = [one for one in (info.default, *(info.param_decls or ())) if str(one).startswith("--")]
                name = names[0] if names else "--" + parameter.name.replace("_", "-")
                yield (*before, str(command.name)), name, {kind, *get_args(kind)}, info.max
    for inner in group.registered_groups:
        yield from options(inner.typer_instance, *before, str(inner.name))


NUMBERS = [
    (command, name, value)
    for command, name, types, most in options(app.app)
    for value in ("nan", "-inf", "1e40", "1e999", "x", "")
    if types & {int, float} and not (value == "1e40" and most == math.inf)
]
PATHS = [(command, name, "") for command, name, types, _ in options(app.app) if Path in types]
ARGUMENTS = [((name,), "", "") for name in ("run", "estimate", "restore", "signs", "validate", "test", "study", "new")]


@pytest.fixture
def refusal(command: Command, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[..., str]:
    """Run a command that must be refused as bad input, and write nothing: gives stderr."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str) -> str:
        done = command(*arguments)
        assert done.returncode == 2
        assert not list(tmp_path.iterdir())
        return done.stderr

    return run


@pytest.mark.parametrize("kind", ["nan", "-inf", "1e40", "1e999", "x", "", "empty path", "empty argument"])
def test_a_bad_value_is_refused_with_its_option_and_what_is_allowed(refusal: Callable[..., str], kind: str) -> None:
    others = {"empty path": PATHS, "empty argument": ARGUMENTS}
    tried = others.get(kind) or [one for one in NUMBERS if one[2] == kind]
    for command, name, value in tried:
        told = refusal(*command, f"{name}={value}" if name else value)
        assert told.startswith(f"error: {name}"), (command, name, value)
        assert ": expected a" in told, (command, name, value)
        assert len(told.splitlines()) == 1, (command, name, value)


def test_the_commands_have_options_with_numbers_and_paths() -> None:
    assert len(NUMBERS) > 100
    assert len(PATHS) > 20


def test_an_airlight_that_is_no_pixel_value_is_refused(refusal: Callable[..., str]) -> None:
    for light in ["nan", "nan,1,1", "1e400", "x", "1,2", "-1", ""]:
        assert "--airlight" in refusal(
            "fog", "photo.png", "--visibility", "50", "--out", "x.png", f"--airlight={light}"
        )
