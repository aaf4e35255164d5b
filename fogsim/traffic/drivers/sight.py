"""What a driver can see of the vehicle ahead: its body against the fog by day, its lamps at any time.

Sources: Koschmieder's law with the 5 % contrast threshold (CIE); Allard's law for lamps; lamp intensities of UNECE R148
and thresholds of illuminance at the eye as gathered in physics references (2·10⁻⁷ lx in darkness, 10⁻⁶ … 10⁻⁵ lx on a
road at night, 10⁻³ lx by day).
"""

import functools
import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogsim.traffic.drivers.lamp_intensity import BRIGHTEST
from fogsim.units import CONTRAST_THRESHOLD, DAY_ILLUMINANCE, NIGHT_ILLUMINANCE, luminance_of

EYE_HEIGHT = 1.2
"""Height of a driver's eyes and of the middle of a rear above the road [m]."""

NIGHT_EYE_THRESHOLD, DAY_EYE_THRESHOLD = 1e-5, 1e-3
"""Illuminance at the eye at which a lamp is noticed on a road, by night and by day [lx]."""

LEAST_CONTRAST = 0.5
"""No vehicle's rear has less contrast to the airlight than this, not even a white one [-]."""

SILHOUETTE_ILLUMINANCE = 10.0
"""Horizontal illuminance in twilight from which a body is seen against the fog, below it by headlamps [lx]."""

AIRLIGHT_REFLECTANCE = 0.95
"""Reflectance of a white horizontal surface that would be as bright as the airlight [-]."""

VERTICAL_ILLUMINANCE = 0.5
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
        """Extinction coefficient at points (..., 3) [1/m].

        Parameters
        ----------
        points : (..., 3) array_like
            Points [m].
        """

    def optical_depth(self, start: ArrayLike, end: ArrayLike) -> NDArray[np.float64]:
        """Optical depth between points (..., 3) [-].

        Parameters
        ----------
        start, end : (..., 3) array_like
            Points [m].
        """


@dataclass(frozen=True, slots=True)
class DriverSight:
    """Eyes and headlamps of a driver.

    Attributes
    ----------
    illuminance : float
        Horizontal illuminance of the scene [lx].
    headlamp_reach : float
        Distance at which an unlit vehicle is seen in the own headlamps at night in clear air [m].
    reaction_time : float
        Time from the first sight of a leader that was not to be seen before to the first reaction [s]; for surprised
        drivers 1 s and more.
    contrast_threshold : float
        Smallest contrast that is noticed [-].
    """

    illuminance: float
    headlamp_reach: float = 55.0
    reaction_time: float = 1.0
    contrast_threshold: float = CONTRAST_THRESHOLD

    @property
    def eye_threshold(self) -> float:
        """Illuminance at the eye at which a lamp is noticed [lx], between night and day on a double log scale."""
        return _eye_threshold(self.illuminance, NIGHT_EYE_THRESHOLD, DAY_EYE_THRESHOLD)

    def sure_distance(self, maximum_extinction: float) -> float:
        """Distance up to which every body is seen where the fog is nowhere denser than given [m].

        Parameters
        ----------
        maximum_extinction : float
            Extinction coefficient [1/m].
        """
        if self.illuminance < SILHOUETTE_ILLUMINANCE:
            return 0.0
        depth = math.log(LEAST_CONTRAST / self.contrast_threshold)
        return math.inf if maximum_extinction == 0 else depth / maximum_extinction

    def hidden_distance(self, minimum_extinction: float) -> float:
        """Distance from which nothing of a vehicle is seen where the fog is nowhere thinner than given [m].

        Parameters
        ----------
        minimum_extinction : float
            Extinction coefficient [1/m].
        """
        if minimum_extinction == 0:
            return math.inf
        by_day = -math.log(self.contrast_threshold) / minimum_extinction
        body = by_day if self.illuminance >= SILHOUETTE_ILLUMINANCE else self.headlamp_reach
        return max(body, self._lamp_distance(minimum_extinction))

    def _lamp_distance(self, extinction: float) -> float:
        """Distance from which even the brightest lamp is not seen, by bisection [m]."""
        near, far = 0.1, math.sqrt(BRIGHTEST / self.eye_threshold)
        while far - near > 0.01:
            middle = 0.5 * (near + far)
            seen = bool(self.sees_lamp(middle, extinction * middle, BRIGHTEST))
            near, far = (middle, far) if seen else (near, middle)
        return far

    def sees_body(self, distance: ArrayLike, depth: ArrayLike, inherent_contrast: ArrayLike) -> NDArray[np.bool_]:
        """Tell whether bodies are seen.

        Parameters
        ----------
        distance : (n,) array_like
            Distances [m].
        depth : (n,) array_like
            Optical depths of the lines of sight [-].
        inherent_contrast : (n,) array_like
            Contrasts to the airlight without fog between, 0 … 1.

        Returns
        -------
        (n,) bool
            By day where C₀ e^(−τ) reaches the threshold; at night within the reach of the headlamps, whose light goes
            through the fog twice.
        """
        transmittance = np.exp(-np.asarray(depth))
        if self.illuminance >= SILHOUETTE_ILLUMINANCE:
            return np.asarray(inherent_contrast * transmittance >= self.contrast_threshold)
        reach = self.headlamp_reach
        # Retro-reflectors and plates return light as I e^(−2τ) / d²; in clear air they are seen up to the reach.
        return np.asarray(transmittance**2 * reach**2 >= np.square(distance))

    def body_limit(self, distance: float, inherent_contrast: float) -> float:
        """Optical depth up to which a body is seen [-]: `sees_body`, solved for the depth.

        Parameters
        ----------
        distance : float
            Distance [m], positive.
        inherent_contrast : float
            Contrast to the airlight without fog between, 0 … 1.

        Returns
        -------
        float
            By day at any distance; negative for a body that is not even seen without fog.
        """
        if self.illuminance >= SILHOUETTE_ILLUMINANCE:
            return math.log(max(inherent_contrast, 1e-9) / self.contrast_threshold)
        return math.log(self.headlamp_reach / distance)

    def lamp_limit(self, distance: float, intensity: float) -> float:
        """Optical depth up to which a lamp is seen [-]: `sees_lamp`, solved for the depth.

        Parameters
        ----------
        distance : float
            Distance [m], positive.
        intensity : float
            Luminous intensity [cd]; 0 for an unlit lamp, which gives ``-inf``.
        """
        return math.log(intensity / (self.eye_threshold * distance**2)) if intensity > 0 else -math.inf

    def depth_limit(
        self, distance: float, inherent_contrast: float, intensity: float = 0.0, head_lamps: float = 1.0
    ) -> float:
        """Optical depth up to which a vehicle is seen, by its body or by its lamps [-].

        Parameters
        ----------
        distance : float
            Distance [m], positive.
        inherent_contrast : float
            Contrast to the airlight without fog between, 0 … 1.
        intensity : float
            Luminous intensity of its brightest lamp toward the eye [cd].
        head_lamps : float
            Light of the own head lamps toward it over that straight ahead [-]; 0 while they are dark.
        """
        by_lamps = self.lamp_limit(distance, intensity)
        if self.illuminance >= SILHOUETTE_ILLUMINANCE:
            return max(self.body_limit(distance, inherent_contrast), by_lamps)
        return max(self.body_limit(distance / math.sqrt(max(head_lamps, 1e-12)), inherent_contrast), by_lamps)

    def sees_lamp(self, distance: ArrayLike, depth: ArrayLike, intensity: ArrayLike) -> NDArray[np.bool_]:
        """Tell whether lamps are seen, E = I e^(−τ) / d² ≥ E_threshold (Allard).

        Parameters
        ----------
        distance, depth : (n,) array_like
            Distances [m] and optical depths [-].
        intensity : (n,) array_like
            Luminous intensities [cd]; 0 for an unlit lamp.
        """
        illuminance = np.asarray(intensity) * np.exp(-np.asarray(depth)) / np.square(np.maximum(distance, 0.1))
        return np.asarray(illuminance >= self.eye_threshold)


@functools.lru_cache
def _eye_threshold(illuminance: float, at_night: float, by_day: float) -> float:
    night, day = NIGHT_ILLUMINANCE, DAY_ILLUMINANCE
    share = math.log(max(illuminance, night) / night) / math.log(day / night)
    return float(at_night * (by_day / at_night) ** min(share, 1.0))


def inherent_contrast(paint: tuple[float, float, float]) -> float:
    """Contrast of a vehicle's rear to the airlight, 0 … 1.

    A third of the rear is dark glass, tyres and shadow; the rest is paint under half of the sky.

    Parameters
    ----------
    paint : tuple of float
        Linear reflectance, 0 … 1.
    """
    reflectance = luminance_of(paint) * 2.0 / 3.0
    return max(0.0, 1.0 - VERTICAL_ILLUMINANCE * reflectance / AIRLIGHT_REFLECTANCE)
