"""No fusion, for runs whose belief no one asks for."""

from collections.abc import Sequence

import numpy as np

from fogsim.fusion.grid_filter import CELLS, LOG_HIGH, LOG_LOW
from fogsim.values.belief import Belief
from fogsim.values.estimate import Estimate


class NoFusion:
    """Believes all visibilities between 10 m and 10 km equally likely, whatever is estimated."""

    def __init__(self) -> None:
        self._log_extinction = np.linspace(LOG_LOW, LOG_HIGH, CELLS)
        self._log_extinction.flags.writeable = False

    def update(self, estimates: Sequence[Estimate], time: float) -> Belief:  # noqa: ARG002 - the protocol's parameters
        """Say what is believed, always the same; see `Fusion.update`.

        Parameters
        ----------
        estimates, time
            See `Fusion.update`.
        """
        return Belief(self._log_extinction, np.full(CELLS, 1.0 / CELLS))

    def reset(self) -> None:
        """Do nothing: there is nothing to be forgotten."""
