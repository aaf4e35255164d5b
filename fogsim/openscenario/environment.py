"""Fog and light of an environment: ``visualRange`` is the distance at which a black target has 5 % contrast."""

import datetime as dt
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from fogsim.openscenario.catalogs import Catalogs
from fogsim.openscenario.daylight import clear_sky_illuminance, sun_elevation, through_clouds
from fogsim.openscenario.findings import Findings
from fogsim.openscenario.xml_tree import Node
from fogsim.traffic.road.opendrive_lanes import OpenDriveLanes

_CLOUDS = ("zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")
_OLD_CLOUDS = {"free": 0.0, "cloudy": 4.0, "overcast": 8.0, "rainy": 8.0, "skyOff": 0.0}
"""Oktas of the words for the sky in OpenSCENARIO 1.0."""

BRIGHTEST = 200_000.0
_DARKEST = 0.001  # Of a clear day, under any clouds
_STEP = 1.0  # along a route, in the search for the start of a box [m]
_EDGE = 1.0  # of a box of fog, whose border is sharp [m]


@dataclass(frozen=True, slots=True)
class Box:
    """A box of fog [m, rad]."""

    centre: tuple[float, float, float]
    length: float
    width: float
    height: float

    def covers(self, points: Any) -> Any:
        """Which of the points (n, 2) are inside."""
        away = np.abs(np.asarray(points) - np.array(self.centre[:2]))
        return (away[:, 0] <= 0.5 * self.length) & (away[:, 1] <= 0.5 * self.width)


@dataclass(frozen=True, slots=True)
class Environment:
    """Fog and light of an environment: V_met [m], extent and illuminance of the ground [lx], None if not given.

    A `box` of None is fog everywhere.
    """

    visibility: float | None = None
    box: Box | None = None
    illuminance: float | None = None


def environment_of(action: Node, catalogs: Catalogs, lanes: OpenDriveLanes) -> Environment:
    """Fog and light of an ``EnvironmentAction``; the map may give its geographic position."""
    findings, reference = catalogs.findings, action.one("CatalogReference")
    node = catalogs.entry(reference) if reference else action.one("Environment")
    if node is None:
        return Environment()
    weather = node.one("Weather")
    fog = weather.one("Fog") if weather else None
    box = fog.one("BoundingBox") if fog else None
    read = Environment(
        None if fog is None else _visibility(fog, findings),
        None if box is None else _box(box, findings),
        _illuminance(node, weather, lanes, findings),
    )
    if weather is not None:
        _check_precipitation(weather, findings)
    condition = node.one("RoadCondition")
    if condition and (
        findings.number(condition, "frictionScaleFactor", 1.0) != 1.0 or condition.get("wetness", "dry") != "dry"
    ):
        findings.refuse(
            condition, "roads are dry: write frictionScaleFactor=1; advice.parameters.friction is for advice"
        )
    if reference:
        findings.look_for_unread(node)
    return read


def _visibility(fog: Node, findings: Findings) -> float:
    visibility = findings.number(fog, "visualRange", is_finite=False)
    if visibility < 1.0:
        findings.refuse(fog, f"visualRange: expected 1 m or more, got {visibility:g}")
        return math.inf
    return visibility


def _box(node: Node, findings: Findings) -> Box:
    centre, size = node.one("Center"), node.one("Dimensions")
    if centre is None or size is None:
        findings.refuse(node, "a box needs a Center and Dimensions")
        return Box((0.0, 0.0, 0.0), 0.0, 0.0, 0.0)
    x, y, z = (findings.number(centre, key) for key in "xyz")
    length, width, height = (findings.number(size, key) for key in ("length", "width", "height"))
    return Box((x, y, z), length, width, height)


def _illuminance(node: Node, weather: Node | None, lanes: OpenDriveLanes, findings: Findings) -> float | None:
    clouds = _oktas(weather, findings) if weather else None
    sun, time = (weather.one("Sun") if weather else None), node.one("TimeOfDay")
    given = [key for key in ("illuminance", "intensity") if sun and sun.get(key)]
    moment = None if time is None else _moment(time, findings)
    elevation = findings.number(sun, "elevation") if sun and sun.get("elevation") else None
    if elevation is None and moment is not None:
        elevation = sun_elevation(moment, lanes.latitude, lanes.longitude)
    clear = None if elevation is None else clear_sky_illuminance(elevation)
    if sun and given:
        lux = findings.number(sun, given[0])
        if elevation and clear and 0.0 < lux < _DARKEST * clear and elevation > 0.0:
            message = f"{given[0]}: {lux:g} lx would be night at a sun of {math.degrees(elevation):.0f}°"
            if given[0] == "intensity" and lux <= 1.0:
                findings.remark(sun, f"{message}; read as the share of the sky without clouds")
                return through_clouds(clear, 8.0 * (1.0 - lux))
            findings.refuse(sun, f"{message}; expected some {clear:.0f} lx")
        return min(max(lux, 0.0), BRIGHTEST)
    return None if clear is None else through_clouds(clear, clouds or 0.0)


def _oktas(weather: Node, findings: Findings) -> float | None:
    word, old = weather.get("fractionalCloudCover"), weather.get("cloudState")
    if word.removesuffix("Oktas") in _CLOUDS:
        return min(float(_CLOUDS.index(word.removesuffix("Oktas"))), 8.0)
    if old in _OLD_CLOUDS:
        return _OLD_CLOUDS[old]
    if word or old:
        findings.refuse(weather, f"unknown cloud cover {word or old!r}")
    return None


def _moment(time: Node, findings: Findings) -> dt.datetime | None:
    text = time.get("dateTime")
    try:
        return dt.datetime.fromisoformat(text)
    except ValueError:
        findings.refuse(time, f"dateTime: expected one such as 2026-11-23T08:30:00+01:00, got {text!r}")
        return None


def _check_precipitation(weather: Node, findings: Findings) -> None:
    for one in weather.all("Precipitation"):
        falls = findings.number(one, "precipitationIntensity", findings.number(one, "intensity", 0.0))
        if one.get("precipitationType") != "dry" and falls > 0.0:
            findings.refuse(one, "rain and snow are not drawn: write precipitationType=dry, or an intensity of 0")


def fog_block(environment: Environment, route: Any, lowest: float) -> dict[str, Any]:
    """The block ``fog`` of a scenario.

    `route` (n, 2) is the middle of the ego's route, and heights of fog count from `lowest` [m].
    """
    visibility = math.inf if environment.visibility is None else environment.visibility
    box = environment.box
    if box is None:
        return {"visibility_m": visibility}
    banks = [
        {"start_m": begin, "end_m": end, "visibility_m": visibility, "edge_m": min(_EDGE, end - begin)}
        for begin, end in _stretches(np.asarray(route, dtype=np.float64), box)
    ]
    low, high = (box.centre[2] + side * box.height - lowest for side in (-0.5, 0.5))
    return {
        "outside_visibility_m": math.inf,
        "banks": banks,
        "top_m": high,
        **({"base_m": low} if low > 0.0 else {}),
    }


def _stretches(route: Any, box: Box) -> list[tuple[float, float]]:
    """Intervals of a route inside a box [m]."""
    steps = np.diff(route, axis=0)
    ends = np.concatenate([[0.0], np.cumsum(np.hypot(steps[:, 0], steps[:, 1]))])
    along = np.linspace(0.0, ends[-1], max(int(ends[-1] / _STEP) + 1, 2))
    points = np.column_stack([np.interp(along, ends, route[:, axis]) for axis in (0, 1)])
    inside = np.concatenate([[False], box.covers(points), [False]]).astype(int)
    begins, stops = np.flatnonzero(np.diff(inside) == 1), np.flatnonzero(np.diff(inside) == -1) - 1
    return [(float(along[a]), float(along[b])) for a, b in zip(begins, stops, strict=True) if b > a]
