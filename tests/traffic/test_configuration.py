from pathlib import Path

import pytest

from fogsim.errors import InputError
from fogsim.traffic.configuration import configured_files


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


@pytest.mark.parametrize(
    ("content", "message"), [("<configuration", "not a SUMO configuration"), ("<configuration/>", "names no network")]
)
def test_what_is_no_configuration(tmp_path: Path, content: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        configured_files(config(tmp_path, content))
