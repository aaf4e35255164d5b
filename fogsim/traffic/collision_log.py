"""Collisions, each pair of vehicles once, for simulations that report them in every step."""

from collections.abc import Iterable

from fogsim.values import Collision


class CollisionLog:
    """Collects collisions until they are asked for."""

    def __init__(self) -> None:
        self._pairs: set[frozenset[str]] = set()
        self._pending: list[Collision] = []

    def add(self, collisions: Iterable[Collision]) -> None:
        """Take in the collisions of a step; those of pairs that have collided before are left out."""
        for collision in collisions:
            pair = frozenset((collision.collider, collision.victim))
            if pair not in self._pairs:
                self._pairs.add(pair)
                self._pending.append(collision)

    def take(self) -> tuple[Collision, ...]:
        """Collisions since the last call."""
        pending, self._pending = tuple(self._pending), []
        return pending
