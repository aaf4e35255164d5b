"""The built wheel, installed into an environment of its own, runs the demo from outside the checkout."""

import json
import os
import shutil
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).resolve().parents[2]
FEW_KERNELS = "estimators=[{method: negru2013, parameters: {as_published: true}}]"
"""Half of a run's kernels are those of the joint fit."""


def call(*command: str | Path, cwd: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    inherited = {k: v for k, v in os.environ.items() if k not in {"PYTHONPATH", "VIRTUAL_ENV"}}
    done = subprocess.run(
        list(map(str, command)),
        cwd=cwd,
        env=inherited | environment,
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done


def carry_kernels_over(checkout: Path, installed: Path) -> None:
    """Give an installed copy of the same sources what is compiled already: to compile anew takes minutes."""
    for source in (checkout / "fogsim").rglob("*.py"):
        copy = installed / source.relative_to(checkout / "fogsim")
        assert copy.read_bytes() == source.read_bytes()
        kernels = list(source.parent.glob(f"__pycache__/{source.stem}.*.nb[ci]"))
        if kernels:
            # numba takes a kernel only for a source of the same time.
            os.utime(copy, ns=(source.stat().st_atime_ns, source.stat().st_mtime_ns))
            (copy.parent / "__pycache__").mkdir(exist_ok=True)
        for kernel in kernels:
            shutil.copy2(kernel, copy.parent / "__pycache__")


@pytest.mark.packaging
@pytest.mark.timeout(900)
def test_the_wheel_runs_the_demo_outside_the_checkout(tmp_path: Path) -> None:
    build = ("-m", "build", "--no-isolation", "--wheel", "--outdir", tmp_path / "dist")
    call(sys.executable, *build, CHECKOUT, cwd=tmp_path)
    (wheel,) = (tmp_path / "dist").glob("fogsim-*.whl")
    venv.create(tmp_path / "venv")
    python = tmp_path / "venv" / "bin" / "python"
    (packages,) = (tmp_path / "venv").glob("lib/python*/site-packages")
    # The wheel's dependencies are those that are here (test_dependencies.py has that none is missing); an editable
    # installation's own path is not taken along, for paths are read from the environment's own folder alone.
    (packages / "dependencies.pth").write_text(f"{sysconfig.get_path('purelib')}\n", encoding="utf-8")
    install = ("-m", "pip", "--python", python, "install", "--no-deps", "--no-compile", "--quiet")
    call(sys.executable, *install, "--disable-pip-version-check", "--force-reinstall", wheel, cwd=tmp_path)
    installed = packages / "fogsim"
    carry_kernels_over(CHECKOUT, installed)
    home = tmp_path / "home"
    home.mkdir()
    fogsim = tmp_path / "venv" / "bin" / "fogsim"
    short = ("--set", "duration_s=2", "--set", "camera.width=160", "--set", "camera.height=120", "--set", FEW_KERNELS)
    done = call(fogsim, "run", "motorway_fog_bank", "--out", "demo", *short, cwd=tmp_path, HOME=str(home))
    assert "ended: time" in done.stdout
    manifest = json.loads((tmp_path / "demo" / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["status"] == "complete"
    options = {"overrides": [FEW_KERNELS]}
    code = (
        "import gymnasium, fogsim_envs; e = gymnasium.make('fogsim/FogAdvisory-v0'); "
        f"e.reset(seed=1, options={options}); e.close()"
    )
    call(python, "-W", "error", "-c", code, cwd=tmp_path, HOME=str(home))
    where = call(python, "-c", "import fogsim; print(fogsim.__file__)", cwd=tmp_path).stdout
    assert str(tmp_path) in where
