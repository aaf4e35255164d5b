"""What FogSim cannot do of a file, and what it leaves out: each reported once, with its path and line."""

import math
import warnings
from dataclasses import dataclass, field
from pathlib import Path

from fogsim.errors import InputError, LeftOutWarning, shown, suggest
from fogsim.openscenario.elements import HARMLESS, REFUSED
from fogsim.openscenario.xml_tree import Node

_NAMESPACES = ("xmlns", "xml:", "xsi:")


@dataclass
class Findings:
    """Collects lines about what FogSim cannot do and what it leaves out."""

    refused: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)

    def refuse(self, node: Node, message: str) -> None:
        """Record an element that FogSim cannot do, and why."""
        _seen(node)
        self._add(self.refused, f"{node.where}: {message}")

    def leave_out(self, node: Node, message: str) -> None:
        """Record an element that FogSim leaves out, and what that means."""
        _seen(node)
        self.remark(node, message)

    def remark(self, node: Node, message: str) -> None:
        """Record how an element is read, where a user might expect something else."""
        self._add(self.remarks, f"{node.where}: {message}")

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
            known = f"FogSim has no {shown(text)} here; {suggest(text, allowed)}"
            missing = f"this attribute is missing; expected {' or '.join(allowed)}"
            self._add(self.refused, f"{node.where}: {key}: {known if text else missing}")
            return allowed[0]
        return text

    def flag(self, node: Node, key: str, default: str = "") -> bool:
        """Truth value of an attribute, in large or small letters, or as 1 or 0; any other becomes a finding."""
        text = {"1": "true", "0": "false"}.get(node.get(key), node.get(key).lower()) or default
        if text not in ("true", "false"):
            self._add(self.refused, f"{node.where}: {key}: expected true or false, got {shown(text or 'nothing')}")
        return text == "true"

    def look_for_unread(self, root: Node) -> None:
        """Refuse elements and attributes that were not read, unless they are harmless."""
        if root.tag in HARMLESS:
            return
        if not root.is_read:
            self.refuse(root, REFUSED.get(root.tag, "FogSim does not know this element here"))
            return
        for key in sorted(root.attributes.keys() - root.read):
            name = f"{root.tag}@{key}"
            if name not in HARMLESS and not key.startswith(_NAMESPACES):
                message = REFUSED.get(name, "FogSim does not know this attribute here")
                self._add(self.refused, f"{root.where}: {key}={shown(root.attributes[key])}: {message}")
        for child in root.children:
            self.look_for_unread(child)

    def close(self, path: Path) -> None:
        """Report all findings; InputError if FogSim cannot do something."""
        if self.refused:
            raise InputError("\n".join(self.refused))
        if self.remarks:
            message = "\n".join(f"  {line.removeprefix(f'{path}:')}" for line in self.remarks)
            warnings.warn(f"{path}: left out, or read otherwise than written:\n{message}", LeftOutWarning, stacklevel=2)

    def _add(self, lines: list[str], line: str) -> None:
        if line not in lines:
            lines.append(line)


def _seen(node: Node) -> None:
    """Mark an element and its children as read, so that it is reported once."""
    for one in node.walk():
        one.is_read = True
        one.read.update(one.attributes)
