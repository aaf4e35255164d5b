"""Kernels that came with the installation are taken where they are right, and nowhere else."""

import os
import pickle
import platform
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numba
import pytest

from fogsim.core.compiling import shipped_code
from fogsim.core.compiling.shipped_code import KINDS, compiled_for, usable_kind, why_not_taken
from fogsim.core.files.user_cache import write_entry
from tests.helpers.command import run_python

SOURCE = """
from fogsim.core.jit import kernel

@kernel
def twice(x):
    return {factor} * x
"""

ASK = """
import importlib, sys
from pathlib import Path
from fogsim.core.compiling import shipped_code
from fogsim.core.jit import is_kept
for folder in map(Path, sys.argv[1:] or ["."]):
    shipped_code.PACKAGE, shipped_code.FOLDER = (folder / "package").resolve(), (folder / "shipped").resolve()
    sys.path[0] = str(shipped_code.PACKAGE / "part")
    sys.modules.pop("doubling", None)
    importlib.invalidate_caches()
    twice = importlib.import_module("doubling").twice
    kept = is_kept(twice)
    print(twice(10.0), kept, sum(twice.stats.cache_hits.values()))
"""

COMPILED_FOR = compiled_for()
pytestmark = pytest.mark.skipif(COMPILED_FOR is None, reason="none are shipped for this machine")

Ask = Callable[..., list[str]]


def asked(folder: Path, environment: dict[str, str], *folders: str) -> list[str]:
    path = os.pathsep.join(path for path in sys.path if path)
    # Bytecode would be taken for that of a source of the same size written within a second.
    told = {"PYTHONDONTWRITEBYTECODE": "1", "PYTHONPATH": path, **environment}
    return run_python("-c", ASK, *folders, cwd=folder, environment=told).stdout.split()


@pytest.fixture(scope="module")
def shipped(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A package whose installation came with a kernel."""
    folder = tmp_path_factory.mktemp("shipped")
    part = folder / "package" / "part"
    part.mkdir(parents=True)
    (part / "doubling.py").write_text(SOURCE.format(factor=2.0))
    with pytest.MonkeyPatch.context() as patch:
        for name in [name for name in os.environ if name.startswith("NUMBA_")]:
            patch.delenv(name)
        assert asked(folder, COMPILED_FOR or {}) == ["20.0", "False", "0"]
        (folder / "shipped" / "part").mkdir(parents=True)
        for file in (part / "__pycache__").glob("*.nb[ci]"):
            file.rename(folder / "shipped" / "part" / file.name)
        yield folder


@pytest.fixture
def ask(shipped: Path, tmp_path: Path) -> Ask:
    """What a process gets of that package."""
    shutil.copytree(shipped, tmp_path, dirs_exist_ok=True)
    return lambda **environment: asked(tmp_path, environment)


def kept(folder: Path) -> list[Path]:
    return list((folder / "package").rglob("*.nb[ci]"))


@pytest.mark.skipif(usable_kind() is None, reason="this processor is older than those that kernels are shipped for")
def test_what_came_is_taken_and_not_compiled_nor_kept_again(ask: Ask, tmp_path: Path) -> None:
    assert ask() == ["20.0", "True", "1"]
    assert not kept(tmp_path)


@pytest.mark.skipif(usable_kind() is None, reason="this processor is older than those that kernels are shipped for")
def test_what_came_is_taken_where_nothing_can_be_kept(ask: Ask, tmp_path: Path) -> None:
    file = tmp_path / "package" / "part" / "__pycache__"
    shutil.rmtree(file, ignore_errors=True)
    file.write_text("no folder")
    assert ask(HOME=str(file), XDG_CACHE_HOME=str(file)) == ["20.0", "True", "1"]


def test_a_changed_source_is_compiled_and_a_damaged_file_is_as_none(shipped: Path, tmp_path: Path) -> None:
    for name in ("changed", "nbc", "nbi"):
        shutil.copytree(shipped, tmp_path / name)
        for file in (tmp_path / name / "shipped").rglob(f"*.{name}"):
            file.write_bytes(file.read_bytes()[:100])
    (tmp_path / "changed" / "package" / "part" / "doubling.py").write_text(SOURCE.format(factor=3.0))
    said = asked(tmp_path, {}, "changed", "nbc", "nbi")
    assert said[::3] == ["30.0", "20.0", "20.0"]
    assert said[2::3] == ["0", "0", "0"]
    assert all(kept(tmp_path / name) for name in ("changed", "nbc", "nbi"))


def test_who_tells_numba_how_to_compile_is_obeyed(ask: Ask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert ask(NUMBA_CPU_NAME="generic") == ["20.0", "False", "0"]
    assert kept(tmp_path)
    monkeypatch.setattr(shipped_code.config, "BOUNDSCHECK", 1)
    assert usable_kind.__wrapped__() is None


def test_an_older_processor_compiles_for_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    (kind,) = KINDS.values()
    for lacking in (None, "avx2"):
        features = {name: name != lacking for name in kind.features}
        monkeypatch.setattr(shipped_code.llvm, "get_host_cpu_features", features.copy)
        assert usable_kind.__wrapped__() == (kind if lacking is None else None)


def test_an_unknown_processor_compiles_for_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail() -> dict[str, bool]:
        raise RuntimeError("failed to query host cpu features")

    monkeypatch.setattr(shipped_code.llvm, "get_host_cpu_features", fail)
    assert usable_kind.__wrapped__() is None


def test_it_is_said_why_what_came_is_not_taken(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(shipped_code, "FOLDER", tmp_path)
    monkeypatch.setattr(shipped_code, "usable_kind", lambda: KINDS[platform.machine()])
    assert why_not_taken() is None
    index = tmp_path / "part" / "doubling.twice-1.nbi"
    write_entry(index, pickle.dumps(numba.__version__))
    assert why_not_taken() is None
    write_entry(index, pickle.dumps("0.1"))
    assert why_not_taken() == f"those that came with it are of numba 0.1, and here is {numba.__version__}"
    index.write_bytes(b"")
    assert why_not_taken() == "those that came with it cannot be read"
    monkeypatch.setattr(shipped_code, "usable_kind", lambda: None)
    assert why_not_taken() == "those that came with it are for x86-64-v3"
