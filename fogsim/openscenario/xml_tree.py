"""Elements of an XML file with their lines and paths, and a record of what was read."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

from fogsim.files.xml_reader import XmlFile

MOST_BYTES, MOST_ELEMENTS = 20_000_000, 500_000
"""Largest file that is read [bytes], and its maximum number of elements."""


def sumo_name(name: str) -> str:
    """Name with what SUMO's ids cannot hold, such as blanks, escaped as in addresses of the web."""
    return re.sub(r"[^\w.:#@\-]", lambda found: f"%{ord(found[0]):02X}", name)


@dataclass(slots=True)
class Node:
    """An element, with its file and line; `label` is its tag with its name in brackets.

    `is_read` and `read` record whether the element and which of its attributes were used; a name always is, in `label`.
    """

    tag: str
    attributes: dict[str, str]
    file: Path
    line: int
    label: str = ""
    above: "Node | None" = field(default=None, repr=False, compare=False)
    children: list["Node"] = field(default_factory=list)
    is_read: bool = False
    read: set[str] = field(default_factory=lambda: {"name"})

    @property
    def path(self) -> str:
        """Path of the element, ``/OpenSCENARIO/Storyboard/Story[name]``."""
        return f"{self.above.path if self.above else ''}/{self.label}"

    @property
    def where(self) -> str:
        """File, line and path."""
        return f"{self.file}:{self.line}: {self.path}"

    def get(self, key: str, default: str = "") -> str:
        """Value of an attribute; references to entities are as SUMO names these."""
        self.is_read = True
        self.read.add(key)
        value = self.attributes.get(key, default).strip()
        return sumo_name(value) if key in ("entityRef", "masterEntityRef") else value

    def all(self, *tags: str) -> list["Node"]:
        """Child elements with one of these tags, or all."""
        self.is_read = True
        found = [child for child in self.children if child.tag in tags or not tags]
        for child in found:
            child.is_read = True
        return found

    def one(self, *tags: str) -> "Node | None":
        """First child element with one of these tags."""
        return next(iter(self.all(*tags)), None)

    def within(self, *path: str) -> "Node | None":
        """Element at the end of a path of tags."""
        node: Node | None = self
        for tag in path:
            node = None if node is None else node.one(tag)
        return node

    def copy(self) -> "Node":
        """An independent copy of it and all its descendants, with the same parent."""
        children = [child.copy() for child in self.children]
        return replace(self, attributes=dict(self.attributes), children=children, read=set(self.read))

    def walk(self) -> Iterator["Node"]:
        """The element and all its descendants."""
        yield self
        for child in self.children:
            yield from child.walk()


def read_xml(path: Path) -> Node:
    """Read a file; nothing outside it is loaded, and document types raise InputError."""
    builder = _Builder(path)
    builder.file.read_all(builder, MOST_BYTES, MOST_ELEMENTS)
    return builder.root


class _Builder:
    is_done = False

    def __init__(self, path: Path) -> None:
        self.file = XmlFile(path)
        self.root = Node("", {}, path, 1)
        self._path = path
        self._open: list[Node] = []

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        above = self._open[-1] if self._open else None
        name = attributes.get("name") or attributes.get("entityRef")
        node = Node(tag, attributes, self._path, self.file.line, f"{tag}[{name}]" if name else tag, above)
        if above is None:
            self.root = node
        else:
            above.children.append(node)
        self._open.append(node)

    def end(self, _: str) -> None:
        self._open.pop()
