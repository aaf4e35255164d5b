"""Bodies that bend, as vehicles of their own for those who draw them."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fogsim.values.light import DARK_SHIFT, Lamp
from fogsim.values.traffic import NO_PIECES, TrafficState

_AHEAD = Lamp.LOW_BEAM | Lamp.HIGH_BEAM | Lamp.FRONT_FOG | Lamp.DAYTIME
_BEHIND = Lamp.POSITION | Lamp.STOP | Lamp.REAR_FOG
_INDICATORS = Lamp.INDICATOR_LEFT | Lamp.INDICATOR_RIGHT


def with_pieces(state: TrafficState, skip: int | None) -> tuple[TrafficState, NDArray[np.intp]]:
    """Traffic with each piece of a body as a row, and the vehicle that each row belongs to (n,).

    The first piece of a vehicle has its row, further ones have rows behind all vehicles. Lamps burn at the front of the
    first and at the rear of the last piece.

    Parameters
    ----------
    state : TrafficState
        The traffic; without pieces it is given back as it is.
    skip : int or None
        A vehicle of which only its first piece is a row, since it is not drawn.
    """
    pieces, count = state.pieces, len(state.ids)
    if not pieces.kind:
        return state, np.arange(count)
    is_first = np.append(True, pieces.row[1:] != pieces.row[:-1])
    is_last = np.append(is_first[1:], True)
    lit = _lamps_of_pieces(state.lamps[pieces.row], is_first, is_last)
    further = np.flatnonzero(~is_first & (pieces.row != (-1 if skip is None else skip)))
    rows = pieces.row[is_first]
    types = list(state.types)
    for row, kind in zip(rows.tolist(), np.array(pieces.kind)[is_first].tolist(), strict=True):
        types[row] = kind
    owner = pieces.row[further]
    body = np.concatenate((np.arange(count), owner))

    def column(own: NDArray[np.float64], of_pieces: NDArray[np.float64]) -> NDArray[np.float64]:
        first = own.copy()
        first[rows] = of_pieces[is_first]
        return np.concatenate((first, of_pieces[further]))

    lamps = state.lamps.copy()
    lamps[rows] = lit[is_first]
    drawn = replace(
        state,
        ids=state.ids + tuple(state.ids[row] for row in owner.tolist()),
        types=(*types, *(pieces.kind[piece] for piece in further.tolist())),
        lane=state.lane + tuple(state.lane[row] for row in owner.tolist()),
        position=column(state.position, pieces.position),
        heading=column(state.heading, pieces.heading),
        grade=column(state.grade, pieces.grade),
        length=column(state.length, pieces.length),
        lamps=np.concatenate((lamps, lit[further])).astype(np.int32),
        pieces=NO_PIECES,
        speed=state.speed[body],
        acceleration=state.acceleration[body],
        width=state.width[body],
        height=state.height[body],
        paint=state.paint[body],
        course=tuple(state.course[row] for row in body.tolist()),
    )
    return drawn, body


def _lamps_of_pieces(
    lamps: NDArray[np.int32], is_first: NDArray[np.bool_], is_last: NDArray[np.bool_]
) -> NDArray[np.int32]:
    """What burns of the lamps of whole vehicles on each of their pieces."""
    at_ends = np.where(is_first | is_last, int(_INDICATORS), 0)
    kinds = at_ends | np.where(is_first, int(_AHEAD), 0) | np.where(is_last, int(_BEHIND), 0)
    known = sum((kinds << shift for shift in DARK_SHIFT.values()), kinds)
    return np.asarray(lamps & known, np.int32)
