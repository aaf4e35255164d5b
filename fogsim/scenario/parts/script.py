"""From the timeline of a scenario to its script."""

import math
from functools import partial

from fogsim.scenario.roads.departures import entering_vehicles
from fogsim.scenario.schema import ScenarioFile
from fogsim.scenario.timeline import actions_of, entry_name, entry_text, fog_reference, vehicles_of
from fogsim.simulation.run_config import Script, ScriptEntry
from fogsim.units import extinction_from_visibility


def script(scenario: ScenarioFile) -> Script:
    """What happens in a run."""
    fog = scenario.fog.visibility_m or scenario.fog.outside_visibility_m or math.inf
    reference = fog_reference(scenario.timeline, extinction_from_visibility(fog))
    entering = entering_vehicles(scenario)
    entries = tuple(
        ScriptEntry(
            name=entry_name(entry, number),
            key=f"timeline.{number}",
            when=entry.when,
            actions=partial(actions_of, entry, reference, entering),
            text=entry_text(entry),
            vehicles=vehicles_of(entry),
            delay=entry.delay_s,
            happens_once=entry.repeat == "once",
        )
        for number, entry in enumerate(scenario.timeline)
    )
    return Script(entries, scenario.end_when)
