"""Scenarios without an ego (``traffic.ego: none``): keys that they lack, and what replaces its camera."""

import math
from collections.abc import Iterator
from typing import Any

from pydantic import ValidationError
from pydantic_core import InitErrorDetails, PydanticCustomError

from fogsim.scenario.mistakes import MISTAKE
from fogsim.scenario.plain_yaml import KeyPath

NO_EGO = "none"
"""Placeholder for the id of a missing ego."""

_NEEDS = "needs an ego, and traffic.ego is none"


def without_ego(written: object) -> object:
    """Fill in defaults of a scenario without an ego and refuse keys that need one; other data is unchanged."""
    traffic = written.get("traffic") if isinstance(written, dict) else None
    if not isinstance(written, dict) or not isinstance(traffic, dict) or traffic.get("ego") != NO_EGO:
        return written
    mistakes = [
        InitErrorDetails(type=PydanticCustomError(MISTAKE, "{message}", {"message": message}), loc=place, input=0)
        for place, message in (*_of_camera(written), *_of_place(written), *_of_events(traffic))
    ]
    if mistakes:
        raise ValidationError.from_exception_data("scenario", mistakes)
    fog, drivers = written.get("fog"), written.get("drivers", {})
    filled = {"renderer": "none", "estimators": [], "lighting": "low_beam", **written, "advice": _advice(written)}
    if isinstance(drivers, dict):
        filled["drivers"] = {"advised": "all", **drivers}
    if isinstance(fog, dict) and not _has_way(written):
        filled["fog"] = {"top_m": "inf", **fog}
    return filled


def _method(value: object) -> dict[str, Any]:
    return {"method": value} if isinstance(value, str) else value if isinstance(value, dict) else {}


def _advice(written: dict[str, Any]) -> object:
    advice = written.get("advice", "stopping_sight_distance")
    return {"informed_by": "truth", **_method(advice)} if isinstance(advice, str | dict) else advice


def _of_camera(written: dict[str, Any]) -> Iterator[tuple[KeyPath, str]]:
    """Keys that need an ego's camera or lights."""
    if written.get("renderer", NO_EGO) != NO_EGO:
        yield ("renderer",), f"drawing frames {_NEEDS}; leave it out, or write none"
    if written.get("estimators"):
        yield ("estimators",), f"reading frames {_NEEDS}; leave it out, or write []"
    if _method(written.get("advice")).get("informed_by") == "belief":
        yield (
            ("advice", "informed_by"),
            f"belief {_NEEDS}; leave it out, or write truth (a meter at the road) or sensors (next to the road)",
        )
    sensors = written.get("sensors")
    if isinstance(sensors, dict) and sensors.get("faults"):
        yield ("sensors", "faults"), f"a fault of a sensor {_NEEDS}; leave it out"
    reports = sensors.get("reports") if isinstance(sensors, dict) else None
    roadside = reports.get("roadside") if isinstance(reports, dict) else None
    if isinstance(roadside, dict) and roadside.get("camera") is not None:
        yield (
            ("sensors", "reports", "roadside", "camera"),
            f"drawing images {_NEEDS}; leave it out: sensors then measure with noise (deviation, wrong)",
        )
    for key in ("vehicles", "cameras"):
        if isinstance(reports, dict) and reports.get(key):
            yield ("sensors", "reports", key), f"who hears other vehicles {_NEEDS}; leave it out, or write roadside"
    if _method(written.get("lighting")).get("method", "low_beam") != "low_beam":
        yield ("lighting",), f"choosing lamps {_NEEDS}; leave it out, or write low_beam"


def _has_way(written: dict[str, Any]) -> bool:
    """Whether there is a route along which positions count: a given one, or a template's road."""
    return bool(written["traffic"].get("along") or written.get("road"))


def _of_place(written: dict[str, Any]) -> Iterator[tuple[KeyPath, str]]:
    """Keys that need an ego's route."""
    drivers, fog = written.get("drivers"), written.get("fog")
    advised = drivers.get("advised") if isinstance(drivers, dict) else None
    if advised == "ego":
        yield ("drivers", "advised"), f"ego {_NEEDS}; leave it out, or write all"
    if _has_way(written):
        return
    what = "counts along the ego's route, and traffic.ego is none: name the road's edges in traffic.along"
    if advised in ("stretch", "signs", "equipped", "law"):
        yield ("drivers", "advised"), f"{advised} {what}"
    if isinstance(fog, dict):
        yield from ((place, f"this {what}") for place in _along_the_route(fog))


def _along_the_route(fog: dict[str, Any]) -> Iterator[KeyPath]:
    if fog.get("banks"):
        yield "fog", "banks"
    if fog.get("top_m", "inf") not in ("inf", ".inf", "infinity", math.inf):
        yield "fog", "top_m"
    for key in ("base_m", "scale_height_m"):
        if fog.get(key) is not None:
            yield "fog", key
    changes = fog.get("changes")
    for number, change in enumerate(changes if isinstance(changes, list | tuple) else ()):
        for key in ("base_m", "top_m"):
            if isinstance(change, dict) and change.get(key) is not None:
                yield "fog", "changes", number, key


def _of_events(traffic: dict[str, Any]) -> Iterator[tuple[KeyPath, str]]:
    events = traffic.get("events")
    for number, event in enumerate(events if isinstance(events, list | tuple) else ()):
        if isinstance(event, dict) and event.get("at_gap_to_ego_m") is not None:
            yield ("traffic", "events", number, "at_gap_to_ego_m"), f"a gap to the ego {_NEEDS}"
