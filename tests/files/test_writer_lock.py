import errno
import fcntl
import os
import subprocess
import sys
from pathlib import Path
from unittest.mock import MagicMock

import pytest

from fogsim.core.files.atomic import whole_file
from fogsim.core.files.writer_lock import LOCK_NAME, WriterLock, WritingProcess
from fogsim.errors import InputError


def test_one_holds_it_and_the_next_is_told_who(tmp_path: Path) -> None:
    with WriterLock(tmp_path), pytest.raises(InputError, match=rf"process {os.getpid()} on .* is writing there; wait"):
        WriterLock(tmp_path)
    assert list(tmp_path.iterdir()) == []
    with WriterLock(tmp_path):
        pass


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.EOPNOTSUPP])
def test_a_file_system_without_locks_is_written_to(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    monkeypatch.setattr(fcntl, "flock", MagicMock(side_effect=OSError(number, os.strerror(number))))
    with WriterLock(tmp_path), whole_file(tmp_path / "file") as file:
        file.write(b"all")
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("file", b"all")]
    monkeypatch.setattr(fcntl, "flock", MagicMock(side_effect=OSError(errno.EIO, "a fault")))
    with pytest.raises(OSError, match="a fault"), WriterLock(tmp_path):
        pass


@pytest.mark.parametrize("content", ["", "no json", "[]", '{"id": 4711, "host": "there"}'])
def test_a_lock_file_that_nobody_holds_locks_nothing(tmp_path: Path, content: str) -> None:
    (tmp_path / LOCK_NAME).write_text(content, encoding="utf-8")
    with WriterLock(tmp_path):
        pass
    assert list(tmp_path.iterdir()) == []


def test_a_process_lives_until_it_ends_and_another_of_its_number_is_another() -> None:
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as child:
        this = WritingProcess.this()
        start = int(Path(f"/proc/{child.pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[19])
        running = WritingProcess(child.pid, this.host, this.boot, start)
        assert WritingProcess.from_json(running.to_json()) == running
        assert running.lives()
        assert not WritingProcess(child.pid, this.host, this.boot, start - 1).lives()
        assert not WritingProcess(child.pid, "elsewhere", this.boot, start).lives()
        assert not WritingProcess(child.pid, this.host, "another boot", start).lives()
        child.communicate()
    assert not running.lives()


def test_what_tells_of_no_process_is_none() -> None:
    for values in [None, [], {}, {"id": "4711"}]:
        assert WritingProcess.from_json(values) is None
