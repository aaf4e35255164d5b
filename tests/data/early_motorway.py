"""The scenario motorway_fog_bank begun early: its road fills for three minutes first, this one for half of one."""

from pathlib import Path

ROUTES = Path(__file__).with_name("early_motorway.rou.xml")
EARLY = f"traffic.routes=[{ROUTES}]"
"""Setting; within a kilometre of the ego there is as much traffic as ever."""
