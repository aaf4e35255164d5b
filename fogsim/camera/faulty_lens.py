"""What is on the glass before a camera, or shines into it: the faults that change light before it is exposed."""

import math
from collections.abc import Iterable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fogsim.camera.soiling import DirtyGlass, WetGlass
from fogsim.core.linear_algebra import matrix_product
from fogsim.values import Camera, CameraPose, RunningFault
from fogsim.values.fault import DirtyLens, Glare, WetLens
from fogsim.values.pinhole import camera_axes

Floats32 = NDArray[np.float32]

SUN_RADIUS = math.radians(0.267)
"""Half the angle that the sun is seen under [rad]."""

NEAR_SCATTER = 1.0
"""Veil of a clean windscreen at 1° from a source, falling with the square of the angle [cd/m² per lx]: a tenth of that
of the eye (CIE 146: 10), assumed."""

NEAREST_SCATTER = math.radians(0.5)
"""Angle within which it grows no more [rad], assumed."""

FAR_SCATTER = 0.4 * 561.0 / 88_900.0
"""Veil of windscreens far from the sun, as the mean of 18 cars had it [cd/m² per lx]: of 561 cd/m² at 88 900 lx 40 %
were scattered (Mefford and Flannagan 2003, UMTRI-2003-36)."""

_AT_ORIGIN = CameraPose((0.0, 0.0, 0.0), 0.0)


class _Glass(Protocol):
    def look_through(self, radiance: Floats32) -> Floats32:
        """Luminance behind the glass (rows, cols, 3) [cd/m²]."""


class SunGlare:
    """A small source of light that nothing hides, and the veil that the windscreen makes of it."""

    def __init__(self, camera: Camera, glare: Glare) -> None:
        level = math.cos(glare.elevation)
        towards = np.array(
            [level * math.cos(glare.azimuth), level * math.sin(glare.azimuth), math.sin(glare.elevation)]
        )
        right, down, ahead = matrix_product(camera_axes(camera, _AT_ORIGIN), towards)
        (u0, v0), focal = camera.principal_point, camera.focal_length
        x = (np.arange(camera.width) - u0) / focal
        y = ((np.arange(camera.height) - v0) / focal)[:, None]
        angle = np.arccos(np.clip((x * right + y * down + ahead) / np.sqrt(1.0 + x**2 + y**2), -1.0, 1.0))
        degrees = np.degrees(np.maximum(angle, NEAREST_SCATTER))
        veil = glare.haze * (NEAR_SCATTER / degrees**2 + FAR_SCATTER)
        # The border of the disc is as wide as a pixel.
        disc = np.clip((SUN_RADIUS - angle) * focal + 0.5, 0.0, 1.0) / (math.pi * SUN_RADIUS**2)
        self._added: Floats32 = (glare.illuminance * (veil + disc)).astype(np.float32)[..., None]

    def look_through(self, radiance: Floats32) -> Floats32:
        """Luminance behind the glass (`radiance` (rows, cols, 3) [cd/m²])."""
        return radiance + self._added


class FaultyLens:
    """Glass before a camera that faults come onto; what is there stays where it is while a fault lasts."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Begin a run: the glass is clean."""
        self._glasses: list[tuple[RunningFault, Camera, _Glass]] = []

    def look_through(self, radiance: Floats32, camera: Camera, faults: Iterable[RunningFault]) -> Floats32:
        """Luminance behind the glass; the same array where nothing is on it (`radiance` (rows, cols, 3) [cd/m²])."""
        on_glass = [fault for fault in faults if isinstance(fault.kind, DirtyLens | WetLens | Glare)]
        # Light that glares comes through dirt and water.
        for fault in sorted(on_glass, key=lambda one: not isinstance(one.kind, Glare)):
            radiance = self._glass(fault, camera).look_through(radiance)
        return radiance

    def _glass(self, fault: RunningFault, camera: Camera) -> _Glass:
        for known, seen_by, glass in self._glasses:
            if known is fault and seen_by == camera:
                return glass
        made = _glass_with(fault, camera)
        self._glasses = [one for one in self._glasses if one[0] is not fault]
        self._glasses.append((fault, camera, made))
        return made


def _glass_with(fault: RunningFault, camera: Camera) -> _Glass:
    # Drawn from a copy: another calibration finds the same dirt.
    rng = np.random.Generator(type(fault.rng.bit_generator)())
    rng.bit_generator.state = fault.rng.bit_generator.state
    match fault.kind:
        case DirtyLens() as dirt:
            return DirtyGlass(camera, dirt, rng)
        case WetLens() as water:
            return WetGlass(camera, water, rng)
        case Glare() as glare:
            return SunGlare(camera, glare)
    raise TypeError(f"{fault.kind} is nothing on the glass")
