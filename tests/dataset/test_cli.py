"""``fogsim dataset``, interrupted in a process of its own."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from early_motorway import EARLY

from tests.helpers.command import Command

FOGSIM = (sys.executable, "-m", "fogsim", "dataset", "motorway_fog_bank")
SMALL = ("--set", EARLY, "--set", "camera.width=96", "--set", "camera.height=72", "--visibility", "80")


def test_an_interrupted_command_says_so_and_the_same_one_continues_it(tmp_path: Path, command: Command) -> None:
    out = tmp_path / "out"
    endless = [*FOGSIM, "--out", str(out), "--frames", "100000", *SMALL]
    process = subprocess.Popen(
        endless, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    deadline = time.monotonic() + 120
    while not (out / "records" / "000002.json").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGINT)  # as Ctrl-C does
    stdout, stderr = process.communicate(timeout=60)
    assert process.returncode == 130, stderr
    assert "Traceback" not in stderr
    assert "the same command continues it" in stdout, stderr
    partial = json.loads((out / "annotations.json").read_text(encoding="utf-8"))
    there = len(partial["images"])
    assert there >= 3
    assert not list(out.rglob("*.part"))
    done = command("dataset", "motorway_fog_bank", "--out", str(out), "--frames", str(there + 2), *SMALL)
    assert done.returncode == 0, done.stderr
    assert f"{there + 2} frames, 2 of them new" in done.stdout
    assert json.loads((out / "annotations.json").read_text(encoding="utf-8"))["info"]["complete"] is True
