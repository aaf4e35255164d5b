"""Lit lamps that a camera may see: of other vehicles, of streets and of traffic lights."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.core.linear_algebra import matrix_product
from fogsim.scene.edges import Edge
from fogsim.scene.lamps import (
    FULL,
    SIGNAL_LOBES,
    STREET_ANGLES,
    STREET_INTENSITIES,
    STREET_LOBE,
    signal_shares,
    sum_of_beams,
)
from fogsim.scene.lane_index import LaneIndex
from fogsim.scene.polyline import Points, arc_length
from fogsim.scene.roadside import Spacing, placed, stations, tube
from fogsim.scene.solids import Material, box, merge
from fogsim.scene.town import signal_light_sources
from fogsim.scene.vehicles import LAMPLESS, LIT_AREAS, BodyLamp, bodies, body_names
from fogsim.units import luminance_of
from fogsim.values.light import Beam, Lamp, LampLobes, LightSources, StreetLighting, dark_shift, joined_sources
from fogsim.values.luminous_intensity import FALL_OFF, LOBE_AZIMUTHS, LOBE_ELEVATIONS, SignalLobe, luminous_intensity
from fogsim.values.scene import FAR, TINY, Batch, Mesh, Scene, Surface
from fogsim.values.traffic import TrafficState, with_pieces

_FORWARD, LEFT, UP, _INTENSITY, _AREA, _FULL_INTENSITY, _AXIS = range(3, 10)
_FOUND = 13
"""Columns of what is found of a lamp, and their count.

First its place [m]; then the way from it to the eye in the vehicle's axes [m], its intensity toward the eye [cd], its
luminous area as the eye sees it [m²], its intensity along its axis [cd], and its axis (3).
"""


class _LampTable(NamedTuple):
    """Lamps of all bodies in their unit boxes."""

    place: NDArray[np.float64]  # (n, 3): Middles
    area: NDArray[np.float64]  # (n,): Luminous areas over width times height of the body
    mask: NDArray[np.int64]  # (n,) int64: Bits of `Lamp` that light each
    intensity: NDArray[np.float64]  # (n,): Along its axis [cd]
    # (n,) int64: By how many bits the lit ones are shifted to tell where a lamp is dark; see
    # `fogsim.values.light.DARK_SHIFT`
    dark_shift: NDArray[np.int64]
    forwards: NDArray[np.float64]  # (n,): 1 for a lamp that shines ahead, −1 for one that shines back
    of_body: NDArray[np.int64]  # (bodies, most) int64: Lamps of each body, then −1
    signals: int  # Bits of lamps whose intensity is that of the table; that of others is left at 0
    lobe: NDArray[np.int64]  # (n,) int64: Number of the way each shines
    # azimuths, elevations (e,): ascending angles next to and above a lamp's axis from 0 on [rad]
    azimuths: NDArray[np.float64]
    elevations: NDArray[np.float64]
    # (lobes, e, a): ln of the share of its axial intensity that a lamp shines there, alike on both sides
    log_share: NDArray[np.float64]
    fall_off: float  # How fast that falls beyond the axes' ends [1/rad]


class _LampCarriers(NamedTuple):
    """Vehicles with lamps."""

    position: NDArray[np.float64]  # (v, 3): Middles of the front bumpers [m]
    heading: NDArray[np.float64]
    grade: NDArray[np.float64]
    length: NDArray[np.float64]
    width: NDArray[np.float64]
    height: NDArray[np.float64]
    lit: NDArray[np.int32]  # (v,) int32: Bits of lit lamps
    body: NDArray[np.int64]  # (v,) int64: Number of the body


@kernel
def _before(axis: NDArray[np.float64], value: float) -> tuple[int, float]:
    """Entry of an axis before a value, and the share of the next one; values beyond its ends are as those."""
    entry = 0
    while entry < axis.shape[0] - 2 and value > axis[entry + 1]:
        entry += 1
    return entry, min(max((value - axis[entry]) / (axis[entry + 1] - axis[entry]), 0.0), 1.0)


@kernel
def _share_toward(lamps: _LampTable, lamp: int, forward: float, left: float, up: float) -> float:
    """Share of its axial intensity that a lamp shines in a direction in the vehicle's axes."""
    ahead = forward * lamps.forwards[lamp]
    azimuth, elevation = math.atan2(abs(left), ahead), math.atan2(abs(up), math.hypot(ahead, left))
    column, aside = _before(lamps.azimuths, azimuth)
    row, above = _before(lamps.elevations, elevation)
    table = lamps.log_share[lamps.lobe[lamp]]
    low = table[row, column] + (table[row, column + 1] - table[row, column]) * aside
    high = table[row + 1, column] + (table[row + 1, column + 1] - table[row + 1, column]) * aside
    beyond_sides = max(azimuth - lamps.azimuths[lamps.azimuths.shape[0] - 1], 0.0)
    beyond_ends = max(elevation - lamps.elevations[lamps.elevations.shape[0] - 1], 0.0)
    return math.exp(low + (high - low) * above - lamps.fall_off * math.hypot(beyond_sides, beyond_ends))


@kernel
def _find_lamps(
    vehicles: _LampCarriers,
    skip: int,
    lamps: _LampTable,
    eye: NDArray[np.float64],
    farthest: float,
    found: NDArray[np.float64],
    which: NDArray[np.int64],
) -> int:
    """Find the lit lamps on the side of their vehicle that the eye is on; their count.

    Takes `eye` (3,) [m], `farthest` [m], `which` (2, n) int64.
    """
    position, count = vehicles.position, 0
    for row in range(len(vehicles.body)):
        dx, dy, dz = eye[0] - position[row, 0], eye[1] - position[row, 1], eye[2] - position[row, 2]
        lit = np.int64(vehicles.lit[row])
        if row == skip or lit == 0 or abs(dx) + abs(dy) > farthest:
            continue
        cosine, sine = math.cos(vehicles.heading[row]), math.sin(vehicles.heading[row])
        level, rise = math.cos(vehicles.grade[row]), math.sin(vehicles.grade[row])
        length, width, height = vehicles.length[row], vehicles.width[row], vehicles.height[row]
        onward, aside = dx * cosine + dy * sine, dy * cosine - dx * sine
        ahead, above = onward * level + dz * rise, dz * level - onward * rise
        for column in range(lamps.of_body.shape[1]):
            lamp = lamps.of_body[vehicles.body[row], column]
            bits = lit & lamps.mask[lamp] & ~(lit >> lamps.dark_shift[lamp])
            # The eye sees lamps at the front from before it, those at the rear from behind it.
            before = ahead > 0.0 if lamps.forwards[lamp] > 0.0 else ahead + length < 0.0
            if lamp < 0 or bits == 0 or not before:
                continue
            x, y, z = lamps.place[lamp, 0] * length, lamps.place[lamp, 1] * width, lamps.place[lamp, 2] * height
            forward, left, up = ahead - x, aside - y, above - z
            far = math.sqrt(forward * forward + left * left + up * up + 1e-12)
            facing = max(forward * lamps.forwards[lamp] / far, 0.0)
            one, sign = found[count], lamps.forwards[lamp]
            over = x * level - z * rise
            one[0] = position[row, 0] + over * cosine - y * sine
            one[1] = position[row, 1] + over * sine + y * cosine
            one[2] = position[row, 2] + x * rise + z * level
            one[_FORWARD], one[LEFT], one[UP] = forward, left, up
            full = lamps.intensity[lamp] if bits & lamps.signals else 0.0
            one[_FULL_INTENSITY] = full
            one[_INTENSITY] = full * _share_toward(lamps, lamp, forward, left, up) if full > 0.0 else 0.0
            one[_AXIS], one[_AXIS + 1], one[_AXIS + 2] = sign * level * cosine, sign * level * sine, sign * rise
            one[_AREA] = lamps.area[lamp] * width * height * facing
            which[0, count], which[1, count] = lamp, bits
            count += 1
    return count


_STREET_LAMP = "street_lamp"
"""Name of the shape of a lamp with its pole."""

_HEIGHT = 8.0
"""Height of the luminous surface above the pole's foot [m]."""

_SIZE = (0.5, 0.22, 0.05)
"""Length, width and height of the luminous surface, which bulges below the head [m]."""

_ARM = 1.4  # how far the head's middle lies over the road [m]
_SPACING = 35.0
_BESIDE = 0.5  # of poles beyond shoulder or footway [m]
_APART = 26.0  # lamps stand on one side of a street: none is nearer to another than this [m]
_POLE = Material((0.20, 0.205, 0.21))
_GLOW = Material((0.55, 0.55, 0.53), Surface.LAMP_STREET)


def street_lamp_shapes() -> dict[str, Mesh]:
    """Shape of a lamp whose arm reaches along y, with its levels of detail."""
    head = box((-0.16, _ARM - 0.38, _HEIGHT), (0.16, _ARM + 0.38, _HEIGHT + 0.1), _POLE)
    (length, width, depth), glow = _SIZE, _GLOW
    lamp = box((-width / 2, _ARM - length / 2, _HEIGHT - depth), (width / 2, _ARM + length / 2, _HEIGHT), glow)
    arm = box((-0.04, 0.0, _HEIGHT + 0.02), (0.04, _ARM - 0.3, _HEIGHT + 0.1), _POLE)
    near = merge((tube(-0.3, 1.2, 0.09, 0.09, _POLE), tube(1.2, _HEIGHT + 0.1, 0.06, 0.06, _POLE), arm, head, lamp))
    far = merge((tube(-0.3, _HEIGHT, 0.06, 0.06, _POLE), head, lamp))
    return {_STREET_LAMP: near, _STREET_LAMP + FAR: far, _STREET_LAMP + TINY: far}


def lamp_posts(edges: Sequence[Edge], index: LaneIndex) -> list[Batch]:
    """Lamps about every 35 m along the outer sides of roads, on one side of roads of two directions, off all lanes."""
    side = _outer_side(edges)
    places, turns, spacing = [], [], Spacing(_APART)
    for edge in edges:
        if edge.side != side:
            continue
        along, heading = stations(edge.line, _SPACING, side * (edge.inner + edge.shoulder + _BESIDE))
        free = index.clearance(along, same_level=2.5, within=1.0) > 0.3
        # Their arms reach to the left of where they look.
        facing = heading if side < 0 else heading + np.pi
        for place, turn in zip(along[free], facing[free].tolist(), strict=True):
            if spacing.takes(place):
                places.append(place)
                turns.append(turn)
    return [placed(_STREET_LAMP, np.array(places), np.array(turns))] if places else []


def _outer_side(edges: Sequence[Edge]) -> int:
    """Side of roads, 1 left or −1 right, that most of the free sides are on: that to which vehicles keep."""
    lengths = {side: sum(float(arc_length(edge.line)[-1]) for edge in edges if edge.side == side) for side in (1, -1)}
    return 1 if lengths[1] > 1.001 * lengths[-1] else -1


def street_lamp_heads(scene: Scene) -> Points:
    """Middles of the luminous surfaces of all street lamps of a scene (n, 3) [m]."""
    batches = [batch.transforms for batch in scene.scenery if batch.shape == _STREET_LAMP]
    if not batches:
        return np.zeros((0, 3))
    head = np.array([0.0, _ARM, _HEIGHT - _SIZE[2] / 2, 1.0])
    return matrix_product(np.concatenate(batches).astype(np.float64)[:, :3], head)


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
    lamps: _LampTable


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
    found, lit = np.empty((most, _FOUND)), np.empty((2, most), np.int64)
    # Columns may lie in one table: without this a kernel is compiled for either.
    columns = (state.position, state.heading, state.grade, state.length, state.width, state.height)
    position, heading, grade, length, width, height = (np.ascontiguousarray(one, np.float64) for one in columns)
    lamps = np.ascontiguousarray(state.lamps, np.int32)
    vehicles = _LampCarriers(position, heading, grade, length, width, height, lamps, numbers)
    count = _find_lamps(vehicles, -1 if skip is None else skip, table.lamps, eye, _FARTHEST_VEHICLE, found, lit)
    found, lit = found[:count], lit[:, :count]
    _add_beams(found[:, _INTENSITY], lit[1], (found[:, _FORWARD], found[:, LEFT], found[:, UP]), beams)
    seen = np.flatnonzero(found[:, _INTENSITY] > 1e-3)
    found, lit = found[seen], lit[:, seen]
    return LightSources(
        np.ascontiguousarray(found[:, :3]),
        np.ascontiguousarray(found[:, _INTENSITY]),
        table.colour[lit[0]],
        np.ascontiguousarray(found[:, _AREA]),
        _lobes(table, found, lit, beams),
    )


def _lobes(table: _Lamps, found: NDArray[np.float64], lit: NDArray[np.int64], beams: Mapping[Lamp, Beam]) -> LampLobes:
    """How the lamps found shine: signals by their lobes, head lamps and front fog lamps by what burns of them."""
    kinds, kind = list(SIGNAL_LOBES), table.lamps.lobe[lit[0]]
    scale = found[:, _FULL_INTENSITY] / FULL
    burning = lit[1] & sum(map(int, beams))
    for bits in sorted(set(burning[burning != 0].tolist())):
        chosen = burning == bits
        kind = np.where(chosen, len(kinds), kind)
        scale = np.where(chosen, 1.0, scale)
        kinds.append(sum_of_beams(tuple(beam for lamp, beam in beams.items() if bits & int(lamp))))
    return LampLobes(tuple(kinds), kind, scale, np.ascontiguousarray(found[:, _AXIS : _AXIS + 3]))


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
    any_lit = int(np.bitwise_or.reduce(lit))
    for lamp, beam in beams.items():
        if any_lit & int(lamp):
            chosen = np.flatnonzero(lit & int(lamp))
            forward, left, up = (part[chosen] for part in toward)
            azimuth, elevation = np.arctan2(-left, forward), np.arctan2(up, np.hypot(forward, left))
            intensity[chosen] += luminous_intensity(beam, azimuth, elevation)


def _of_streets(heads: NDArray[np.float64], eye: NDArray[np.float64]) -> LightSources:
    offset = eye - heads
    distance = np.sqrt(np.einsum("ij,ij->i", offset, offset))
    near = np.flatnonzero((distance < _FARTHEST_STREET_LAMP) & (offset[:, 2] < 0))
    down = -offset[near, 2] / distance[near]
    intensity = np.interp(np.arccos(down), STREET_ANGLES, STREET_INTENSITIES)
    length, width, depth = _SIZE
    # The surface bulges below the head, so that it does not vanish when seen from the side.
    area = length * width * down + 0.5 * (length + width) * depth * np.sqrt(1.0 - down**2)
    count = len(near)
    lobes = LampLobes((STREET_LOBE,), np.zeros(count, np.int64), np.ones(count), np.tile((1.0, 0.0, 0.0), (count, 1)))
    return LightSources(heads[near], intensity, np.tile(_luminance_one(_WARM), (count, 1)), area, lobes)


def street_lighting(heads: NDArray[np.float64], sky_illuminance: float) -> StreetLighting:
    """Street lamps as what lights the road (`heads` (n, 3) [m], `sky_illuminance` [lx])."""
    tint = _luminance_one(_WARM)
    colour = (float(tint[0]), float(tint[1]), float(tint[2]))
    return StreetLighting(heads, _HEIGHT, STREET_ANGLES, STREET_INTENSITIES, colour, sky_illuminance)


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
        lamps=_LampTable(
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
