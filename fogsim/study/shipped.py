"""The studies that come with FogSim, by name."""

from pathlib import Path

from fogsim.errors import UnknownNameError
from fogsim.scenario import catalogue


def shipped_studies() -> dict[str, Path]:
    """Names and files of the shipped studies, which are next to the scenarios."""
    folders = {file.parents[1] / "studies" for file in catalogue().values()}
    return {file.stem: file for folder in folders for file in sorted(folder.glob("*.yaml"))}


def study_file(name_or_path: str | Path) -> Path:
    """Path of a study file or of a shipped study's name; a path is not checked."""
    path = Path(name_or_path)
    if path.suffix or len(path.parts) != 1 or path.exists():
        return path
    known = shipped_studies()
    if str(name_or_path) not in known:
        raise UnknownNameError("study", str(name_or_path), known)
    return known[str(name_or_path)]
