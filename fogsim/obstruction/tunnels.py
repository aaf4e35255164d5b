"""Tunnels: the spaces under structures that are roofs."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.obstruction.obstructions import box_rows
from fogsim.values.road import Structure, StructureKind

_LEAST_HEIGHT = 2.0
"""A roof is a structure of kind tunnel whose underside is higher than this above its line [m]."""

_SKIN = 0.1
"""How far a space reaches into the roof over it, stays within it to the sides, and ends before its portals [m].

So what is seen of ceiling and walls from within is in it, and what is seen from without is not, rounding or no.
"""


@dataclass(frozen=True, slots=True)
class Tunnel:
    """A space with a roof and walls, open at both ends."""

    line: NDArray[np.float64]  # (n, 3): Its middle on the road, from one portal to the other [m]
    half_width: float  # Half of its width, walls included [m]
    height: float  # Height of its ceiling above the road [m]

    @property
    def length(self) -> float:
        """Length along its line in plan [m]."""
        steps = np.diff(self.line[:, :2], axis=0)
        return float(np.sqrt(np.einsum("ij,ij->i", steps, steps)).sum())

    def boxes(self) -> NDArray[np.float64]:
        """Its space as boxes (m, 10), in order along its line; see `fogsim.obstruction.box_kernels`."""
        rows = np.array(box_rows(self.line, self.half_width - _SKIN, (-1.0, self.height + _SKIN)))
        # The first begins, and the last ends, behind the portal.
        rows[0, :3] += _SKIN * np.append(rows[0, 3:5], rows[0, 5])
        rows[0, 6] -= _SKIN
        rows[-1, 6] -= _SKIN
        return rows


def tunnels_of(structures: Iterable[Structure]) -> tuple[Tunnel, ...]:
    """Tunnels among structures: what is under their roofs."""
    return tuple(
        Tunnel(one.line, 0.5 * one.width, one.bottom)
        for one in structures
        if one.kind is StructureKind.TUNNEL and one.bottom > _LEAST_HEIGHT
    )
