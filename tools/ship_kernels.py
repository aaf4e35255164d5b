"""The wheel's kernels, compiled when it is built, so that a first run compiles none.

hatchling's build hook. It needs all that FogSim needs and takes a minute, so it is off unless it is asked for, as
``make wheel`` does; without it a wheel is for any machine and any Python, and first runs compile:

    HATCH_BUILD_HOOK_ENABLE_CUSTOM=true python -m build
"""

import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

FOLDER = "fogsim/_kernels"
"""Where the wheel has them, as `fogsim.core.compiling.shipped_code` finds them."""

SOURCES = ("fogsim", "envs", "scenarios")
COMPILE = ("-c", "from fogsim.cli.compile import compile_kernels\nfor ready in compile_kernels():\n    print(ready)")
"""What Python runs: not the command itself, which wants to know the version of FogSim that is installed."""


class KernelsHook(BuildHookInterface[Any]):
    """Adds compiled kernels to a wheel, and says in its name for which Python and machine they are."""

    PLUGIN_NAME = "custom"

    _workplace: "tempfile.TemporaryDirectory[str] | None" = None

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile them, unless the installation is one of the checkout itself."""
        if version != "standard":
            return
        variables = compiled_for(Path(self.root))
        if variables is None:
            self.app.display_warning(f"No kernels are shipped for {platform.platform()}: first runs will compile.")
            return
        self._workplace = tempfile.TemporaryDirectory()
        self.app.display_info("Compiling FogSim's kernels, a minute or two …")
        build_data["force_include"] |= compiled_kernels(Path(self.root), Path(self._workplace.name), variables)
        python = f"cp{sys.version_info.major}{sys.version_info.minor}"
        build_data["pure_python"] = False
        # They call nothing of a C library but mathematics, which it has had as long as there are such wheels.
        build_data["tag"] = f"{python}-{python}-manylinux_2_17_{platform.machine()}"

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:  # noqa: ARG002 - hatchling's
        """Remove what they were compiled in."""
        if self._workplace is not None:
            self._workplace.cleanup()


def compiled_for(root: Path) -> Mapping[str, str] | None:
    """Environment in which they are compiled; None on systems for which none are shipped."""
    if platform.libc_ver()[0] != "glibc":
        return None
    sys.path.insert(0, str(root))
    # What hatchling imports must not need what only the build needs.
    from fogsim.core.compiling.shipped_code import compiled_for as variables  # noqa: PLC0415

    sys.path.remove(str(root))
    return variables()


def compiled_kernels(root: Path, workplace: Path, variables: Mapping[str, str]) -> dict[str, str]:
    """Compile kernels in a copy of the sources in an empty folder: the place in the wheel of each of numba's files."""
    for name in SOURCES:
        shutil.copytree(root / name, workplace / name, ignore=shutil.ignore_patterns("__pycache__"))
    inherited = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    # The last is what build frontends have, to let Python find what they installed for the build alone.
    path = (str(workplace), str(workplace / "envs"), os.environ.get("PYTHONPATH", ""))
    environment = {**inherited, **variables, "PYTHONPATH": os.pathsep.join(path), "PYTHONDONTWRITEBYTECODE": "1"}
    subprocess.run([sys.executable, *COMPILE], cwd=workplace, env=environment, check=True)  # noqa: S603 - FogSim's own
    package = workplace / "fogsim"
    return {
        str(file): str(Path(FOLDER) / file.parents[1].relative_to(package) / file.name)
        for file in sorted(package.rglob("__pycache__/*.nb[ci]"))
    }
