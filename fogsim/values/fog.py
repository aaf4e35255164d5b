"""Fog as a field in space."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class FogBank:
    """A stretch of fog across the road: a slab in the world with soft edges, unlimited sideways.

    The extra extinction rises along `axis` over `edge` metres centred on `start`, and falls likewise at `end`.

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


@dataclass(frozen=True, slots=True)
class FogField:
    """Extinction coefficient and airlight in space: a homogeneous layer with banks in it.

    Attributes
    ----------
    extinction : float
        Extinction coefficient outside the banks [1/m]; 0 is clear air.
    banks : tuple of FogBank
        Denser (or thinner) stretches, not overlapping.
    airlight : tuple of float
        Radiance of an infinite path through the fog by day, per colour channel [cd/m²].
    top : float
        Height above which there is no fog [m]; ``inf`` where the layer has no end.
    """

    extinction: float
    airlight: tuple[float, float, float]
    banks: tuple[FogBank, ...] = ()
    top: float = float("inf")
