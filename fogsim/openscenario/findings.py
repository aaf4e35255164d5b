"""What FogSim cannot do of a file, and what it leaves out: each reported once, with its path and line."""

import math
import warnings
from dataclasses import dataclass, field
from pathlib import Path

from fogsim.errors import InputError, LeftOutWarning, shown, suggest
from fogsim.openscenario.xml_tree import Node

PASSED_OVER = {
    "FileHeader": "who wrote the file, and when",
    "SceneGraphFile": "a 3D model of the surroundings: FogSim draws its own",
    "Properties": "free-form properties",
    "Property": "free-form properties",
    "File": "files of free-form properties",
    "CustomContent": "free-form properties",
    "Axles": "places of the axles",
    "UserDefinedProperties": "free-form properties",
    "ParameterDeclarations": "read with the parameters",
    "CatalogLocations": "read with the catalogs",
    "UsedArea": "part of the map that is used",
    "ConstraintGroup": "limits of parameters",
}
"""Elements without effect in FogSim, and what they are."""

ATTRIBUTES_PASSED_OVER = frozenset(
    {"name", "model3d", "mass", "role", "animation", "maximumExecutionCount", "atmosphericPressure", "temperature"}
)
"""Attributes without effect in FogSim."""


@dataclass
class Findings:
    """Collects lines about what FogSim cannot do and what it leaves out."""

    refused: list[str] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)

    def refuse(self, node: Node, told: str) -> None:
        """Record an element that FogSim cannot do, and why."""
        _seen(node)
        self._add(self.refused, f"{node.where}: {told}")

    def leave_out(self, node: Node, told: str) -> None:
        """Record an element that FogSim leaves out, and what that means."""
        _seen(node)
        self._add(self.left_out, f"{node.where}: {told}")

    def number(self, node: Node, key: str, default: float | None = None, *, is_finite: bool = True) -> float:
        """Number of an attribute; an invalid one, or a missing one without default, becomes a finding."""
        text = node.get(key)
        if not text and default is not None:
            return default
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if math.isnan(value) or (is_finite and math.isinf(value)):
            self._add(self.refused, f"{node.where}: expected a number for {key}, got {shown(text or 'nothing')}")
            return 0.0
        return value

    def word(self, node: Node, key: str, allowed: tuple[str, ...], default: str = "") -> str:
        """Word of an attribute; one that is not allowed becomes a finding."""
        text = node.get(key) or default
        if text not in allowed:
            self._add(self.refused, f"{node.where}: {key}: unknown value {shown(text)}; {suggest(text, allowed)}")
            return allowed[0]
        return text

    def look_for_unread(self, root: Node) -> None:
        """Record elements and attributes that were not read."""
        if root.tag in PASSED_OVER:
            return
        if not root.is_read:
            self.refuse(root, "FogSim does not know this element here")
            return
        unread = root.attributes.keys() - root.read - ATTRIBUTES_PASSED_OVER
        for key in sorted(unread) if root.read else ():
            self._add(self.left_out, f"{root.where}: {key}={shown(root.attributes[key])} has no effect")
        for child in root.children:
            self.look_for_unread(child)

    def close(self, path: Path) -> None:
        """Report all findings; InputError if FogSim cannot do something."""
        if self.refused:
            raise InputError("\n".join(self.refused))
        if self.left_out:
            told = "\n".join(f"  {line.removeprefix(f'{path}:')}" for line in self.left_out)
            warnings.warn(f"{path}: left out, for FogSim has none of it:\n{told}", LeftOutWarning, stacklevel=2)

    def _add(self, lines: list[str], line: str) -> None:
        if line not in lines:
            lines.append(line)


def _seen(node: Node) -> None:
    """Mark an element and its children as read, so that it is reported once."""
    for one in node.walk():
        one.is_read = True
        one.read.update(one.attributes)
