"""Roads and signs of a network from its file, whatever drives there."""

import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.values import Lane, PavedArea, Sign, SignalHead


@dataclass(frozen=True, slots=True)
class RoadMap:
    """A SUMO network.

    `edges` are ranges of lane indices, from the side that vehicles keep to. `drawn` (n,) marks lanes to draw, and
    `between` (n,) lanes between junctions that are not only for pedestrians. `areas` are junctions. `location` is the
    offset added to the source's coordinates [m] and their projection, as in the file.
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
        """Middle lane of an edge; of two, the inner one."""
        places = self.edges[edge]
        return self.lanes[places[len(places) // 2]]

    def speed_limit(self, edge: str) -> float:
        """Highest speed limit of an edge's lanes [m/s]."""
        return max(self.lanes[place].speed_limit for place in self.edges[edge])


def edge_ranges(edges: Sequence[str], counts: Iterable[int]) -> dict[str, range]:
    """Lane indices of each edge when lanes are listed edge by edge, from the number of lanes of each."""
    ends = list(itertools.accumulate(counts, initial=0))
    return {edge: range(*ends_of) for edge, ends_of in zip(edges, itertools.pairwise(ends), strict=True)}
