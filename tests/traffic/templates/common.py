"""SUMO plays files of templates."""

import subprocess
from pathlib import Path

import sumo


def play(folder: Path, net: str, routes: str, *options: str) -> str:
    """What SUMO writes to its error output for a network and a route file; it must end well."""
    (folder / "net.xml").write_text(net, encoding="utf-8")
    (folder / "rou.xml").write_text(routes, encoding="utf-8")
    arguments = [Path(sumo.SUMO_HOME, "bin", "sumo"), "-n", "net.xml", "-r", "rou.xml", "--no-step-log", "true"]
    return subprocess.run([*arguments, *options], cwd=folder, check=True, capture_output=True, text=True).stderr
