"""What a scenario's script does in a run."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Begun:
    """Something of the script that has begun.

    Attributes
    ----------
    name : str
        Its name in the scenario: its own, or its key path, such as ``timeline.0``.
    time : float
        When it began [s].
    what : str
        What it does, in a few words.
    """

    name: str
    time: float
    what: str = ""
