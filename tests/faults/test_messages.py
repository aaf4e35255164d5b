"""Messages show what a user wrote as it is, in the file's own keys, one printable line for each mistake."""

import io
import types
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import pytest
from pydantic import BaseModel, ValidationError
from rich.console import Console

from fogsim.cli import printing
from fogsim.cli.progress import progress_bar
from fogsim.errors import InputError, printable
from fogsim.offline.camera_file import CameraFile
from fogsim.scenario import Scenario, load_scenario
from fogsim.scenario.mistakes import mistakes_in
from fogsim.scenario.parts.lamp_file import LampFile
from fogsim.scenario.timeline import FogActions, LightActions, TimelineEntry
from fogsim.scenario.timeline.schema import SignalActions
from fogsim.scenario.timeline.vehicle_actions import VehicleActions
from fogsim.scenario.variation import VariationKeys
from fogsim.study.plan import StudyFile

MARKED = ["file.yaml:100: x", ":smile: [red]a[/]", "[link=x]y", r"back\slash [red]"]


@pytest.mark.parametrize("text", MARKED)
def test_errors_and_remarks_are_literal(capsys: pytest.CaptureFixture[str], text: str) -> None:
    printing.print_error(text)
    printing.print_remarks("warning", (text,))
    assert capsys.readouterr().err == f"error: {text}\nwarning: {text}\n"


@pytest.mark.parametrize("text", MARKED)
def test_descriptions_of_progress_are_literal(text: str) -> None:
    console = Console(file=io.StringIO(), width=200)
    with progress_bar(console, stays=True) as progress:
        progress.update(progress.add_task(text, total=1), completed=1)
    assert text in console.file.getvalue()  # type: ignore[attr-defined]  # a StringIO


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("fog 80 m – Ω", "fog 80 m – Ω"),
        ("\x1b[31mred", r"\x1b[31mred"),
        ("a\tb", r"a\tb"),
        ("bell\a", r"bell\x07"),
        ("\udcff", r"\udcff"),
    ],
)
def test_what_terminals_would_obey_is_escaped_and_lines_end_unless_they_must_not(text: str, shown: str) -> None:
    assert printable(text) == shown
    assert printable(shown) == shown
    assert printable("a\nb") == "a\nb"
    assert printable("a\nb", in_one_line=True) == r"a\nb"


def test_all_consoles_leave_emoji_codes_alone() -> None:
    for console in (printing.stdout, printing.stderr):
        assert console.render_str(":100:").plain == ":100:"


def test_error_texts_have_no_control_characters() -> None:
    for name in ["a\x1b[31mb", "a\nb", "\ud800"]:
        assert "\x1b" not in str(InputError(f"there is no {name}"))
        with pytest.raises(InputError) as error:
            load_scenario(name)
        assert str(error.value).isprintable()


# Every field of every file, with values that do not fit.

WRONG: list[Any] = [None, True, -1.5, 10**9, "\x1b[31mno\n", [], [[]], {}, {"no\n": 1}, [{"kind": "no\n"}], ["no", -1]]

SUBJECTS = {VehicleActions: "slow", SignalActions: "signal.C", FogActions: "fog", LightActions: "light"}

Put = Callable[[Any], Any]
"""Builds a file's data around a value."""


def _alternatives(annotation: Any) -> Iterator[Any]:
    if get_origin(annotation) is Annotated:
        yield from _alternatives(get_args(annotation)[0])
    elif get_origin(annotation) in (Union, types.UnionType):
        for part in get_args(annotation):
            yield from _alternatives(part)
    else:
        yield annotation


def _tags(model: type[BaseModel]) -> dict[str, Any]:
    literals = {name: field.annotation for name, field in model.model_fields.items()}
    return {name: get_args(one)[0] for name, one in literals.items() if get_origin(one) is Literal and name != "side"}


def _places(annotation: Any, put: Put) -> Iterator[Put]:
    for one in _alternatives(annotation):
        if isinstance(one, type) and issubclass(one, BaseModel):
            for name, field in one.model_fields.items():
                key, tags = field.alias or name, _tags(one)

                def inside(value: Any, key: str = key, tags: dict[str, Any] = tags) -> Any:
                    return put({**tags, key: value})

                yield inside
                if one is TimelineEntry and key == "do":
                    yield from _subjects(field.annotation, inside)
                else:
                    yield from _places(field.annotation, inside)
        elif get_origin(one) is dict:
            yield lambda value: put({"name": value})
            yield lambda value: put({"na\nme": value})
            yield from _places(get_args(one)[1], lambda value: put({"name": value}))
        elif get_origin(one) in (tuple, list):
            yield lambda value: put([value])
            yield from _places(get_args(one)[0], lambda value: put([value]))


def _subjects(annotation: Any, put: Put) -> Iterator[Put]:
    """What entries of the timeline do, which goes by the name of the subject."""
    for one in _alternatives(get_args(next(iter(_alternatives(annotation))))[1]):
        if isinstance(one, type) and issubclass(one, BaseModel):
            subject = SUBJECTS.get(one, "sensors.camera")

            def inside(value: Any, subject: str = subject) -> Any:
                return put({subject: value})

            yield from _places(one, inside)


def _is_own(path: tuple[str | int, ...], data: Any) -> bool:
    for key in path:
        there = data if isinstance(data, dict) else range(len(data)) if isinstance(data, list) else ()
        if key not in there:
            return False
        data = data[key]
    return True


def _is_made(path: tuple[str | int, ...]) -> bool:
    """Whether a validator makes the key of another: of a list of egos, or of options whose names have dots."""
    return path[:2] in (("traffic", "equipped_vehicles"), ("traffic", "sumo_options"))


def test_key_paths_are_those_of_the_file() -> None:
    """Each place gets a third of the values, the next place the next third."""
    for model in [Scenario, StudyFile, VariationKeys, CameraFile, LampFile]:
        tried = 0
        for number, put in enumerate(_places(model, lambda value: value)):
            for data in map(put, WRONG[number % 3 :: 3]):
                try:
                    model.model_validate(data, context={"folder": Path()})
                except ValidationError as error:
                    found = mistakes_in(model, error, data)
                else:
                    continue
                tried += 1
                for path, text in found:
                    assert text.isprintable(), (data, text)
                    assert "[key]" not in text
                    is_missing = text.startswith("this key is missing")
                    assert _is_own(path[:-1] if is_missing else path, data) or _is_made(path), (data, path, text)
                assert len({(path, text) for path, text in found}) == len(found), (data, found)
        assert tried > len(WRONG)


def test_a_value_that_fits_none_of_several_types_is_one_mistake(tmp_path: Path) -> None:
    for written, line in [
        ("actors: {ego: {lane: 3.5}}", "actors.ego.lane: input should be 'right' or 'left', or a valid integer"),
        (r'actors: {"a\nb": {}}', r"actors.'a\nb': a name has visible characters"),
        ("traffic: {sumo_options: {'a b': 1}}", "traffic.sumo_options.a b: string should match pattern"),
    ]:
        file = tmp_path / "wrong.yaml"
        file.write_text(
            f"name: wrong\nfog: {{visibility_m: 80}}\nroad: {{template: rural}}\n{written}\n", encoding="utf-8"
        )
        with pytest.raises(InputError) as error:
            load_scenario(file)
        (told,) = str(error.value).splitlines()
        assert line in told
