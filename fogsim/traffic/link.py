"""How a SUMO simulation is reached: in this process, or over a connection. Both offer the same calls."""

from collections.abc import Sequence
from typing import Any, Protocol

Api = Any
"""The domains of SUMO's TraCI (``vehicle``, ``simulation``, ``lane``, …), as libsumo and traci both offer them.

Neither has types; every use is inside the traffic stage.
"""


class SumoLink(Protocol):
    """A SUMO simulation that can be begun, stepped and ended."""

    def begin(self, arguments: Sequence[str]) -> Api:
        """Start SUMO with arguments of its command line, or load it anew if this link has begun it before.

        Raises
        ------
        SimulationError
            If SUMO refuses, or cannot be reached.
        """

    def step(self) -> None:
        """Move the simulation by one step."""

    def end(self) -> None:
        """End the simulation, or leave it; ending twice is allowed."""
