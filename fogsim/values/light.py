"""Light that is not daylight: lamps of a vehicle, beams of head lamps, and lamps that are seen from afar."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntFlag, StrEnum

import numpy as np
from numpy.typing import NDArray


class Lamp(IntFlag):
    """Lamps of a vehicle that can be lit, one bit each, so that an integer array holds those of many vehicles."""

    NONE = 0
    POSITION = 1
    LOW_BEAM = 2
    HIGH_BEAM = 4
    FRONT_FOG = 8
    REAR_FOG = 16
    STOP = 32
    INDICATOR_LEFT = 64
    INDICATOR_RIGHT = 128
    DAYTIME = 256


class Side(StrEnum):
    """Where on a vehicle a lamp of its kind is; in the middle there are third stop lamps."""

    LEFT = "left"
    RIGHT = "right"
    MIDDLE = "middle"


DARK_SHIFT: Mapping[Side, int] = {Side.LEFT: 12, Side.RIGHT: 21, Side.MIDDLE: 25}
"""By how many bits a kind of lamp is shifted where the lamps on one side are dark while others of the kind burn.

These bits lie next to those of `Lamp` and of `SignalLight`. In the middle there is a bit for `Lamp.STOP` alone.
"""

MIDDLE = 0.05
"""Lamps nearer to the middle plane of a vehicle than this belong to no side, as a share of its width [-]."""

NEVER_APART = 62
"""A shift by which no bit is left, for lamps in the middle that are the only ones of their kind."""

MIDDLE_LAMPS = Lamp.STOP
"""Kinds whose lamp in the middle is switched separately."""

ALL_LAMPS = Lamp(sum(Lamp))
"""Every kind of lamp."""


def lamp_names(lamps: Lamp) -> str:
    """Lamps in words."""
    return "+".join(str(lamp.name).lower() for lamp in Lamp if lamp and lamp in lamps)


def dark_shift(across: float, is_stop_lamp: bool) -> int:
    """Shift (see `DARK_SHIFT`) for a lamp by its place."""
    if abs(across) >= MIDDLE:
        return DARK_SHIFT[Side.LEFT if across > 0.0 else Side.RIGHT]
    return DARK_SHIFT[Side.MIDDLE] if is_stop_lamp else NEVER_APART


def burning(lamps: int, side: Side) -> int:
    """Kinds of lamps that burn on a side of a vehicle, bits of `Lamp`."""
    kinds = MIDDLE_LAMPS if side is Side.MIDDLE else ALL_LAMPS
    return lamps & ~(lamps >> DARK_SHIFT[side]) & int(kinds)


def dark_on(kinds: int, side: Side) -> int:
    """Bits that say that lamps on a side are dark."""
    return (kinds & int(MIDDLE_LAMPS if side is Side.MIDDLE else ALL_LAMPS)) << DARK_SHIFT[side]


def settled(lamps: int) -> int:
    """Lit lamps without the kinds that burn on no side."""
    lit = {side: burning(lamps, side) for side in Side}
    kinds = lit[Side.LEFT] | lit[Side.RIGHT] | lit[Side.MIDDLE]
    return kinds | sum(dark_on(kinds & ~lit[side], side) for side in Side)


class SignalLight(IntFlag):
    """Lit lenses of a traffic light, in bits next to those of `Lamp`; red with yellow comes before green."""

    DARK = 0
    RED = 512
    YELLOW = 1024
    GREEN = 2048


SIGNAL_COLOURS: Mapping[SignalLight, tuple[float, float, float]] = {
    SignalLight.RED: (1.0, 0.01, 0.005),
    SignalLight.YELLOW: (1.0, 0.36, 0.015),
    SignalLight.GREEN: (0.0, 1.0, 0.26),
}
"""Linear colours of the lenses' light; those of EN 12368 are purer than screens can show."""

SIGNAL_INTENSITY = 200.0
"""Luminous intensity of a traffic light's lens of 200 mm toward those for whom it is meant, by day and night [cd].

Asked for by day: at least 100, 200 or 400 cd (EN 12368, levels 1 to 3), 240 cd (Japan), in red 165 cd for 200 mm and
365 cd for 300 mm (ITE VTCSH-LED 2005), 200 cd (CIE 1980); gathered by the Lighting Research Center, Rensselaer.
"""

SIGNAL_DIAMETER = 0.2
"""Diameter of that lens [m]; one of 300 mm is as luminous and so shines 450 cd, level 3 of EN 12368."""


@dataclass(frozen=True, slots=True, eq=False)
class Beam:
    """Luminous intensity of one lamp over direction, seen from the lamp; a beam equals none but itself.

    Attributes
    ----------
    azimuth : (n,) float64
        Ascending directions to the right of the lamp's axis [rad].
    elevation : (m,) float64
        Ascending directions above the horizontal through the lamp [rad].
    intensity : (m, n) float64
        Luminous intensity [cd], not negative.
    """

    azimuth: NDArray[np.float64]
    elevation: NDArray[np.float64]
    intensity: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class HeadLamp:
    """A lit lamp of the vehicle that carries the camera.

    Attributes
    ----------
    offset : tuple of float
        (forward, left, up) from the camera's optical centre in the vehicle's axes [m].
    beam : Beam
        What it shines.
    colour : tuple of float
        Linear colour of luminance 1.
    """

    offset: tuple[float, float, float]
    beam: Beam
    colour: tuple[float, float, float] = (1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class LampLobes:
    """How lamps shine in other directions than toward the camera.

    Attributes
    ----------
    kinds : tuple of Beam
        Kinds of lamps.
    kind : (n,) int64
        Number of each lamp's kind, −1 for one that shines alike in all directions.
    scale : (n,) float64
        Intensity of each over that of its kind.
    forward : (n, 3) float64
        Unit vector along the axis of each.
    """

    kinds: tuple[Beam, ...]
    kind: NDArray[np.int64]
    scale: NDArray[np.float64]
    forward: NDArray[np.float64]

    @classmethod
    def alike(cls, count: int) -> "LampLobes":
        """So many lamps that shine alike in all directions.

        Parameters
        ----------
        count : int
            How many.
        """
        return cls((), np.full(count, -1, np.int64), np.ones(count), np.zeros((count, 3)))


@dataclass(frozen=True, slots=True)
class LightSources:
    """Lit lamps that the camera may see: of other vehicles and of streets.

    Attributes
    ----------
    position : (n, 3) float64
        Places [m].
    intensity : (n,) float64
        Luminous intensity toward the camera [cd].
    colour : (n, 3) float64
        Linear colours of luminance 1.
    area : (n,) float64
        Luminous area as the camera sees it [m²].
    lobes : LampLobes or None
        How they shine in other directions; None where all shine alike in all.
    """

    position: NDArray[np.float64]
    intensity: NDArray[np.float64]
    colour: NDArray[np.float64]
    area: NDArray[np.float64]
    lobes: LampLobes | None = None

    @classmethod
    def none(cls) -> "LightSources":
        """No lamp at all."""
        return cls(np.zeros((0, 3)), np.zeros(0), np.zeros((0, 3)), np.zeros(0))


def joined_sources(parts: Sequence[LightSources]) -> LightSources:
    """Lamps of several groups as one."""
    parts = [part for part in parts if len(part.intensity)]
    if len(parts) == 1:
        return parts[0]
    if not parts:
        return LightSources.none()
    names = ("position", "intensity", "colour", "area")
    position, intensity, colour, area = (np.concatenate([getattr(part, name) for part in parts]) for name in names)
    if all(part.lobes is None for part in parts):
        return LightSources(position, intensity, colour, area)
    lobes = [part.lobes or LampLobes.alike(len(part.intensity)) for part in parts]
    kinds = tuple(dict.fromkeys(kind for part in lobes for kind in part.kinds))
    # The last number is that of lamps of no kind.
    numbers = [np.array([*(kinds.index(kind) for kind in part.kinds), -1], np.int64)[part.kind] for part in lobes]
    scale, forward = (np.concatenate([getattr(part, name) for part in lobes]) for name in ("scale", "forward"))
    return LightSources(position, intensity, colour, area, LampLobes(kinds, np.concatenate(numbers), scale, forward))


@dataclass(frozen=True, slots=True)
class StreetLighting:
    """Street lamps as what lights the road, all alike, next to the sky.

    Attributes
    ----------
    position : (n, 3) float64
        Places [m].
    height : float
        Height above the road [m].
    angle, intensity : (m,) float64
        Ascending angles from straight down [rad], and luminous intensity there, alike in all directions about the lamp
        [cd].
    colour : tuple of float
        Linear colour of luminance 1.
    sky_illuminance : float
        Horizontal illuminance of the sky in which the scene is drawn [lx]; where it is 0 the lamps light nothing.
    """

    position: NDArray[np.float64]
    height: float
    angle: NDArray[np.float64]
    intensity: NDArray[np.float64]
    colour: tuple[float, float, float]
    sky_illuminance: float


@dataclass(frozen=True, slots=True)
class RoadBeams:
    """Lit head lamps of other vehicles as what lights the road, next to the sky; those of a pair shine together."""

    position: NDArray[np.float64]  # (n, 3): Middle between the lamps of a pair [m]
    heading: NDArray[np.float64]  # (n,): Direction of their axes, counter-clockwise from x [rad]
    grade: NDArray[np.float64]  # (n,): Upward inclination of the road before them [rad]
    height: NDArray[np.float64]  # (n,): Height above the road [m]
    kinds: tuple[Beam, ...]  # Kinds of lamps
    kind: NDArray[np.int64]  # (n,) int64: Number of each pair's kind
    scale: NDArray[np.float64]  # (n,): How many of the pair burn
    # Horizontal illuminance of the sky in which the scene is drawn [lx]; where it is 0 the lamps light nothing
    sky_illuminance: float


@dataclass(frozen=True, slots=True)
class Lights:
    """All light that is not daylight, at one instant.

    Attributes
    ----------
    own : tuple of HeadLamp
        Lit lamps of the vehicle that carries the camera.
    others : LightSources
        Everyone else's.
    streets : StreetLighting or None
        Street lamps as what lights the road; how they are seen themselves is in `others`.
    beams : RoadBeams or None
        Head lamps of others as what lights the road; how they are seen themselves is in `others`.
    """

    own: tuple[HeadLamp, ...]
    others: LightSources
    streets: StreetLighting | None = None
    beams: RoadBeams | None = None

    @classmethod
    def none(cls) -> "Lights":
        """No lamp lit."""
        return cls((), LightSources.none())
