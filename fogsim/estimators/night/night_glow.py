"""Fog from the shape of the glow about the tail lamps of the tracked vehicle ahead, whose range the radar tells."""

import math
from dataclasses import replace
from typing import Annotated

import numpy as np

from fogsim.estimators.image_check import ObservationCheck
from fogsim.estimators.night.glow_fit import EXTINCTIONS, MOST_LOOKS, SPACING, USUAL, GlowLook, likelihood, look_at
from fogsim.estimators.night.tail_lamps import find_tail_lamps, red_glow, road_light
from fogsim.parameters import Range, checked_parameters
from fogsim.values.camera import Camera
from fogsim.values.camera_response import exposure_of
from fogsim.values.estimate import Estimate, ExtinctionBounds
from fogsim.values.light import Lamp
from fogsim.values.observation import Observation
from fogsim.vision.light.pixel_kernels import Pixels

NEAREST, FARTHEST = 8.0, 120.0
"""Ranges of the vehicle ahead at which its glow is measured [m]."""

LEAST_RINGS = 5
"""Fewest rings about the lamps that tell."""

JUMP, SURPRISE = 0.3, 12.0
"""Change of the light's logarithm from one look to the next that only other lamps, or another exposure that the road
does not show, can make [-]; and of the range that only another vehicle can [m]."""

UNUSUAL = 1.0
"""Deviation of lamps' intensity over the road's luminance where the road may lie in other beams than low ones [-]."""

MOST_MISFIT = 3.0
"""Mean square of a ring's deviation from the best model beyond which the light is not that of the lamps [-]."""

UNEVEN = 0.12
"""Largest difference of the light over the model's from side to side [-]."""

LEAST_LOOKS = 3
"""Fewest ranges for an estimate; bounds need two, for other lamps may spoil one look."""

SHARED = 0.15
"""Deviation of k relative to itself by what all looks share: droplets, lamps and roads unlike the models' [-]."""

SURE = 0.5
"""Largest deviation of k relative to itself for an estimate; where it is larger, bounds are told [-]."""

DAYLIGHT = 0.25
"""Median luminance of the picture's upper half from which on it is day, over full exposure [-]."""


@checked_parameters
class NightGlow:
    """Fog from the glow about the tail lamps of the vehicle ahead.

    Droplets spread a lamp's light the wider the more optical depth τ = k R lies before it, and the glow falls off with
    the range the faster; the radar tells R. The red light about the lamps, less that of white light, is free of the own
    lamps' veil. Its profile at several ranges is compared with FogSim's formula of the glow (`fogsim.atmosphere.lamps`)
    on the linear response. The lamps' intensity is free within what is usual, and the same at all ranges; the near road
    in the own beams tells the exposure. Four kinds of droplets, two of lamps and three shares of glare of the lens are
    equally likely beforehand. Cores of lamps are saturated and not used.

    Parameters
    ----------
    camera : Camera
        The assumed calibration.
    setback : float
        Distance of the camera behind the front bumper, from which the radar measures, where observations do not tell
        [m].
    memory : float
        Time for which looks at the glow from other ranges are kept [s].
    """

    method = "night_glow"

    def __init__(
        self,
        camera: Camera,
        *,
        setback: Annotated[float, Range(0.0, 10.0, "m")] = 1.7,
        memory: Annotated[float, Range(0.1, 1e4, "s")] = 20.0,
    ) -> None:
        self._camera, self._check = camera, ObservationCheck(camera)
        self._setback, self._memory = setback, memory
        self.reset()

    def reset(self) -> None:
        """Forget earlier pictures."""
        self._check.reset()
        self._looks: tuple[GlowLook, ...] = ()

    def update(self, observation: Observation) -> Estimate:
        """Estimate from one picture.

        Parameters
        ----------
        observation : Observation
            Its image, lead and camera's setback are used.

        Returns
        -------
        Estimate
            Diagnostics: ``lead_distance`` from the camera [m], ``lamps``, column and row of their middle [px],
            ``optical_depth`` [-], ``looks``, how many ranges count, and ``ranges``, between which [m]; or ``reason``,
            with bounds where the glow tells some.

        Raises
        ------
        InputError
            If camera, image or time do not fit (see `fogsim.estimators.image_check`).
        """
        image = self._check.kernel_image(observation)
        distance = math.nan
        if observation.lead is not None:
            distance = observation.lead.distance + (observation.camera_setback or self._setback)
        found: dict[str, object] = {"lead_distance": distance} if math.isfinite(distance) else {}
        why = self._trouble_of(image, distance)
        lamps = why or find_tail_lamps(image, self._camera, distance)
        if isinstance(lamps, str):
            return Estimate.invalid(self.method, lamps, **found)
        found["lamps"] = (lamps.u, lamps.v)
        seen, road = red_glow(image, self._camera, lamps), road_light(image, self._camera)
        if int((np.isfinite(seen.log_red).sum(axis=1) >= 3).sum()) < LEAST_RINGS:
            why = "there is too little red light about the lamps: no glow to be measured"
            return Estimate.invalid(self.method, why, **found)
        look = look_at(seen, lamps, self._camera.focal_length, distance, road, observation.time)
        if look.unevenness > UNEVEN:
            why = "the red light does not lie evenly about the lamps: other lamps, or none"
            return Estimate.invalid(self.method, why, **found)
        self._keep(look)
        beams = Lamp.LOW_BEAM | Lamp.HIGH_BEAM | Lamp.FRONT_FOG
        by_low_beam = observation.lamps is not None and observation.lamps & beams == Lamp.LOW_BEAM
        return self._estimate(look, USUAL if by_low_beam else UNUSUAL, found)

    def _trouble_of(self, image: Pixels, distance: float) -> str:
        """Why a picture can tell nothing, before it is looked at closely."""
        if not math.isfinite(distance):
            return "there is no range: the radar has no vehicle ahead"
        if image.ndim == 2:
            return "the picture is grey: the red of tail lamps cannot be told from the own lamps' light"
        if not NEAREST <= distance <= FARTHEST:
            return f"the vehicle ahead is {distance:.0f} m away: expected {NEAREST:g} … {FARTHEST:g} m"
        return "daylight: the upper half of the picture is bright" if self._is_day(image) else ""

    def _is_day(self, image: Pixels) -> bool:
        camera = self._camera
        above = image[: max(round(camera.horizon_row), 1) : 8, ::8].astype(np.float64) / (2**camera.bits - 1)
        return float(np.median(exposure_of(above, camera.response, camera.black_level))) > DAYLIGHT

    def _keep(self, look: GlowLook) -> None:
        """Take a look in, in place of an earlier one from about the same range."""
        if self._looks and _is_another(self._looks[-1], look):
            self._looks = ()
        recent = (one for one in self._looks if look.time - one.time <= self._memory)
        apart = tuple(one for one in recent if abs(math.log(one.distance / look.distance)) >= SPACING)
        self._looks = (*apart[-MOST_LOOKS + 1 :], look)

    def _estimate(self, look: GlowLook, usual: float, found: dict[str, object]) -> Estimate:
        share, misfit = likelihood(self._looks, usual)
        if misfit > MOST_MISFIT:
            self._looks = ()
            return Estimate.invalid(self.method, "the red light does not fall off as about a pair of lamps", **found)
        k = float((share * EXTINCTIONS).sum())
        deviation = math.hypot(math.sqrt(max(float((share * (EXTINCTIONS - k) ** 2).sum()), 0.0)), SHARED * k)
        distances = [one.distance for one in self._looks]
        found |= {
            "optical_depth": k * look.distance,
            "looks": len(distances),
            "ranges": (min(distances), max(distances)),
        }
        if len(distances) >= LEAST_LOOKS and deviation <= SURE * k:
            return Estimate(self.method, k, deviation, diagnostics=found)
        below = np.cumsum(share)
        least, most = (float(EXTINCTIONS[int(np.searchsorted(below, part))]) for part in (0.05, 0.95))
        why = "the glow's shape tells too little: the vehicle ahead must be seen at ranges that differ more"
        bounds = ExtinctionBounds(most, least) if len(distances) > 1 else None
        return replace(Estimate.invalid(self.method, why, **found), bounds=bounds)


def _is_another(last: GlowLook, look: GlowLook) -> bool:
    """Whether the light is that of other lamps than in the last look: they braked, say, or it is another vehicle."""
    if abs(look.distance - last.distance) > SURPRISE:
        return True
    change = look.ratio - last.ratio
    known = np.isfinite(change[0, 0])
    # Of all optical depths, the one at which the two looks fit best.
    return bool(known.any()) and float(np.abs(np.median(change[:, :, known], axis=2)).min()) > JUMP
