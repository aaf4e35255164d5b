"""Roads and signs of a network as its file has them, whoever drives there."""

import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.values import Lane, PavedArea, Sign, SignalHead


@dataclass(frozen=True, slots=True)
class RoadMap:
    """A SUMO network.

    Attributes
    ----------
    edges : mapping from edge id to range
        Places of each edge's lanes, from the side that vehicles keep to.
    lanes : tuple of Lane
        All lanes, tracks and areas for walking among them.
    drawn : (n,) bool
        Which of them are drawn as lanes.
    between : (n,) bool
        Which of them lead from junction to junction and are for more than pedestrians.
    areas : tuple of PavedArea
        Where roads and footways meet.
    limit_signs : tuple of Sign
        Signs where the speed limit changes.
    signal_heads : tuple of SignalHead
        Heads of the traffic lights.
    location : tuple of str or None
        What was added to the source's coordinates [m] and their projection, as the file has it; None if it has not.
    """

    edges: Mapping[str, range]
    lanes: tuple[Lane, ...]
    drawn: NDArray[np.bool_]
    between: NDArray[np.bool_]
    areas: tuple[PavedArea, ...]
    limit_signs: tuple[Sign, ...]
    signal_heads: tuple[SignalHead, ...]
    location: tuple[str, str] | None

    def middle_lane(self, edge: str) -> Lane:
        """Middle lane of an edge, the one more to the inside where there are two.

        Parameters
        ----------
        edge : str
            Its id.

        Raises
        ------
        KeyError
            If there is no such edge.
        """
        places = self.edges[edge]
        return self.lanes[places[len(places) // 2]]

    def speed_limit(self, edge: str) -> float:
        """Highest speed limit of an edge's lanes [m/s].

        Parameters
        ----------
        edge : str
            Its id.

        Raises
        ------
        KeyError
            If there is no such edge.
        """
        return max(self.lanes[place].speed_limit for place in self.edges[edge])


def edge_ranges(edges: Sequence[str], counts: Iterable[int]) -> dict[str, range]:
    """Places of each edge's lanes among those of all edges, one edge after another.

    Parameters
    ----------
    edges : sequence of str
        Ids of the edges.
    counts : iterable of int
        How many lanes each has.
    """
    ends = list(itertools.accumulate(counts, initial=0))
    return {edge: range(*ends_of) for edge, ends_of in zip(edges, itertools.pairwise(ends), strict=True)}
