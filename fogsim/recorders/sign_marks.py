"""Marks over a picture at the signs of the map: where it has them, which were found, and from how far."""

import math
from collections.abc import Callable, Iterable
from pathlib import Path

from PIL import ImageDraw

from fogsim.core.files.atomic import write_json
from fogsim.recorders.style import ADVICE, GROUND, MUTED, Colour, font
from fogsim.units import KMH_PER_MPS
from fogsim.values import Frame, Sign, SignLook, SignMap, Step
from fogsim.values.observation import sign_place

_GEOGRAPHIC = "longitude and latitude [deg], WGS 84"
NET = "x and y of the SUMO network [m], not longitude and latitude: the network has no usable projection"

LonLat = tuple[float, float]


def write_sign_map(
    path: Path, signs: SignMap, name: str, geographic: Callable[[float, float], LonLat] | None = None
) -> None:
    """Write a sign map as a GeoJSON FeatureCollection of points (`geographic` [m], [deg])."""
    place = geographic or (lambda x, y: (x, y))
    write_json(
        path,
        {
            "type": "FeatureCollection",
            "name": name,
            "coordinates": _GEOGRAPHIC if geographic else NET,
            "features": [_feature(sign, place) for sign in signs.signs],
        },
    )


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


_LEAST_RADIUS = 4.0
"""Least radius of a mark [px]."""

_MOST = 8
"""Signs that are marked, the nearest; more would hide the picture."""


def sign_looks(step: Step) -> tuple[SignLook, ...]:
    """What is known of the signs ahead: by the first method that looks for them, else by the map alone."""
    observation = step.observation
    looked = next((found for one in step.estimates if (found := looks_of(one.diagnostics.get("sign_looks")))), ())
    if not isinstance(observation.frame, Frame):
        return looked
    known, camera = {look.sign_id for look in looked}, observation.frame.camera
    places = [(sign, sign_place(sign, camera, observation.camera_setback)) for sign in observation.signs]
    return looked + tuple(
        SignLook(sign.sign_id, *place[:2], place[3], sign.distance)
        for sign, place in places
        if place is not None and sign.sign_id not in known
    )


def looks_of(diagnostic: object) -> tuple[SignLook, ...]:
    """Looks for signs in a diagnostic of an estimate; none if it is something else."""
    if not isinstance(diagnostic, tuple):
        return ()
    return tuple(look for look in diagnostic if isinstance(look, SignLook))


def draw_signs(
    draw: ImageDraw.ImageDraw, signs: Iterable[SignLook], scale: float, origin: tuple[int, int], size: tuple[int, int]
) -> None:
    """Mark signs [px]: a thin circle where the map has one, a bright one with its distances where it was detected."""
    written: list[tuple[float, float, float, float]] = []
    for sign in sorted(signs, key=lambda one: one.distance)[:_MOST]:
        u, v, radius = (sign.u + 0.5) * scale, (sign.v + 0.5) * scale, max(sign.radius * scale, _LEAST_RADIUS)
        if -radius < u < size[0] + radius and -radius < v < size[1] + radius:
            _mark(draw, sign, (u + origin[0], v + origin[1]), radius + 2.0, written)


def _mark(
    draw: ImageDraw.ImageDraw,
    sign: SignLook,
    middle: tuple[float, float],
    radius: float,
    written: list[tuple[float, float, float, float]],
) -> None:
    """Mark a sign; its distance is left out where it would stand upon that of a nearer one."""
    (u, v), colour = middle, ADVICE if sign.detected else MUTED
    width = 2 if sign.detected else 1
    _circle(draw, u, v, radius + 1.0, width + 2, GROUND)
    _circle(draw, u, v, radius, width, colour)
    place, text = (u, v - radius - 3), sign_text(sign)
    left, top, right, bottom = draw.textbbox(place, text, font=font(12), anchor="ms", stroke_width=2)
    if all(right < x0 or left > x1 or bottom < y0 or top > y1 for x0, y0, x1, y1 in written):
        written.append((left, top, right, bottom))
        draw.text(place, text, fill=colour, font=font(12), anchor="ms", stroke_width=2, stroke_fill=GROUND)


def _circle(draw: ImageDraw.ImageDraw, u: float, v: float, radius: float, width: int, colour: Colour) -> None:
    draw.ellipse([(u - radius, v - radius), (u + radius, v + radius)], outline=colour, width=width)


def sign_text(sign: SignLook) -> str:
    """Distance by the map, and that at which the sign was first seen."""
    if sign.first_seen is None:
        return f"{sign.distance:.0f} m"
    return f"{sign.distance:.0f} m, seen from {sign.first_seen:.0f} m"
