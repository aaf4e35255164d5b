"""Shapes, frames, decisions and metrics are the same whatever processor the libraries beneath believe they run on.

``tools/fingerprint.py`` is run by processes that are told to use other kernels of OpenBLAS, none of numpy's AVX-512,
numba's code for any x86-64, or the C library's functions without FMA. Of OpenBLAS's kernels, those are taken that this
processor can run: always three.
"""

import json
import platform
import runpy
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fogsim.estimators import ESTIMATORS
from fogsim.offline import NIGHT_METHODS
from tests.helpers.command import run_program

TOOL = Path(__file__).parents[2] / "tools" / "fingerprint.py"
CORE_TYPES = {"SkylakeX": "avx512bw", "Haswell": "avx2", "Sandybridge": "avx", "Nehalem": "sse4_2", "Prescott": "sse3"}
"""OpenBLAS's kernels, and the instructions that they need."""

pytestmark = [
    pytest.mark.skipif(platform.machine() not in {"x86_64", "AMD64"}, reason="variants are those of x86-64"),
    pytest.mark.timeout(1800),
]


def _core_types() -> list[str]:
    """The newest, the second and the oldest kernels of OpenBLAS that this processor can run."""
    cpuinfo = Path("/proc/cpuinfo")
    flags = set(cpuinfo.read_text().replace("pni", "sse3").split()) if cpuinfo.exists() else {"avx", "sse4_2", "sse3"}
    able = [core for core, needed in CORE_TYPES.items() if needed in flags]
    return [able[0], able[1], able[-2]] if len(able) > 3 else able


def _numpy_features() -> str:
    """What numpy may be told not to use: its AVX-512 or, where there is none, all that it has found."""
    found = np.show_config(mode="dicts")["SIMD Extensions"].get("found", [])
    newest = [name for name in found if name.startswith("AVX512") or name == "X86_V4"]
    return " ".join(newest or found)


BESIDE: Mapping[str, Mapping[str, str]] = {
    "all else as it is": {},
    "numpy without AVX-512": {"NPY_DISABLE_CPU_FEATURES": _numpy_features()},
    "C library without FMA": {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA"},
}
VARIANTS: Mapping[str, Mapping[str, str]] = {
    f"OpenBLAS for {core}, {name}": {"OPENBLAS_CORETYPE": core, **setting}
    for core, (name, setting) in zip(_core_types(), BESIDE.items(), strict=False)
}
"""Two changes at a time, for each variant takes the time of two drives, and whatever differs is found all the same."""
PARTS = ("shapes", "day", "night", "chase")
GENERIC = {
    "numba for any processor": ("shapes", "day", "chase"),
    "numba for any processor, at the same time": ("night",),
}
"""Two processes that together tell all; the kernels of drawing are those that both compile at once."""

ROUNDED = """
import hashlib, math, numpy as np
x = np.random.default_rng(0).normal(size=(200, 200))
for y in (x @ x, np.concatenate((np.exp(x), np.exp(x.astype("f4")))), np.array([math.exp(v) for v in x.ravel()])):
    print(hashlib.sha256(y.tobytes()).hexdigest())
"""

Answers = Mapping[str, "Future[Any]"]


@pytest.fixture(scope="module")
def answers(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Answers]:
    """What each process says; those two start first, together, that compile every kernel into one empty folder."""
    kernels = {"NUMBA_CPU_NAME": "generic", "NUMBA_CACHE_DIR": str(tmp_path_factory.mktemp("kernels"))}
    with ThreadPoolExecutor(max_workers=2) as pool:
        generic = {name: pool.submit(_fingerprint, kernels, parts) for name, parts in GENERIC.items()}
        others = {name: pool.submit(_fingerprint, setting) for name, setting in {"here": {}, **VARIANTS}.items()}
        yield generic | others


def _fingerprint(setting: Mapping[str, str], parts: Sequence[str] = PARTS) -> Any:
    return json.loads(_said(setting, TOOL, *parts))


def _said(setting: Mapping[str, str], *arguments: str | Path) -> str:
    """What Python prints where the environment is changed so."""
    return run_program(sys.executable, *arguments, environment=setting).stdout


@pytest.fixture(scope="module")
def differences() -> Callable[[Any, Any], Iterator[str]]:
    """The tool's comparison."""
    found: Callable[[Any, Any], Iterator[str]] = runpy.run_path(str(TOOL))["differences"]
    return found


def test_three_kinds_of_kernels_are_tried() -> None:
    assert len(_core_types()) == 3


def test_variants_do_vary() -> None:
    """What they are set against is not the same for all: products of BLAS, exponentials of numpy and of C."""
    said = {name: _said(setting, "-c", ROUNDED).split() for name, setting in VARIANTS.items()}
    products, exponentials, of_c = zip(*said.values(), strict=True)
    assert len(set(products[:3])) > 1
    assert len(set(exponentials)) > 1
    assert len(set(of_c)) > 1


@pytest.mark.parametrize("variant", [*VARIANTS, *GENERIC])
def test_a_processor_changes_nothing(
    answers: Answers, differences: Callable[[Any, Any], Iterator[str]], variant: str
) -> None:
    here = answers["here"].result()
    parts = GENERIC.get(variant, PARTS)
    assert not list(differences({part: here[part] for part in parts}, answers[variant].result()))


def test_what_is_compared_is_a_drive_in_fog_with_advice(answers: Answers) -> None:
    here = answers["here"].result()
    assert all(len(set(here[drive]["frames"])) == len(here[drive]["frames"]) == 11 for drive in ("day", "night"))
    assert here["day"]["decisions"][0] != here["day"]["decisions"][-1]
    assert len(here["shapes"]) > 150


def test_every_method_of_the_day_sees_the_fog_in_what_is_compared(answers: Answers) -> None:
    valid = answers["here"].result()["chase"]["valid"]
    assert list(valid) == list(ESTIMATORS)
    # The chase passes no signs, and is by day; the vehicle stays in sight, and other sensors there are none.
    silent = {"belaroussi2015", "sign_contrast", "gabb2014", "hautiere2006_stereo", "scatterometer", *NIGHT_METHODS}
    telling = [frames for method, frames in valid.items() if method not in silent]
    assert all(sum(frames) >= 5 for frames in telling)


def test_second_cameras_and_scatterometers_tell_in_what_is_compared(answers: Answers) -> None:
    last = answers["here"].result()["day"]["decisions"][-1]
    assert "hautiere2006_stereo True" in last
    assert "scatterometer True" in last


def test_a_difference_is_told(answers: Answers, differences: Callable[[Any, Any], Iterator[str]]) -> None:
    here = answers["here"].result()
    other = json.loads(json.dumps(here))
    other["night"]["frames"][3] = "another"
    other["day"]["numbers"]["0 route"] += 1e-6
    other["day"]["metrics"][2] = "another"
    told = list(differences(here, other))
    assert [line.split(":")[0] for line in told] == ["/day/metrics/2", "/day/numbers/0 route", "/night/frames/3"]
