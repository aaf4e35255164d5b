"""The directory that the results of one run go to."""

from pathlib import Path

from fogsim.errors import InputError
from fogsim.recorders.files import partial_path

_NAMES = {
    "manifest": "manifest.json",
    "metrics": "metrics.json",
    "table": "steps.parquet",
    "video": "video.mp4",
    "report": "report.html",
}


class RunDirectory:
    """The directory of one run and the names of the files in it.

    Parameters
    ----------
    path : Path
        The directory; it is made with its parents if it is not there.
    overwrite : bool
        True to remove results of an earlier run: the files that FogSim writes, and never another.

    Raises
    ------
    InputError
        If the path is not a directory, cannot be made, or holds results and must not be overwritten.
    """

    def __init__(self, path: Path, overwrite: bool = False) -> None:
        self.path = Path(path)
        self._made = [folder for folder in (self.path, *self.path.parents) if not folder.exists()]
        self._make()
        earlier = [name for name in self._own_files() if name.is_file()]
        if earlier and not overwrite:
            found = ", ".join(name.name for name in earlier)
            raise InputError(
                f"{self.path} holds results of an earlier run ({found}); "
                "choose another directory with --out, or replace them with --overwrite"
            )
        for name in earlier:
            name.unlink()

    def _make(self) -> None:
        try:
            self.path.mkdir(parents=True, exist_ok=True)
        except FileExistsError:
            raise InputError(f"results need a directory, but {self.path} is a file") from None
        except OSError as error:
            raise InputError(f"cannot make the directory {self.path} for the results: {error.strerror}") from error

    def discard(self) -> None:
        """Take everything away that FogSim has written here, and the directories that were made for it."""
        for name in self._own_files():
            name.unlink(missing_ok=True)
        for folder in self._made:
            if any(folder.iterdir()):
                break
            folder.rmdir()

    def _own_files(self) -> list[Path]:
        whole = [self.path / name for name in _NAMES.values()]
        return whole + [partial_path(name) for name in whole]

    @property
    def manifest(self) -> Path:
        """What was run, with what, and how it ended."""
        return self.path / _NAMES["manifest"]

    @property
    def metrics(self) -> Path:
        """Summary of the metrics."""
        return self.path / _NAMES["metrics"]

    @property
    def table(self) -> Path:
        """One row a step."""
        return self.path / _NAMES["table"]

    @property
    def video(self) -> Path:
        """What the camera saw, with a panel beside it."""
        return self.path / _NAMES["video"]

    @property
    def report(self) -> Path:
        """Report to read."""
        return self.path / _NAMES["report"]

    def files(self) -> list[str]:
        """Names of the whole result files that are there now, sorted."""
        return sorted(name for name in _NAMES.values() if (self.path / name).is_file())
