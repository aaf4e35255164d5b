"""Elements of SUMO's XML files, one after the other, without keeping the file."""

import gzip
import zlib
from pathlib import Path
from typing import IO, Protocol, cast
from xml.parsers import expat

_CHUNK = 1 << 16
UNREADABLE = (expat.ExpatError, OSError, EOFError, zlib.error, ValueError, LookupError)
"""What a file that is damaged, missing, or in an unknown encoding raises."""


def open_unpacked(path: Path) -> IO[bytes]:
    """Open a file to be read, packed by gzip or not.

    Parameters
    ----------
    path : Path
        The file.
    """
    with path.open("rb") as plain:
        packed = plain.read(2) == b"\x1f\x8b"
    return cast("IO[bytes]", gzip.open(path)) if packed else path.open("rb")


class ElementReader(Protocol):
    """What looks at elements."""

    @property
    def is_done(self) -> bool:
        """True when the rest of the file does not matter."""
        ...

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        """Look at the beginning of an element.

        Parameters
        ----------
        tag : str
            Its name.
        attributes : dict
            Its attributes.
        """
        ...

    def end(self, tag: str) -> None:
        """Look at the end of an element.

        Parameters
        ----------
        tag : str
            Its name.
        """
        ...


def read_elements(path: Path, reader: ElementReader, most_bytes: int) -> int:
    """Show a file's elements to a reader until it is done, or the file or the allowance is at its end.

    Parameters
    ----------
    path : Path
        An XML file, packed by gzip or not.
    reader : ElementReader
        What looks at them.
    most_bytes : int
        Most bytes to be read, unpacked.

    Returns
    -------
    int
        Bytes that have been read, unpacked; `most_bytes` if the end of the file was not reached.

    Raises
    ------
    ExpatError, OSError, EOFError, zlib.error, ValueError, LookupError
        If the file cannot be read; see `UNREADABLE`.
    """
    if not path.is_file():
        raise FileNotFoundError(path)
    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = reader.start, reader.end
    done = 0
    with open_unpacked(path) as source:
        while not reader.is_done and done < most_bytes:
            chunk = source.read(min(_CHUNK, most_bytes - done))
            parser.Parse(chunk, not chunk)
            if not chunk:
                break
            done += len(chunk)
    return done
