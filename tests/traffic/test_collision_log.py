"""Each pair of vehicles collides once, however often the simulation tells it."""

from fogsim.traffic.setup import CollisionLog
from fogsim.values import Collision


def test_a_pair_counts_once_whoever_is_the_collider_and_is_given_once() -> None:
    log = CollisionLog()
    first, other = Collision(1.0, "a", "b", 5.0), Collision(1.1, "b", "c", 2.0)
    log.add([first])
    log.add([Collision(1.1, "b", "a", 4.0), other])
    assert log.take() == (first, other)
    log.add([Collision(1.2, "a", "b", 3.0)])
    assert log.take() == ()
