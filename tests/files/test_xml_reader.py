"""Elements one after the other, from plain and packed files, up to where the rest does not matter."""

import gzip
from pathlib import Path

import pytest

from fogsim.errors import InputError
from fogsim.files.xml_reader import open_unpacked, read_elements

TEXT = '<a x="1"><b/><c y="2"></c></a>'


class Tags:
    """Notes tags until one that ends the reading."""

    def __init__(self, last: str = "") -> None:
        self.is_done = False
        self.seen: list[str] = []
        self._last = last

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        self.seen.append(tag + "".join(attributes.values()))
        self.is_done = tag == self._last

    def end(self, tag: str) -> None:
        self.seen.append(f"/{tag}")


@pytest.mark.parametrize("packed", [False, True])
def test_elements_come_in_the_order_of_the_file(tmp_path: Path, packed: bool) -> None:
    file, tags = tmp_path / "file.xml", Tags()
    file.write_bytes(gzip.compress(TEXT.encode()) if packed else TEXT.encode())
    assert read_elements(file, tags, 1000) == len(TEXT)
    assert tags.seen == ["a1", "b", "/b", "c2", "/c", "/a"]
    with open_unpacked(file) as source:
        assert source.read() == TEXT.encode()


def test_reading_ends_at_the_allowance_or_when_the_reader_is_done(tmp_path: Path) -> None:
    file = tmp_path / "file.xml"
    file.write_text("<a>" + "<b/>" * 100_000 + "</a>", encoding="utf-8")
    assert read_elements(file, Tags(), 100) == 100
    assert read_elements(file, Tags("b"), 10**6) < 10**5
    with pytest.raises(InputError, match=r"none\.xml: cannot be read: No such file"):
        read_elements(tmp_path / "none.xml", Tags(), 100)
