"""Lamps of the camera's own vehicle, as the air and the road are lit by them."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from fogsim.lighting.beams import front_fog_beam, high_beam, low_beam
from fogsim.values import Beam, HeadLamp, Lamp
from fogsim.values.light import Side, burning


def _beams() -> dict[Lamp, Beam]:
    return {Lamp.LOW_BEAM: low_beam(), Lamp.HIGH_BEAM: high_beam(), Lamp.FRONT_FOG: front_fog_beam()}


@dataclass(frozen=True, slots=True)
class LampMount:
    """Where a car's front lamps are, and what they shine.

    Attributes
    ----------
    behind_bumper : float
        Distance of the lamps behind the front bumper [m].
    half_spacing : float
        Distance of each head lamp from the middle of the car [m].
    height : float
        Height of the head lamps above the road [m].
    fog_half_spacing, fog_height : float
        The same of the front fog lamps [m].
    beams : mapping of Lamp to Beam
        Beam of one lamp of each pair.
    """

    behind_bumper: float = 0.1
    half_spacing: float = 0.6
    height: float = 0.65
    fog_half_spacing: float = 0.65
    fog_height: float = 0.35
    beams: Mapping[Lamp, Beam] = field(default_factory=_beams)


def own_head_lamps(
    lamps: Lamp, mount_height: float, setback: float = 1.9, mount: LampMount | None = None
) -> tuple[HeadLamp, ...]:
    """Lit lamps that shine ahead.

    Parameters
    ----------
    lamps : Lamp
        Lit lamps; of these only low beam, high beam and front fog lamps throw light ahead.
    mount_height : float
        Height of the camera above the road [m].
    setback : float
        Distance of the camera behind the front bumper [m].
    mount : LampMount or None
        Where the lamps are; None for a car's.
    """
    where = mount or LampMount()
    lit = []
    for lamp, beam in where.beams.items():
        if lamp in lamps:
            fog = lamp is Lamp.FRONT_FOG
            aside = where.fog_half_spacing if fog else where.half_spacing
            up = (where.fog_height if fog else where.height) - mount_height
            offsets = [
                offset for side, offset in ((Side.LEFT, aside), (Side.RIGHT, -aside)) if burning(lamps, side) & lamp
            ]
            lit += [HeadLamp((setback - where.behind_bumper, offset, up), beam) for offset in offsets]
    return tuple(lit)
