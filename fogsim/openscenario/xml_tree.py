"""Elements of an XML file with their lines and paths, and who has looked at what of them."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from fogsim.errors import InputError

MOST_BYTES = 20_000_000
"""Largest file that is read."""


@dataclass(slots=True)
class Node:
    """An element.

    Attributes
    ----------
    tag : str
        Its name.
    attributes : dict
        Its attributes.
    file : Path
        Where it stands.
    line : int
        On which line.
    path : str
        Elements around it and itself, ``/OpenSCENARIO/Storyboard/Story[name]``.
    children : list of Node
        Elements in it.
    is_read, read : bool, set of str
        Whether it has been looked at, and which of its attributes.
    """

    tag: str
    attributes: dict[str, str]
    file: Path
    line: int
    path: str
    children: list["Node"] = field(default_factory=list)
    is_read: bool = False
    read: set[str] = field(default_factory=set)

    @property
    def where(self) -> str:
        """File, line and path."""
        return f"{self.file}:{self.line}: {self.path}"

    def get(self, key: str, default: str = "") -> str:
        """Value of an attribute.

        Parameters
        ----------
        key, default : str
            Its name, and what stands for it where it is missing.
        """
        self.is_read = True
        self.read.add(key)
        return self.attributes.get(key, default).strip()

    def all(self, *tags: str) -> list["Node"]:
        """Elements in it that have one of some names.

        Parameters
        ----------
        *tags : str
            The names; none for every element.
        """
        self.is_read = True
        found = [child for child in self.children if child.tag in tags or not tags]
        for child in found:
            child.is_read = True
        return found

    def one(self, *tags: str) -> "Node | None":
        """First element in it that has one of some names.

        Parameters
        ----------
        *tags : str
            The names.
        """
        return next(iter(self.all(*tags)), None)

    def within(self, *path: str) -> "Node | None":
        """Element that is found by going from one to the next.

        Parameters
        ----------
        *path : str
            Their names.
        """
        node: Node | None = self
        for tag in path:
            node = None if node is None else node.one(tag)
        return node

    def walk(self) -> Iterator["Node"]:
        """It and everything in it."""
        yield self
        for child in self.children:
            yield from child.walk()


def read_xml(path: Path) -> Node:
    """Read a file; nothing outside it is fetched, and it may not define entities.

    Parameters
    ----------
    path : Path
        The file.

    Raises
    ------
    InputError
        If it cannot be read, is too large, is no XML, or has a document type.
    """
    try:
        with path.open("rb") as file:
            raw = file.read(MOST_BYTES + 1)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    if len(raw) > MOST_BYTES:
        raise InputError(f"{path}: cannot be read: it has more than {MOST_BYTES} bytes")
    builder = _Builder(path)
    try:
        builder.parser.Parse(raw, True)
    except expat.ExpatError as error:
        raise InputError(f"{path}:{error.lineno}: no XML: {expat.errors.messages[error.code]}") from error
    except (ValueError, LookupError) as error:
        raise InputError(f"{path}: no XML: {error}") from error
    return builder.root


class _Builder:
    def __init__(self, path: Path) -> None:
        self._path = path
        self._open: list[Node] = []
        self.root = Node("", {}, path, 1, "")
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.StartDoctypeDeclHandler = self._refuse

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        above = self._open[-1] if self._open else None
        name = attributes.get("name") or attributes.get("entityRef")
        path = f"{above.path if above else ''}/{tag}{f'[{name}]' if name else ''}"
        node = Node(tag, attributes, self._path, self.parser.CurrentLineNumber, path)
        if above is None:
            self.root = node
        else:
            above.children.append(node)
        self._open.append(node)

    def _end(self, _: str) -> None:
        self._open.pop()

    def _refuse(self, *_: object) -> None:
        # Entities of a document type can grow without bound, or name other files.
        line = self.parser.CurrentLineNumber
        raise InputError(f"{self._path}:{line}: a document type (<!DOCTYPE …>) is not read; leave it out")
