"""Say in one line what FogSim needs from the operating system and does not find; exit 1 if anything is missing.

    python3 tools/check_system.py [--all-tests] [--packages]

``--all-tests`` asks also for what only the tests need: OpenGL, without which FogSim draws on the processor, a
display without a screen for sumo-gui, and the browser that opens the documentation site. ``--packages`` prints
nothing but the names of the Debian packages.
Runs before anything is installed, so it uses the standard library alone.
"""

import ctypes
import importlib.util
import shutil
import sys

MINIMUM = (3, 11)
LIBRARIES = {"libXrender.so.1": "libxrender1", "libatomic.so.1": "libatomic1"}
"""Shared libraries that SUMO's wheel loads, and the packages that provide them."""

TEST_LIBRARIES = {
    "libEGL.so.1": "libegl1 libegl-mesa0 libgl1-mesa-dri",
    "libGL.so.1": "libgl1",
    "libOSMesa.so.8": "libosmesa6",
}
TEST_PROGRAMS = {"Xvfb": "xvfb", "chromium": "chromium"}


def missing_packages(for_all_tests: bool = False) -> list[str]:
    """Debian/Ubuntu packages that would provide what is not found."""
    packages = []
    if importlib.util.find_spec("ensurepip") is None:
        packages.append(f"python{sys.version_info.major}.{sys.version_info.minor}-venv")
    for library, provided_by in (LIBRARIES | (TEST_LIBRARIES if for_all_tests else {})).items():
        try:
            ctypes.CDLL(library)
        except OSError:
            packages += provided_by.split()
    if for_all_tests:
        packages += [package for program, package in TEST_PROGRAMS.items() if shutil.which(program) is None]
    return packages


def main() -> int:
    """Check and report."""
    if "--packages" in sys.argv[1:]:
        print(" ".join(missing_packages("--all-tests" in sys.argv[1:])))  # noqa: T201 - the line is the result
        return 0
    if sys.version_info < MINIMUM:
        print(f"FogSim needs Python {MINIMUM[0]}.{MINIMUM[1]} or newer, this is {sys.version.split()[0]}.")  # noqa: T201 - the line is the result
        return 1
    packages = missing_packages(for_all_tests="--all-tests" in sys.argv[1:])
    if packages:
        print(f"FogSim lacks system libraries; install them with: sudo apt-get install {' '.join(packages)}")  # noqa: T201 - the line is the result
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
