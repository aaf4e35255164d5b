"""What the loop asks of a traffic simulation, whatever runs it."""

from collections.abc import Sequence
from typing import Protocol

from fogsim.traffic.drivers.sight import FogAccess
from fogsim.values import Command, NetworkSnapshot, RoadNetwork, SignMap, TrafficSnapshot, Unplayed
from fogsim.values.script import TrafficAction


class AnyTraffic(Protocol):
    """A running traffic simulation."""

    def enter_fog(self, fog: FogAccess) -> None:
        """Let drivers see only what this fog lets them see, from now on and in every later run."""

    def begin(self, actions: Sequence[TrafficAction]) -> tuple[TrafficAction, ...]:
        """Begin what a script asks for, with the next step.

        Returns those that could not begin: the vehicle has left, or there is no such lane.
        """

    def advance(self, command: Command) -> None:
        """Move by one traffic step with a command in force."""

    def unplayed(self) -> Unplayed:
        """List what of the script has not been played since the start; before `close`."""

    def close(self) -> None:
        """End the simulation; closing twice is allowed."""


class Traffic(AnyTraffic, Protocol):
    """A running traffic simulation with one ego vehicle."""

    def start(self, seed: int) -> None:
        """Begin, or begin again, and run until the ego is on the road."""

    def planned_network(self) -> tuple[RoadNetwork, SignMap] | None:
        """Roads and signs along the ego's way before `start`; None where no file has it written out."""

    def network(self) -> tuple[RoadNetwork, SignMap]:
        """Roads and signs; after `start`."""

    def observe(self) -> TrafficSnapshot | None:
        """Report where everyone is and what has happened since the last call; None once the ego has left."""


class NetworkTraffic(AnyTraffic, Protocol):
    """A running traffic simulation without an ego vehicle."""

    def start(self, seed: int) -> None:
        """Begin, or begin again."""

    def observe_network(self) -> NetworkSnapshot:
        """Report where everyone is and what has happened since the last call."""
