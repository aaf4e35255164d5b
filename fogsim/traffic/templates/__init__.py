"""Roads by template, and who drives on them, written to SUMO's files: no netconvert is needed."""

from fogsim.traffic.templates.beside import Obstruction, additional_text
from fogsim.traffic.templates.catalogue import RAMP, ROAD_TEMPLATES, RoadTemplate, measures, usual_mix
from fogsim.traffic.templates.demand import Demand, actors_text, cuts_around, routes_text
from fogsim.traffic.templates.layout import Layout
from fogsim.traffic.templates.net_writer import net_text
from fogsim.traffic.templates.on_foot import WALKING_SPEED, Footfall, Walker
from fogsim.traffic.templates.placement import (
    VEHICLE_KINDS,
    Actor,
    Placed,
    PlacementError,
    Relation,
    check_placement,
    place_actors,
    read_ways,
)

__all__ = [
    "RAMP",
    "ROAD_TEMPLATES",
    "VEHICLE_KINDS",
    "WALKING_SPEED",
    "Actor",
    "Demand",
    "Footfall",
    "Layout",
    "Obstruction",
    "Placed",
    "PlacementError",
    "Relation",
    "RoadTemplate",
    "Walker",
    "actors_text",
    "additional_text",
    "check_placement",
    "cuts_around",
    "measures",
    "net_text",
    "place_actors",
    "read_ways",
    "routes_text",
    "usual_mix",
]
