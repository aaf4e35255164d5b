"""What never changes about vehicles, asked once for each."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.appearance import body_kind, paint, section
from fogsim.traffic.sumo.link import Api

_COLUMNS = 6


class Bodies:
    """Kinds, sizes and paints of vehicles as a table that grows with every vehicle met.

    Parameters
    ----------
    api : Api
        The simulation.
    """

    def __init__(self, api: Api) -> None:
        self._api = api
        self._row: dict[str, int] = {}
        self._kinds: list[str] = []
        self._numbers = np.empty((64, _COLUMNS))

    def of(self, ids: Sequence[str]) -> tuple[tuple[str, ...], NDArray[np.float64]]:
        """Body kinds, and (n, 6) length, width, height [m] and linear reflectances red, green, blue of the paint."""
        known = self._row
        try:
            rows = [known[v] for v in ids]
        except KeyError:
            rows = [known[v] if v in known else self._meet(v) for v in ids]
        kinds = self._kinds
        return tuple([kinds[row] for row in rows]), self._numbers[rows]

    def forget(self, vehicles: Sequence[str]) -> None:
        """Forget vehicles whose ids others may bear now."""
        for vehicle in vehicles:
            self._row.pop(vehicle, None)

    def _meet(self, vehicle: str) -> int:
        get, row = self._api.vehicle, len(self._kinds)
        if row == len(self._numbers):
            self._numbers = np.concatenate((self._numbers, np.empty_like(self._numbers)))
        length = get.getLength(vehicle)
        kind = body_kind(get.getVehicleClass(vehicle), get.getShapeClass(vehicle), length)
        self._numbers[row, :3] = length, *section(kind, get.getWidth(vehicle), get.getHeight(vehicle))
        self._numbers[row, 3:] = paint(vehicle, get.getColor(vehicle))
        self._kinds.append(kind)
        self._row[vehicle] = row
        return row
