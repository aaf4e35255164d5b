"""Sign maps as GeoJSON, which every GIS reads."""

import math
from collections.abc import Callable
from pathlib import Path

from fogsim.core.files.atomic import write_json
from fogsim.units import KMH_PER_MPS
from fogsim.values import Sign, SignMap

_GEOGRAPHIC = "longitude and latitude [deg], WGS 84"
NET = "x and y of the SUMO network [m], not longitude and latitude: the network has no usable projection"

LonLat = tuple[float, float]


def write_sign_map(
    path: Path, signs: SignMap, name: str, geographic: Callable[[float, float], LonLat] | None = None
) -> None:
    """Write a sign map as a GeoJSON FeatureCollection of points (`geographic` [m], [deg])."""
    place = geographic or _as_they_are
    write_json(
        path,
        {
            "type": "FeatureCollection",
            "name": name,
            "coordinates": _GEOGRAPHIC if geographic else NET,
            "features": [_feature(sign, place) for sign in signs.signs],
        },
    )


def _as_they_are(x: float, y: float) -> LonLat:
    return x, y


def _feature(sign: Sign, place: Callable[[float, float], LonLat]) -> dict[str, object]:
    x, y, z = sign.position
    is_limit = sign.kind == "speed_limit"
    return {
        "type": "Feature",
        "id": sign.sign_id,
        "geometry": {"type": "Point", "coordinates": list(place(x, y))},
        "properties": {
            "kind": sign.kind,
            **({"speed_limit_kmh": sign.value * KMH_PER_MPS} if is_limit else {"value": sign.value}),
            "x_m": x,
            "y_m": y,
            "z_m": z,
            # Clockwise from north, as compasses and GIS count.
            "heading_deg": (90.0 - math.degrees(sign.heading)) % 360.0,
            "diameter_m": sign.diameter,
        },
    }
