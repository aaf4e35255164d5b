"""Files with the format's axes, and entries of the catalogs that a file refers to."""

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from fogsim.errors import InputError, shown, suggest
from fogsim.openscenario.parameters import declared, put_parameters
from fogsim.openscenario.xml_tree import Node, read_xml

LOCATIONS = (
    *("VehicleCatalog", "PedestrianCatalog", "MiscObjectCatalog", "EnvironmentCatalog"),
    *("ControllerCatalog", "ManeuverCatalog", "RouteCatalog", "TrajectoryCatalog"),
)
"""Types of catalogs that are read."""

_MIRRORED = {"y", "dy", "h"}  # Of positions and orientations
_CRITERION = "criteria_"


@dataclass
class Catalogs:
    """The catalogs that a file names, relative to its folder, and the entries that were `used`."""

    root: Node
    used: list[Node] = field(default_factory=list)
    _read: dict[Path, list[Node]] = field(default_factory=dict)
    _places: list[Path] = field(default_factory=list)

    def __post_init__(self) -> None:
        locations = self.root.one("CatalogLocations")
        for kind in locations.all(*LOCATIONS) if locations else ():
            self._places += [self.root.file.parent / place.get("path") for place in kind.all("Directory")]

    def entry(self, reference: Node) -> Node | None:
        """The element that a ``CatalogReference`` refers to, with its parameters; None, and a finding, if missing."""
        catalog, name = reference.get("catalogName"), reference.get("entryName")
        given = {
            one.get("parameterRef").removeprefix("$"): one.get("value")
            for block in reference.all("ParameterAssignments")
            for one in block.all("ParameterAssignment")
        }
        names: list[str] = []
        for found in self._entries(catalog):
            if found.name == name:
                self.used.append(whole := found.copy())
                own = declared(whole, {}, given)
                whole.children = [child for child in whole.children if child.tag != "ParameterDeclarations"]
                put_parameters(whole, {**own, **given})
                whole.is_read = True
                return whole
            names.append(found.name)
        message = suggest(name, names) if names else f"there is no catalog {shown(catalog)} in the CatalogLocations"
        reference.refuse(f"unknown entry {shown(name)} of {catalog}; {message}")
        return None

    def within(self, holder: Node, *tags: str) -> Node | None:
        """The child element with one of these tags, or the entry of a catalog in its place; None without one."""
        reference = holder.one("CatalogReference")
        return self.entry(reference) if reference else holder.one(*tags)

    def _entries(self, catalog: str) -> Iterator[Node]:
        for file in self._files():
            if file not in self._read:
                self._read[file] = []
                try:
                    root = read_xml(file, self.root.findings)
                    to_standard(root)
                    self._read[file] = root.children
                except InputError as error:
                    self.root.findings.refused.setdefault(str(error))
            for one in self._read[file]:
                # A copied catalog may still have its old name inside.
                if one.tag == "Catalog" and catalog in (one.attributes.get("name"), file.stem):
                    yield from one.children

    def _files(self) -> Iterator[Path]:
        for path in self._places:
            yield from sorted(path.glob("*.xosc")) if path.is_dir() else ([path] if path.is_file() else [])


def to_standard(root: Node) -> None:
    """Give a file the format's axes if its description begins with ``CARLA:``, whose y is to the right of x.

    Conditions whose names begin with `criteria_` judge a run of ScenarioRunner and trigger nothing; they are left out.
    """
    headers = (node.attributes.get("description", "") for node in root.children if node.tag == "FileHeader")
    nodes = list(root.walk()) if any(text.startswith("CARLA:") for text in headers) else []
    for node in (one for one in nodes if one.tag.endswith(("Position", "Orientation"))):
        # What is no number is found where it is read.
        with contextlib.suppress(ValueError):
            for key in node.attributes.keys() & _MIRRORED:
                node.attributes[key] = repr(-float(node.attributes[key]))
    for node in (one for one in nodes if one.tag == "StopTrigger"):
        for group in node.children:
            criteria = [one for one in group.children if one.name.startswith(_CRITERION)]
            for one in criteria:
                one.remark("a criterion of ScenarioRunner; FogSim's are expectations")
            group.children = [one for one in group.children if one not in criteria]
        node.children = [group for group in node.children if group.children]
