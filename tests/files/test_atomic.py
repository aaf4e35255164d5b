"""Files that are whole or not there."""

import errno
import math
import os
import stat
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from fogsim.core.files.atomic import (
    Reserve,
    is_stream,
    naming,
    partial_path,
    publish,
    whole_file,
    write_bytes,
    write_json,
)
from fogsim.errors import InputError


def test_a_write_that_fails_leaves_the_old_file_and_no_part(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a"
    write_bytes(path, b"old")

    def cut_off(whole: Path) -> None:
        assert whole == path
        raise OSError("cut off")

    monkeypatch.setattr("fogsim.core.files.atomic.publish", cut_off)
    with pytest.raises(OSError, match="cut off"):
        write_bytes(path, b"new")
    assert path.read_bytes() == b"old"
    assert not partial_path(path).exists()


def test_a_full_disk_of_a_network_leaves_the_old_file_and_no_part(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_bytes(tmp_path / "a", b"old")
    close = os.close

    def full(descriptor: int) -> None:
        close(descriptor)
        raise OSError(errno.EDQUOT, "Disk quota exceeded")

    quota = pytest.raises(OSError, match=r"quota exceeded.*a\.part")
    with monkeypatch.context() as network, quota, whole_file(tmp_path / "a"):
        network.setattr(os, "close", full)
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("a", b"old")]


def test_an_error_in_the_block_leaves_the_old_file_and_no_part(tmp_path: Path) -> None:
    path = tmp_path / "a"
    write_bytes(path, b"old")
    with pytest.raises(ZeroDivisionError), whole_file(path) as file:
        file.write(b"new" * (1 // 0))
    assert path.read_bytes() == b"old"
    assert [one.name for one in tmp_path.iterdir()] == ["a"]


@pytest.mark.parametrize("target", ["a", "there/a", "there/new", "link/a"])
def test_a_link_stays_and_its_target_is_written(tmp_path: Path, target: str) -> None:
    (tmp_path / "there").mkdir()
    (tmp_path / "link").symlink_to("there")
    for name in ("a", "there/a"):
        (tmp_path / name).write_bytes(b"old")
    path = tmp_path / "there" / "path"
    path.symlink_to(tmp_path / target)
    write_bytes(path, b"new")
    assert path.is_symlink()
    assert (tmp_path / target).read_bytes() == b"new"
    assert not (tmp_path / target).is_symlink()
    assert not list(tmp_path.rglob("*.part"))


def test_links_that_lead_to_one_another_are_an_error(tmp_path: Path) -> None:
    (tmp_path / "a").symlink_to("b")
    (tmp_path / "b").symlink_to("a")
    with pytest.raises(OSError, match=r"Too many levels of symbolic links: .*a'"):
        write_bytes(tmp_path / "a", b"new")
    assert (tmp_path / "a").is_symlink()


def test_a_link_in_place_of_the_part_is_not_followed(tmp_path: Path) -> None:
    (tmp_path / "mine").write_bytes(b"mine")
    partial_path(tmp_path / "a").symlink_to("mine")
    write_bytes(tmp_path / "a", b"new")
    assert (tmp_path / "mine").read_bytes() == b"mine"
    assert not (tmp_path / "a").is_symlink()


def test_two_writers_of_one_file_are_one(tmp_path: Path) -> None:
    with whole_file(tmp_path / "file") as file:
        file.write(b"the first ")
        with pytest.raises(InputError, match="another process is writing it"):
            write_bytes(tmp_path / "file", b"other")
        file.write(b"writer's")
    assert (tmp_path / "file").read_bytes() == b"the first writer's"
    (tmp_path / "file.part").write_bytes(b"left by a process that was killed")
    write_bytes(tmp_path / "file", b"other")
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("file", b"other")]


def test_a_file_keeps_its_permissions_and_a_new_one_has_the_usual(tmp_path: Path) -> None:
    (tmp_path / "plain").touch()
    for name in ("old", "linked"):
        (tmp_path / name).touch()
        (tmp_path / name).chmod(0o640)
    (tmp_path / "link").symlink_to("linked")
    for name in ("old", "link", "new"):
        write_bytes(tmp_path / name, b"new")
    modes = [stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("old", "linked", "new")]
    assert modes == [0o640, 0o640, stat.S_IMODE((tmp_path / "plain").stat().st_mode)]


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files away")
def test_a_file_keeps_its_owner(tmp_path: Path) -> None:
    (tmp_path / "a").touch()
    os.chown(tmp_path / "a", 1234, 5678)
    write_bytes(tmp_path / "a", b"new")
    found = (tmp_path / "a").stat()
    assert (found.st_uid, found.st_gid) == (1234, 5678)


def test_a_pipe_gets_what_is_written_and_stays(tmp_path: Path) -> None:
    pipe, link, read = tmp_path / "pipe", tmp_path / "link", list[bytes]()
    os.mkfifo(pipe)
    link.symlink_to(pipe)
    for path in (pipe, link):
        reader = threading.Thread(target=lambda: read.append(pipe.read_bytes()), daemon=True)
        reader.start()
        write_bytes(path, b"new")
        reader.join(10.0)
    assert read == [b"new", b"new"]
    assert pipe.is_fifo()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link", "pipe"]


def test_a_device_gets_what_is_written_and_stays(tmp_path: Path) -> None:
    """A terminal, since a mistake here would cost root its /dev/null."""
    master, slave = os.openpty()
    terminal = Path(os.ttyname(slave))
    (tmp_path / "link").symlink_to(terminal)
    for path in (terminal, tmp_path / "link"):
        write_bytes(path, b"new")
        assert os.read(master, 10) == b"new"
    assert terminal.is_char_device()
    assert (tmp_path / "link").is_symlink()
    os.close(slave)
    os.close(master)


def test_nothing_but_a_file_is_replaced_by_one_that_is_whole(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    partial_path(tmp_path / "pipe").write_bytes(b"new")
    with pytest.raises(InputError, match="pipe is not a regular file"):
        publish(tmp_path / "pipe")
    assert (tmp_path / "pipe").is_fifo()


PRINTS = """
import os, sys
from pathlib import Path
from fogsim.core.files.atomic import write_text
print("before")
for name in sys.argv[1:]:
    write_text(Path(name), f"{name}\\n")
print("after")
"""


def test_what_goes_to_stdout_stands_between_the_printed_lines(tmp_path: Path) -> None:
    """A file that stdout is redirected to is neither replaced nor cut off."""
    names = ["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1", str(tmp_path / "link")]
    (tmp_path / "link").symlink_to("/dev/stdout")
    with (tmp_path / "out").open("wb") as out:
        subprocess.run([sys.executable, "-c", PRINTS, *names], stdout=out, check=True)
    assert (tmp_path / "out").read_text(encoding="utf-8").split() == ["before", *names, "after"]
    assert (tmp_path / "link").is_symlink()


def test_only_pipes_devices_and_open_files_are_streams(tmp_path: Path) -> None:
    (tmp_path / "1").touch()
    (tmp_path / "nowhere").symlink_to("none")
    files = ["1", "none", "nowhere", "1/below", "."]
    assert not any(is_stream(tmp_path / name) for name in files)
    assert all(map(is_stream, map(Path, ["/dev/null", "/dev/stdout", "/dev/fd/1", "/dev/fd/999"])))


def test_json_holds_nothing_that_json_has_no_word_for(tmp_path: Path) -> None:
    for value in [math.nan, math.inf, object()]:
        with pytest.raises(InputError, match=r"values\.json holds only"):
            write_json(tmp_path / "values.json", {"value": value})
        assert not list(tmp_path.iterdir())


def test_an_error_of_the_system_names_the_file() -> None:
    with pytest.raises(OSError, match="here") as told, naming(Path("here")):
        raise OSError(28, "No space left on device")
    assert (told.value.errno, told.value.filename) == (28, "here")


def test_a_reserve_takes_room_until_it_is_released(tmp_path: Path) -> None:
    reserve = Reserve(tmp_path / "reserve")
    least = (tmp_path / "reserve").stat().st_size
    reserve.grow(1000)
    assert (tmp_path / "reserve").stat().st_size == least + 1000
    reserve.release()
    reserve.release()
    assert not list(tmp_path.iterdir())
