"""Protocol of recorders, and the run that they are given."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from fogsim.recorders.run_directory import RunDirectory
from fogsim.values import Step, TrafficStep

Derived = Mapping[str, float | None]
"""What was derived from a step; the keys are `DERIVED_QUANTITIES`, None where a quantity is undefined.

Without an ego there are none of them.
"""

DERIVED_QUANTITIES: Mapping[str, str] = {
    "time_to_collision_s": "time to collision with the leader; none if it is not approached",
    "drac_mps2": "deceleration rate to avoid a crash with the leader",
    "stopping_sight_distance_m": "distance in which the ego could stop after a reaction time",
    "visibility_margin_m": "true visibility ahead minus stopping sight distance; none in clear air",
}
"""Quantities that every recorder of an ego's run is handed with each step, and what they mean."""

AnyStep_contra = TypeVar("AnyStep_contra", bound=TrafficStep, contravariant=True)


class StepRecorder(Protocol[AnyStep_contra]):
    """Writes what happens to a file; under its final name a file is always whole."""

    def record(self, step: AnyStep_contra, derived: Derived) -> None:
        """Take in one finished step."""

    def close(self, complete: bool) -> None:
        """Finish the file and give it its final name; closing twice does nothing.

        KeyboardInterrupt may cut it off where `complete` is True; it is called once more then, with False.
        """


Recorder = StepRecorder[Step]
"""A recorder of runs about an ego."""

TrafficRecorder = StepRecorder[TrafficStep]
"""A recorder of traffic alone, which can record runs about an ego, too."""


def _no_summary() -> Mapping[str, object]:
    return {}


def _no_road() -> NDArray[np.float64]:
    return np.zeros((0, 4))


@dataclass(frozen=True, slots=True)
class RunInformation:
    """What a recorder may want to know before the first step."""

    directory: RunDirectory  # Where the files go
    # title, description: name and description of the scenario
    title: str
    description: str
    seed: int  # Seed of the run
    methods: tuple[str, ...]  # Estimators, in the order in which they are to be shown
    frame_period: float  # Time between two steps [s]
    # Gives the metrics of the run by key when the run is over; a key ends in its unit
    summary: Callable[[], Mapping[str, object]] = _no_summary
    meanings: Mapping[str, str] = field(default_factory=dict)  # One line on each of those keys
    # Gives means over everyone on the road of traffic alone when the run is over (n, 4): middle of a stretch [m],
    # speed [m/s], extinction [1/m], and time of the vehicles [s]; empty where no road was named
    along_road: Callable[[], NDArray[np.float64]] = _no_road
    # Those keys by topic, for the report's folded tables
    topics: Mapping[str, Sequence[str]] = field(default_factory=dict)
    settings: Callable[[], Mapping[str, str]] = dict  # Returns paragraphs on how the run was set up, by their headings
