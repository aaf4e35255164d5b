"""What a scenario makes happen while it runs: the block ``timeline``, and the actions that its entries stand for."""

from fogsim.scenario.timeline.actions import (
    SIGNAL_STATES,
    Entries,
    actions_of,
    departing_vehicles,
    entry_name,
    entry_text,
    fog_reference,
    light_range,
    operations,
    scripted_fog,
    vehicles_of,
)
from fogsim.scenario.timeline.checks import check_timeline, named_vehicles, pointless_triggers
from fogsim.scenario.timeline.schema import FogActions, LightActions, SignalActions, Timeline, TimelineEntry

__all__ = [
    "SIGNAL_STATES",
    "Entries",
    "FogActions",
    "LightActions",
    "SignalActions",
    "Timeline",
    "TimelineEntry",
    "actions_of",
    "check_timeline",
    "departing_vehicles",
    "entry_name",
    "entry_text",
    "fog_reference",
    "light_range",
    "named_vehicles",
    "operations",
    "pointless_triggers",
    "scripted_fog",
    "vehicles_of",
]
