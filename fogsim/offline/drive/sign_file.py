"""Your own map of signs: GeoJSON, points in WGS 84."""

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fogsim.core.files.readers import number_within, read_json
from fogsim.errors import InputError, shown
from fogsim.recorders.sign_marks import NET
from fogsim.scene import SIGN_KINDS
from fogsim.units import KMH_PER_MPS

USUAL_HEIGHT, USUAL_DIAMETER = 2.2, 0.6
"""Default height of a face's middle above the road, and its default size [m]."""

_WGS84 = ("CRS84", "4326")
"""Suffixes of the names of coordinate frames that GeoJSON may use."""


@dataclass(frozen=True, slots=True)
class GeographicSign:
    """A sign of the map at a WGS 84 position [rad]; `height` of its middle above the road and `diameter` are in m.

    `value` is the speed of a speed limit [m/s]; `heading` is the direction of travel that it applies to,
    counterclockwise from east [rad], None if the map does not give it.
    """

    sign_id: str
    kind: str
    value: float
    longitude: float
    latitude: float
    height: float
    diameter: float
    heading: float | None


@dataclass(frozen=True, slots=True)
class SignFile:
    """A map with at least one sign, each with a unique id, and remarks on what was assumed or skipped."""

    path: Path
    signs: tuple[GeographicSign, ...]
    remarks: tuple[str, ...]


def load_sign_file(path: Path) -> SignFile:
    """Read a map of signs: a GeoJSON FeatureCollection of points, as ``fogsim signs`` writes it with WGS 84.

    Properties: ``kind`` (required), ``height_m``, ``diameter_m``, ``heading_deg`` (clockwise from north, the direction
    of travel that the sign applies to), ``speed_limit_kmh``. Features other than points are skipped.
    """
    content = _read(path)
    _refuse_other_frames(path, content)
    features = content.get("features")
    if not isinstance(features, list):
        raise InputError(f'{path}: expected a GeoJSON FeatureCollection with "features", got {_kind_of(content)}')
    points = [(number, one) for number, one in enumerate(features) if _is_point(one)]
    if not points:
        raise InputError(f"{path}: the map has no signs: expected features that are points, got {len(features)} others")
    signs = tuple(_sign(f"{path}: feature {number}", number, one) for number, one in points)
    twice = [sign_id for sign_id, count in Counter(sign.sign_id for sign in signs).items() if count > 1]
    if twice:
        raise InputError(f"{path}: two signs have the id {twice[0]!r}; ids must be unique, or left out")
    return SignFile(path, signs, tuple(_remarks(path, signs, points, len(features) - len(points))))


def _read(path: Path) -> dict[str, Any]:
    content = read_json(path)
    if not isinstance(content, dict):
        raise InputError(f"{path}: expected a GeoJSON FeatureCollection, got {type(content).__name__}")
    return content


def _kind_of(content: Mapping[str, Any]) -> str:
    return f"type {shown(content['type'])}" if "type" in content else "no type"


def _refuse_other_frames(path: Path, content: Mapping[str, Any]) -> None:
    """Refuse a map that declares other coordinates than longitude and latitude."""
    if content.get("coordinates") == NET:
        raise InputError(
            f"{path}: its points are x and y of a SUMO network, which has no projection; expected longitude and "
            "latitude, WGS 84"
        )
    frame = content.get("crs") or "CRS84"
    name = _block(_block(frame).get("properties")).get("name", frame)
    if not isinstance(name, str) or not name.endswith(_WGS84):
        raise InputError(f"{path}: the map is in {shown(name)}; expected longitude and latitude, WGS 84 (EPSG:4326)")


def _block(value: Any) -> dict[str, Any]:
    return value if isinstance(value, dict) else {}


def _is_point(feature: Any) -> bool:
    return _block(_block(feature).get("geometry")).get("type") == "Point"


def _sign(where: str, number: int, feature: Mapping[str, Any]) -> GeographicSign:
    content = _block(feature.get("properties"))
    kind, sign_id = content.get("kind"), feature.get("id", content.get("id", number))
    if not isinstance(kind, str) or not kind:
        raise InputError(f'{where}: a sign needs a property "kind", as "speed_limit" or "stop", got {shown(kind)}')
    if not isinstance(sign_id, str | int | float):
        raise InputError(f"{where}: expected text or a number for its id, got {shown(sign_id)}")
    longitude, latitude = _place(where, feature["geometry"].get("coordinates"))
    heading = _number(where, content, "heading_deg", math.nan, -360.0, 360.0)
    limit = _number(where, content, "speed_limit_kmh", math.nan, 0.0, 300.0) / KMH_PER_MPS
    return GeographicSign(
        str(sign_id),
        kind,
        limit,
        math.radians(longitude),
        math.radians(latitude),
        _number(where, content, "height_m", USUAL_HEIGHT, 0.0, 20.0),
        _number(where, content, "diameter_m", USUAL_DIAMETER, 0.1, 10.0),
        None if math.isnan(heading) else math.radians(90.0 - heading),
    )


def _place(where: str, content: Any) -> tuple[float, float]:
    """Longitude and latitude [deg]."""
    if not isinstance(content, list) or len(content) < 2:
        raise InputError(f"{where}: expected coordinates [longitude, latitude], got {shown(content)}")
    longitude, latitude = (
        number_within(where, key, one) for key, one in zip(("longitude", "latitude"), content[:2], strict=True)
    )
    if abs(longitude) > 180.0 or abs(latitude) > 90.0:
        raise InputError(
            f"{where}: expected longitude within ±180° and latitude within ±90° (WGS 84), got {content[:2]}: "
            "the map is in another coordinate frame"
        )
    return longitude, latitude


def _number(where: str, content: Mapping[str, Any], key: str, usual: float, least: float, most: float) -> float:
    """Number of a property; the default if it is missing."""
    value = content.get(key)
    return usual if value is None else number_within(where, key, value, least, most)


def _remarks(path: Path, signs: tuple[GeographicSign, ...], points: list[tuple[int, Any]], others: int) -> list[str]:
    def without(key: str) -> int:
        return sum(_block(one.get("properties")).get(key) is None for _, one in points)

    assumed = [
        (without("height_m"), f"no height_m: {USUAL_HEIGHT} m above the road are assumed"),
        (without("diameter_m"), f"no diameter_m: {USUAL_DIAMETER} m are assumed"),
        (without("heading_deg"), "no heading_deg: they are taken to face the vehicle that comes nearest"),
    ]
    remarks = [f"{path}: {_count(count)} with {what}" for count, what in assumed if count]
    unknown = sorted({sign.kind for sign in signs if sign.kind.removeprefix("xodr.") not in SIGN_KINDS})
    if unknown:
        remarks.append(f"{path}: unknown kinds, searched as signs of any kind: {', '.join(unknown[:5])}")
    if others:
        remarks.append(f"{path}: {others} features that are not points are skipped")
    return remarks


def _count(count: int) -> str:
    return "1 sign" if count == 1 else f"{count} signs"
