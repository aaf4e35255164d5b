"""The scenarios that come with FogSim."""

from pathlib import Path

from fogsim.errors import InputError, UnknownNameError

SCENARIO_FILE = "scenario.yaml"
_PACKAGE = Path(__file__).resolve().parent.parent


def catalogue() -> dict[str, Path]:
    """Names and files of the scenarios that come with FogSim: in the wheel, or beside it in a checkout."""
    for folder in (_PACKAGE / "_scenarios", _PACKAGE.parent / "scenarios"):
        files = sorted(folder.glob(f"*/{SCENARIO_FILE}"))
        if files:
            return {file.parent.name: file for file in files}
    return {}


def scenario_file(name_or_path: str | Path) -> Path:
    """File of a scenario.

    Parameters
    ----------
    name_or_path : str or Path
        A name in the catalogue, a scenario file, or a folder that holds ``scenario.yaml``.

    Raises
    ------
    InputError
        If there is nothing of that name; `UnknownNameError` for an unknown name of the catalogue.
    """
    path = Path(name_or_path)
    # Without a name, the path is that of the working directory.
    if is_folder(path) and str(name_or_path):
        path = path / SCENARIO_FILE
    if exists(path) and not path.is_dir():
        return path
    known = catalogue()
    if str(name_or_path) in known:
        return known[str(name_or_path)]
    if path.suffix in {".yaml", ".yml"} or len(path.parts) > 1:
        raise InputError(f"{name_or_path}: there is no such scenario file")
    raise UnknownNameError("scenario", str(name_or_path), known)


def exists(path: Path) -> bool:
    """Whether there is something of a name; a name that none can have is not there."""
    try:
        return path.exists()
    except OSError:
        return False


def is_folder(path: Path) -> bool:
    """Whether there is a folder of a name; a name that none can have is none."""
    return exists(path) and path.is_dir()


def is_file(path: Path) -> bool:
    """Whether there is a regular file of a name; a name that none can have is none."""
    return exists(path) and path.is_file()
