"""Entries of catalogs that a file refers to."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from fogsim.errors import InputError, shown, suggest
from fogsim.openscenario.carla import to_standard
from fogsim.openscenario.findings import Findings
from fogsim.openscenario.parameters import declared, put_parameters
from fogsim.openscenario.xml_tree import Node, read_xml

LOCATIONS = (
    "VehicleCatalog",
    "PedestrianCatalog",
    "MiscObjectCatalog",
    "EnvironmentCatalog",
    "ControllerCatalog",
    "ManeuverCatalog",
    "RouteCatalog",
    "TrajectoryCatalog",
)
"""Types of catalogs that are read."""


@dataclass
class Catalogs:
    """The catalogs that a file names, relative to its folder."""

    folder: Path
    locations: Node | None
    findings: Findings
    _read: dict[Path, Node] = field(default_factory=dict)
    _places: list[Path] = field(default_factory=list)

    def __post_init__(self) -> None:
        for kind in self.locations.all(*LOCATIONS) if self.locations else ():
            self._places += [self.folder / place.get("path") for place in kind.all("Directory")]

    def entry(self, reference: Node) -> Node | None:
        """The element that a ``CatalogReference`` refers to, with its parameters; None, and a finding, if missing."""
        catalog, name = reference.get("catalogName"), reference.get("entryName")
        given = {
            one.get("parameterRef").removeprefix("$"): one.get("value")
            for block in reference.all("ParameterAssignments")
            for one in block.all("ParameterAssignment")
        }
        names: list[str] = []
        for found in self._named(catalog):
            names += [one.attributes.get("name", "") for one in found.children]
            for one in found.children:
                if one.attributes.get("name") == name:
                    whole = one.copy()
                    own = declared(whole, {}, self.findings, given)
                    whole.children = [child for child in whole.children if child.tag != "ParameterDeclarations"]
                    put_parameters(whole, {**own, **given}, self.findings)
                    whole.is_read = True
                    return whole
        message = suggest(name, names) if names else f"there is no catalog {shown(catalog)} in the CatalogLocations"
        self.findings.refuse(reference, f"unknown entry {shown(name)} of {catalog}; {message}")
        return None

    def _named(self, catalog: str) -> Iterator[Node]:
        for file in self._files():
            if file not in self._read:
                try:
                    self._read[file] = read_xml(file)
                    to_standard(self._read[file], self.findings)
                except InputError as error:
                    self.findings.refused.append(str(error))
                    self._read[file] = Node("", {}, file, 1)
            # A copied catalog may still have its old name inside.
            yield from (
                one
                for one in self._read[file].children
                if one.tag == "Catalog" and catalog in (one.attributes.get("name"), file.stem)
            )

    def _files(self) -> Iterator[Path]:
        for path in self._places:
            yield from sorted(path.glob("*.xosc")) if path.is_dir() else ([path] if path.is_file() else [])
