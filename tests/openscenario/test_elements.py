"""Every element and attribute of the format is honoured, harmless or refused, and files are held to it."""

import re
from pathlib import Path

import pytest

from fogsim.errors import InputError
from fogsim.openscenario import read_openscenario
from fogsim.openscenario.elements import HARMLESS, HONOURED, REFUSED

DATA = Path(__file__).parents[1] / "data"
SCHEMA = {
    (words := line.split())[0]: words[1:]
    for line in (DATA / "openscenario_1_3.txt").read_text(encoding="utf-8").splitlines()
    if not line.startswith("#")
}

pytestmark = pytest.mark.filterwarnings("ignore::fogsim.errors.LeftOutWarning")


def _refused(file: Path) -> str:
    with pytest.raises(InputError) as refused:
        read_openscenario(file)
    return str(refused.value)


def test_each_element_and_attribute_of_the_schema_has_one_decision() -> None:
    elements = [*HONOURED, *(name for table in (HARMLESS, REFUSED) for name in table if "@" not in name)]
    assert sorted(elements) == sorted(SCHEMA)
    attributes = [f"{name}@{key}" for name, keys in HONOURED.items() for key in keys]
    attributes += [name for table in (HARMLESS, REFUSED) for name in table if "@" in name]
    assert sorted(attributes) == sorted(f"{name}@{key}" for name in HONOURED for key in SCHEMA[name])


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
