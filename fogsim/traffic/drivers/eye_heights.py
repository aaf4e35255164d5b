"""How high a driver's eyes are above the road.

| who | height [m] | source |
|---|---|---|
| car | 1.08 | AASHTO's design value: 90 % of car drivers sit higher (Fitzpatrick, Lienau & Fambro 1998) |
| truck, fire engine | 2.33 | AASHTO, *A Policy on Geometric Design of Highways and Streets* (2011), section 3.2.6 |
| bus, coach | 1.8 | Austroads, *Guide to Road Design*, part 3, vertical height parameters |
| motorcycle, moped, scooter | 1.35 | 5th percentile in Selangor (doi 10.1061/(ASCE)TE.1943-5436.0000226) |
| bicycle | 1.4 | AASHTO, *Guide for the Development of Bicycle Facilities* (1999), stopping sight distance |
| van, ambulance | 1.5 | assumed: between a car and a truck |
| pedestrian | 1.5 | assumed |
| wheelchair | 1.2 | assumed |
| tram, underground; other trains | 2.0; 2.7 | assumed |
"""

from fogsim.traffic.appearance import body_kind

EYE_HEIGHTS = {"car": 1.08, "van": 1.5, "truck": 2.33, "bus": 1.8, "motorcycle": 1.35}
"""Height of the eyes above the road, by body kind [m]."""

_OF_CLASSES = {
    "bicycle": 1.4,
    "pedestrian": 1.5,
    "wheelchair": 1.2,
    "tram": 2.0,
    "rail_urban": 2.0,
    "subway": 2.0,
    "rail": 2.7,
    "rail_electric": 2.7,
    "rail_fast": 2.7,
}
"""The same of SUMO's vehicle classes that share a body with others, but not the height [m]."""


def eye_height(vehicle_class: str, shape: str = "", length: float = 0.0) -> float:
    """Height of a driver's eyes above the road [m]."""
    known = _OF_CLASSES.get(vehicle_class)
    return EYE_HEIGHTS[body_kind(vehicle_class, shape, length)] if known is None else known
