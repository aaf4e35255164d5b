"""Where the files go that SUMO writes: into one folder, whatever their names in SUMO's own files are."""

import collections
import os
import shutil
import tempfile
import warnings
import weakref
from pathlib import Path

from fogsim.core.files.xml_reader import root_tag
from fogsim.errors import InputError

_TO_THE_ROOT = "../" * (os.pathconf("/", "PC_PATH_MAX") // 5 + 1)
"""From any folder to the root, which has nothing above it: from a deeper one, the path is too long for the system."""

_TOKEN = "TIME"  # noqa: S105 - what SUMO puts the time for, in a prefix
_END_OF_XML = 200
_LOG_NAME = ".fogsim-warnings"
_WARNING = "Warning:"
_LOG = ("--error-log", _LOG_NAME, "--aggregate-warnings", "20")  # so many of a type, or the log of a day would be long
_OPEN_FILES = Path("/proc/self/fd")
_MOST_NAMED = 6
"""Files that a message names."""


class OutputFolder:
    """A folder for all that SUMO writes: by options, by detectors, by devices.

    SUMO puts its option ``output-prefix`` before the last part of every name of an output, of absolute names too, so
    that a prefix that leads through the root to this folder brings all of them there. Files of one name from different
    folders become one; ``stdout`` and ``/dev/null`` stay what they are. Without a `folder` there is one that is removed
    at the end, with a warning if anything is in it; SUMO's own `warnings`, if collected, are read on `close`.
    """

    def __init__(self, folder: Path | None, prefix: str = "", collects_warnings: bool = False) -> None:
        self._folder = folder
        self._prefix = prefix
        self._log = _LOG if collects_warnings else ()
        self.warnings: tuple[str, ...] = ()
        self._own: Path | None = None
        self._way = ""
        self._reported: set[str] = set()

    def open(self) -> list[str]:
        """Make the folder, and give the arguments of SUMO's command line that lead there."""
        self.warnings = ()
        if self._own is None and (self._folder is None or not _can_be_named(self._folder)):
            self._own = Path(tempfile.mkdtemp(prefix="fogsim-"))
            # Also where no one closes it.
            self._removal = weakref.finalize(self, shutil.rmtree, self._own, ignore_errors=True)
        leads = self._writable() if self._own is None or self._folder is None else self._link(self._own)
        self._way = f"{_TO_THE_ROOT}{str(leads)[1:]}/{self._prefix}"
        return ["--output-prefix", self._way, *self._log]

    @property
    def _place(self) -> Path:
        place = self._folder if self._folder is not None else self._own
        if place is None:
            raise InputError("the folder for SUMO's outputs has not been opened")
        return place

    def _writable(self) -> Path:
        place = self._place
        try:
            place.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=place):
                pass
        except OSError as error:
            raise InputError(f"cannot write SUMO's outputs into {place}: {error.strerror}") from error
        return place.resolve()

    def _link(self, own: Path) -> Path:
        """A way to a folder whose own name SUMO does not take."""
        link, target = own / "outputs", self._writable()
        if not link.is_symlink():
            link.symlink_to(target)
        return link

    def twice(self) -> list[str]:
        """Names of files that SUMO has open for several outputs; none where the system does not report them."""
        if self._folder is None or not _OPEN_FILES.is_dir():
            return []
        place = str(self._folder.resolve())
        targets = collections.Counter(map(_target, _OPEN_FILES.iterdir()))
        return sorted(Path(name).name for name, times in targets.items() if times > 1 and name.startswith(place))

    def shorten(self, message: str) -> str:
        """A message of SUMO's with the names of files as they were asked for."""
        return message.replace(self._way, self._prefix) if self._way else message

    def report_lost(self) -> None:
        """Warn of outputs that will not be kept, each once."""
        if self._folder is not None or self._own is None:
            return
        lost = [name for name in _names(self._own) if name not in self._reported]
        if lost:
            self._reported.update(lost)
            more = f" and {len(lost) - _MOST_NAMED} more" if len(lost) > _MOST_NAMED else ""
            warnings.warn(
                f"SUMO writes {', '.join(lost[:_MOST_NAMED])}{more}, which will not be kept: each run would replace "
                "the files of the one before. Name a folder for them (fogsim.run(…, sumo_outputs=…)), or use "
                "fogsim run",
                stacklevel=2,
            )

    def close(self) -> None:
        """Remove what is not kept, and a folder in which nothing is; twice does nothing."""
        try:
            self._take_warnings()
            self.report_lost()
            if self._folder is not None:
                self._report_cut_off(self._folder)
                if self._folder.is_dir() and not any(self._folder.iterdir()):
                    self._folder.rmdir()
        finally:
            if self._own is not None:
                self._removal()
                self._own = None

    def _take_warnings(self) -> None:
        place = self._folder or self._own
        log = None if place is None else place / f"{self._prefix}{_LOG_NAME}"
        if self._log and log is not None and log.is_file():
            lines = log.read_text(encoding="utf-8", errors="replace").splitlines()
            self.warnings = tuple(line.removeprefix(_WARNING).strip() for line in lines if line.startswith(_WARNING))
            log.unlink()

    def _report_cut_off(self, folder: Path) -> None:
        cut = [name for name in _names(folder) if name.endswith(".xml") and not _is_whole(folder / name)]
        if cut:
            warnings.warn(
                f"SUMO could not write all of {', '.join(cut[:_MOST_NAMED])} in {folder}, and does not say why: is the "
                "disk full?",
                stacklevel=2,
            )


def _target(descriptor: Path) -> str:
    try:
        return str(descriptor.readlink())
    except OSError:
        return ""  # that of the listing itself, which is closed by now


def _can_be_named(folder: Path) -> bool:
    """Whether SUMO takes the name of a folder in a prefix: as Unicode, without the word for which it puts the time."""
    name = str(folder.resolve())
    return _TOKEN not in name and name.encode(errors="replace").decode() == name


def _names(folder: Path) -> list[str]:
    there = folder.iterdir() if folder.is_dir() else ()
    return sorted(path.name for path in there if not path.name.endswith(_LOG_NAME))


def _is_whole(path: Path) -> bool:
    """Whether an XML file ends with the end of the element that it begins with."""
    try:
        name = root_tag(path).encode()
    except InputError:
        return False
    with path.open("rb") as file:
        file.seek(max(0, file.seek(0, 2) - _END_OF_XML))
        last = file.read().rstrip().rpartition(b"<")[2]
    return last == b"/" + name + b">" or (last.startswith(name) and last.endswith(b"/>"))
