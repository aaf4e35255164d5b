"""What is kept of a case that failed: a video around the failure, and a plot of what was looked at."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Artefacts:
    """Files about a failure.

    Attributes
    ----------
    plot : Path or None
        SVG of the signals.
    video : Path or None
        Video around it.
    """

    plot: Path | None = None
    video: Path | None = None
