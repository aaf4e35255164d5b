"""What of huang2015's evaluation is run: camera, vehicle, visibilities and ways."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fogsim.calibration.staged_road import StagedVehicle
from fogsim.reproduce.huang2015_published import TABLE_4_3, TABLE_5_2, TABLE_5_3
from fogsim.reproduce.road_sweeps import DRIVES
from fogsim.values import Camera, Estimate

CAMERA = Camera(800, 600, 5600.0, (399.5, 299.5), mount_height=1.0)
"""λ = 5600 px·m and H = 1 m are eq. 4.11's; the thesis tells no size of image."""

VEHICLE = StagedVehicle(length=4.7, width=1.8, height=1.45, paint=(0.03, 0.05, 0.12))
"""The vehicle that is followed: the thesis shows dark ones, whose size it does not tell."""

VARIANTS = ("published", "corrected")
WAYS = ("away", "back", "noisy")
"""How the vehicle of table 4.3 drives, and with a noisy sensor away."""

STEP, FIRST, LAST = 5.0, 25.0, 90.0
"""Ranges at which the thesis clips [m]."""

VISIBILITY_4_2 = 150.0
"""V_met of table 4.2 [m]."""

NEAR = 0.1
"""Relative error that the notes count as reached [-]."""


@dataclass(frozen=True, slots=True)
class Plan:
    """Which parts of the evaluation are run.

    Attributes
    ----------
    methods, ratios, tracks, references : tuple of float
        Visibilities of tables 4.1 and 4.3, of the confidence curves and ratios, of 5.1, and of 5.3 [m].
    intervals : mapping
        Table 5.2: visibilities by interval [m].
    starts : tuple of float
        Positions of the reference in table 5.3 [m].
    drives : int
        Drives of each setting of the rough method's sweeps.
    """

    methods: tuple[float, ...] = tuple(TABLE_4_3)
    ratios: tuple[float, ...] = (150.0, 500.0)
    tracks: tuple[float, ...] = (100.0, 200.0, 300.0, 400.0, 500.0)
    references: tuple[float, ...] = (100.0, 200.0, 300.0, 400.0, 500.0)
    intervals: Mapping[float, tuple[float, ...]] = field(
        default_factory=lambda: {interval: tuple(row) for interval, row in TABLE_5_2.items()}
    )
    starts: tuple[float, ...] = tuple(TABLE_5_3)
    drives: int = DRIVES


@dataclass(frozen=True, slots=True)
class Case:
    """One vehicle followed in one fog by one variant.

    Attributes
    ----------
    visibility : float
        V_met [m].
    variant : str
        One of `VARIANTS`.
    interval : float
        Change of range between pictures [m].
    start : float
        Range of the first picture [m].
    back : bool
        Whether the vehicle comes nearer, from 90 m.
    noisy : bool
        Whether the sensor has noise.
    """

    visibility: float
    variant: str
    interval: float = STEP
    start: float = FIRST
    back: bool = False
    noisy: bool = False

    @property
    def frames(self) -> list[float]:
        """Ranges of the frames that the estimator gets [m]: more than it keeps where jumps would lose the track."""
        step = min(self.interval, STEP) if self.interval % STEP == 0 else self.interval
        ranges = [float(r) for r in np.arange(self.start, LAST + 1e-9, step)]
        return ranges[::-1] if self.back else ranges


Results = Mapping[Case, Mapping[float, Estimate]]
"""Estimates by case and by the range of the latest frame [m]."""

Rough = Mapping[float, Mapping[str, Estimate]]
"""Estimates from the road alone, by visibility and variant."""
