from pathlib import Path

import pytest

from fogsim.errors import InputError
from fogsim.traffic.road.configuration import OVERRIDES, configured_files, ignored_options


def config(folder: Path, content: str) -> Path:
    path = folder / "a.sumocfg"
    path.write_text(content, encoding="utf-8")
    return path


def test_files_are_relative_to_the_configuration(tmp_path: Path) -> None:
    path = config(
        tmp_path,
        '<configuration><input><net-file value="nets/a.net.xml"/><additional-files value="b.add.xml, /c.add.xml"/>'
        "</input></configuration>",
    )
    assert configured_files(path) == (tmp_path / "nets/a.net.xml", (tmp_path / "b.add.xml", Path("/c.add.xml")))


def test_short_names_and_no_additional_files(tmp_path: Path) -> None:
    assert configured_files(config(tmp_path, '<configuration><n value="a.net.xml"/></configuration>')) == (
        tmp_path / "a.net.xml",
        (),
    )


def test_what_is_no_configuration(tmp_path: Path) -> None:
    for content, message in [("<configuration", "not XML"), ("<configuration/>", "names no network")]:
        with pytest.raises(InputError, match=message):
            configured_files(config(tmp_path, content))


def test_options_that_cannot_hold_here_are_told_with_the_reason(tmp_path: Path) -> None:
    path = config(
        tmp_path,
        '<configuration><traci_server><remote-port value="8813"/></traci_server><random v="true"/></configuration>',
    )
    port, random = ignored_options(path)
    assert port.startswith("remote-port=8813 is left out: SUMO would listen")
    assert random == "random=true is left out: a run must depend on its seed alone"
    assert OVERRIDES == ("--remote-port", "0", "--random", "false")


def test_options_that_hold_as_they_are_need_no_word(tmp_path: Path) -> None:
    for text in ['<remote-port value="0"/>', '<random value="False"/>', "<random/>"]:
        assert ignored_options(config(tmp_path, f"<configuration>{text}</configuration>")) == ()
