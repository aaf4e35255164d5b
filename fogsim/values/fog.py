"""Fog as a field in space and time."""

import itertools
import math
from dataclasses import dataclass
from typing import Annotated, NamedTuple

from fogsim.core.parameters import NUMBER, checked_parameters
from fogsim.errors import InputError

GROUND_ALBEDO = 0.1
"""Default albedo of the land around [-]: in visible light, grass and asphalt have about as much."""


def airlight_share(ground_albedo: float = GROUND_ALBEDO) -> float:
    """Airlight seen level near the ground over E / π, in fog below an overcast sky that gives E: 0.34 + 0.66 ρ."""
    return 0.34 + 0.66 * ground_albedo


AIRLIGHT_SHARE = airlight_share()
"""Default airlight over that of a white horizontal diffuser, with the default land around [-]."""


@checked_parameters
@dataclass(frozen=True, slots=True)
class FogBank:
    """A stretch of fog across the road: a slab in the world with soft edges, unlimited sideways.

    The extra extinction rises along `axis` over `edge` metres centred on `start`, and falls in the same way at `end`.

    Attributes
    ----------
    origin : tuple of float
        (x, y) of the point from which `start` and `end` are measured [m].
    axis : tuple of float
        Unit vector (x, y) along the bank.
    start, end : float
        Distances along the axis at which half of the extra extinction is reached [m]; start < end.
    edge : float
        Length of each soft edge [m], positive and not longer than the bank.
    extra_extinction : float
        What the inside of the bank adds to the extinction coefficient outside [1/m]; negative for a clearing.
    """

    origin: tuple[float, float]
    axis: tuple[float, float]
    start: float
    end: float
    edge: float
    extra_extinction: float

    def __post_init__(self) -> None:
        """Refuse a bank that ends before it starts."""
        if not self.start < self.end:
            raise InputError(f"a fog bank must end beyond its start, got {self.start!r} to {self.end!r} m")
        if not 0 < self.edge <= (self.end - self.start) * (1 + 1e-9):
            raise InputError(f"a fog bank's edge must be positive and not longer than the bank, got {self.edge!r} m")


@checked_parameters
@dataclass(frozen=True, slots=True)
class FogShelter:
    """A tunnel, into which fog does not get.

    Attributes
    ----------
    line : tuple of (float, float, float)
        Points along its middle on the road, from one portal to the other [m].
    half_width, height : float
        Half of its width, walls included, and the height of its ceiling [m].
    reach : float
        How far from the portals fog reaches in [m]: over this distance it thins to nothing.
    """

    line: tuple[tuple[float, float, float], ...]
    half_width: float
    height: float
    reach: float


@checked_parameters
@dataclass(frozen=True, slots=True)
class FogPatches:
    """Random thick and thin places: the extinction times a log-normal factor of mean 1.

    The logarithm of the factor is Gaussian with the correlation e^(−(Δ/ℓ)²), Δ/ℓ being the distance in correlation
    lengths, horizontally and vertically.

    Attributes
    ----------
    correlation_length : float
        Horizontal distance at which the correlation has fallen to 1/e [m], positive.
    correlation_height : float
        The same, vertically [m].
    strength : float
        Standard deviation of the logarithm of the factor [-], 0 … 2.
    seed : int
        The same seed gives the same patches.
    offset : tuple of float
        (x, y) by which they have drifted [m].
    """

    correlation_length: float
    correlation_height: float
    strength: float
    seed: int = 0
    offset: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        """Refuse patches without size or of impossible strength."""
        for name in ("correlation_length", "correlation_height"):
            if not 0 < getattr(self, name) < math.inf:
                raise InputError(f"the {name} of fog patches must be a positive length, got {getattr(self, name)!r} m")
        if not 0 <= self.strength <= 2:
            raise InputError(f"the strength of fog patches must lie within 0 … 2, got {self.strength!r}")


@checked_parameters
@dataclass(frozen=True, slots=True)
class FogChange:
    """The fog at one time; between two of them it changes linearly, before the first and after the last not at all.

    Attributes
    ----------
    time : float
        Time since the run began [s].
    density : float
        Factor of the extinction coefficient everywhere [-], not negative.
    base, top : float
        Heights between which there is fog then [m].
    """

    time: float
    density: float
    base: Annotated[float, NUMBER]
    top: Annotated[float, NUMBER]


@checked_parameters
@dataclass(frozen=True, slots=True)
class FogField:
    """Extinction coefficient and airlight in space and time.

    The extinction coefficient is k = (`extinction` + what the banks add) · h(z) · (factor of the patches) · (density
    of the time) · (1 − share of a shelter), where h is 1 between `base` and `top`, falls to 0 beyond them over smooth
    edges, and falls by e over each `scale_height` above `ground`. Banks and patches drift with the wind.

    Attributes
    ----------
    extinction : float
        Extinction coefficient outside the banks [1/m]; 0 is clear air.
    banks : tuple of FogBank
        Denser (or thinner) stretches, not overlapping.
    airlight : tuple of float
        Luminance of an infinite path through the fog near the ground by day, per colour channel [cd/m²].
    top : float
        Height above which there is no fog [m]; ``inf`` where the layer has no end.
    top_edge : float
        Thickness of the top's soft edge, centred on `top` [m]; 0 for a sharp one.
    base : float
        Height below which there is no fog [m]: that of fog which has lifted; ``-inf`` where it rests on the ground.
    base_edge : float
        Thickness of the base's soft edge [m].
    scale_height : float
        Height over which ground fog thins by e [m]; ``inf`` where it does not.
    ground : float
        Height from which `scale_height` counts [m]; below it the fog is as thick as there.
    patches : FogPatches or None
        Random thick and thin places.
    wind : tuple of float
        Velocity (x, y) with which banks and patches drift [m/s].
    changes : tuple of FogChange
        The fog over time, in order of time; empty for fog that does not change.
    shelters : tuple of FogShelter
        Places without fog; they stay where they are.
    reachable_densities : tuple of float
        Factors of the extinction coefficient that a script may bring next to those of `changes` [-].
    airlight_share : float
        The airlight over that of a white horizontal surface under the same sky [-]: what another daylight goes by.
    airlight_shading : float
        How much the airlight dims with each unit of optical depth overhead [-]; 0 for airlight that is the same
        everywhere. Two-stream theory of a conservative layer gives ¾ (1 − g), about 0.1 in fog.
    ground_albedo : float or None
        Albedo of the land [-], 0 … 1, for an airlight by elevation and path as radiative transfer in a plane layer of
        even fog has it (`airlight` is its level then); None for Koschmieder's, the same everywhere.
    forward_scatter : float
        Share of what the fog takes from the transmitted light that arrives blurred by day [-], 0 … 0.3.
    forward_scatter_width : float
        Standard deviation of that blur in directions [rad].
    """

    extinction: float
    airlight: tuple[float, float, float]
    banks: tuple[FogBank, ...] = ()
    top: Annotated[float, NUMBER] = math.inf
    top_edge: float = 0.0
    base: Annotated[float, NUMBER] = -math.inf
    base_edge: float = 0.0
    scale_height: Annotated[float, NUMBER] = math.inf
    ground: float = 0.0
    patches: FogPatches | None = None
    wind: tuple[float, float] = (0.0, 0.0)
    changes: tuple[FogChange, ...] = ()
    airlight_share: float = AIRLIGHT_SHARE
    airlight_shading: float = 0.0
    ground_albedo: float | None = None
    forward_scatter: float = 0.0
    forward_scatter_width: float = math.radians(1.0)
    shelters: tuple[FogShelter, ...] = ()
    reachable_densities: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Refuse a field that cannot be."""
        if not 0 <= self.extinction < math.inf:
            raise InputError(f"an extinction coefficient must be finite and not negative, got {self.extinction!r} 1/m")
        if not all(0 <= light < math.inf for light in self.airlight):
            raise InputError(f"airlight must be finite and not negative, got {self.airlight!r} cd/m²")
        if not self.scale_height > 0:
            raise InputError(f"the scale height of fog must be positive, got {self.scale_height!r} m")
        for base, top in ((self.base, self.top), *((change.base, change.top) for change in self.changes)):
            if not base + 0.5 * self.base_edge <= top - 0.5 * self.top_edge:
                raise InputError(f"the top of fog must lie above its base, soft edges included, got {base} and {top} m")
        for one, other in itertools.pairwise(self.changes):
            if not one.time < other.time:
                raise InputError(f"times of changing fog must increase, got {one.time!r} and then {other.time!r} s")
        if self.ground_albedo is not None:
            self._refuse_no_layer(self.ground_albedo)

    def _refuse_no_layer(self, albedo: float) -> None:
        """Refuse an airlight by elevation and path where there is no plane layer of even fog."""
        if not 0 <= albedo <= 1:
            raise InputError(f"the albedo of the ground must lie within 0 … 1, got {albedo!r}")
        uneven = {
            "banks": bool(self.banks),
            "patches": self.patches is not None,
            "a soft top": self.top_edge > 0,
            "no top": math.isinf(self.top),
            "a base": self.base > -math.inf,
            "a scale height": math.isfinite(self.scale_height),
            "tunnels": bool(self.shelters),
            "shaded airlight": self.airlight_shading > 0,
            "forward scattering": self.forward_scatter > 0,
        }
        found = [name for name, is_so in uneven.items() if is_so]
        if found:
            raise InputError(
                f"airlight by elevation is known of an even layer of fog on flat land, not with {', '.join(found)}"
            )


class SideLight(NamedTuple):
    """Daylight of surfaces that are not level."""

    # vertical, below: illuminance of a vertical surface, on the mean of all sides, and of one that faces down, over
    # that of a level one [-]
    vertical: float
    below: float


EVEN_LIGHT = SideLight(0.56, 0.12)
"""That under a sky which is about as bright everywhere, above dark ground."""
