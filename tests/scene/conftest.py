"""A small motorway to build scenes of."""

import numpy as np
import pytest

from fogsim.values import Lane, LaneMarking, RoadNetwork


def carriageway(edge: str, start: tuple[float, float], heading: float, length: float, speed: float) -> list[Lane]:
    """Three parallel straight lanes, the rightmost first."""
    ahead = np.array([np.cos(heading), np.sin(heading), 0.0])
    left = np.array([-np.sin(heading), np.cos(heading), 0.0])
    distance = np.linspace(0.0, length, 7)[:, None]
    return [
        Lane(
            lane_id=f"{edge}_{i}",
            edge_id=edge,
            centreline=np.array([*start, 0.0]) + left * 3.5 * i + ahead * distance,
            width=3.5,
            speed_limit=speed,
            left=LaneMarking.SOLID if i == 2 else LaneMarking.DASHED,
            right=LaneMarking.SOLID if i == 0 else LaneMarking.DASHED,
            outermost=i == 0,
        )
        for i in range(3)
    ]


@pytest.fixture(scope="session")
def motorway() -> RoadNetwork:
    lanes = carriageway("out", (0, 0), 0.0, 600.0, 36.0) + carriageway("back", (600, 20), np.pi, 600.0, 36.0)
    return RoadNetwork(tuple(lanes), lanes[0].centreline)
