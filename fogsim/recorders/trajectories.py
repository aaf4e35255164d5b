"""Every vehicle and person at every camera period, in the columns of SUMO's own floating car data."""

import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, Self, TypeVar

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from fogsim.core.files.atomic import whole_file, write_text
from fogsim.core.files.row_log import row_batches, row_schema
from fogsim.recorders.protocol import Derived
from fogsim.recorders.table import LoggedTable
from fogsim.recorders.templating import render
from fogsim.units import visibility_from_extinction
from fogsim.values import Step, TrafficStep
from fogsim.values.traffic import BOX, PEDESTRIAN, with_persons

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


MOST_ROWS_HELD = 50_000
"""Rows of one batch at most: some megabytes."""

ROWS_PER_GROUP = 200_000
"""Rows of one row group at least, but for the last: what a reader has in memory at once."""

TRAJECTORY_COLUMNS: Mapping[str, tuple[Any, str]] = {
    "index": (pa.int64(), "number of the camera period, as in steps.parquet"),
    "timestep_time": (pa.float64(), "SUMO's time after its step [s]; fcd-output has the time before it"),
    "vehicle_id": (pa.string(), "vehicle, or person on foot"),
    "vehicle_x": (pa.float64(), "east, middle of the front bumper [m]; a change of lane takes time here"),
    "vehicle_y": (pa.float64(), "north, of the same point [m]"),
    "vehicle_z": (pa.float64(), "height of the road there [m]"),
    "vehicle_angle": (pa.float64(), "heading, clockwise from north [°]"),
    "vehicle_type": (pa.string(), "kind of body (car, van, truck, bus, motorcycle, pedestrian), not SUMO's vType"),
    "vehicle_speed": (pa.float64(), "speed [m/s]"),
    "vehicle_lane": (pa.string(), "SUMO's lane, empty off the lanes; a change of lane is made at once here"),
    "vehicle_slope": (pa.float64(), "slope of the road, positive uphill [°]; null for pedestrians"),
    "vehicle_acceleration": (pa.float64(), "acceleration [m/s²]; null for pedestrians"),
    "visibility": (
        pa.float64(),
        "true meteorological visibility at the driver's eyes [m]; null for clear air, pedestrians",
    ),
    "believed_visibility": (
        pa.float64(),
        "what the ego and other equipped vehicles believe, median [m]; null for others",
    ),
    "believed_visibility_low": (pa.float64(), "lower end of the 90 % interval of that [m]"),
    "believed_visibility_high": (pa.float64(), "upper end of it [m]"),
    "advised_speed": (pa.float64(), "lowest speed in force that was heard advised [m/s]; null for none"),
}
"""Columns of ``trajectories.parquet``: their types and meanings, named as in SUMO's fcd-output."""


_BELIEVED = ("believed_visibility", "believed_visibility_low", "believed_visibility_high")

_AnyStep = TypeVar("_AnyStep", bound=TrafficStep)


class TrajectoryRecorder(LoggedTable[TrafficStep]):
    """Writes ``trajectories.parquet``: a row for each vehicle and person on foot that is read, and each step.

    Rows go by time, and within a time as the traffic lists the vehicles, then persons; equal steps give equal bytes.
    Memory does not grow with the run.
    """

    def __init__(self, path: Path, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__(path, TRAJECTORY_COLUMNS, write_trajectory_table, clock)
        self._last = -math.inf
        self._rows_held = 0

    def record(self, step: TrafficStep, _derived: Derived | None = None) -> None:
        """Add the vehicles of a step; one in which no time has passed adds nothing."""
        traffic = step.traffic
        # The step that ends a run may show once more what was last seen.
        if traffic.time > self._last:
            self._held.append(step)
            self._rows_held += len(traffic.ids) + len(traffic.persons.ids)
            self._last = traffic.time
        if self._flush_if_due(at_once=self._rows_held >= MOST_ROWS_HELD):
            self._rows_held = 0

    def _batch(self) -> Any:
        steps = self._held
        states = [with_persons(step.traffic) for step in steps]
        counts = [len(state.ids) for state in states]
        position = np.concatenate([state.position for state in states])

        def of_all(name: str) -> Any:
            return np.concatenate([getattr(state, name) for state in states])

        def texts(name: str) -> list[str]:
            return [text for state in states for text in getattr(state, name)]

        columns = {
            "index": np.repeat([step.index for step in steps], counts),
            "timestep_time": np.repeat([state.time for state in states], counts),
            "vehicle_id": texts("ids"),
            "vehicle_x": position[:, 0],
            "vehicle_y": position[:, 1],
            "vehicle_z": position[:, 2],
            "vehicle_angle": np.mod(90.0 - np.degrees(of_all("heading")), 360.0),
            "vehicle_type": texts("types"),
            "vehicle_speed": of_all("speed"),
            "vehicle_lane": texts("lane"),
            "vehicle_slope": np.degrees(of_all("grade")),
            "vehicle_acceleration": of_all("acceleration"),
            "visibility": [visibility for step in steps for visibility in _visibilities(step)],
            "advised_speed": [speed for step in steps for speed in _advised_speeds(step)],
        }
        believed = [quantiles for step in steps for quantiles in _believed_visibilities(step)]
        columns |= {name: [quantiles[i] for quantiles in believed] for i, name in enumerate(_BELIEVED)}
        arrays = [pa.array(columns[field.name], type=field.type, from_pandas=True) for field in self._schema]
        return pa.RecordBatch.from_arrays(arrays, schema=self._schema)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self.close(complete=kind is None)


def with_trajectories(steps: Iterable[_AnyStep], path: Path) -> Iterator[_AnyStep]:
    """Pass steps on, and write the trajectories of all vehicles in them into a parquet file."""
    with TrajectoryRecorder(path) as recorder:
        for step in steps:
            recorder.record(step)
            yield step


def _visibilities(step: TrafficStep) -> list[float | None]:
    """Visibility at each vehicle [m]; None in clear air, where it is not known, and for persons."""
    extinctions = step.truth.vehicle_extinctions
    persons: list[float | None] = [None] * len(step.traffic.persons.ids)
    if extinctions is None:
        return [*[None] * len(step.traffic.ids), *persons]
    return [visibility_from_extinction(k) if k > 0.0 else None for k in extinctions.tolist()] + persons


def _believed_visibilities(step: TrafficStep) -> list[tuple[float | None, ...]]:
    """Visibility that each vehicle believes, and its 90 % interval [m]; None for who has no camera."""
    beliefs = {}
    if isinstance(step, Step):
        beliefs = {one.vehicle_id: one.belief for one in step.equipped} | {step.traffic.ids[step.ego]: step.belief}
    nothing: tuple[float | None, ...] = (None,) * len(_BELIEVED)
    told = [
        beliefs[one].visibility_quantiles((0.5, 0.05, 0.95)) if one in beliefs else nothing for one in step.traffic.ids
    ]
    return told + [nothing] * len(step.traffic.persons.ids)


def _advised_speeds(step: TrafficStep) -> list[float | None]:
    """What each vehicle has heard advised [m/s]; None for who has heard nothing, and for persons."""
    heard = step.traffic.advised_speed.tolist() or [math.inf] * len(step.traffic.ids)
    return [speed if speed < math.inf else None for speed in heard] + [None] * len(step.traffic.persons.ids)


def write_trajectory_table(path: Path, log: Path, complete: bool) -> None:
    """Make a parquet file of a log of trajectories, whole or not at all, group of rows by group."""
    schema = row_schema(log)
    plain = schema.remove_metadata()
    with (
        whole_file(path) as file,
        # As of ``steps.parquet``: without a stored schema readers take the metadata from the end of the file.
        pq.ParquetWriter(file, plain, compression="zstd", store_schema=False) as writer,
    ):
        for group in _row_groups(log):
            writer.write_table(group.replace_schema_metadata(None), row_group_size=len(group))
        writer.add_key_value_metadata({"fogsim.complete": "true" if complete else "false", **schema.metadata})


def _row_groups(log: Path) -> Iterator[Any]:
    """Rows of a log, in tables of `ROWS_PER_GROUP` or a little more; of rows that stand there twice the first count."""
    held: list[Any] = []
    last = -math.inf
    for batch in row_batches(log):
        times = batch["timestep_time"].to_numpy()
        new = batch.filter(pa.array(times > last))
        if not len(new):
            continue
        last = float(times[-1])
        held.append(new)
        if sum(len(b) for b in held) >= ROWS_PER_GROUP:
            yield pa.Table.from_batches(held).combine_chunks()
            held = []
    if held:
        yield pa.Table.from_batches(held).combine_chunks()
