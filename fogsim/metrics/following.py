"""Who follows whom, from the positions of all vehicles at one instant."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.values import TrafficState

_MOST_EMPTY = 8
"""Lanes for each vehicle up to which to count through the empty ones, too, costs less than to sort them out."""


class Following(NamedTuple):
    """Followers and the vehicles ahead of them on the same course."""

    # follower, leader (n,) int: rows of the two in the traffic
    follower: NDArray[np.intp]
    leader: NDArray[np.intp]
    # (n,): Distance from the follower's front bumper to the leader's rear bumper [m], at least 0
    gap: NDArray[np.float64]
    # speed, leader_speed (n,): speeds of the two [m/s]
    speed: NDArray[np.float64]
    leader_speed: NDArray[np.float64]


def find_following(traffic: TrafficState) -> Following:
    """Pair each vehicle with the nearest one ahead of it on its course; see `pair_on_courses`."""
    known: dict[str, int] = {}
    course = np.array([known.setdefault(name, len(known)) for name in traffic.course], dtype=np.intp)
    return pair_on_courses(
        traffic.position, traffic.heading, traffic.length, traffic.speed, course, traffic.across, traffic.width
    )


def pair_on_courses(
    position: NDArray[np.float64],
    heading: NDArray[np.float64],
    length: NDArray[np.float64],
    speed: NDArray[np.float64],
    course: NDArray[np.intp],
    across: NDArray[np.float64],
    width: NDArray[np.float64],
) -> Following:
    """Pair each vehicle with the nearest one ahead of it on its course; lanes end where SUMO's edges end.

    Vehicles of a lane are in the order of their places along the mean of their headings, so a lane may turn by up to
    180° from its first vehicle to its last. Gaps are straight lines: in a curve of radius R they are too short by about
    gap³ / 24 R².

    Takes `position` (n, 3) [m], `heading`, `length`, `speed` (n,) [rad], [m], [m/s], `course` (n,) int, `across` (n,)
    [m], `width` (n,) [m].
    """
    course = course - course.min(initial=0)
    if course.max(initial=0) > _MOST_EMPTY * len(course):
        _, course = np.unique(course, return_inverse=True)
    cosine, sine = np.cos(heading), np.sin(heading)
    # The sum of the headings' unit vectors need not have the length 1 to give the order.
    along = position[:, 0] * np.bincount(course, cosine)[course] + position[:, 1] * np.bincount(course, sine)[course]
    # numpy sorts numbers of 16 bits and less by counting.
    order = np.argsort(along, kind="stable")
    short = course[order].astype(np.min_scalar_type(course.max(initial=0)))
    order = order[np.argsort(short, kind="stable")]
    if len(across):
        follower, leader = _overlapping(order, course, across, width)
        aside = across[leader] - across[follower]
    else:
        same = course[order[1:]] == course[order[:-1]]
        follower, leader = order[:-1][same], order[1:][same]
        aside = None
    way = position[leader] - position[follower]
    if aside is None:
        # Across the mean heading: exact along an arc, and free of the drawn glide of a lane change.
        x, y = cosine[follower] + cosine[leader], sine[follower] + sine[leader]
        aside = (way[:, 1] * x - way[:, 0] * y) / np.maximum(np.hypot(x, y), 1e-9)
    distance = np.sqrt(np.maximum(way[:, 0] ** 2 + way[:, 1] ** 2 + way[:, 2] ** 2 - aside**2, 0.0))
    return Following(follower, leader, np.maximum(distance - length[leader], 0.0), speed[follower], speed[leader])


def _overlapping(
    order: NDArray[np.intp], course: NDArray[np.intp], across: NDArray[np.float64], width: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Followers and the next vehicles on their courses whose widths overlap with theirs, in the order given."""
    waiting, leader = np.arange(len(order)), np.full(len(order), -1)
    for ahead in range(1, len(order)):
        waiting = waiting[waiting < len(order) - ahead]
        waiting = waiting[course[order[waiting + ahead]] == course[order[waiting]]]
        if not len(waiting):
            break
        one, other = order[waiting], order[waiting + ahead]
        meets = np.abs(across[other] - across[one]) < 0.5 * (width[other] + width[one])
        leader[waiting[meets]] = other[meets]
        waiting = waiting[~meets]
    found = np.flatnonzero(leader >= 0)
    return order[found], leader[found].astype(np.intp)
