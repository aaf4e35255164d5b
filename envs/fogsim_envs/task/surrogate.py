"""What camera and estimator would say of the fog, drawn from how they were measured to err: no frame is drawn.

The table is made by ``python benchmarks/surrogate.py --fit`` from runs with frames, and compared with others by the
same command without it. An estimate's error depends on the visibility ahead and on the light, lasts from one estimate
to the next, and has a part that stays for an episode, as that of a wrong calibration does.
"""

import bisect
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.core.files.readers import read_json
from fogsim.core.parameters import checked_parameters
from fogsim.errors import InputError, shown
from fogsim.units import visibility_from_extinction
from fogsim.values import Estimate

MEASURED, MEASURED_2 = (Path(__file__).with_name(name) for name in ("surrogate.json", "surrogate_2.json"))
"""The tables that come with FogSim, in 160×120 pixels, two frames a second: of negru2013, and of version 2's estimators
(the first that answers)."""

LIGHTS = ("day", "dusk", "night")
_DAY, _DUSK = 1000.0, 10.0
"""Illuminance of the sky from which it is day, and dusk [lx]."""

Table = NDArray[np.float64]


def light_class(illuminance: float) -> int:
    """Place in `LIGHTS` of an illuminance of the sky (`illuminance` [lx])."""
    return 0 if illuminance >= _DAY else 1 if illuminance >= _DUSK else 2


@checked_parameters
@dataclass(frozen=True, slots=True)
class SurrogateTable:
    """How an estimator was measured to err, by light (rows) and visibility ahead (columns)."""

    method: str  # Name of the estimator
    edges: Table  # (bins + 1,): Visibilities that part the columns [m], rising
    # stays_valid, becomes_valid (lights, bins): shares of valid estimates after a valid and after an invalid one
    stays_valid: Table
    becomes_valid: Table
    none_seen: Table  # (lights, bins): Share of valid estimates that say "no fog seen"
    error: Table  # (lights, bins, quantiles): Quantiles of ln(estimated / true k), at even shares from 0 to 1
    deviation: Table  # (lights, bins, quantiles): Quantiles of ln(standard deviation / k) of those estimates, too
    # (lights, bins, quantiles): Quantiles of ln(standard deviation · 1 m) of estimates that say "no fog seen"
    none_deviation: Table
    # episode_share, persistence: share of an error's variance that stays for an episode, and correlation of the rest
    # from one estimate to the next
    episode_share: float
    persistence: float

    @classmethod
    def load(cls, path: Path = MEASURED) -> "SurrogateTable":
        """Read a table."""
        written = read_json(path)
        if not isinstance(written, dict):
            raise InputError(f"{path}: expected an object, got {shown(written)}")
        try:
            fields: dict[str, Any] = {n: np.array(one) if isinstance(one, list) else one for n, one in written.items()}
            return cls(**fields)
        except ValueError as error:
            raise InputError(f"{path}: {error}") from error

    def __post_init__(self) -> None:
        """Refuse arrays whose shapes do not fit together."""
        shape = len(LIGHTS), len(self.edges) - 1
        for name in ("stays_valid", "becomes_valid", "none_seen", "error", "deviation", "none_deviation"):
            found: Table = getattr(self, name)
            if found.shape[:2] != shape or found.ndim > 3:
                raise InputError(
                    f"SurrogateTable: {name} must have the shape {shape} or {shape} and quantiles, got {found.shape}"
                )
        for name in self.__slots__[1:]:
            if not np.isfinite(getattr(self, name)).all():
                raise InputError(f"SurrogateTable: {name} must have finite numbers")

    def as_json(self) -> str:
        """The table as JSON, its numbers with four digits after the point."""
        return json.dumps({name: _rounded(getattr(self, name)) for name in self.__slots__})


def _rounded(value: Any) -> Any:
    """A field as JSON has it."""
    if isinstance(value, str):
        return value
    return np.round(value, 4).tolist()


class EstimatorSurrogate:
    """Draws estimates in place of an estimator."""

    def __init__(self, table: SurrogateTable) -> None:
        self._table = table
        self._inner_edges = table.edges[1:-1].tolist()
        self._own = math.sqrt(1.0 - table.persistence**2)
        self._of_episode, self._of_frame = math.sqrt(table.episode_share), math.sqrt(1.0 - table.episode_share)
        self.reset(np.random.default_rng(0))

    def reset(self, rng: np.random.Generator) -> None:
        """Begin an episode."""
        self._rng = rng
        self._common, self._error, self._width = rng.standard_normal(3).tolist()
        self._was_valid = True

    def estimate(self, extinction: float, illuminance: float) -> Estimate:
        """Draw the next estimate (`extinction` [1/m], `illuminance` [lx])."""
        table, light = self._table, light_class(illuminance)
        column = bisect.bisect_left(self._inner_edges, visibility_from_extinction(extinction))
        new, width = self._rng.standard_normal(2).tolist()
        valid, none = self._rng.random(2).tolist()
        self._error = table.persistence * self._error + self._own * new
        self._width = table.persistence * self._width + self._own * width
        likely = table.stays_valid if self._was_valid else table.becomes_valid
        self._was_valid = valid < likely[light, column]
        if not self._was_valid:
            return Estimate.invalid(table.method, "drawn")
        spread = _cumulative(self._width)
        if none < table.none_seen[light, column]:
            return Estimate(table.method, 0.0, math.exp(_at(table.none_deviation[light, column], spread)))
        share = _cumulative(self._of_episode * self._common + self._of_frame * self._error)
        # In clear air there is no k to err by a share of: the least that a visibility of 100 km stands for.
        estimated = max(extinction, _CLEAR) * math.exp(_at(table.error[light, column], share))
        return Estimate(table.method, estimated, estimated * math.exp(_at(table.deviation[light, column], spread)))


_CLEAR = 3e-5
"""Extinction coefficient by which errors in clear air are measured [1/m]."""


def relative_extinction(estimated: float, extinction: float) -> float:
    """Error of an estimate as the table has it, ln(estimated / true k) (`estimated`, `extinction` [1/m])."""
    return math.log(estimated / max(extinction, _CLEAR))


def _cumulative(normal: float) -> float:
    """Share of a normal distribution below a value."""
    return 0.5 * (1.0 + math.erf(normal / math.sqrt(2.0)))


def _at(quantiles: Table, share: float) -> float:
    """Quantile at a share, between two of the table's by a straight line."""
    place = share * (len(quantiles) - 1)
    lower = min(int(place), len(quantiles) - 2)
    low, high = quantiles[lower : lower + 2].tolist()
    return float(low + (place - lower) * (high - low))
