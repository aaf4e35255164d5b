"""A fog field with what other stages ask of it, handed to them by the loop."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogsim.atmosphere.optical_depth import extinction, optical_depth
from fogsim.values import FogField


@dataclass(frozen=True, slots=True)
class FieldAccess:
    """Extinction and optical depth of one field.

    Attributes
    ----------
    field : FogField
        The fog.
    """

    field: FogField

    @property
    def maximum_extinction(self) -> float:
        """Extinction coefficient that is exceeded nowhere [1/m]; banks do not overlap."""
        return self.field.extinction + max((0.0, *(bank.extra_extinction for bank in self.field.banks)))

    @property
    def minimum_extinction(self) -> float:
        """Extinction coefficient that is reached everywhere below the fog's top [1/m]; banks do not overlap."""
        return self.field.extinction + min((0.0, *(bank.extra_extinction for bank in self.field.banks)))

    def extinction(self, points: ArrayLike) -> NDArray[np.float64]:
        """Extinction coefficient at points (..., 3) [1/m]; see `fogsim.atmosphere.extinction`."""
        return extinction(self.field, points)

    def optical_depth(self, start: ArrayLike, end: ArrayLike) -> NDArray[np.float64]:
        """Optical depth between points (..., 3) [-]; see `fogsim.atmosphere.optical_depth`."""
        return optical_depth(self.field, start, end)
