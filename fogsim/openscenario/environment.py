"""Fog and light of an environment: ``visualRange`` is the distance at which a black target has 5 % contrast."""

import datetime as dt
import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.polynomial import polynomial

from fogsim.openscenario.parameters import Catalogs
from fogsim.openscenario.xml_tree import HARMLESS, Node, NodeError, sumo_name
from fogsim.traffic.road.opendrive_lanes import OpenDriveLanes
from fogsim.values.traffic import BOX, PEDESTRIAN

# SUMO's class of each vehicle category that is read
CLASSES = {"car": "passenger", "van": "delivery", "truck": "truck", "bus": "bus"}
CLASSES |= {"motorbike": "motorcycle", "bicycle": "bicycle", "train": "rail", "tram": "tram"}
# How hard SUMO's drivers of each category speed up and brake where nothing else is said [m/s²]
HABITS = {"car": (2.6, 4.5), "van": (2.6, 4.5), "truck": (1.3, 4.0), "bus": (1.2, 4.0)}
HABITS |= {"motorbike": (6.0, 10.0), "bicycle": (1.2, 3.0), "train": (0.25, 1.3), "tram": (1.0, 3.0)}
_ASIDE = 0.1  # Distance between the middles of axle and body that is none [m]
_FASTEST, _QUICKEST = 138.0, 50.0  # Top speeds and accelerations that a file may give [m/s, m/s²]
_RUNNER = 10.0  # Acceleration of persons and obstacles [m/s²]
_THINGS: tuple[str, ...] = ("none", "obstacle", "barrier", "railing", "soundBarrier", "trafficIsland")
_THINGS += ("pole", "streetLamp", "tree", "vegetation", "building")
_CATEGORIES = {  # Attribute, its words, and the usual one
    "Vehicle": ("vehicleCategory", tuple(CLASSES), "car"),
    "Pedestrian": ("pedestrianCategory", ("pedestrian", "wheelchair", "animal"), ""),
    "MiscObject": ("miscObjectCategory", _THINGS, ""),
}
_TAKEN = ("fog", "light")
_EGO_NAMES = ("ego", "hero", "ego_vehicle", "egovehicle")
_WORD = re.compile(r"[A-Za-z_][\w:#@\-]*")


@dataclass(frozen=True, slots=True)
class Vehicle:
    """A vehicle: its size [m] and limits [m/s, m/s²]; persons and obstacles have a `body`, and no lamps."""

    name: str
    node: Node
    category: str
    length: float
    width: float
    height: float
    front: float  # From its reference point, the middle of the rear axle, to the front bumper [m]
    top_speed: float = _FASTEST
    acceleration: float = _RUNNER
    deceleration: float = _RUNNER
    body: str = ""
    named: str = ""  # In timelines

    @property
    def called(self) -> str:
        """Its name in conditions."""
        return self.named if _WORD.fullmatch(self.named) else f'"{self.named}"'

    @property
    def lamps(self) -> dict[str, dict[str, str]]:
        """Block of a timeline that keeps its lamps dark if it has none."""
        return {"lamps": {"all": "off"}} if self.body else {}

    @property
    def rear(self) -> float:
        """From the rear bumper to the reference point [m]."""
        return self.length - self.front


class Vehicles(dict[str, Vehicle]):
    """Vehicles by name; `selections` are lists of names."""

    def __init__(self) -> None:
        super().__init__()
        self.selections: dict[str, list[Node]] = {}

    def members(self, nodes: Iterable[Node]) -> list[Node]:
        """References to entities, with those of its members in place of each to a selection."""
        return [part for one in nodes for part in self.selections.get(one.get("entityRef"), [one])]

    def selected(self, nodes: Iterable[Node]) -> list[str]:
        """Names of the entities to which elements refer, those of selections one by one; unknown ones are refused."""
        self.known(each := self.members(nodes))
        return list(dict.fromkeys(one.get("entityRef") for one in each))

    @property
    def ego(self) -> str:
        """Name of the ego: a vehicle with a usual name (``Ego``, ``hero``), otherwise the first."""
        driven = [name for name, vehicle in self.items() if not vehicle.body]
        return next((name for name in driven if name.lower() in _EGO_NAMES), next(iter(driven), "ego"))

    def of(self, node: Node, key: str = "entityRef") -> Vehicle:
        """The vehicle to which an element refers; ValueError if there is none."""
        if (name := node.get(key)) not in self:
            raise NodeError(node, f"there is no vehicle {name!r}")
        return self[name]

    def known(self, nodes: Iterable[Node]) -> list[Node]:
        """Those of some elements that refer to a vehicle; all others are refused."""
        found = []
        for one in nodes:
            with one.refusing():
                self.of(one)
                found.append(one)
        return found


def read_vehicles(entities: Node, catalogs: Catalogs) -> Vehicles:
    """Vehicles of a file; what is none becomes a finding."""
    found = Vehicles()
    for entity in entities.all("ScenarioObject"):
        name = sumo_name(entity.get("name"))
        if not name or name in _TAKEN or name in found:
            entity.refuse(f"expected a unique name other than {' or '.join(_TAKEN)}; got {name!r}")
            continue
        for controller in entity.all("ObjectController"):
            if controller.children or controller.attributes:
                controller.remark(HARMLESS["ObjectController"], is_whole=True)
        found[name] = Vehicle(name, entity, "car", 4.6, 1.85, 1.5, 3.7)
        with entity.refusing():
            found[name] = _vehicle(name, catalogs.need(entity, *_CATEGORIES))
    for one in entities.all("EntitySelection"):
        if (name := sumo_name(one.get("name"))) in found:
            one.refuse(f"there is an entity {name!r} already")
        with one.refusing():
            found.selections[name] = one.need("Members").some("EntityRef")
            found.known(found.selections[name])
    for name, vehicle in found.items():
        found[name] = replace(vehicle, named="ego" if name == found.ego else name)
    return found


def _vehicle(name: str, node: Node) -> Vehicle:
    """A vehicle, a person, or an obstacle, which FogSim draws as a box."""
    category = node.word(*_CATEGORIES.get(node.tag, _CATEGORIES["MiscObject"]))
    if node.tag != "Vehicle":
        # Wheelchairs and animals have no figure.
        return Vehicle(name, node, category, *_size(node), body=PEDESTRIAN if category == "pedestrian" else BOX)
    for trailer in node.all("Trailer"):
        if any(one.tag != "TrailerRef" or one.get("entityRef") for one in trailer.all()):
            trailer.refuse("vehicles have no trailers; describe the whole as one vehicle")
    performance, size = node.need("Performance"), _size(node)
    limits = {"Speed": _FASTEST, "Acceleration": _QUICKEST, "Deceleration": _QUICKEST}
    top, up, down = (min(max(performance.number(f"max{key}"), 0.1), most) for key, most in limits.items())
    return Vehicle(name, node, category, *size, top, up, down)


def _size(node: Node) -> tuple[float, float, float, float]:
    """Length, width, height, and from the reference point to the front [m]."""
    box = node.need("BoundingBox")
    centre, size = box.need("Center"), box.need("Dimensions")
    length, width, height = (size.number(key) for key in ("length", "width", "height"))
    centre.get("z")  # All stand on the road.
    if abs(centre.number("y")) > _ASIDE:
        centre.refuse("y: a body lies about its reference point to the left and right alike; write 0")
    return max(length, 0.2), max(width, 0.2), max(height, 0.2), centre.number("x") + 0.5 * length


_CLOUDS = ("zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")
_OKTAS = tuple(f"{one}Oktas" for one in _CLOUDS)
_OLD_CLOUDS = {"free": 0.0, "cloudy": 4.0, "overcast": 8.0, "rainy": 8.0, "skyOff": 0.0}  # In 1.0
_USUAL_LATITUDE = math.radians(50.0)  # If a map gives none [rad]
_BRANCHES = (  # Lowest elevation [deg] and coefficients of each piece of `clear_sky_illuminance`
    (20.0, (3.74, 3.97, -4.07, 1.47)),
    (5.0, (3.05, 13.28, -45.98, 64.33)),
    (-0.8, (2.88, 22.26, -207.64, 1034.30)),
    (-5.0, (2.88, 21.81, -258.11, -858.36)),
    (-12.0, (2.70, 12.17, -431.69, -1899.83)),
    (-18.0, (13.84, 262.72, 1447.42, 2797.93)),
)
_BRIGHTEST = 200_000.0
_MOONLIGHT = 0.3  # The most that the full moon gives [lx] (Kyba et al., Astronomy & Geophysics 58, 2017)
_DARKEST = 0.001  # Of a clear day, under any clouds
_STEP = 1.0  # along a route, in the search for the start of a box [m]
_EDGE = 1.0  # of a box of fog, whose border is sharp [m]


Box = tuple[tuple[float, ...], tuple[float, ...]]  # Centre, and length, width and height [m]


@dataclass(frozen=True, slots=True)
class Environment:
    """Fog, everywhere or in a box, by its V_met [m], and illuminance of the ground [lx]; None if not given."""

    visibility: float | None = None
    box: Box | None = None
    illuminance: float | None = None

    def then(self, later: "Environment") -> "Environment":
        """What holds once a later one is set, which may leave out fog or light."""
        fog, light = (self if one is None else later for one in (later.visibility, later.illuminance))
        return Environment(fog.visibility, fog.box, light.illuminance)


def environment_of(action: Node, catalogs: Catalogs, lanes: OpenDriveLanes) -> Environment:
    """Fog and light of an ``EnvironmentAction``; the map may give its geographic position."""
    node = catalogs.need(action, "Environment")
    weather, road = node.one("Weather"), node.one("RoadCondition")
    fog = weather.one("Fog") if weather else None
    extent, box, visibility = fog.one("BoundingBox") if fog else None, None, None
    if fog and (visibility := fog.number("visualRange", is_finite=False)) < 1.0:
        fog.refuse(f"visualRange: expected 1 m or more, got {visibility:g}")
    if extent:
        centre, size = extent.need("Center"), extent.need("Dimensions")
        x, y, z = map(centre.number, "xyz")
        box = (x + lanes.moved[0], y + lanes.moved[1], z), tuple(map(size.number, ("length", "width", "height")))
    for one in weather.all("Precipitation") if weather else ():
        falls = one.number("precipitationIntensity", one.number("intensity", 0.0))
        if one.get("precipitationType") != "dry" and falls > 0.0:
            one.refuse("rain and snow are not drawn: write precipitationType=dry, or an intensity of 0")
    if road and (road.number("frictionScaleFactor", 1.0) != 1.0 or road.get("wetness", "dry") != "dry"):
        road.refuse("roads are dry: write frictionScaleFactor=1; advice.parameters.friction is for advice")
    return Environment(visibility, box, _illuminance(node, weather, lanes))


def _illuminance(node: Node, weather: Node | None, lanes: OpenDriveLanes) -> float | None:
    clouds = _oktas(weather) if weather else 0.0
    sun, time = (weather.one("Sun") if weather else None), node.one("TimeOfDay")
    given = next((key for key in ("illuminance", "intensity") if sun and sun.get(key)), None)
    elevation = _elevation(time, lanes) if time else None
    if sun and sun.get("elevation"):
        elevation = sun.number("elevation")
        if abs(elevation) > math.pi and given is None:
            sun.refuse(f"elevation: expected an angle in radians, from -pi to pi, got {elevation:g}")
    clear = None if elevation is None else clear_sky_illuminance(elevation)
    if clear is None and given is None and weather and clouds:
        weather.remark("clouds without a TimeOfDay, or a Sun's elevation: the light stays as it is")
    if sun is None or given is None:
        return None if clear is None else through_clouds(clear, clouds)
    lux = sun.number(given)
    if elevation and clear and 0.0 < lux < _DARKEST * clear and elevation > 0.0:
        message = f"{given}: {lux:g} lx would be night at a sun of {math.degrees(elevation):.0f}°"
        if given == "intensity" and lux <= 1.0:
            sun.remark(f"{message}; read as the share of the sky without clouds")
            return through_clouds(clear, 8.0 * (1.0 - lux))
        if given == "illuminance" and lux <= _MOONLIGHT:
            sun.remark(f"{message}; read as a moon there")
            return lux
        sun.refuse(f"{message}; expected some {clear:.0f} lx")
    return min(max(lux, 0.0), _BRIGHTEST)


def _oktas(weather: Node) -> float:
    old = weather.word("cloudState", tuple(_OLD_CLOUDS), "free")
    if not weather.get("fractionalCloudCover"):
        return _OLD_CLOUDS[old]
    return min(float(_OKTAS.index(weather.word("fractionalCloudCover", _OKTAS))), 8.0)


def _elevation(time: Node, lanes: OpenDriveLanes) -> float | None:
    text = time.get("dateTime")
    try:
        return sun_elevation(dt.datetime.fromisoformat(text), lanes.latitude, lanes.longitude)
    except ValueError:
        time.refuse(f"dateTime: expected one such as 2026-11-23T08:30:00+01:00, got {text!r}")
        return None


def fog_block(environment: Environment, route: Any, lowest: float) -> dict[str, Any]:
    """The block ``fog`` of a scenario, by the middle of the ego's route (n, 2) and its lowest height [m]."""
    visibility = math.inf if environment.visibility is None else environment.visibility
    box = environment.box
    if box is None:
        return {"visibility_m": visibility}
    banks = [
        {"start_m": begin, "end_m": end, "visibility_m": visibility, "edge_m": min(_EDGE, end - begin)}
        for begin, end in _stretches(np.asarray(route, dtype=np.float64), *np.array(box)[:, :2])
    ]
    low, high = (box[0][2] + side * box[1][2] - lowest for side in (-0.5, 0.5))
    base = {"base_m": low} if low > 0.0 else {}
    return {"outside_visibility_m": math.inf, "banks": banks, "top_m": high, **base}


def _stretches(route: Any, centre: Any, size: Any) -> list[tuple[float, float]]:
    steps = np.diff(route, axis=0)
    ends = np.concatenate([[0.0], np.cumsum(np.hypot(steps[:, 0], steps[:, 1]))])
    along = np.linspace(0.0, ends[-1], max(int(ends[-1] / _STEP) + 1, 2))
    points = np.column_stack([np.interp(along, ends, route[:, axis]) for axis in (0, 1)])
    covered = (np.abs(points - centre) <= 0.5 * size).all(axis=1)
    inside = np.concatenate([[False], covered, [False]]).astype(int)
    begins, stops = np.flatnonzero(np.diff(inside) == 1), np.flatnonzero(np.diff(inside) == -1) - 1
    return [(float(along[a]), float(along[b])) for a, b in zip(begins, stops, strict=True) if b > a]


def sun_elevation(moment: dt.datetime, latitude: float | None, longitude: float | None) -> float:
    """Elevation of the sun's centre [rad] at a place [rad, east and north], after Spencer (Search 2(5), 1971)."""
    # A time without a time zone, or without a longitude, is mean solar time.
    hour = moment.hour + moment.minute / 60.0 + moment.second / 3600.0
    offset = moment.utcoffset()
    if longitude is not None and offset is not None:
        hour += math.degrees(longitude) / 15.0 - offset.total_seconds() / 3600.0
    day = 2.0 * math.pi * (moment.timetuple().tm_yday - 1 + (hour - 12.0) / 24.0) / 365.0
    terms = [trig(n * day) for n in (1, 2, 3) for trig in (math.cos, math.sin)]
    declination = 0.006918 + math.fsum(
        c * t for c, t in zip((-0.399912, 0.070257, -0.006758, 0.000907, -0.002697, 0.001480), terms, strict=True)
    )
    equation = 229.18 * (
        0.000075 + math.fsum(c * t for c, t in zip((0.001868, -0.032077, -0.014615, -0.040849), terms[:4], strict=True))
    )
    solar = hour + (equation / 60.0 if longitude is not None else 0.0)
    angle = math.pi * (solar - 12.0) / 12.0
    north = _USUAL_LATITUDE if latitude is None else latitude
    height = math.sin(north) * math.sin(declination) + math.cos(north) * math.cos(declination) * math.cos(angle)
    return math.asin(min(max(height, -1.0), 1.0))


def clear_sky_illuminance(elevation: float) -> float:
    """Horizontal illuminance by sun and clear sky [lx] (Seidelmann, Explanatory Supplement, 1992, p. 491)."""
    degrees = min(90.0, max(_BRANCHES[-1][0], math.degrees(elevation)))
    coefficients = next(one for lowest, one in _BRANCHES if degrees >= lowest)
    return math.pow(10.0, float(polynomial.polyval(degrees / 90.0, coefficients)))


def through_clouds(illuminance: float, oktas: float) -> float:
    """Horizontal illuminance [lx] under 0 … 8 oktas (Kasten & Czeplak, Solar Energy 24, 1980: 1 − 0.75 (N/8)^3.4)."""
    return illuminance * (1.0 - 0.75 * math.pow(min(oktas, 8.0) / 8.0, 3.4))
