"""Damaged files of each cache: made again, replaced, and never the end of a start."""

import importlib.util
import io
import os
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from fogsim.core.files.user_cache import keep_newest, kept_text, read_entry, replace_file, write_entry, write_generated
from fogsim.traffic.road import map_cache
from fogsim.traffic.road.network import read_net
from tests.traffic.common import networks_parsed

GRID = Path(__file__).resolve().parents[1] / "data" / "grid" / "grid.net.xml"
TEXTS = {"road.net.xml": "<net/>\n" * 40, "road.rou.xml": "<routes/>\n"}
KERNEL = """
from fogsim.core.jit import kernel

@kernel
def twice(x):
    return 2.0 * x
"""


def flip(file: Path) -> None:
    """Change a bit in the middle."""
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes(content)


def replace_by(make: Callable[[Path], object]) -> Callable[[Path], None]:
    """Damage by something else in a file's place."""

    def damage(file: Path) -> None:
        file.unlink()
        make(file)

    return damage


DAMAGES: Mapping[str, Callable[[Path], object]] = {
    "empty": lambda file: file.write_bytes(b""),
    "cut off": lambda file: file.write_bytes(file.read_bytes()[:-50]),
    "garbage": lambda file: file.write_bytes(b"\x80\x05\x95" + bytes(range(256))),
    "longer": lambda file: file.write_bytes(file.read_bytes() + b"x"),
    "one bit": flip,
    "missing": lambda file: file.unlink(),
    "a folder": replace_by(lambda file: (file / "inside").mkdir(parents=True)),
    "a pipe": replace_by(os.mkfifo),
    "a link to nowhere": replace_by(lambda file: file.symlink_to("nowhere")),
}


class Used(NamedTuple):
    """What a cache is for, with how often it was made so far (0: not counted), and which of its files are damaged."""

    use: Callable[[], tuple[object, int]]
    folder: Path
    pattern: str = "*"


def _generated(folder: Path, _: pytest.MonkeyPatch) -> Used:
    def use() -> tuple[object, int]:
        made = write_generated("roads", TEXTS)
        return {name: (made / name).read_text(encoding="utf-8") for name in TEXTS}, 0

    return Used(use, folder / "roads", "*/road.net.xml")


def _kept(folder: Path, _: pytest.MonkeyPatch) -> Used:
    made = list[str]()

    def make() -> str:
        made.append("a road " * 20)
        return made[-1]

    return Used(lambda: (kept_text("opendrive", GRID, b"recipe", make), len(made)), folder / "opendrive")


def _map(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Used:
    monkeypatch.setattr(map_cache, "_WORTHWHILE", 0)
    parsed = networks_parsed(monkeypatch)

    def use() -> tuple[object, int]:
        lanes = read_net(GRID).lanes
        return [(lane.lane_id, lane.width, lane.centreline.tolist()) for lane in lanes], len(parsed)

    return Used(use, folder / "networks")


def _kernel(folder: Path, pattern: str) -> Used:
    module = folder / "doubling.py"
    module.parent.mkdir(exist_ok=True)
    module.write_text(KERNEL, encoding="utf-8")
    compiled = 0

    def use() -> tuple[object, int]:
        nonlocal compiled
        spec = importlib.util.spec_from_file_location("doubling", module)
        loaded: Any = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(loaded)
        answer = loaded.twice(21.0)
        compiled += sum(loaded.twice.stats.cache_misses.values())
        return answer, compiled

    return Used(use, folder / "__pycache__", pattern)


CACHES: Mapping[str, Callable[[Path, pytest.MonkeyPatch], Used]] = {
    "generated road": _generated,
    "converted road": _kept,
    "map of a network": _map,
    "index of a kernel": lambda folder, _: _kernel(folder, "*.nbi"),
    "code of a kernel": lambda folder, _: _kernel(folder, "*.nbc"),
}


# Files are read and replaced alike in all of them.
@pytest.mark.parametrize(
    ("cache", "damage"),
    [
        *(("map of a network", damage) for damage in DAMAGES),
        *((cache, "one bit") for cache in CACHES if cache != "map of a network"),
        ("generated road", "a pipe"),
    ],
)
def test_what_is_damaged_is_made_once(cache: str, damage: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FOGSIM_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr("numba.core.config.CACHE_DIR", "")
    used = CACHES[cache](tmp_path / "cache", monkeypatch)
    first, made = used.use()
    (file,) = used.folder.glob(used.pattern)
    DAMAGES[damage](file)
    assert used.use() == (first, 2 * made)
    assert used.use() == (first, 2 * made)
    assert file.is_file()
    assert not file.is_symlink()
    assert not list(used.folder.rglob("*.part"))


def _arrays(change: Callable[[dict[str, Any]], object]) -> Callable[[bytes], bytes]:
    def forged(content: bytes) -> bytes:
        with np.load(io.BytesIO(content)) as found:
            arrays = dict(found)
        change(arrays)
        file = io.BytesIO()
        np.savez(file, **arrays)
        return file.getvalue()

    return forged


@pytest.mark.parametrize(
    "forge",
    [
        _arrays(lambda arrays: arrays.update(edges=np.array([print], object))),
        _arrays(lambda arrays: arrays.pop("sizes")),
        _arrays(lambda arrays: arrays.update(centrelines=arrays["centrelines"][:-1])),
        _arrays(lambda arrays: arrays.update(codes=arrays["codes"].ravel())),
        lambda content: content[:-100],
    ],
    ids=["objects", "a key less", "points less", "another shape", "no archive"],
)
def test_a_map_with_a_right_checksum_and_wrong_arrays_is_made_again(
    forge: Callable[[bytes], bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FOGSIM_CACHE_DIR", str(tmp_path))
    used = _map(tmp_path, monkeypatch)
    first = used.use()
    (file,) = used.folder.iterdir()
    content = read_entry(file)
    write_entry(file, forge(content))
    assert used.use() == (first[0], 2)
    assert used.use() == (first[0], 2)


def test_a_kernel_that_cannot_be_kept_is_compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("fogsim.core.compiling.code_libraries.write_entry", full)
    monkeypatch.setattr("numba.core.config.CACHE_DIR", "")
    used = _kernel(tmp_path / "package", "*")
    assert used.use() == (42.0, 1)
    assert used.use() == (42.0, 2)


def test_code_of_an_earlier_source_is_never_taken_for_this_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("numba.core.config.CACHE_DIR", "")
    used = _kernel(tmp_path, "*")
    assert used.use() == (42.0, 1)
    (tmp_path / "doubling.py").write_text(KERNEL.replace("2.0", "30.0"), encoding="utf-8")

    def nearly_full(path: Path, content: bytes) -> None:
        if path.suffix == ".nbc":
            raise OSError(28, "No space left on device")
        write_entry(path, content)

    with monkeypatch.context() as disk:
        disk.setattr("fogsim.core.compiling.code_libraries.write_entry", nearly_full)
        assert used.use()[0] == 630.0
    assert used.use()[0] == 630.0
    assert len([*tmp_path.rglob("*.nbc")]) == len([*tmp_path.rglob("*.nbi")])  # none of the earlier source is left


def test_a_file_in_place_of_a_folder_of_roads_gives_way(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FOGSIM_CACHE_DIR", str(tmp_path))
    folder = write_generated("roads", TEXTS)
    shutil.rmtree(folder)
    folder.write_text("no folder", encoding="utf-8")
    assert write_generated("roads", TEXTS) == folder
    assert sorted(path.name for path in folder.iterdir()) == sorted(TEXTS)


def test_a_write_that_fails_leaves_the_entry_and_no_part(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_entry(tmp_path / "entry", b"old")

    def cut_off(self: Path, _: Path) -> Path:
        raise OSError("cut off")

    monkeypatch.setattr(Path, "replace", cut_off)
    with pytest.raises(OSError, match="cut off"):
        replace_file(tmp_path / "entry", b"new")
    assert read_entry(tmp_path / "entry") == b"old"
    assert [path.name for path in tmp_path.iterdir()] == ["entry"]


def test_only_the_newest_are_kept_of_files_and_folders(tmp_path: Path) -> None:
    for number in range(6):
        path = tmp_path / str(number)
        path.mkdir() if number % 2 else path.touch()
        os.utime(path, (number, number))
    # The clock was set back before "3" was written.
    keep_newest(tmp_path, 2, tmp_path / "3")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["3", "4", "5"]
