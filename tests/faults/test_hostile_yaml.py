"""Scenario and camera files that are hostile, broken or no files at all: each ends at once, in one message."""

import itertools
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from fogsim.errors import InputError
from fogsim.offline.camera_file import load_calibration
from fogsim.scenario import load_scenario
from fogsim.scenario.plain_yaml import DEEPEST, MOST_BYTES, MOST_NODES, parse_yaml

READERS = [load_scenario, load_calibration]
Reader = Callable[[Path], object]
NAMES = "abcdefghij"


def each_ten_times_the_last(first: str, pattern: str) -> str:
    """Blocks of which each repeats the one before by aliases."""
    pairs = itertools.pairwise(NAMES)
    return f"a: &a {first}\n" + "".join(
        f"{name}: &{name} {pattern.replace('@', ','.join([f'*{last}'] * 10))}\n" for last, name in pairs
    )


HOSTILE = {
    "alias bomb": (each_ten_times_the_last("[1, 1, 1]", "[@]"), f":[0-9]+: .*more than {MOST_NODES} keys and values"),
    "merge bomb": (each_ten_times_the_last("{x: 1}", "{<<: [@]}"), f"more than {MOST_NODES} keys and values"),
    "recursive list": ("x: &x [*x]\n", f":1: .*more than {DEEPEST} blocks and lists inside one another"),
    "recursive block": ("x: &x {a: *x}\n", f":1: .*more than {DEEPEST} blocks and lists"),
    "deep nesting": ("\nx: " + "[" * 3000 + "]" * 3000, f":2: .*more than {DEEPEST} blocks and lists"),
    "deep by aliases": (
        "k0: &a0 [1]\n" + "".join(f"k{i}: &a{i} [*a{i - 1}]\n" for i in range(1, 100)),
        f"more than {DEEPEST} blocks and lists",
    ),
    "many values": ("x: [" + "1," * MOST_NODES + "]", f"more than {MOST_NODES} keys and values"),
    "huge integer": ("x: 1\nwidth: " + "9" * 5000, ":2: .*a number has at most 300 digits, got '9{39} … 9{39}'"),
    "endless number": ("x: 1\nfog: {visibility_m: 1e400}", r":2: .*fog\.visibility_m: expected a finite .*'1e400'"),
    "key twice": ("width: 640\nheight: 3\nwidth: 640\n", ":3: .*width: duplicate key, first on line 1"),
    "key twice, as number and text": ("1: x\n'1': y\n", ":2: .*1: duplicate key, first on line 1"),
    "key twice in a list": ("x:\n- {a: 1, a: 2}\n", r":2: .*x\.0\.a: duplicate key, first on line 2"),
    "escape beyond Unicode": ('x: 1\ny: "\\U00110000"\n', ":2: .*no character"),
    "escape beyond numbers": ('y: "\\UFFFFFFFF"\n', ":1: .*no character"),
    "long version": ("%YAML " + "1" * 5000 + ".1\n---\nx: 1\n", ":1: .*version of %YAML is too long"),
    "tab": ("x: 1\n\ty: 2\n", ":2: .*found character '.t' that cannot start any token"),
    "NUL": ("x: 1\ny: a\0b\n", r":2: .*the character '.x00' is not allowed"),
    "not UTF-8": (b"x: 1\ny: \xff\n", ":2: expected UTF-8 text, got the byte 0xff"),
    "UTF-16": ("x: 1\n".encode("utf-16"), ":1: expected UTF-8 text, got the byte 0xff"),
    "tag of Python": ("x: !!python/object/apply:os.getpid []\n", ":1: .*tags are not used here, got '.*getpid'"),
    "tag of a number": ("x: !!int abc\n", ":1: .*tags are not used here, got 'tag:yaml.org,2002:int'"),
    "list for a key": ("? [a]\n: b\n", ":1: .*a key must be text, got a list or a block"),
    "two documents": ("a: b\n---\nc: d\n", ":2: .*expected a single document"),
    "unknown alias": ("a: *b\n", ":1: .*found undefined alias 'b'"),
    "unclosed": ("a: [1, 2", "not valid YAML"),
    "text": ("just words", "expected a mapping of keys to values, got str"),
    "nothing": ("", "expected a mapping of keys to values, the file is empty"),
    "huge": ("#" * (MOST_BYTES + 1), f"cannot be read: larger than {MOST_BYTES} bytes"),
}


def test_hostile_content_ends_in_one_message(tmp_path: Path) -> None:
    file = tmp_path / "file.yaml"
    for (content, told), reader in zip(HOSTILE.values(), itertools.cycle(READERS), strict=False):
        file.write_bytes(content if isinstance(content, bytes) else content.encode())
        with pytest.raises(InputError, match=told) as error:
            reader(file)
        assert str(error.value).startswith(str(file))
        assert len(str(error.value).splitlines()) == 1


@pytest.mark.parametrize("reader", READERS)
def test_what_is_no_regular_file_is_not_read(tmp_path: Path, reader: Reader) -> None:
    pipe, folder, missing = tmp_path / "pipe.yaml", tmp_path / "folder.yaml", tmp_path / "missing.yaml"
    os.mkfifo(pipe)
    folder.mkdir()
    for path in (pipe, Path("/dev/zero")):
        with pytest.raises(InputError, match=f"^{path}: cannot be read: not a regular file$"):
            reader(path)
    for path in (folder, missing, tmp_path / ("x" * 300 + ".yaml")):
        with pytest.raises(InputError, match=f"^{path}: (cannot be read|there is no such)"):
            reader(path)


def test_names_that_no_file_can_have() -> None:
    for name in ["", "a\0b", "x" * 300]:
        with pytest.raises(InputError, match=r"^unknown scenario "):
            load_scenario(name)
        for setting in (f"traffic.net={name!r}", f"traffic.routes=[{name!r}]"):
            with pytest.raises(InputError, match=r"^--set .*: traffic\.(net|routes)"):
                load_scenario("motorway_fog_bank", [setting.replace("\0", "\\0").replace("'", '"')])


def test_values_are_what_they_look_like() -> None:
    for text, value in [
        ("1e2", 100.0),
        ("1E-2", 0.01),
        (".5", 0.5),
        ("-5", -5),
        ("0640", 640),
        ("1_000", 1000),
        (".inf", float("inf")),
        ("1:30", "1:30"),
        ("0x10", "0x10"),
        ("2026-11-22", "2026-11-22"),
        ("=", "="),
        ("yes", True),
        ("Off", False),
        ("", None),
        ("~", None),
        ("{yes: 1, null: 2, 3: 4}", {"yes": 1, "null": 2, "3": 4}),
        ("{a: &a {x: 1}, b: {<<: *a, y: 2}}", {"a": {"x": 1}, "b": {"x": 1, "y": 2}}),
        ("\ufeffa: 1", {"a": 1}),
    ]:
        assert parse_yaml(text)[0] == value
        assert type(parse_yaml(text)[0]) is type(value)


def test_hostile_overrides_end_in_one_message() -> None:
    for override, told in [
        ("a.b=[" + "[" * 3000, "^--set 'a.b=.* … .*': the value is not valid YAML: more than 40 blocks"),
        ("a.b=&a [*a]", "the value is not valid YAML: more than 40 blocks"),
        (".".join("a" * 3000) + "=1", "^--set '[a.]* … [a.]*=1': a key path has at most 40 keys, got 3000"),
        ("fog.banks." + "9" * 5000 + "=1", "fog.banks is a list of 1; its places are 0 … 0"),
        ("fog.banks.-1.edge_m=1", "fog.banks is a list of 1; its places are 0 … 0"),
        ("traffic.keep_lane.0.x=1", "traffic.keep_lane.0 is a single value and has no keys below it"),
        ("fog.visibility_m.x=3", "fog.visibility_m: .*valid number; got a block of keys"),
        ("fgo.visibility_m=3", "^--set fgo.visibility_m=3: fgo: unknown key; did you mean 'fog'"),
        ("camera={width: 64, width: 64}", "width: duplicate key"),
        ("camera={width: 5}", "^--set camera={width: 5}: camera.width: "),
        ("fog.visibility_m=", "scenario.yaml:27 with --set fog.visibility_m=: fog: visibility_m .* is missing"),
        ('fog.visibility_m="\\e[31m"', r"^--set fog.visibility_m=.*; got '.x1b\[31m'$"),
        ("x" * 3000 + "=1", "^--set 'x{39} … x{37}=1': 'x{39} … x{39}': unknown key"),
        ('"\\e[31m"=1', "unknown key"),
        ("directory=/tmp", "^--set directory=/tmp: directory: unknown key"),
    ]:
        with pytest.raises(InputError, match=told) as error:
            load_scenario("motorway_fog_bank", [override])
        assert len(str(error.value).splitlines()) == 1
        assert str(error.value).isprintable()
    with pytest.raises(InputError, match=r"overrides must be a list, each text, got 'fog\.vis"):
        load_scenario("motorway_fog_bank", "fog.visibility_m=80")
    # A block that is left empty takes overrides.
    assert load_scenario("motorway_fog_bank", ["camera=", "camera.width=64"]).camera.width == 64


SCENARIO = "name: x\ntraffic: {net: a.net.xml, routes: [b]}\nfog: {visibility_m: 80}\n"


def test_every_mistake_is_told_once_and_no_second_follows(tmp_path: Path) -> None:
    for content, told in [
        (SCENARIO + "directory: /tmp\n", ["4: directory: unknown key"]),
        (SCENARIO.replace("net:", "nett:"), ["2: traffic.nett: unknown key; did you mean 'net'"]),
        (SCENARIO.replace("traffic:", "trafic:"), ["2: trafic: unknown key; did you mean 'traffic'"]),
        ("name: x\ntraffic: {confg: a}\nfog: {visibility_m: 80}\n", ["2: traffic.confg: unknown key"]),
        (SCENARIO + "estimators: []\n", ["4: estimators: must have at least one entry; got []"]),
        (SCENARIO + "estimators: [x, 3]\n", ["4: estimators.0: unknown estimator", "4: estimators.1: must be a block"]),
        (SCENARIO.replace("routes: [b]", "routes: 0"), ["2: traffic.routes: must be a list; got 0"]),
        ("name: x\ntraffic:\nfog: 3\n", ["2: traffic: must be a block of keys", "3: fog: must be a block of keys"]),
    ]:
        file = tmp_path / "scenario.yaml"
        file.write_text(content, encoding="utf-8")
        with pytest.raises(InputError) as error:
            load_scenario(file)
        lines = str(error.value).splitlines()
        assert all(line.startswith(f"{file}:{start}") for line, start in zip(lines, told, strict=True)), lines
    # Of many, the first are told.
    file.write_text(SCENARIO + "".join(f"key{i}: 1\n" for i in range(500)), encoding="utf-8")
    with pytest.raises(InputError) as error:
        load_scenario(file)
    lines = str(error.value).splitlines()
    assert (len(lines), lines[-1]) == (51, f"{file}: and 450 more mistakes")
