"""Published figures next to ours, one cell of a paper's table at a time."""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True)
class PaperCell:
    """One published figure, and what FogSim's frames give in its place.

    Attributes
    ----------
    place : str
        Where the paper has it, such as "table 5.1".
    row, column : str
        What it is about, with units.
    paper : float
        The published figure; infinite where the paper prints ∞.
    as_published : float or None
        Result of the method as its authors describe it; None where it gives no valid estimate.
    corrected : float or None
        Result of the default method, with repairs; None where it gives no valid estimate.
    claim : {"equal", "at_most", "at_least"}
        Whether the paper states a value or a limit.
    tolerance : float
        Largest deviation that counts as reached: relative for values, 0 for limits; in the figure's unit if `absolute`.
    absolute : bool
        Whether the tolerance is in the figure's own unit, as for shares in percent.
    """

    place: str
    row: str
    column: str
    paper: float
    as_published: float | None
    corrected: float | None
    claim: Literal["equal", "at_most", "at_least"] = "equal"
    tolerance: float = 0.1
    absolute: bool = False

    def reached(self, ours: float | None) -> bool:
        """Whether a result agrees with the published figure."""
        if ours is None:
            return False
        if self.claim != "equal":
            return ours <= self.paper if self.claim == "at_most" else ours >= self.paper
        if self.paper == float("inf") or ours == float("inf"):
            return ours == self.paper
        return abs(ours - self.paper) <= (self.tolerance if self.absolute else self.tolerance * abs(self.paper))
