"""Elements one after the other, from plain and packed files, up to where the rest does not matter."""

import gzip
from pathlib import Path

import pytest

from fogsim.core.files.xml_reader import open_unpacked, read_elements, read_tree, root_tag
from fogsim.errors import InputError

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


def test_encodings_that_expat_does_not_know_are_read_alike(tmp_path: Path) -> None:
    for encoding in ["utf-8", "utf8", "utf-16", "iso-8859-15", "windows-1252", "shift_jis", "gb18030"]:
        file, name = tmp_path / "file.xml", "東" if encoding in {"shift_jis", "gb18030"} else "Straße"
        text = f'<?xml version="1.0" encoding="{encoding}"?>\n<a name="{name}">{"<b/>" * 20_000}{name}</a>'
        file.write_bytes(text.encode(encoding))
        root = read_tree(file, "a")
        assert (root.get("name"), len(root), root[-1].tail) == (name, 20_000, name)


def test_prefixes_of_tags_do_not_matter(tmp_path: Path) -> None:
    file = tmp_path / "file.xml"
    file.write_text('<g:gpx xmlns:g="urn:x"><g:trkpt lat="1"/></g:gpx>', encoding="utf-8")
    assert [one.get("lat") for one in read_tree(file, "gpx").iter("trkpt")] == ["1"]


def test_the_first_element_is_found_without_the_rest(tmp_path: Path) -> None:
    file = tmp_path / "file.xml"
    file.write_text(f"<!-- {' ' * 10_000} -->\n<net><edge></net", encoding="utf-8")
    assert root_tag(file) == "net"
    file.write_text(f"<net>{'<edge/>' * 10_000}<broken", encoding="utf-8")
    assert root_tag(file, "net") == "net"
    file.write_text(" " * 3_000_000, encoding="utf-8")
    with pytest.raises(InputError, match="begins with more than"):
        root_tag(file)
