"""Commands without stdin, stdout or stderr, as daemons are started, and with streams that take nothing."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

FULL = "error: the operating system refused: [Errno 28] No space left on device"


def run_in_shell(command: str, folder: Path) -> tuple[int, str, str]:
    """Exit code of Python, stdout and stderr of a command line for bash."""
    done = subprocess.run(
        ["/bin/bash", "-c", f"{sys.executable} {command}; exit ${{PIPESTATUS[0]}}"],
        cwd=folder,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
        timeout=200,
    )
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize(
    ("command", "code", "told"),
    [
        ("-m fogsim --version <&- >&- 2>&-", 0, ""),
        ("-m fogsim schema scenery 2>/dev/full", 2, ""),
        ("-m fogsim --help | head -c 0", 141, ""),  # as other programs that nothing reads: 128 + SIGPIPE
        ("-m fogsim --version >/dev/full", 2, FULL),
    ],
)
def test_a_closed_or_full_stream_ends_in_no_traceback(tmp_path: Path, command: str, code: int, told: str) -> None:
    ended, _, said = run_in_shell(command, tmp_path)
    assert (ended, said.strip()) == (code, told)


def test_text_that_the_encoding_lacks_is_escaped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONIOENCODING", "ascii")
    monkeypatch.setenv("COLUMNS", "100")
    code, printed, said = run_in_shell("-m fogsim run --help", tmp_path)
    assert (code, said) == (0, "")
    assert "NAME=VALUE,\\u2026" in printed


OPENED = """\
import json, os, subprocess, sys
from fogsim.core.files.standard_streams import open_standard_streams
open_standard_streams()
print("lost", flush=True)
sys.stdin.read(), sys.stderr.write("lost")
child = subprocess.call("echo lost; echo lost >&2", shell=True)
open("file", "w").write(json.dumps([os.open(".", os.O_RDONLY), child]))
"""


@pytest.mark.parametrize("closed", [">&-", "<&- >&- 2>&-"])
def test_no_file_and_no_child_gets_the_number_of_a_stream(tmp_path: Path, closed: str) -> None:
    (tmp_path / "opened.py").write_text(OPENED, encoding="utf-8")
    code, _, said = run_in_shell(f"opened.py {closed}", tmp_path)
    assert code == 0, said
    number, child = json.loads((tmp_path / "file").read_text(encoding="utf-8"))
    assert number > 2
    assert child == 0
