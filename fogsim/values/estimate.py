"""What one estimator says about the fog in one frame."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from fogsim.units import visibility_from_extinction

NORMAL_90_PERCENT = 1.6448536269514722
"""Half-width of the central 90 % interval of a normal distribution in standard deviations [-]."""


class FogCategory(StrEnum):
    """Fog classes of negru2013, table I."""

    NONE = "none"
    LOW = "low"
    MODERATE = "moderate"
    DENSE = "dense"
    VERY_DENSE = "very dense"


def fog_category(visibility: float) -> FogCategory:
    """Class of a meteorological visibility (negru2013, table I: 50, 100, 300 and 1000 m).

    Parameters
    ----------
    visibility : float
        Meteorological visibility [m].
    """
    if visibility < 50:
        return FogCategory.VERY_DENSE
    if visibility < 100:
        return FogCategory.DENSE
    if visibility < 300:
        return FogCategory.MODERATE
    return FogCategory.LOW if visibility < 1000 else FogCategory.NONE


@dataclass(frozen=True, slots=True)
class SignLook:
    """What came of looking for a sign of the map in a picture: ``Estimate.diagnostics["sign_looks"]`` has them.

    Attributes
    ----------
    sign_id : str
        Its id in the sign map.
    u, v : float
        Column and row of its middle: where it was detected, else where the map has it [px].
    radius : float
        Half of its diameter there [px].
    distance : float
        Distance by the map [m].
    detected : bool
        Whether this picture shows it.
    first_seen : float or None
        Distance at which it was first detected [m]; None as long as it was not.
    """

    sign_id: str
    u: float
    v: float
    radius: float
    distance: float
    detected: bool = False
    first_seen: float | None = None


@dataclass(frozen=True, slots=True)
class ExtinctionBounds:
    """What is known of the extinction where it cannot be estimated: that it is at most or at least so much."""

    # most, least: k is likely at most, and at least, this [1/m]; ``inf`` and 0 where nothing is known
    most: float = math.inf
    least: float = 0.0
    softness: float = 0.1  # Standard deviation of either end in ln k [-]


@dataclass(frozen=True, slots=True)
class OpticalDepths:
    """Optical depth along the road ahead: how the fog varies with the distance.

    Attributes
    ----------
    distance : (n,) tuple of float
        Distances from the camera [m], ascending.
    depth : (n,) tuple of float
        Optical depth up to each, τ = ∫ k ds [-].
    standard_deviation : (n,) tuple of float
        Its standard deviation [-].
    """

    distance: tuple[float, ...]
    depth: tuple[float, ...]
    standard_deviation: tuple[float, ...]

    def mean_extinction(self, distance: float) -> tuple[float, float]:
        """Mean extinction from the camera to a distance, and its standard deviation [1/m].

        Parameters
        ----------
        distance : float
            How far [m]; beyond the last distance that of the last counts, nearer than the first that of the first.
        """
        at = min(max(distance, self.distance[0]), self.distance[-1])
        after = next((i for i, place in enumerate(self.distance) if place >= at), len(self.distance) - 1)
        before = max(after - 1, 0)
        length = self.distance[after] - self.distance[before]
        share = (at - self.distance[before]) / length if length > 0.0 else 0.0
        depth, deviation = (
            (1.0 - share) * values[before] + share * values[after] for values in (self.depth, self.standard_deviation)
        )
        return depth / at, deviation / at


@dataclass(frozen=True, slots=True)
class DenserFog:
    """Fog ahead that is much denser than that before it, such as a bank.

    Attributes
    ----------
    distance : float
        From the camera to where the extinction reaches half of the densest that is seen [m].
    standard_deviation : float
        Of the distance [m].
    extinction : float
        The densest that is seen [1/m].
    """

    distance: float
    standard_deviation: float
    extinction: float


@dataclass(frozen=True, slots=True)
class Estimate:
    """An estimate of the extinction coefficient, or the statement that there is none.

    Attributes
    ----------
    method : str
        Name of the estimator in the registry.
    extinction : float
        Extinction coefficient k [1/m], ≥ 0; 0 with a finite deviation means "no fog that this method could see". Where
        the fog is uneven, the mean from the camera to the meteorological visibility, or to `reach` if that is nearer.
    standard_deviation : float
        Standard deviation of k [1/m]; ``inf`` if not valid.
    valid : bool
        False if the method gives no estimate for this frame; the numbers are then meaningless.
    diagnostics : mapping
        What the method found on the way (rows, bands, reasons), for overlays and debugging.
    bounds : ExtinctionBounds or None
        Of an estimate that is not valid: what is known all the same ("at least 250 m").
    reach : float
        Distance up to which the estimate speaks of the fog [m]: what lies beyond was not seen.
    optical_depths : OpticalDepths or None
        How the fog varies along the road, from methods that estimate it.
    denser : DenserFog or None
        Denser fog ahead, from methods that detect it.
    common_deviation : float
        Standard deviation of ln k that all images of a drive have in common, as by the droplets or the pattern of the
        own beam [-], a part of the whole: averaging over images does not reduce it.
    scale_deviation : float
        Standard deviation of the logarithm of all distances, as by an unknown lens [-], a part of the whole: the
        interval has it as a factor.
    """

    method: str
    extinction: float
    standard_deviation: float
    valid: bool = True
    diagnostics: Mapping[str, object] = field(default_factory=dict)
    bounds: ExtinctionBounds | None = None
    reach: float = math.inf
    optical_depths: OpticalDepths | None = None
    denser: DenserFog | None = None
    common_deviation: float = 0.0
    scale_deviation: float = 0.0

    @classmethod
    def invalid(cls, method: str, reason: str, **diagnostics: object) -> "Estimate":
        """Build an invalid estimate, with the reason in the diagnostics.

        Parameters
        ----------
        method : str
            Name of the estimator in the registry.
        reason : str
            Why the method gives no estimate.
        **diagnostics : object
            What else it found.
        """
        return cls(method, 0.0, math.inf, valid=False, diagnostics={"reason": reason, **diagnostics})

    @property
    def visibility(self) -> float:
        """Meteorological visibility ln 20 / k [m]; ``inf`` for k = 0."""
        return visibility_from_extinction(self.extinction)

    @property
    def visibility_interval(self) -> tuple[float, float]:
        """Central 90 % interval of the meteorological visibility [m]; what the bounds leave, (0, inf), if not valid."""
        if not self.valid:
            if self.bounds is None:
                return (0.0, math.inf)
            widened = math.exp(NORMAL_90_PERCENT * self.bounds.softness)
            return (
                visibility_from_extinction(self.bounds.most * widened),
                visibility_from_extinction(self.bounds.least / widened),
            )
        half_width = NORMAL_90_PERCENT * self._deviation_without(self.scale_deviation * self.extinction)
        least, most = self.extinction - half_width, self.extinction + half_width
        # What rounding leaves of a difference of equals is no visibility of 1e18 m.
        least = least if least > 1e-9 * half_width else 0.0
        if self.scale_deviation > 0.0:
            least, most = self._on_any_scale(least, -1.0), self._on_any_scale(most, 1.0)
        return visibility_from_extinction(most), visibility_from_extinction(least)

    def _on_any_scale(self, end: float, side: float) -> float:
        """The lower (side −1) or upper (1) end of an interval of k with what an unknown scale adds to it [1/m]."""
        by_scale = NORMAL_90_PERCENT * self.scale_deviation
        if self.extinction == 0.0 or end == 0.0:
            return end * math.exp(by_scale)
        return self.extinction * math.exp(side * math.hypot(math.log(end / self.extinction), by_scale))

    def _deviation_without(self, part: float) -> float:
        """Standard deviation of k without an independent part [1/m]."""
        return self.standard_deviation if part == 0.0 else math.sqrt(max(self.standard_deviation**2 - part**2, 0.0))

    @property
    def own_deviation(self) -> float:
        """Standard deviation of k that this image alone has [1/m]."""
        common = self.extinction * math.expm1(NORMAL_90_PERCENT * self.common_deviation) / NORMAL_90_PERCENT
        return self._deviation_without(common)

    @property
    def category(self) -> FogCategory:
        """Fog class of the estimate."""
        return fog_category(self.visibility)
