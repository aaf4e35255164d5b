"""Fog as it is described along a route, and the field that it makes there."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.fog.layer_airlight import layer_thickness
from fogsim.atmosphere.lamps.phase_function import Droplets
from fogsim.core.parameters import Range, checked_parameters
from fogsim.errors import InputError
from fogsim.values import FogBank, FogField, FogShelter, Structure
from fogsim.values.obstruction import Tunnel, tunnels_of


@dataclass(frozen=True, slots=True)
class RouteBank:
    """A fog bank along a route; start and end are where it is half as dense as inside."""

    # start, end: Positions along the route [m]
    start: float
    end: float
    edge: float  # Length of each soft edge [m]
    extra_extinction: float  # What it adds to the extinction coefficient outside [1/m]


@checked_parameters
@dataclass(frozen=True, slots=True)
class FogConfig:
    """Fog along a route.

    Parameters
    ----------
    field : FogField
        The fog without banks and shelters, its heights above the lowest point of the route.
    banks : tuple of RouteBank
        Fog banks along the route, not overlapping.
    in_tunnels : float
        How far fog reaches into tunnels [m]; ``inf`` fills them.
    droplets : Droplets
        Sizes of the droplets, which set how fog scatters lamplight.
    has_patches_of_run : bool
        Whether each run draws the seed of its patches, if there are any.
    eye_height : float
        Height of the camera above the road [m], which must lie within a layer with an airlight of its own.
    """

    field: FogField
    banks: tuple[RouteBank, ...] = ()
    in_tunnels: Annotated[float, Range(0.0, math.inf)] = 10.0
    droplets: Droplets = Droplets.MODERATE_RADIATION
    has_patches_of_run: bool = True
    eye_height: float = 0.0

    def along(self, route: NDArray[np.float64], structures: Sequence[Structure] = ()) -> FogField:
        """Lay the fog along a route; `of_run` draws its patches.

        Parameters
        ----------
        route : (n, 3) float64
            Points of the route [m].
        structures : sequence of Structure
            Bridges and tunnels, into which fog does not get.
        """
        field, ground = self.field, float(route[:, 2].min())
        tunnels = tunnels_of(structures) if math.isfinite(self.in_tunnels) else ()
        fog = replace(
            field,
            banks=tuple(_bank(bank, route) for bank in self.banks),
            top=ground + field.top,
            base=ground + field.base,
            ground=ground,
            changes=tuple(replace(one, base=ground + one.base, top=ground + one.top) for one in field.changes),
            shelters=tuple(_shelter(tunnel, self.in_tunnels) for tunnel in tunnels),
        )
        if fog.ground_albedo is not None:
            _check_layer(fog, float(route[:, 2].max()) + self.eye_height)
        return fog

    def of_run(self, fog: FogField, patch_seed: int) -> FogField:
        """Fog with the patches of one run, unless their seed is fixed.

        Parameters
        ----------
        fog : FogField
            Fog along a route.
        patch_seed : int
            Seed of the patches.
        """
        if fog.patches is None or not self.has_patches_of_run:
            return fog
        return replace(fog, patches=replace(fog.patches, seed=patch_seed))


def _shelter(tunnel: Tunnel, reach: float) -> FogShelter:
    points = tuple((x, y, z) for x, y, z in tunnel.line.tolist())
    return FogShelter(points, tunnel.half_width, tunnel.height, reach)


def _bank(bank: RouteBank, route: NDArray[np.float64]) -> FogBank:
    """A bank between two places of the route: a slab across the straight line that joins them."""
    station = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(route, axis=0), axis=1))))

    def place(at: float) -> NDArray[np.float64]:
        inside = np.array([np.interp(at, station, route[:, axis]) for axis in (0, 1)])
        # Before the start and beyond the end of the route, go straight on.
        first, last = route[1, :2] - route[0, :2], route[-1, :2] - route[-2, :2]
        before, beyond = min(at, 0.0), max(at - station[-1], 0.0)
        return np.asarray(inside + before * first / math.hypot(*first) + beyond * last / math.hypot(*last))

    start, end = place(bank.start), place(bank.end)
    chord = math.dist(start, end)
    axis = (end - start) / chord
    return FogBank(
        origin=(float(start[0]), float(start[1])),
        axis=(float(axis[0]), float(axis[1])),
        start=0.0,
        end=chord,
        edge=min(bank.edge, chord),
        extra_extinction=bank.extra_extinction,
    )


def _check_layer(fog: FogField, eye: float) -> None:
    """Refuse a layer that may become denser than is known, or lower than an eye."""
    tops = [fog.top, *(change.top for change in fog.changes)]
    density = max([1.0, *fog.reachable_densities, *(change.density for change in fog.changes)])
    layer_thickness(fog.extinction * density, max(tops) - fog.ground)
    if eye > min(tops):
        raise InputError(
            "fog.airlight: photons is known for eyes within the layer: fog.top_m must be above the highest point of "
            f"the road and the camera, {eye - fog.ground:.4g} m, got {min(tops) - fog.ground:.4g} m"
        )
