"""Bodies of vehicles as rectangles, and the straight distance between two."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from fogsim.values import TrafficState


@dataclass(frozen=True, slots=True)
class Body:
    """A rectangle: middle of its front [m], heading [rad], length and width [m]."""

    x: float
    y: float
    heading: float
    length: float
    width: float

    def behind(self, distance: float, left: float = 0.0) -> tuple[float, float]:
        """The point so far behind the front and to the left [m]."""
        cosine, sine = math.cos(self.heading), math.sin(self.heading)
        return self.x - distance * cosine - left * sine, self.y - distance * sine + left * cosine

    def corners(self) -> list[tuple[float, float]]:
        """Its corners [m]."""
        return [self.behind(back, side * self.width) for back in (0.0, self.length) for side in (-0.5, 0.5)]

    def beyond(self, point: tuple[float, float]) -> Iterator[float]:
        """How far a point is before the front, behind the rear, to the left and to the right of it [m]."""
        x, y = point[0] - self.x, point[1] - self.y
        ahead = x * math.cos(self.heading) + y * math.sin(self.heading)
        left = y * math.cos(self.heading) - x * math.sin(self.heading)
        yield from (ahead, -ahead - self.length, left - 0.5 * self.width, -left - 0.5 * self.width)


def body_of(traffic: TrafficState, row: int) -> Body:
    """Body of the vehicle in a row."""
    x, y = traffic.position[row, :2].tolist()
    return Body(x, y, float(traffic.heading[row]), float(traffic.length[row]), float(traffic.width[row]))


def clearance(one: Body, other: Body) -> float:
    """Straight distance between two bodies, 0 where they overlap [m]."""
    nearest, is_apart = math.inf, False
    for body, corners in ((one, other.corners()), (other, one.corners())):
        beyond = [list(body.beyond(corner)) for corner in corners]
        # They are apart if all corners of one lie beyond a side of the other.
        is_apart |= any(min(side) > 0.0 for side in zip(*beyond, strict=True))
        nearest = min(nearest, *(math.hypot(max(f, r, 0.0), max(le, ri, 0.0)) for f, r, le, ri in beyond))
    return nearest if is_apart else 0.0
