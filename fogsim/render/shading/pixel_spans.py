"""From the slots of pixels to runs of pixels, and a list of the surfaces that are seen."""

from typing import Any

import numpy as np

from fogsim.jit import kernel
from fogsim.render.shading.layout import Copies, Numbers, Runs, Wide


@kernel
def find_runs(
    slots: Numbers, top: int, bottom: int, copies: Copies, rays: Wide, terrain: bool, runs: Runs
) -> tuple[int, int]:
    """Find the runs of some rows.

    Parameters
    ----------
    slots : (rows, cols) int32
        What each pixel sees.
    top, bottom : int
        First row, and the one after the last.
    copies : Copies
        What is drawn.
    rays : (3, 3) float64
        See `Lens`.
    terrain : bool
        Whether there is terrain below the horizon; else there is sky.
    runs : Runs
        Is filled, but for what is known of the surfaces.

    Returns
    -------
    tuple of int
        Numbers of runs and of surfaces.
    """
    run, surface_of_slot, slot_of, copy_of = runs.run, runs.surface_of_slot, runs.slot, runs.copy
    first = copies.first
    for copy in range(len(copies.mesh)):
        for own in range(first[copy], first[copy + 1]):
            surface_of_slot[own] = -2 - copy
    count, surfaces = 0, 2
    columns = np.uint64(slots.shape[1])
    ends = np.empty(columns, np.int32)
    for v in range(top, bottom):
        begin = np.int32(0)
        for piece in range(_ends(slots[v], ends)):
            end, slot = ends[piece], slots[v, begin]
            surface: Any = 0
            if slot >= 0:
                surface = surface_of_slot[slot]
                if surface < 0:
                    copy_of[surfaces], slot_of[surfaces] = -2 - surface, slot
                    surface_of_slot[slot] = surface = surfaces
                    surfaces += 1
                split: Any = end
            else:
                surface, split = _background(v, int(begin), int(end), rays, terrain)
            run[count, 0], run[count, 1], run[count, 2], run[count, 3] = v, begin, split, surface
            count += 1
            if split < end:
                run[count, 0], run[count, 1], run[count, 2], run[count, 3] = v, split, end, 1 - surface
                count += 1
            begin = end
    return count, surfaces


@kernel
def _ends(row: Numbers, ends: Numbers) -> np.uint64:
    """Columns after the last pixel of each stretch of equal slots in a row; their count.

    Every column is written down, and by the next one again unless a stretch ends there: a processor that guesses where
    that is loses more than it takes to write.
    """
    last, count = np.uint64(row.shape[0] - 1), np.uint64(0)
    for u in range(last):
        after = u + np.uint64(1)
        ends[count] = np.int32(after)
        count += np.uint64(row[u] != row[after])
    ends[count] = np.int32(last) + np.int32(1)
    return count + np.uint64(1)


@kernel
def _background(v: int, begin: int, end: int, rays: Wide, terrain: bool) -> tuple[int, int]:
    """Whether a run of background begins with sky (0) or terrain (1), and where it changes to the other."""
    slope, rest = rays[2, 0], rays[2, 1] * v + rays[2, 2]
    surface = 1 if terrain and slope * begin + rest < 0.0 else 0
    last = 1 if terrain and slope * (end - 1) + rest < 0.0 else 0
    if surface == last:
        return surface, end
    split = min(max(int(np.ceil(-rest / slope)), begin + 1), end - 1)
    while split > begin + 1 and (slope * (split - 1) + rest < 0.0) == (last == 1):
        split -= 1
    while split < end - 1 and (slope * split + rest < 0.0) != (last == 1):
        split += 1
    return surface, split
