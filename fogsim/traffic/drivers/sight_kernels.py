"""What drivers see, as compiled kernels: the laws are those of `fogsim.traffic.drivers.sight`."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.traffic.drivers.adaptation import NIGHT_EYE_THRESHOLD, Adaptation, contrast_ratio

_FARTHEST = 1e5
"""Distance beyond which sight is not distinguished from sight without end [m]."""

DISTANCE_TOLERANCE = 0.01
"""By how much a distance that is searched for may be too small [m]."""

NEAREST = 0.1
"""No one is nearer than this [m]."""

BODY_MIDDLE = 1.2
"""Height above the road at which a vehicle is looked at by those whose eyes are higher [m]."""


DISTANCE, DEPTH, _CLOSING, _DEEPENING, CONTRAST, STEADY, INTENSITY, BRIGHTEST, OWN_STEADY, OWN = range(10)
"""Rows of what is known of drivers and their leaders.

Distance [m] and optical depth [-] between them, and bounds on how fast these change [m/s], [1/s]; the leader's inherent
contrast [-]; the luminous intensity of its lamps: of those that are always lit, of the brightest that is lit, and that
may be [cd]; light of the driver's own head lamps: what is always lit, and what is [-].
"""

HIDDEN, SEEN, DAZZLED = 0.0, 1.0, 2.0
"""A leader is out of sight, or in sight; or in sight unless glare, which is not known, hides it."""


IN_DOUBT = 2.0
"""A vehicle in another lane or road is seen at most by its lamps, or in the driver's head lamps."""

_X, _Y, _Z = range(3)
_MINIMUM_GAP, _BODY_CONTRAST, _EYE_HEIGHT, _LENGTH, _WIDTH = range(5)
"""Columns of traits of vehicles: the driver's minimum gap [m], the body's contrast [-], the driver's eyes above the
road [m], length and width [m]."""

_PART_HEADING, _PART_BEHIND, _PART_LENGTH = 3, 4, 5
"""Columns of parts of bodies, after where their front ends are [m]: headings [rad], how far behind the front bumper
they begin and how long they are [m]."""

EYES, END, LINE, BEARING, AHEAD, ASIDE, TARGET_CONTRAST, LINE_DEPTH, JUDGED = 0, 3, 6, 7, 8, 9, 10, 11, 12
"""Columns of lines of sight: where one begins, at the driver's eyes, and where it ends, at the nearest part of another
vehicle [m], its length [m], its horizontal angle from straight ahead [rad], and where the eyes are, from the middle of
the other's front bumper: ahead of it and to its left [m]; the other's inherent contrast [-]; the optical depth along
the line [-], and what `judge_lines` finds."""

FARTHEST_SIGHT = 2000.0
"""No one is seen farther away than this [m]; a vehicle that is teleported is nowhere."""


class Closing(NamedTuple):
    """Bounds on how fast gaps and what lies in them change."""

    speed: float  # By how much one vehicle's speed changes, on the average over the time that is looked ahead [m/s]
    drift: float  # How fast fog drifts and changes [m/s]
    extinction: float  # Extinction coefficient that is exceeded nowhere [1/m]
    even: float  # Extinction coefficient of fog that is the same everywhere [1/m]; negative for other fog


@kernel
def face_leaders(
    traits: NDArray[np.float64],
    rows: NDArray[np.intp],
    read: NDArray[np.float64],
    lamps: NDArray[np.float64],
    closing: Closing,
    facing: NDArray[np.float64],
    lines: NDArray[np.float64],
) -> None:
    """Put down where leaders are, how fast that changes, and in uneven fog the lines on which drivers look at them.

    Takes `traits` (m, 3 or more), the `rows` (2, n) of followers and leaders in it, what is `read` of them (4, n), gaps
    [m], speeds [m/s] and signals of leaders, the luminous intensity of rear `lamps` (2, 128) by signals [cd], `facing`
    (10, n), and `lines` (2, n, 3), in uneven fog with the places of followers and leaders [m].
    """
    for i in range(rows.shape[1]):
        own, other, signals = traits[rows[0, i]], traits[rows[1, i]], int(read[3, i]) & 127
        facing[DISTANCE, i] = max(read[0, i] + own[_MINIMUM_GAP], NEAREST)
        facing[CONTRAST, i], facing[STEADY, i] = other[_BODY_CONTRAST], lamps[0, 0]
        facing[INTENSITY, i], facing[BRIGHTEST, i] = lamps[0, signals], lamps[1, signals]
        facing[OWN_STEADY, i] = facing[OWN, i] = 1.0
        facing[_CLOSING, i] = abs(read[2, i] - read[1, i]) + closing.speed
        if closing.even >= 0.0:
            facing[DEPTH, i] = closing.even * facing[DISTANCE, i]
            facing[_DEEPENING, i] = closing.extinction * facing[_CLOSING, i]
            continue
        # In a bank that one end has reached and the other has not, each end counts by itself; and the fog drifts.
        apart = read[1, i] + read[2, i] + 2.0 * closing.speed + closing.drift
        facing[_DEEPENING, i] = closing.extinction * apart
        start, end, height = lines[0, i], lines[1, i], own[_EYE_HEIGHT]
        x, y, z = end[_X] - start[_X], end[_Y] - start[_Y], end[_Z] - start[_Z]
        start[_Z] += height
        z += min(height, BODY_MIDDLE) - height
        share = facing[DISTANCE, i] / math.sqrt(x * x + y * y + z * z)
        end[_X], end[_Y], end[_Z] = start[_X] + x * share, start[_Y] + y * share, start[_Z] + z * share


@kernel
def depth_limit(
    eyes: Adaptation,
    threshold: float,
    reach: float,
    distance: float,
    contrast: float,
    intensity: float,
    head_lamps: float,
) -> float:
    """Optical depth up to which a vehicle is seen [-]; see `DriverSight.depth_limit` (`distance` [m])."""
    squared = distance * distance
    once = contrast * eyes.airlight / (eyes.luminance * (threshold * contrast_ratio(eyes, distance)))
    once += intensity / (squared * eyes.eye_threshold)
    twice = head_lamps * reach**2 / squared * NIGHT_EYE_THRESHOLD / eyes.eye_threshold
    inverse = 0.5 * (once + math.sqrt(once * once + 4.0 * twice))
    return math.log(inverse) if inverse > 0.0 else -math.inf


@kernel
def depth_limits(
    eyes: Adaptation, threshold: float, reach: float, looks: NDArray[np.float64], limits: NDArray[np.float64]
) -> None:
    """Write the `depth_limit` of each of many `looks` (4, n): distance [m], contrast, intensity [cd], head lamps."""
    for i in range(limits.size):
        limits[i] = depth_limit(eyes, threshold, reach, looks[0, i], looks[1, i], looks[2, i], looks[3, i])


@kernel
def seen_distance(
    eyes: Adaptation,
    threshold: float,
    reach: float,
    extinction: float,
    contrast: float,
    intensity: float,
    head_lamps: float,
) -> float:
    """Distance up to which a vehicle is seen in even fog [1/m]; see `DriverSight.seen_distance` [m]."""
    near, far = 0.0, _FARTHEST
    if depth_limit(eyes, threshold, reach, far, contrast, intensity, head_lamps) >= extinction * far:
        return math.inf
    while far - near > DISTANCE_TOLERANCE:
        middle = 0.5 * (near + far)
        if depth_limit(eyes, threshold, reach, middle, contrast, intensity, head_lamps) >= extinction * middle:
            near = middle
        else:
            far = middle
    return near


@kernel
def judge_leaders(
    eyes: Adaptation,
    threshold: float,
    reach: float,
    dazzled: Adaptation,
    facing: NDArray[np.float64],
    horizon: float,
    judged: NDArray[np.float64],
) -> None:
    """Judge (2, n) whether leaders (`facing` (10, n)) are seen, and for how long that is sure to stay so [s]."""
    for i in range(facing.shape[1]):
        distance, depth, contrast = facing[DISTANCE, i], facing[DEPTH, i], facing[CONTRAST, i]
        deepening, change = facing[_DEEPENING, i], facing[_CLOSING, i] * horizon
        judged[1, i] = 0.0
        # Lamps that are commanded may go dark at once; what the others light stays.
        steady, own = facing[STEADY, i], facing[OWN_STEADY, i]
        if depth < depth_limit(dazzled, threshold, reach, distance, contrast, steady, own):
            spare = depth_limit(dazzled, threshold, reach, distance + change, contrast, steady, own) - depth
            judged[0, i], judged[1, i] = SEEN, min(max(spare, 0.0) / deepening, horizon)
            continue
        lit, own = facing[INTENSITY, i], facing[OWN, i]
        if depth <= depth_limit(eyes, threshold, reach, distance, contrast, lit, own):
            is_certain = depth <= depth_limit(dazzled, threshold, reach, distance, contrast, lit, own)
            judged[0, i] = SEEN if is_certain else DAZZLED
            continue
        # Lamps that are commanded may be commanded otherwise in any step.
        lit, nearest = facing[BRIGHTEST, i], max(distance - change, NEAREST)
        limit = depth_limit(eyes, threshold, reach, nearest, contrast, lit, 1.0)
        judged[0, i], judged[1, i] = HIDDEN, min(max(depth - limit, 0.0) / deepening, horizon)


@kernel
def draw_lines_of_sight(
    traits: NDArray[np.float64],
    rows: NDArray[np.intp],
    read: NDArray[np.float64],
    parts: NDArray[np.float64],
    ends: NDArray[np.int64],
    lines: NDArray[np.float64],
) -> None:
    """Write to `lines` (n, 13) the straight lines from observers' eyes to the nearest part of what they look at.

    Takes `traits` (m, 5 or more), the `rows` (2 n,) of observers and then of targets in it, what is `read` of them, all
    front bumpers [m] and then all of SUMO's angles [°], and straight `parts` (m, 6) of bodies that bend, each target's
    before its end in `ends` (n,).
    """
    count, first = ends.size, 0
    for n in range(count):
        other = count + n
        x, y, height = read[3 * n], read[3 * n + 1], traits[rows[n], _EYE_HEIGHT]
        half, nearest = 0.5 * traits[rows[other], _WIDTH], math.inf
        for i in range(first, max(ends[n], first + 1)):
            if i < ends[n]:
                front_x, front_y, front_z = parts[i, _X], parts[i, _Y], parts[i, _Z]
                heading, behind, length = parts[i, _PART_HEADING], parts[i, _PART_BEHIND], parts[i, _PART_LENGTH]
            else:
                front_x, front_y, front_z = read[3 * other], read[3 * other + 1], read[3 * other + 2]
                heading, behind, length = _heading(read[6 * count + other]), 0.0, traits[rows[other], _LENGTH]
            east, north = math.cos(heading), math.sin(heading)
            ahead = (x - front_x) * east + (y - front_y) * north
            aside = (y - front_y) * east - (x - front_x) * north
            along, across = min(max(ahead, -length), 0.0), min(max(aside, -half), half)
            end_x, end_y = front_x + along * east - across * north, front_y + along * north + across * east
            distance = math.hypot(end_x - x, end_y - y)
            if distance < nearest:
                nearest = distance
                lines[n, END], lines[n, END + 1] = end_x, end_y
                lines[n, END + 2] = front_z + min(height, BODY_MIDDLE)
                lines[n, AHEAD], lines[n, ASIDE] = ahead - behind, aside
        first = ends[n]
        lines[n, EYES], lines[n, EYES + 1], lines[n, EYES + 2] = x, y, read[3 * n + 2] + height
        up = lines[n, END + 2] - lines[n, EYES + 2]
        lines[n, LINE] = max(math.sqrt(nearest * nearest + up * up), NEAREST)
        bearing = math.atan2(lines[n, END + 1] - y, lines[n, END] - x) - _heading(read[6 * count + n])
        lines[n, BEARING] = bearing - 2.0 * math.pi * np.rint(bearing / (2.0 * math.pi))
        lines[n, TARGET_CONTRAST] = traits[rows[other], _BODY_CONTRAST]


@kernel
def _heading(angle: float) -> float:
    """Counterclockwise from east [rad] (`angle` clockwise from north [°])."""
    return (90.0 - angle) * (math.pi / 180.0)


@kernel
def judge_lines(
    eyes: Adaptation, threshold: float, reach: float, sure: float, even: float, lines: NDArray[np.float64]
) -> None:
    """Write to lines of sight whether what they end at is seen, and in even fog their optical depths.

    Takes `reach` [m], `sure`, the distance up to which every body is seen [m], and `even`, the extinction coefficient
    of fog that is the same everywhere [1/m], negative for other fog.
    """
    for n in range(len(lines)):
        line, distance = lines[n], lines[n, LINE]
        if even >= 0.0:
            line[LINE_DEPTH] = even * distance
        if distance <= sure:
            line[JUDGED] = SEEN
        elif distance > FARTHEST_SIGHT:
            line[JUDGED] = HIDDEN
        else:
            limit = depth_limit(eyes, threshold, reach, distance, line[TARGET_CONTRAST], 0.0, 0.0)
            line[JUDGED] = SEEN if line[LINE_DEPTH] <= limit else IN_DOUBT
