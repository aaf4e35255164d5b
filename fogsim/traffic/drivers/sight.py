"""What a driver can see of a vehicle: its body against the fog and in the own head lamps, and its lamps.

A vehicle is seen where

    A e^(−τ) + B e^(−2τ) ≥ 1,
    A = C₀ L_air / (L C_th) + I / (d² E_th),    B = (reach / d)² E_night / E_th,

with the optical depth τ of the line of sight, the distance d, the inherent contrast C₀ of the body, the luminances
L_air of the fog in the sky's light and L of all that the eye is adapted to, and the intensity I of the brightest lamp.
The first term of A is Koschmieder's law, the second Allard's; B is what the own head lamps light, through fog twice: it
is 1 at `DriverSight.headlamp_reach` at night in clear air. Shares of the threshold are added: a body that is nearly
seen and lamps that are nearly seen are seen together. Solved for e^(−τ), that is a square root. C_th and E_th
follow adaptation; see `fogsim.traffic.drivers.sight_kernels`.
"""

import functools
import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogsim.traffic.drivers.adaptation import Adaptation, adaptation
from fogsim.traffic.drivers.lamp_intensity import BRIGHTEST, HIGH_BEAM_LIGHT
from fogsim.traffic.drivers.sight_kernels import (
    DISTANCE_TOLERANCE,
    depth_limit,
    depth_limits,
    judge_leaders,
    judge_lines,
    seen_distance,
)
from fogsim.units import CONTRAST_THRESHOLD, DAY_ILLUMINANCE, extinction_from_visibility, luminance_of
from fogsim.values.fog import AIRLIGHT_SHARE

_VERTICAL_ILLUMINANCE = 0.5
"""Illuminance of a vertical surface under an overcast sky over that of a horizontal one [-]."""


class FogAccess(Protocol):
    """The fog as the traffic stage needs it; given by the stage that knows the atmosphere."""

    @property
    def maximum_extinction(self) -> float:
        """An extinction coefficient that is exceeded nowhere [1/m]."""

    @property
    def minimum_extinction(self) -> float:
        """An extinction coefficient that the fog reaches everywhere near the road [1/m]; 0 if there is none."""

    def extinction(self, points: ArrayLike) -> NDArray[np.float64]:
        """Extinction coefficient at points (..., 3) [1/m] (`points` (..., 3) [m])."""

    def optical_depth(self, start: ArrayLike, end: ArrayLike) -> NDArray[np.float64]:
        """Optical depth between points (..., 3) [-] (`start`, `end` (..., 3) [m])."""


class ClearAir:
    """Fog that is nowhere."""

    maximum_extinction = minimum_extinction = 0.0

    def extinction(self, points: ArrayLike) -> NDArray[np.float64]:
        """0 at all points (..., 3); see `FogAccess.extinction`."""
        return np.zeros(np.shape(points)[:-1])

    def optical_depth(self, start: ArrayLike, end: ArrayLike) -> NDArray[np.float64]:
        """0 between all points (..., 3); see `FogAccess.optical_depth`."""
        return np.zeros(np.broadcast_shapes(np.shape(start), np.shape(end))[:-1])


@dataclass(frozen=True, slots=True)
class DriverSight:
    """Eyes and headlamps of a driver."""

    illuminance: float  # Horizontal illuminance of the scene [lx]
    # Distance at which an unlit vehicle is seen in the own headlamps at night in clear air [m]
    headlamp_reach: float = 55.0
    # Time from the first sight of a leader that was not to be seen before to the first reaction [s]; for surprised
    # drivers 1 s and more
    reaction_time: float = 1.0
    contrast_threshold: float = CONTRAST_THRESHOLD  # Smallest contrast that is noticed by day [-]
    # The airlight over that of a white horizontal surface [-]: before darker fog, paint stands out less
    airlight_share: float = AIRLIGHT_SHARE

    def depth_limit(
        self,
        distance: float,
        inherent_contrast: float,
        intensity: float = 0.0,
        head_lamps: float = 1.0,
        glare: float = 0.0,
    ) -> float:
        """Optical depth up to which a vehicle is seen [-]; negative if it is not even seen without fog."""
        eyes, threshold, reach = self._eyes(glare)
        seen = float(inherent_contrast), float(intensity), float(head_lamps)
        return depth_limit(eyes, threshold, reach, float(distance), *seen)

    def depth_limits(self, looks: NDArray[np.float64]) -> NDArray[np.float64]:
        """Optical depths up to which vehicles are seen, without glare (n,) [-]; see `sight_kernels.depth_limits`."""
        limits = np.empty(looks.shape[1])
        depth_limits(*self._eyes(0.0), looks, limits)
        return limits

    def _adapted(self, glare: float) -> Adaptation:
        return adaptation(self.illuminance, glare, self.airlight_share)

    def _eyes(self, glare: float) -> tuple[Adaptation, float, float]:
        """Parameters of eyes and head lamps for kernels; whole numbers would trigger another compilation."""
        return self._adapted(glare), float(self.contrast_threshold), float(self.headlamp_reach)

    def seen_distance(
        self,
        extinction: float,
        inherent_contrast: float,
        intensity: float = 0.0,
        head_lamps: float = 1.0,
        glare: float = 0.0,
    ) -> float:
        """Distance up to which a vehicle is seen in even fog [1/m], up to 1 cm less; ``inf`` if far [m]."""
        eyes, threshold, reach = self._eyes(glare)
        seen = float(inherent_contrast), float(intensity), float(head_lamps)
        return seen_distance(eyes, threshold, reach, float(extinction), *seen)

    def judge_leaders(
        self, facing: NDArray[np.float64], most_glare: float, horizon: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Whether leaders (`facing` (10, n)) are seen, and for how long that is sure to stay so [s]."""
        judged = np.empty((2, facing.shape[1]))
        eyes, threshold, reach = self._eyes(0.0)
        judge_leaders(eyes, threshold, reach, self._adapted(most_glare), facing, horizon, judged)
        return judged[0], judged[1]

    def judge_lines(self, lines: NDArray[np.float64], sure: float, extinction: float | None) -> None:
        """Judge whether targets are seen without any lamps or glare; see `sight_kernels.judge_lines`."""
        judge_lines(*self._eyes(0.0), sure, -1.0 if extinction is None else extinction, lines)

    def sure_distance(self, maximum_extinction: float, most_glare: float = 0.0) -> float:
        """Distance up to which every body is seen, without lamps, if fog is nowhere denser than given [1/m] [m]."""
        least = inherent_contrast((1.0, 1.0, 1.0), self.airlight_share)
        return self.seen_distance(maximum_extinction, least, head_lamps=0.0, glare=most_glare)

    def hidden_distance(self, minimum_extinction: float, brightest: float = BRIGHTEST) -> float:
        """Distance from which nothing of a vehicle is seen if fog is nowhere thinner than given [1/m] [m]."""
        # By day no one sees by head lamps.
        own = HIGH_BEAM_LIGHT if self.illuminance < DAY_ILLUMINANCE else 1.0
        return self.seen_distance(minimum_extinction, 1.0, brightest, own) + DISTANCE_TOLERANCE


def inherent_contrast(paint: tuple[float, float, float], airlight_share: float = AIRLIGHT_SHARE) -> float:
    """Contrast of a rear to the airlight, 0 … 1: a third is dark glass and tyres, the rest paint under half the sky."""
    reflectance = luminance_of(paint) * 2.0 / 3.0
    return max(0.0, 1.0 - _VERTICAL_ILLUMINANCE * reflectance / airlight_share)


_TYPICAL_CONTRAST = 0.9
"""Inherent contrast of a typical rear to the airlight [-]: paint of reflectance 0.25 and a third that is dark."""

_POSITION_LAMP = 8.0
"""Luminous intensity of a rear position lamp [cd]."""

_REFERENCE_LAMP = 2.0
"""Luminous intensity of the rear light whose range gives the visibility by night (White & Jeffery 1980) [cd]."""

_STEPS_PER_E_FOLD = 100


@dataclass(frozen=True, slots=True)
class LeaderReach:
    """Distances up to which drivers see a typical vehicle ahead."""

    # Its body, against the airlight or in the own head lamps [m]; ``inf`` where fog hides nothing that matters
    by_body: float
    farthest: float  # Anything of it, with lit rear position lamps [m]


CLEAR = LeaderReach(math.inf, math.inf)
"""Of drivers who see through fog, and of all in clear air."""


def leader_reach(sight: DriverSight | None, visibility: float) -> LeaderReach:
    """How far away drivers see a typical vehicle ahead in even fog, to half a percent (`visibility` [m])."""
    return CLEAR if sight is None or math.isinf(visibility) else _leader_reach(sight, _step(visibility))


def drivers_visibility(sight: DriverSight | None, visibility: float) -> float:
    """Visibility that drivers go by [m]: the meteorological one by day, in darkness at most the range of a rear lamp.

    White & Jeffery 1980: speeds by night follow those by day if visibility is the distance at which a rear light of 2
    cd is seen.
    """
    if sight is None or sight.illuminance >= DAY_ILLUMINANCE or math.isinf(visibility):
        return visibility
    return min(visibility, _visibility(sight, _step(visibility)))


def _step(visibility: float) -> int:
    """Number of the step on a logarithmic scale of visibilities, so that few need be computed in uneven fog."""
    return round(_STEPS_PER_E_FOLD * math.log(visibility))


def _extinction(step: int) -> float:
    return extinction_from_visibility(math.exp(step / _STEPS_PER_E_FOLD))


@functools.lru_cache(maxsize=4096)
def _leader_reach(sight: DriverSight, step: int) -> LeaderReach:
    extinction = _extinction(step)
    return LeaderReach(
        by_body=sight.seen_distance(extinction, _TYPICAL_CONTRAST),
        farthest=sight.seen_distance(extinction, _TYPICAL_CONTRAST, _POSITION_LAMP),
    )


@functools.lru_cache(maxsize=4096)
def _visibility(sight: DriverSight, step: int) -> float:
    # By day this is the visibility itself, in darkness the range of the lamp.
    return sight.seen_distance(_extinction(step), 1.0, _REFERENCE_LAMP, head_lamps=0.0)
