"""Lit lamps that a camera may see: of other vehicles, of streets and of traffic lights."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.bodies import LAMPLESS, LIT_AREAS, BodyLamp, bodies
from fogsim.scene.lamp_kernels import (
    AREA,
    AXIS,
    FORWARD,
    FOUND,
    FULL_INTENSITY,
    INTENSITY,
    LEFT,
    UP,
    LampCarriers,
    LampTable,
    find_lamps,
)
from fogsim.scene.lamps import (
    FULL,
    SIGNAL_LOBES,
    STREET_ANGLES,
    STREET_INTENSITIES,
    STREET_LOBE,
    signal_shares,
    sum_of_beams,
)
from fogsim.scene.street_lamps import HEIGHT, SIZE
from fogsim.scene.town import signal_light_sources
from fogsim.scene.vehicles import body_names
from fogsim.units import luminance_of
from fogsim.values.light import Beam, Lamp, LampLobes, LightSources, StreetLighting, dark_shift, joined_sources
from fogsim.values.luminous_intensity import FALL_OFF, LOBE_AZIMUTHS, LOBE_ELEVATIONS, SignalLobe, luminous_intensity
from fogsim.values.scene import Surface
from fogsim.values.traffic import TrafficState, with_pieces

_FARTHEST_VEHICLE = 1500.0
"""Distance beyond which lamps of vehicles are left out [m]."""

_FARTHEST_STREET_LAMP = 400.0
"""Distance beyond which street lamps are left out [m]."""

_RED, _AMBER = (1.0, 0.03, 0.015), (1.0, 0.36, 0.015)
_WHITE, _WARM = (1.0, 0.97, 0.90), (1.0, 0.90, 0.72)

_SIGNAL_LAMPS: Mapping[tuple[Surface, bool], tuple[Lamp, float, tuple[float, float, float]]] = {
    (Surface.LAMP_POSITION_REAR, False): (Lamp.POSITION, 8.0, _RED),
    (Surface.LAMP_STOP, False): (Lamp.STOP, 100.0, _RED),
    (Surface.LAMP_REAR_FOG, False): (Lamp.REAR_FOG, 200.0, _RED),
    (Surface.LAMP_INDICATOR_LEFT, False): (Lamp.INDICATOR_LEFT, 200.0, _AMBER),
    (Surface.LAMP_INDICATOR_RIGHT, False): (Lamp.INDICATOR_RIGHT, 200.0, _AMBER),
    (Surface.LAMP_INDICATOR_LEFT, True): (Lamp.INDICATOR_LEFT, 200.0, _AMBER),
    (Surface.LAMP_INDICATOR_RIGHT, True): (Lamp.INDICATOR_RIGHT, 200.0, _AMBER),
    (Surface.LAMP_HEAD, True): (Lamp.DAYTIME, 600.0, _WHITE),
}
"""Lamp that lights a surface at the rear (False) or the front (True), intensity along its axis [cd], and colour.

Within what UNECE allows: rear position 4–12 cd (R7), stop 60–185 cd (R7), rear fog 150–300 cd (R38), direction
indicators 50–500 cd rear and 175–1000 cd front (R6), daytime 400–1200 cd (R87). Lamps whose surface is smaller than
that of `LIT_AREAS`, as the third stop lamp, have less in proportion.
"""

_FOG_HEIGHT, _FOG_INSET = 0.55, 1.0  # front fog lamps lie below the head lamps: share of their height, and of their y
_FOG_AREA = 0.010  # [m²]
_SIGNALS = ~int(Lamp.LOW_BEAM | Lamp.HIGH_BEAM | Lamp.FRONT_FOG)  # lamps whose intensity no beam defines

_LOBES: Mapping[Lamp, SignalLobe] = {Lamp.REAR_FOG: SignalLobe.REAR_FOG, Lamp.DAYTIME: SignalLobe.DAYTIME}
"""How lamps shine; those that are not named as signals do."""


@dataclass(frozen=True, slots=True)
class _Lamps:
    """Lamps of all bodies, the numbers of the bodies by their names, and the lamps' colours (n, 3)."""

    number: Mapping[str, int]
    colour: NDArray[np.float64]
    lamps: LampTable


def light_sources(
    state: TrafficState,
    skip: int | None,
    eye: Sequence[float] | NDArray[np.float64],
    beams: Mapping[Lamp, Beam],
    street_lamps: NDArray[np.float64] | None = None,
) -> LightSources:
    """Every lit lamp that shines toward a camera, whatever stands between.

    Returns lamps that face away are left out. Takes `eye` (3,) [m], `street_lamps` (n, 3) [m].
    """
    here = np.asarray(eye, np.float64)
    parts = [_of_vehicles(state, skip, here, beams)] if len(state.ids) else []
    if street_lamps is not None and len(street_lamps):
        parts.append(_of_streets(street_lamps, here))
    if state.signals.ids:
        parts.append(signal_light_sources(state.signals, here, state.time))
    return joined_sources(parts)


def _of_vehicles(
    state: TrafficState, skip: int | None, eye: NDArray[np.float64], beams: Mapping[Lamp, Beam]
) -> LightSources:
    state, _ = with_pieces(state, skip)
    table = _lamps()
    numbers = _numbers(body_names(state))
    most = len(numbers) * table.lamps.of_body.shape[1]
    found, lit = np.empty((most, FOUND)), np.empty((2, most), np.int64)
    turned = np.stack((np.cos(state.heading), np.sin(state.heading), np.cos(state.grade), np.sin(state.grade)))
    size = np.stack((state.length, state.width, state.height))
    lamps = state.lamps.astype(np.int64)
    if skip is not None:
        lamps[skip] = 0
    position = np.ascontiguousarray(state.position, np.float64)
    vehicles = LampCarriers(position, turned, size, lamps, numbers)
    count = find_lamps(vehicles, table.lamps, eye, _FARTHEST_VEHICLE, found, lit)
    found, lit = found[:count], lit[:, :count]
    _add_beams(found[:, INTENSITY], lit[1], (found[:, FORWARD], found[:, LEFT], found[:, UP]), beams)
    seen = np.flatnonzero(found[:, INTENSITY] > 1e-3)
    found, lit = found[seen], lit[:, seen]
    return LightSources(
        np.ascontiguousarray(found[:, :3]),
        np.ascontiguousarray(found[:, INTENSITY]),
        table.colour[lit[0]],
        np.ascontiguousarray(found[:, AREA]),
        _lobes(table, found, lit, beams),
    )


def _lobes(table: _Lamps, found: NDArray[np.float64], lit: NDArray[np.int64], beams: Mapping[Lamp, Beam]) -> LampLobes:
    """How the lamps found shine: signals by their lobes, head lamps and front fog lamps by what burns of them."""
    kinds, kind = list(SIGNAL_LOBES), table.lamps.lobe[lit[0]]
    scale = found[:, FULL_INTENSITY] / FULL
    burning = lit[1] & sum(map(int, beams))
    for bits in np.unique(burning).tolist():
        if bits:
            chosen = burning == bits
            kind = np.where(chosen, len(kinds), kind)
            scale = np.where(chosen, 1.0, scale)
            kinds.append(sum_of_beams(tuple(beam for lamp, beam in beams.items() if bits & lamp)))
    return LampLobes(tuple(kinds), kind, scale, np.ascontiguousarray(found[:, AXIS : AXIS + 3]))


@lru_cache(maxsize=16)
def _numbers(names: tuple[str, ...]) -> NDArray[np.int64]:
    """Numbers of bodies by the names of their shapes."""
    return np.array([_lamps().number[name] for name in names], np.int64)


def _add_beams(
    intensity: NDArray[np.float64],
    lit: NDArray[np.int64],
    toward: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
    beams: Mapping[Lamp, Beam],
) -> None:
    """Add what head lamps and front fog lamps shine in a direction (forward, left, up) to the intensities."""
    for lamp, beam in beams.items():
        chosen = np.flatnonzero(lit & int(lamp))
        if len(chosen):
            forward, left, up = (part[chosen] for part in toward)
            azimuth, elevation = np.arctan2(-left, forward), np.arctan2(up, np.hypot(forward, left))
            intensity[chosen] += luminous_intensity(beam, azimuth, elevation)


def _of_streets(heads: NDArray[np.float64], eye: NDArray[np.float64]) -> LightSources:
    offset = eye - heads
    distance = np.sqrt(np.einsum("ij,ij->i", offset, offset))
    near = np.flatnonzero((distance < _FARTHEST_STREET_LAMP) & (offset[:, 2] < 0))
    down = -offset[near, 2] / distance[near]
    intensity = np.interp(np.arccos(down), STREET_ANGLES, STREET_INTENSITIES)
    length, width, depth = SIZE
    # The surface bulges below the head, so that it does not vanish when seen from the side.
    area = length * width * down + 0.5 * (length + width) * depth * np.sqrt(1.0 - down**2)
    count = len(near)
    lobes = LampLobes((STREET_LOBE,), np.zeros(count, np.int64), np.ones(count), np.tile((1.0, 0.0, 0.0), (count, 1)))
    return LightSources(heads[near], intensity, np.tile(_luminance_one(_WARM), (count, 1)), area, lobes)


def street_lighting(heads: NDArray[np.float64], sky_illuminance: float) -> StreetLighting:
    """Street lamps as what lights the road (`heads` (n, 3) [m], `sky_illuminance` [lx])."""
    tint = _luminance_one(_WARM)
    colour = (float(tint[0]), float(tint[1]), float(tint[2]))
    return StreetLighting(heads, HEIGHT, STREET_ANGLES, STREET_INTENSITIES, colour, sky_illuminance)


def _luminance_one(colour: tuple[float, float, float]) -> NDArray[np.float64]:
    return np.array(colour) / luminance_of(colour)


@cache
def _lamps() -> _Lamps:
    """Lamps of all bodies, where their surfaces are."""
    rows: list[tuple[NDArray[np.float64], float, int, float, NDArray[np.float64], float]] = []
    members: list[list[int]] = []
    for body in bodies().values():
        _, width, height = body.size
        first = len(rows)
        for lamp in body.lamps:
            rows += _rows_of(lamp, width * height)
        members.append(list(range(first, len(rows))))
    most = max(map(len, members))
    members.append([])
    place, area, mask, intensity, colour, forwards = zip(*rows, strict=True)
    return _Lamps(
        number={**{name: n for n, name in enumerate(bodies())}, **dict.fromkeys(LAMPLESS, len(bodies()))},
        colour=np.array(colour),
        lamps=LampTable(
            place=np.array(place),
            area=np.array(area),
            mask=np.array(mask),
            intensity=np.array(intensity),
            dark_shift=np.array(
                [dark_shift(y, bool(bits & int(Lamp.STOP))) for (_, y, _), bits in zip(place, mask, strict=True)]
            ),
            forwards=np.array(forwards),
            of_body=np.array([member + [-1] * (most - len(member)) for member in members]),
            signals=_SIGNALS,
            lobe=np.array([_lobe_of(bits) for bits in mask], np.int64),
            azimuths=LOBE_AZIMUTHS,
            elevations=LOBE_ELEVATIONS,
            log_share=signal_shares(),
            fall_off=FALL_OFF * math.log(10.0) / math.radians(1.0),
        ),
    )


def _lobe_of(bits: int) -> SignalLobe:
    """How a lamp shines that is lit by some bits, where they are signals."""
    return next((lobe for lamp, lobe in _LOBES.items() if bits & lamp), SignalLobe.SIGNAL)


def _rows_of(
    body_lamp: BodyLamp, box_area: float
) -> list[tuple[NDArray[np.float64], float, int, float, NDArray[np.float64], float]]:
    """A lamp, and below a head lamp the front fog lamp."""
    known = _SIGNAL_LAMPS.get((body_lamp.surface, body_lamp.front))
    if known is None:
        return []
    lamp, intensity, colour = known
    forwards = 1.0 if body_lamp.front else -1.0
    tint = _luminance_one(colour)
    share = min(body_lamp.area * box_area / LIT_AREAS[body_lamp.surface], 1.0)
    if body_lamp.surface is not Surface.LAMP_HEAD:
        return [(body_lamp.centre, body_lamp.area, int(lamp), share * intensity, tint, forwards)]
    lit = int(lamp | Lamp.LOW_BEAM | Lamp.HIGH_BEAM)
    below = body_lamp.centre * np.array([1.0, _FOG_INSET, _FOG_HEIGHT])
    head = (body_lamp.centre, body_lamp.area, lit, share * intensity, tint, forwards)
    return [head, (below, _FOG_AREA / box_area, int(Lamp.FRONT_FOG), 0.0, tint, forwards)]
