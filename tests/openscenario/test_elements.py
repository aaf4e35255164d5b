"""Every element and attribute of the format is honoured, harmless or refused, and files are held to it."""

import functools
import re
import shutil
from pathlib import Path
from xml.sax.saxutils import quoteattr

import pytest

from fogsim.errors import InputError
from fogsim.openscenario import read_openscenario, read_parameter_cases, reading
from fogsim.openscenario.xml_tree import HARMLESS, REFUSED, Node, read_xml

DATA = Path(__file__).parents[1] / "data"
SCHEMA = {
    (words := line.split())[0]: words[1:]
    for line in (DATA / "openscenario_1_3.txt").read_text(encoding="utf-8").splitlines()
    if not line.startswith("#")
}
HONOURED = {
    name: [key for key in keys if not {f"{name}@{key}"} & {*HARMLESS, *REFUSED}]
    for name, keys in SCHEMA.items()
    if name not in {*HARMLESS, *REFUSED}
}

pytestmark = pytest.mark.filterwarnings("ignore::fogsim.errors.LeftOutWarning")


def _refused(file: Path) -> str:
    with pytest.raises(InputError) as refused:
        read_openscenario(file)
    return str(refused.value)


def test_each_element_and_attribute_of_the_schema_has_one_decision() -> None:
    # What is neither harmless nor refused is honoured, which the test of each attribute shows.
    decided = [*HARMLESS, *REFUSED]
    known = {*SCHEMA, *(f"{name}@{key}" for name in HONOURED for key in SCHEMA[name])}
    assert len(decided) == len(set(decided))
    assert set(decided) <= known


def test_refused_and_unknown_elements_are_refused_wherever_they_stand(tmp_path: Path) -> None:
    names = [name for name in (*REFUSED, "Whatever") if "@" not in name]
    lines = (DATA / "openscenario" / "slow_lead.xosc").read_text(encoding="utf-8").splitlines()
    number = next(i for i, line in enumerate(lines) if line.strip() == "<Actions>") + 1
    lines[number:number] = [f"<{name}/>" for name in names]
    (file := tmp_path / "all.xosc").write_text("\n".join(lines), encoding="utf-8")
    (tmp_path / "two_lanes.xodr").write_bytes((DATA / "openscenario" / "two_lanes.xodr").read_bytes())
    told = _refused(file).splitlines()
    for place, name in enumerate(names, start=number + 1):
        why = REFUSED.get(name, "FogSim does not know this element here")
        assert f"{file}:{place}: /OpenSCENARIO/Storyboard/Init/Actions/{name}: {why}" in told


def test_unknown_and_refused_attributes_are_refused_on_every_element(tmp_path: Path) -> None:
    (tmp_path / "two_lanes.xodr").write_bytes((DATA / "openscenario" / "two_lanes.xodr").read_bytes())
    text = (DATA / "openscenario" / "slow_lead.xosc").read_text(encoding="utf-8")
    text = re.sub("<ObjectController>.*</ObjectController>", "<ObjectController/>", text)
    refused = {name: [one.partition("@")[2] for one in REFUSED if one.startswith(f"{name}@")] for name in SCHEMA}
    added = re.sub(
        r"<(\w+)(?=[ />])",
        lambda tag: " ".join([tag[0], 'whatever="1"', *(f'{key}="1"' for key in refused[tag[1]])]),
        text,
    )
    (file := tmp_path / "all.xosc").write_text(added, encoding="utf-8")
    told = _refused(file)
    for name in set(re.findall(r"<(\w+)", text)) - set(HARMLESS):
        for key in ("whatever", *refused[name]):
            assert re.search(rf":\d+: /.*{name}(\[[^]]*\])?: {key}='1': \w", told), (name, key)


USES = {f"catalogs/{kind}.xosc": "everything.xosc" for kind in ("vehicles", "environments", "maneuvers")} | {
    f"catalogs/{kind}.xosc": "on_foot_and_on_routes.xosc" for kind in ("persons", "things", "routes")
}
USES["catalogs/trajectories.xosc"] = "off_the_lanes.xosc"
"""Catalogs, and files that use them."""


def _written(root: Node) -> str:
    inner = "".join(_written(child) for child in root.children)
    attributes = "".join(f" {key}={quoteattr(text)}" for key, text in root.attributes.items())
    return f"<{root.tag}{attributes}>{inner}</{root.tag}>"


def _read(folder: Path, name: str, root: Node) -> object:
    """What a changed file is read as: the data of its scenario, or its cases; None if it is refused."""
    (folder / name).unlink()  # as in tests/scenario/test_fuzz.py
    (folder / name).write_text(_written(root), encoding="utf-8")
    try:
        return read_parameter_cases(folder / name) or read_openscenario(folder / USES.get(name, name)).data
    except InputError:
        return None


def _others(text: str) -> list[str]:
    """Values that differ from one: more and less, the other truth, another name."""
    try:
        return [f"{float(text) + more:g}" for more in (3.0, -3.0)]
    except ValueError:
        return ["true" if text == "false" else "false" if text == "true" else "another"]


@pytest.fixture(autouse=True)
def _each_road_is_read_once(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("map_net", "read_opendrive_lanes"):
        monkeypatch.setattr(reading, name, functools.cache(getattr(reading, name)))


@pytest.fixture
def corpus(tmp_path: Path) -> dict[str, Node]:
    """Elements of the files whose attributes are changed one at a time, by their names in a folder of copies."""
    shutil.copytree(DATA / "openscenario", tmp_path, dirs_exist_ok=True)
    # Small files first: what is shown in one need not be in the next.
    turns = ("speeds_in_turn.xosc", "speeds_at_random.xosc", "counts_at_random.xosc")
    files = ("slow_lead.xosc", "on_foot_and_on_routes.xosc", "off_the_lanes.xosc", "everything.xosc")
    return {name: read_xml(tmp_path / name) for name in (*turns, *files, *USES)}


def test_every_attribute_that_is_honoured_changes_the_scenario(tmp_path: Path, corpus: dict[str, Node]) -> None:
    assert {*HONOURED} <= {node.tag for root in corpus.values() for node in root.walk()}
    unshown = {(name, key) for name, keys in HONOURED.items() for key in keys}
    for name, root in corpus.items():
        plain = _read(tmp_path, name, root)
        for node in root.walk():
            for key in [key for key in node.attributes if (node.tag, key) in unshown]:
                kept = node.attributes[key]
                for node.attributes[key] in _others(kept):
                    if _read(tmp_path, name, root) != plain:
                        unshown.discard((node.tag, key))
                        break
                node.attributes[key] = kept
        assert plain == _read(tmp_path, name, root) is not None
    # Roads of these maps lie next to one another: see tests/traffic/road/test_opendrive_lanes.py.
    assert unshown == {("WorldPosition", "z")}


def test_what_is_harmless_changes_nothing(tmp_path: Path, corpus: dict[str, Node]) -> None:
    root = corpus[name := "everything.xosc"]
    plain = read_openscenario(tmp_path / name).data
    for node in root.walk():
        for one in HARMLESS:
            if one.startswith(f"{node.tag}@"):
                node.attributes[one.partition("@")[2]] = "0.5"
    init = next(node for node in root.walk() if node.tag == "Actions")
    init.children += [Node(one, {"whatever": "1"}, tmp_path, 1) for one in HARMLESS if "@" not in one]
    assert _read(tmp_path, name, root) == plain
