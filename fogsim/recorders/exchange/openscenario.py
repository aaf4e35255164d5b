"""What a run was as an OpenSCENARIO file: who drove where and when, the fog and the light of day."""

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from fogsim.core.files.atomic import write_text
from fogsim.recorders.protocol import Derived
from fogsim.recorders.templating import render
from fogsim.values import Step, TrafficStep
from fogsim.values.traffic import BOX, PEDESTRIAN

_REFERENCE_SHARE = 0.28
"""Where the middle of a body is ahead of the rear axle, the reference point, as a share of its length [-]."""

_CHANGE = 0.01
"""Change of the visibility that becomes an event of its own, as a share [-]."""

FARTHEST = 100_000.0
"""Visibility that stands for clear air, which the format cannot express [m]."""

_CATEGORIES = {"car": "car", "van": "van", "truck": "truck", "bus": "bus", "motorcycle": "motorbike"}

_OTHERS = {
    BOX: ("MiscObject", "miscObjectCategory", "obstacle"),
    PEDESTRIAN: ("Pedestrian", "pedestrianCategory", "pedestrian"),
}


class _Vertex(NamedTuple):
    """Time [s], place of the reference point [m] and heading [rad]."""

    time: float
    x: float
    y: float
    z: float
    heading: float


@dataclass
class _Track:
    """A vehicle: its body, and its reference point over time."""

    kind: str
    size: tuple[float, float, float]
    first_speed: float
    vertices: list[_Vertex] = field(default_factory=list)


class OpenScenarioRecorder:
    """Writes ``scenario.xosc`` (OpenSCENARIO XML 1.2) when the run is over.

    Each vehicle follows its trajectory, with the time of each camera period; visibility at the camera is
    ``visualRange``, again whenever it has changed by a hundredth. Roads are not written.
    """

    def __init__(self, path: Path, title: str) -> None:
        self._path = path
        self._title = title
        self._tracks: dict[str, _Track] = {}
        self._visibility: list[tuple[float, float]] = []
        self._ego = ""
        self._end = 0.0
        self._open = True

    def record(self, step: TrafficStep, _derived: Derived | None = None) -> None:
        """Take in who is where."""
        if self._visibility and step.time <= self._end:
            return
        traffic, self._end = step.traffic, step.time
        for row, name in enumerate(traffic.ids):
            length = float(traffic.length[row])
            size = (length, float(traffic.width[row]), float(traffic.height[row]))
            track = self._tracks.setdefault(name, _Track(traffic.types[row], size, float(traffic.speed[row])))
            x, y, z = map(float, traffic.position[row])
            heading, back = float(traffic.heading[row]), (0.5 + _REFERENCE_SHARE) * length
            x, y = x - back * math.cos(heading), y - back * math.sin(heading)
            track.vertices.append(_Vertex(step.time, x, y, z, heading))
        now = min(step.truth.visibility, FARTHEST)
        if not self._visibility or abs(now / self._visibility[-1][1] - 1.0) > _CHANGE:
            self._visibility.append((step.time, now))
        if isinstance(step, Step):
            self._ego = traffic.ids[step.ego]

    def close(self, complete: bool) -> None:
        """Write the file."""
        if self._open:
            text = render(
                "scenario.xosc",
                description=f"{self._title}: a run of FogSim" + ("" if complete else ", cut short"),
                tracks=self._tracks,
                visibilities=self._visibility,
                ego=self._ego,
                end=self._end,
                reference_share=_REFERENCE_SHARE,
                categories=_CATEGORIES,
                others=_OTHERS,
            )
            write_text(self._path, text)
            self._open = False
