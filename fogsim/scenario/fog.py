"""The fog of a scenario file: how thick, where, and how it changes."""

import itertools
import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fogsim.atmosphere import Droplets, FogConfig, RouteBank
from fogsim.scenario.section import (
    Distance,
    Length,
    Moment,
    Number,
    Place,
    Reach,
    Section,
    Seed,
    SpeedKmh,
    Top,
    Visibility,
)
from fogsim.units import KMH_PER_MPS, extinction_from_visibility
from fogsim.values import FogChange, FogField, FogPatches
from fogsim.values.fog import GROUND_ALBEDO, airlight_share


class Bank(Section):
    """A fog bank along the ego's route; start and end are where it is half as dense as inside."""

    start_m: Place
    """Where it begins: half as dense as inside, along the ego's route."""

    end_m: Place
    """Where it ends, too."""

    visibility_m: Visibility
    """Meteorological visibility inside."""

    edge_m: Length = 100.0
    """Length of each soft edge."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not self.start_m < self.end_m:
            raise ValueError(f"start_m must be less than end_m, got {self.start_m:g} and {self.end_m:g}")
        if self.edge_m > self.end_m - self.start_m:
            raise ValueError(
                f"edge_m must not be longer than the bank ({self.end_m - self.start_m:g} m), got {self.edge_m:g}"
            )
        return self


class Patches(Section):
    """Random thick and thin places in the fog; the extinction coefficient keeps its mean."""

    correlation_length_m: Annotated[Length, Field(ge=0.1)]
    """Distance at which thick and thin have little to do with each other any more (correlation 1/e)."""

    correlation_height_m: Annotated[Length, Field(ge=0.1)] = 10.0
    """The same, upwards."""

    strength: Annotated[Number, Field(ge=0, le=2)] = 0.6
    """Standard deviation of the logarithm of the extinction coefficient; 0.6 is from half to twice as thick."""

    seed: Seed | None = None
    """Seed of the patches, which are then the same in every run; by default each seed of the run has its own."""


class Wind(Section):
    """Wind that banks and patches drift with."""

    speed_kmh: SpeedKmh
    """Its speed."""

    from_deg: Annotated[Number, Field(ge=0, le=360)]
    """Where it comes from: 0 is north, 90 east."""


class Change(Section):
    """The fog at one time; in between it changes linearly."""

    at_s: Moment
    """Time since the ego's appearance; before the first and after the last of them the fog stays the same."""

    density: Annotated[Number, Field(ge=0, le=1000)] = 1.0
    """Factor of the extinction coefficient everywhere: 2 halves the visibility."""

    base_m: Place | None = None
    """Height of the fog's base; to be given at all times or at none."""

    top_m: Place | None = None
    """Height of the fog's top; to be given at all times or at none."""


class Fog(Section):
    """Either homogeneous (visibility_m), or banks with another visibility outside them."""

    visibility_m: Visibility | None = None
    """Meteorological visibility of homogeneous fog; `inf` is clear air. Leaves no room for the two below."""

    outside_visibility_m: Visibility | None = None
    """Meteorological visibility outside the banks."""

    banks: tuple[Bank, ...] = ()
    """Fog banks along the ego's route; they must not overlap."""

    top_m: Top = 250.0
    """Height of the fog layer; this and all heights are above the lowest point of the ego's route."""

    top_edge_m: Distance = 0.0
    """Thickness of its soft upper edge, centred on `top_m`."""

    base_m: Place | None = None
    """Height below which there is no fog, for fog that has lifted; it rests on the ground if not given."""

    base_edge_m: Distance = 0.0
    """Thickness of its soft lower edge, centred on `base_m`."""

    scale_height_m: Annotated[Length, Field(ge=0.1)] | None = None
    """Height over which ground fog thins by a factor e; it does not if not given."""

    patches: Patches | None = None
    """Random thick and thin places."""

    wind: Wind | None = None
    """Wind that banks and patches drift with."""

    changes: tuple[Change, ...] = ()
    """How the fog thickens, thins, sinks and lifts over time."""

    droplets: Droplets = Droplets.MODERATE_RADIATION
    """Sizes of the droplets, which set how fog scatters lamplight: large in advection fog, small in radiation fog."""

    airlight: Literal["koschmieder", "photons"] = "koschmieder"
    """Light that the fog adds by day: the same everywhere, or by elevation and path as photons have it, which are
    scattered many times between sky and ground: for even fog in a layer, on flat land without tunnels."""

    ground_albedo: Annotated[Number, Field(ge=0, le=1)] = GROUND_ALBEDO
    """Albedo ρ of the land around: 0.05 dark asphalt or woods, 0.1 grass and roads, 0.2 dry grass, 0.8 snow. The
    airlight's level near the ground is 0.34 + 0.66 ρ of a white surface's."""

    airlight_shading: Annotated[Number, Field(ge=0, le=1)] = 0.0
    """Dimming of the airlight for each unit of optical depth overhead; 0.1 in real fog, 0 for an even airlight."""

    forward_scatter: Annotated[Number, Field(ge=0, le=0.3)] = 0.0
    """Weight of the blur that forward scattering puts on what is seen through much fog by day."""

    forward_scatter_deg: Annotated[Number, Field(ge=0.01, le=10)] = 1.0
    """Width of that blur (standard deviation)."""

    in_tunnels_m: Reach = 10.0
    """How far fog reaches into tunnels, where it thins to nothing; `inf` fills them."""

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        homogeneous = self.visibility_m is not None
        heterogeneous = self.outside_visibility_m is not None or bool(self.banks)
        if homogeneous and heterogeneous:
            raise ValueError("give either visibility_m (homogeneous fog) or outside_visibility_m with banks, not both")
        if not homogeneous and self.outside_visibility_m is None:
            raise ValueError("visibility_m (homogeneous fog), or outside_visibility_m with banks, is missing")
        ordered = sorted(self.banks, key=lambda b: b.start_m)
        for one, other in itertools.pairwise(ordered):
            if one.end_m + 0.5 * one.edge_m > other.start_m - 0.5 * other.edge_m:
                raise ValueError(f"banks overlap: one ends at {one.end_m:g} m, another starts at {other.start_m:g} m")
        return self

    @model_validator(mode="after")
    def _even_for_photons(self) -> Self:
        if self.airlight != "photons":
            return self
        uneven = ("outside_visibility_m", "patches", "top_edge_m", "base_m", "scale_height_m", "airlight_shading")
        defaults = type(self).model_fields
        given = [key for key in (*uneven, "forward_scatter") if getattr(self, key) != defaults[key].default]
        given += ["top_m: inf"] if math.isinf(self.top_m) else []
        if given or any(change.base_m is not None for change in self.changes):
            raise ValueError(
                "airlight: photons is known of even fog in a layer on the ground (visibility_m, top_m), not with "
                + (", ".join(given) or "base_m in changes")
            )
        return self

    @property
    def airlight_share(self) -> float:
        """Airlight near the ground over that of a white surface [-]."""
        return airlight_share(self.ground_albedo)

    @model_validator(mode="after")
    def _times_increase(self) -> Self:
        for one, other in itertools.pairwise(self.changes):
            if not one.at_s < other.at_s:
                raise ValueError(f"at_s of changes must increase, got {one.at_s:g} and then {other.at_s:g}")
        for key in ("base_m", "top_m"):
            given = [getattr(change, key) is not None for change in self.changes]
            if any(given) and not all(given):
                counts = f"got it in {sum(given)} of {len(given)}"
                raise ValueError(f"{key} must be given in all changes or in none, {counts}")
        return self

    @model_validator(mode="after")
    def _top_above_base(self) -> Self:
        for base, top in ((self.base_m, self.top_m), *map(self.heights, self.changes)):
            if base is not None and base + 0.5 * self.base_edge_m > top - 0.5 * self.top_edge_m:
                raise ValueError(f"top_m must lie above base_m, soft edges included, got {top:g} and {base:g}")
        return self

    def heights(self, change: Change) -> tuple[float | None, float]:
        """Base and top at the time of a change [m].

        Parameters
        ----------
        change : Change
            One of `changes`.
        """
        return (
            self.base_m if change.base_m is None else change.base_m,
            self.top_m if change.top_m is None else change.top_m,
        )


def fog_config(fog: Fog, airlight: tuple[float, float, float], eye_height: float) -> FogConfig:
    """Fog along a route (`airlight` [cd/m²], `eye_height` [m])."""
    visibility = fog.visibility_m if fog.visibility_m is not None else fog.outside_visibility_m
    outside = extinction_from_visibility(math.inf if visibility is None else visibility)
    field = FogField(
        extinction=outside,
        airlight=airlight,
        top=fog.top_m,
        top_edge=fog.top_edge_m,
        base=-math.inf if fog.base_m is None else fog.base_m,
        base_edge=fog.base_edge_m,
        scale_height=fog.scale_height_m or math.inf,
        patches=None if fog.patches is None else _patches(fog.patches),
        wind=(0.0, 0.0) if fog.wind is None else _velocity(fog.wind),
        changes=_changes(fog),
        airlight_shading=fog.airlight_shading,
        airlight_share=fog.airlight_share,
        ground_albedo=fog.ground_albedo if fog.airlight == "photons" else None,
        forward_scatter=fog.forward_scatter,
        forward_scatter_width=math.radians(fog.forward_scatter_deg),
    )
    return FogConfig(
        field=field,
        banks=tuple(_bank(bank, outside) for bank in fog.banks),
        in_tunnels=fog.in_tunnels_m,
        droplets=fog.droplets,
        has_patches_of_run=fog.patches is None or fog.patches.seed is None,
        eye_height=eye_height,
    )


def _bank(bank: Bank, outside: float) -> RouteBank:
    extra = extinction_from_visibility(bank.visibility_m) - outside
    return RouteBank(bank.start_m, bank.end_m, bank.edge_m, extra)


def _changes(fog: Fog) -> tuple[FogChange, ...]:
    changes = []
    for change in fog.changes:
        base, top = fog.heights(change)
        changes.append(FogChange(change.at_s, change.density, -math.inf if base is None else base, top))
    return tuple(changes)


def _patches(patches: Patches) -> FogPatches:
    return FogPatches(patches.correlation_length_m, patches.correlation_height_m, patches.strength, patches.seed or 0)


def _velocity(wind: Wind) -> tuple[float, float]:
    """East and north components [m/s]; wind is named by where it comes from."""
    speed, bearing = wind.speed_kmh / KMH_PER_MPS, math.radians(wind.from_deg)
    return -speed * math.sin(bearing), -speed * math.cos(bearing)
