"""The cache directory of the user."""

import os
import sys
from pathlib import Path

VARIABLE = "FOGSIM_CACHE_DIR"
"""Environment variable with another directory."""


def cache_directory() -> Path:
    """FogSim's folder in the user's cache directory, which may not exist yet.

    ``FOGSIM_CACHE_DIR`` if set; otherwise ``fogsim`` in ``XDG_CACHE_HOME`` or in the system's cache folder:
    ``~/.cache``, ``~/Library/Caches`` (macOS), ``%LOCALAPPDATA%`` (Windows).
    """
    named = os.environ.get(VARIABLE)
    if named:
        return Path(named)
    home = os.path.expanduser("~")  # noqa: PTH111 - without a home, Path.home() raises
    system = {"darwin": f"{home}/Library/Caches", "win32": os.environ.get("LOCALAPPDATA", f"{home}/AppData/Local")}
    return Path(os.environ.get("XDG_CACHE_HOME") or system.get(sys.platform, f"{home}/.cache")) / "fogsim"
