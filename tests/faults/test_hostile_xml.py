"""XML files that are hostile, broken or no files at all: each ends at once, in one message that names the file."""

import gzip
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from fogsim.core.files import xml_reader
from fogsim.errors import InputError
from fogsim.offline.drive.track_file import load_track
from fogsim.openscenario import read_openscenario, xml_tree
from fogsim.scenario.loading import load_scenario, scenario_from_config
from fogsim.traffic.road import netconvert
from fogsim.traffic.road.configuration import configured_files
from fogsim.traffic.road.netconvert import opendrive_net
from fogsim.traffic.road.network import read_net
from fogsim.traffic.road.opendrive import opendrive_signs
from fogsim.traffic.road.signs import sign_map
from fogsim.traffic.road.structures import structures

DATA = Path(__file__).parents[1] / "data"
NET = DATA / "road" / "road.net.xml"
XODR = DATA / "openscenario" / "two_lanes.xodr"

MANY = "version='1.9' " + " ".join(f"a{i}=''" for i in range(2000))
Reader = Callable[[Path], object]
READERS: dict[str, tuple[str, str, Reader]] = {
    "OpenSCENARIO": ("file.xosc", "OpenSCENARIO", read_openscenario),
    "OpenDRIVE signals": ("file.xodr", "OpenDRIVE", opendrive_signs),
    "OpenDRIVE roads": ("file.xodr", "OpenDRIVE", opendrive_net),
    "configuration": ("file.sumocfg", "configuration", configured_files),
    "network": ("file.net.xml", "net", read_net),
    "signs": ("file.add.xml", "additional", lambda path: sign_map(read_net(NET), [path])),
    "structures": ("file.add.xml", "additional", lambda path: structures([path])),
    "track": ("file.gpx", "gpx", load_track),
}
"""Name of a file, its first element, and what reads it."""

KINDS: dict[str, tuple[Callable[[str], bytes], str]] = {
    "empty": (lambda _: b"", ":1: not XML: no element found"),
    "text": (lambda _: b"root:x:0:0", ":1: not XML: "),
    "binary": (lambda _: bytes(range(256)), ":1: not XML: "),
    "truncated": (lambda root: f'<{root} version="1.9">\n'.encode(), ":2: not XML: "),
    "deep": (lambda root: f'<{root} version="1.9">'.encode() + b"<a>" * 60_000, "more than 100 elements inside one"),
    "entities": (lambda root: f'<!DOCTYPE a [<!ENTITY a "a">]><{root}/>'.encode(), ":1: a document type .*not read"),
    "many attributes": (lambda root: f"<{root} {MANY}/>".encode(), ":1: an element has more than 1000 attributes"),
    "unknown encoding": (lambda root: f'<?xml version="1.0" encoding="klingon"?><{root}/>'.encode(), "'klingon'"),
    "no encoding of text": (lambda root: f'<?xml version="1.0" encoding="rot13"?><{root}/>'.encode(), "'rot13'"),
    "another encoding": (lambda root: f'<?xml version="1.0" encoding="utf-16"?><{root}/>'.encode(), "encoding utf-16"),
    "damaged encoding": (
        lambda root: f'<?xml version="1.0" encoding="shift_jis"?><{root} a="'.encode() + b'\x81\x20"/>',
        "not text in the encoding shift_jis",
    ),
    "damaged gzip": (lambda root: gzip.compress(f"<{root}/>".encode() * 99)[:30], "cannot be read: "),
}


def test_hostile_content_ends_in_one_message(tmp_path: Path) -> None:
    for content, told in KINDS.values():
        for name, root, read in READERS.values():
            file = tmp_path / name
            file.write_bytes(content(root))
            with pytest.raises(InputError, match=told) as error:
                read(file)
            assert str(file) in str(error.value)
            assert len(str(error.value).splitlines()) == 1


def test_another_first_element_is_refused(tmp_path: Path) -> None:
    for reader in ["OpenSCENARIO", "OpenDRIVE signals", "configuration", "network", "track"]:
        name, root, read = READERS[reader]
        (tmp_path / name).write_text("<html/>", encoding="utf-8")
        with pytest.raises(InputError, match=f"expected <{root}>.* at its top, got <html>"):
            read(tmp_path / name)


@pytest.mark.parametrize("reader", READERS)
def test_what_is_not_a_regular_file_is_not_read(tmp_path: Path, reader: str) -> None:
    name, _, read = READERS[reader]
    file = tmp_path / name
    for make in (lambda: None, lambda: os.mkfifo(file), lambda: file.symlink_to("/dev/zero"), file.mkdir):
        make()
        with pytest.raises(InputError, match=r"cannot be read: (No such file|not a regular file)"):
            read(file)
        if file.is_dir():
            break
        file.unlink(missing_ok=True)


def test_limits_of_trees_and_tags(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "bomb.xml.gz"
    file.write_bytes(gzip.compress(b"<a>" + b" " * 1_000_000 + b"</a>"))
    with pytest.raises(InputError, match="cannot be read: larger than 100000 bytes"):
        xml_reader.read_tree(file, most_bytes=100_000)
    monkeypatch.setattr(xml_reader, "LONGEST_TAG", 100_000)
    file.write_bytes(gzip.compress(b"<a b='" + b"c" * 1_000_000 + b"'/>"))
    with pytest.raises(InputError, match=":1: a tag or comment is longer than 100000 bytes"):
        xml_reader.read_tree(file)
    file.write_bytes(b"<a>" + b"<b/>" * 1000 + b"</a>")
    monkeypatch.setattr(xml_tree, "MOST_ELEMENTS", 500)
    with pytest.raises(InputError, match=":1: 500 elements or more"):
        xml_tree.read_xml(file)


ROAD = '<geometry s="0" x="100" y="-20" hdg="0" length="500"><line/></geometry>'


def test_numbers_of_roads_are_checked_before_netconvert(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for old, new, told in [
        *[
            ('length="900"', f'length="{length}"', "length must be a number within 0 … 50000")
            for length in ("nan", "1e7", "1e300", "-5", "inf", "long")
        ],
        ('length="500"', 'length="1e7"', "<geometry>: length must be a number within 0 … 50000"),
        (ROAD, ROAD.replace('length="500"', 'length="4e4"') * 2, "its geometry is 80400 m long"),
        ('x="100"', 'x="1e300"', "<geometry>: x must be a number"),
        ('hdg="0"', 'hdg="nan"', "<geometry>: hdg must be a number"),
        ('curvature="0.000833333333"', 'curvature="inf"', "<arc>: curvature must be a number"),
        ('<elevation s="0" a="0"', '<elevation s="0" a="nan"', "<elevation>: a must be a number"),
        ('a="3.5"', 'a="1e300"', "<width>: a must be a number"),
    ]:
        for read in [opendrive_signs, opendrive_net]:
            monkeypatch.setattr(netconvert, "_run", lambda *_: pytest.fail("netconvert was started"))
            file = tmp_path / "file.xodr"
            text = XODR.read_text(encoding="utf-8")
            assert old in text
            file.write_text(text.replace(old, new, 1), encoding="utf-8")
            with pytest.raises(InputError, match=f"^{file}: road '7': {told}"):
                read(file)


@pytest.mark.parametrize(
    ("limit", "value", "told"),
    [
        ("_LONGEST_RUN", 0.001, "netconvert has not read it within 0.001 s"),
        ("_MOST_MEMORY", 2**20, "netconvert can read: .+"),
        ("_MOST_BYTES", 2**10, "0 MiB of output"),
    ],
)
def test_netconvert_has_limits(monkeypatch: pytest.MonkeyPatch, limit: str, value: float, told: str) -> None:
    monkeypatch.setattr(netconvert, limit, value)
    with pytest.raises(InputError, match=told) as error:
        opendrive_net(XODR)
    assert len(str(error.value).splitlines()) == 1


POI = '<poi id="s" type="fogsim.sign.{kind}" x="100" y="3" angle="90"><param key="value" value="100"/>{more}</poi>'
POLY = (
    '<poly id="s" type="fogsim.structure.wall" shape="0,0 10,0"><param key="width" value="1"/>'
    '<param key="top" value="3"/></poly>'
)
SIGNAL = (
    '<OpenDRIVE><road id="1" length="50"><planView><geometry s="0" x="0" y="0" hdg="0" length="50"><line/></geometry>'
    '</planView><signals><signal id="s" s="20" t="-5" type="274" value="50" width="0.6" zOffset="2"/></signals></road>'
    "</OpenDRIVE>"
)
SHAPES: dict[str, tuple[str, str, Reader]] = {
    "sign": ("a.add.xml", f"<additional>{POI.format(kind='speed_limit', more='')}</additional>", READERS["signs"][2]),
    "structure": ("a.add.xml", f"<additional>{POLY}</additional>", READERS["structures"][2]),
    "signal": ("a.xodr", SIGNAL, opendrive_signs),
}


def test_signs_and_structures_of_impossible_measures_are_named(tmp_path: Path) -> None:
    for kind, old, new in [
        *[("sign", 'x="100"', f'x="{x}"') for x in ("nan", "inf", "1e300", "", "east")],
        ("sign", 'angle="90"', 'angle="nan"'),
        *[("sign", 'value="100"', f'value="{value}"') for value in ("-100", "nan", "1e300")],
        *[("sign", "</poi>", f'<param key="diameter" value="{size}"/></poi>') for size in ("-5", "0", "nan", "1e300")],
        *[("sign", "</poi>", f'<param key="height" value="{height}"/></poi>') for height in ("-1", "nan", "1e300")],
        ("structure", "0,0 10,0", "0,0 nan,0"),
        ("structure", "0,0 10,0", "0,0 1e300,0"),
        ("structure", 'value="3"', 'value="nan"'),
        ("structure", 'value="1"', 'value="-1"'),
        *[("signal", 's="20"', f's="{s}"') for s in ("nan", "-9", "1e300")],
        ("signal", 't="-5"', 't="inf"'),
        ("signal", 'zOffset="2"', 'zOffset="nan"'),
        *[("signal", 'value="50"', f'value="{value}"') for value in ("nan", "1e6", "1e300")],
    ]:
        name, text, read = SHAPES[kind]
        file = tmp_path / name
        file.write_text(text, encoding="utf-8")
        read(file)
        assert old in text
        file.write_text(text.replace(old, new, 1), encoding="utf-8")
        with pytest.raises(InputError, match=rf"^{file}.*(poi|poly|signal) 's'.*, got "):
            read(file)


FOG = "fog: {visibility_m: 80}\n"
SCENARIO = "name: x\ntraffic: {net: road.net.xml, routes: [road.rou.xml], additional: [a.add.xml]}\n" + FOG


@pytest.mark.parametrize(
    ("file", "content", "told"),
    [
        ("road.net.xml", "root:x:0:0", "net: .*road.net.xml:1: not XML"),
        ("road.net.xml", "<routes/>", "net: .*road.net.xml: expected <net> at its top, got <routes>"),
        ("road.rou.xml", "{}", r"routes\.0: .*road.rou.xml:1: not XML"),
        ("road.rou.xml", "<net/>", r"routes\.0: .*road.rou.xml: expected <routes> at its top, got <net>"),
        ("a.add.xml", "<svg/>", r"additional\.0: .*a.add.xml: expected .*, got <svg>"),
    ],
)
def test_a_scenario_names_files_of_the_right_kinds(tmp_path: Path, file: str, content: str, told: str) -> None:
    for name in ("road.net.xml", "road.rou.xml"):
        shutil.copy(DATA / "road" / name, tmp_path)
    (tmp_path / "a.add.xml").write_text("<additional/>", encoding="utf-8")
    (tmp_path / "x.yaml").write_text(SCENARIO, encoding="utf-8")
    load_scenario(tmp_path / "x.yaml", ["traffic.ego=none"])
    (tmp_path / file).write_text(content, encoding="utf-8")
    with pytest.raises(InputError, match=rf"^{tmp_path}/x.yaml:2: traffic\.{told}"):
        load_scenario(tmp_path / "x.yaml", ["traffic.ego=none"])


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (None, "^{0}: traffic.config: there is no file .x.sumocfg. in "),
        ("<net/>", "^{0}: expected <configuration> at its top, got <net>"),
        ('<configuration><net-file value="none.xml"/></configuration>', "none.xml: cannot be read: No such file"),
        ('<configuration><net-file value="x.sumocfg"/></configuration>', "x.sumocfg: expected <net> at its top"),
    ],
)
def test_a_configuration_names_files_of_the_right_kinds(tmp_path: Path, content: str | None, told: str) -> None:
    file = tmp_path / "x.sumocfg"
    if content is not None:
        file.write_text(content, encoding="utf-8")
    with pytest.raises(InputError, match=told.format(file)):
        scenario_from_config(file, "ego", ["fog.visibility_m=80"])
