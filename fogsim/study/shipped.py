"""The studies that come with FogSim, by name, as its scenarios are."""

from pathlib import Path

from fogsim.errors import UnknownNameError
from fogsim.scenario import catalogue


def shipped_studies() -> dict[str, Path]:
    """Names and files of the studies that come with FogSim: beside its scenarios."""
    folders = {file.parents[1] / "studies" for file in catalogue().values()}
    return {file.stem: file for folder in folders for file in sorted(folder.glob("*.yaml"))}


def study_file(name_or_path: str | Path) -> Path:
    """File of a study.

    Parameters
    ----------
    name_or_path : str or Path
        A study file, or the name of a study that comes with FogSim.

    Raises
    ------
    UnknownNameError
        For one word that is neither; a path is opened as it is, and who opens it says what is wrong.
    """
    path = Path(name_or_path)
    if path.suffix or len(path.parts) != 1 or path.exists():
        return path
    known = shipped_studies()
    if str(name_or_path) not in known:
        raise UnknownNameError("study", str(name_or_path), known)
    return known[str(name_or_path)]
