"""What of a timeline does not fit the rest of its scenario."""

import math
from collections.abc import Iterator, Sequence

from fogsim.conditions.moment import EGO
from fogsim.scenario.sensor_schema import AnyFault
from fogsim.scenario.timeline.actions import doings_of, entry_name, vehicles_of
from fogsim.scenario.timeline.schema import FogActions, LightActions, SignalActions, TimelineEntry, VehicleActions
from fogsim.units import DAY_ILLUMINANCE


def timeline_mistakes(
    entries: Sequence[TimelineEntry], *, has_ego: bool, illuminance: float, visibility: float, has_banks: bool
) -> Iterator[str]:
    """Say what does not fit, one line each with its key path.

    Parameters
    ----------
    entries : sequence of TimelineEntry
        The timeline.
    has_ego : bool
        Whether there is an ego.
    illuminance : float
        Illuminance of the scenario [lx].
    visibility : float
        Its meteorological visibility, outside banks [m].
    has_banks : bool
        Whether it has fog banks.
    """
    names = [entry_name(entry, number) for number, entry in enumerate(entries)]
    for number, entry in enumerate(entries):
        at = f"timeline.{number}"
        if names[number] in names[:number]:
            yield f"{at}.name: names of entries must differ, and {names[number]!r} stands there twice"
        if not has_ego and EGO in vehicles_of(entry):
            yield f"{at}.do: it tells of the ego, and traffic.ego is none"
        for subject, doing in doings_of(entry):
            told = _mistake(doing, has_ego, illuminance, math.isfinite(visibility), has_banks)
            if told:
                yield f"{at}.do.{subject}: {told}"


def _mistake(
    doing: VehicleActions | SignalActions | FogActions | LightActions | AnyFault,
    has_ego: bool,
    illuminance: float,
    is_foggy: bool,
    has_banks: bool,
) -> str | None:
    if isinstance(doing, VehicleActions | SignalActions):
        return None
    if isinstance(doing, FogActions):
        return _fog_mistake(doing, is_foggy, has_banks)
    if not has_ego:
        return "daylight and sensors concern an ego's camera, and traffic.ego is none"
    if isinstance(doing, LightActions) and illuminance < DAY_ILLUMINANCE:
        return (
            f"daylight changes by day alone, and light.illuminance_lx is {illuminance:g}, less than "
            f"{DAY_ILLUMINANCE:g}, where lamps light the road"
        )
    return None


def _fog_mistake(doing: FogActions, is_foggy: bool, has_banks: bool) -> str | None:
    if doing.density is not None and not is_foggy and not has_banks:
        return "there is no fog of which this could be a multiple; write visibility_m, or give the scenario fog"
    if doing.visibility_m is not None and not is_foggy and has_banks:
        return "outside the banks the air is clear; write density, which is that of the banks"
    return None
