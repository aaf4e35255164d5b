"""Reading untrusted XML: limited in size and depth, without document types, in any encoding that Python knows.

Every XML file is read here, compressed by gzip or not; faults are one-line InputErrors.
"""

import codecs
import gzip
import re
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Protocol, cast
from xml.etree import ElementTree as ET
from xml.parsers import expat

from fogsim.core.files.readers import open_regular
from fogsim.errors import InputError, shown

_MOST_BYTES = 2**28
"""Largest file that is kept as a tree, unpacked [bytes]."""

MOST_ELEMENTS = 2_000_000
"""Most elements of a file that is kept as a tree; they take half a gigabyte."""

_DEEPEST, _MOST_ATTRIBUTES = 100, 1000
"""Maximum depth of elements, and of attributes per element."""

LONGEST_TAG = 2**23
"""Longest tag or comment [bytes]; expat reads one again with each chunk."""

_CHUNK = 2**16
_HEAD = 2**12
"""The first chunk is smaller, for readers of only the first element [bytes]."""

_MOST_BEFORE_ROOT = 2**20
_MOST_SHOWN, _MOST_ROOTS_SHOWN = 80, 2  # characters of a tag in a message, and expected first elements
_ENCODING = re.compile(rb"""(?:\xef\xbb\xbf)?<\?xml[^>]*?\sencoding\s*=\s*["']([^"'>]*)["']""")
_BUILT_IN = frozenset(("utf-8", "utf-16", "iso-8859-1", "us-ascii"))
_PROBE = rb"<a b='\u0041-1'/>"
"""Bytes that an encoding must map to ASCII, since the declaration that names it was read as ASCII."""


class _ElementReader(Protocol):
    """Receives the elements of a file in order."""

    @property
    def is_done(self) -> bool:
        """True when the rest of the file is not needed."""

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        """Begin an element; a ValueError is reported with file and line."""

    def end(self, tag: str) -> None:
        """End an element."""


@contextmanager
def open_unpacked(path: Path) -> Iterator[IO[bytes]]:
    """Open a regular file, compressed by gzip or not; damage found while reading is an `InputError`."""
    with open_regular(path) as plain:
        is_packed = plain.read(2) == b"\x1f\x8b"
        plain.seek(0)
        try:
            yield cast("IO[bytes]", gzip.GzipFile(fileobj=plain)) if is_packed else plain
        except (EOFError, OSError, zlib.error) as error:
            raise InputError(f"{path}: cannot be read: {error}") from error


class XmlFile:
    """An XML file that is being read."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._parser = expat.ParserCreate()

    @property
    def line(self) -> int:
        """Line of the current element."""
        return self._parser.CurrentLineNumber

    def read(
        self,
        reader: _ElementReader,
        most_bytes: int,
        most_elements: int | None = None,
        text: Callable[[str], object] | None = None,
    ) -> int:
        """Read until the reader is done or the file or the limit ends; return the unpacked bytes that were read."""
        done = given = 0
        with open_unpacked(self._path) as source:
            chunk = source.read(min(_HEAD, most_bytes))
            encoding = self._encoding(chunk)
            is_foreign = encoding.lower() not in _BUILT_IN
            decoder = codecs.getincrementaldecoder(encoding if is_foreign else "utf-8")()
            self._parser = parser = expat.ParserCreate("utf-8" if is_foreign else None)
            self._connect(reader, most_elements, text)
            while True:
                try:
                    data = decoder.decode(chunk, not chunk).encode() if is_foreign else chunk
                    parser.Parse(data, not chunk)
                except expat.ExpatError as error:
                    message = expat.errors.messages[error.code]
                    is_other = message == expat.errors.XML_ERROR_INCORRECT_ENCODING
                    reason = f"not text in the encoding {encoding}" if is_other else f"not XML: {message}"
                    raise self._refusal(reason) from error
                except UnicodeError as error:
                    raise self._refusal(f"not text in the encoding {encoding}: {error}") from error
                done, given = done + len(chunk), given + len(data)
                if not chunk or reader.is_done or done >= most_bytes:
                    return done
                if given - max(parser.CurrentByteIndex, 0) > LONGEST_TAG:
                    raise self._refusal(f"a tag or comment is longer than {LONGEST_TAG} bytes")
                chunk = source.read(min(_CHUNK, most_bytes - done))

    def read_all(
        self,
        reader: _ElementReader,
        most_bytes: int = _MOST_BYTES,
        most_elements: int = MOST_ELEMENTS,
        text: Callable[[str], object] | None = None,
    ) -> None:
        """Read the whole file; InputError if it unpacks to more than `most_bytes`."""
        if self.read(reader, most_bytes, most_elements, text) >= most_bytes:
            raise InputError(f"{self._path}: cannot be read: larger than {most_bytes} bytes")

    def _connect(self, reader: _ElementReader, most_elements: int | None, text: Callable[[str], object] | None) -> None:
        depth = elements = 0

        def start(tag: str, attributes: dict[str, str]) -> None:
            nonlocal depth, elements
            depth += 1
            elements += 1
            if depth > _DEEPEST:
                raise self._refusal(f"more than {_DEEPEST} elements inside one another")
            if elements == most_elements:
                raise self._refusal(f"{most_elements} elements or more")
            if len(attributes) > _MOST_ATTRIBUTES:
                raise self._refusal(f"an element has more than {_MOST_ATTRIBUTES} attributes")
            try:
                reader.start(tag, attributes)
            except InputError:
                raise
            except ValueError as error:
                raise self._refusal(f"<{tag[:_MOST_SHOWN]}>: {error}") from error

        def end(tag: str) -> None:
            nonlocal depth
            depth -= 1
            reader.end(tag)

        def doctype(*_: object) -> None:
            # Entities of a document type can grow without bound, or name other files.
            raise self._refusal("a document type (<!DOCTYPE …>) is not read; leave it out")

        parser = self._parser
        parser.StartElementHandler, parser.EndElementHandler = start, end
        parser.StartDoctypeDeclHandler = doctype
        if text is not None:
            parser.CharacterDataHandler = text

    def _encoding(self, head: bytes) -> str:
        found = _ENCODING.match(head)
        name = found[1].decode("ascii", "replace") if found else "utf-8"
        if name.lower() not in _BUILT_IN:
            try:
                is_known = _PROBE.decode(name) == _PROBE.decode("ascii")
            except (LookupError, ValueError):
                is_known = False
            if not is_known:
                raise self._refusal(f"cannot read the encoding {shown(name)}; write the file in UTF-8")
        return name

    def _refusal(self, reason: str) -> InputError:
        return InputError(f"{self._path}:{self.line}: {reason}")


def read_elements(path: Path, reader: _ElementReader, most_bytes: int) -> int:
    """Pass the elements of a file to a reader; see `XmlFile.read`."""
    return XmlFile(path).read(reader, most_bytes)


def read_tree(path: Path, *roots: str, most_bytes: int = _MOST_BYTES) -> ET.Element:
    """Root of a file, which must be one of `roots` if any are given; tags lose their prefixes."""
    builder, file = _TreeBuilder(path, roots), XmlFile(path)
    file.read_all(builder, most_bytes, text=builder.tree.data)
    return builder.tree.close()


def root_tag(path: Path, *roots: str) -> str:
    """Tag of the first element, which must be one of `roots` if any are given; the rest is not read."""
    reader = _RootReader(path, roots)
    read_elements(path, reader, _MOST_BEFORE_ROOT)
    if reader.tag is None:
        raise InputError(f"{path}: not XML: it begins with more than {_MOST_BEFORE_ROOT} bytes of blanks and comments")
    return reader.tag


class _RootReader:
    """Reads only the first element."""

    def __init__(self, path: Path, roots: tuple[str, ...]) -> None:
        self._path = path
        self._roots = roots
        self.tag: str | None = None

    @property
    def is_done(self) -> bool:
        return self.tag is not None

    def start(self, tag: str, _: dict[str, str]) -> None:
        if self.tag is None:
            self.tag = tag
            if self._roots and tag not in self._roots:
                wanted = " or ".join(f"<{root}>" for root in self._roots[:_MOST_ROOTS_SHOWN])
                raise InputError(f"{self._path}: expected {wanted} at its top, got <{tag[:_MOST_SHOWN]}>")

    def end(self, tag: str) -> None:
        pass


class _TreeBuilder(_RootReader):
    """Builds a tree of all elements."""

    is_done = False

    def __init__(self, path: Path, roots: tuple[str, ...]) -> None:
        super().__init__(path, roots)
        self.tree = ET.TreeBuilder()

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        tag = tag.rpartition(":")[2]
        super().start(tag, attributes)
        self.tree.start(tag, attributes)

    def end(self, tag: str) -> None:
        self.tree.end(tag.rpartition(":")[2])
