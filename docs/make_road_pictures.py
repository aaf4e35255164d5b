"""Make docs/pictures/roads.jpg and tunnel.jpg, roads as the ego sees them: ``python docs/make_road_pictures.py``."""

import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from staging import PICTURES, sheet

import fogsim

SCENES = {
    "motorway": ("{template: motorway}", "{position: 200 m, speed: 100 km/h}", 1.0),
    "ramp": ("{template: ramp}", "{'on': ramp, position: 150 m, speed: 80 km/h}", 3.0),
    "straight": ("{template: straight}", "{position: 300 m, speed: 80 km/h}", 1.0),
    "curve": ("{template: curve}", "{position: 400 m, speed: 80 km/h}", 1.0),
    "grade, 4 %": ("{template: grade, grade_at: 100 m}", "{position: 60 m, speed: 80 km/h}", 1.0),
    "rural": ("{template: rural}", "{position: 300 m, speed: 80 km/h}", 1.0),
    "crossing": ("{template: crossing}", "{position: 230 m, speed: 50 km/h}", 1.0),
    "crossing, lights: true": ("{template: crossing, lights: true}", "{position: 230 m, speed: 50 km/h}", 2.0),
    "roundabout": ("{template: roundabout}", "{position: 230 m, speed: 50 km/h}", 1.0),
    "tunnel": ("{template: tunnel, tunnel_at: 330 m}", "{position: 280 m, speed: 80 km/h}", 0.5),
    "obstructions": (
        "{template: crossing, obstructions: [{kind: building, at: 240 m, length: 40 m, distance: 4 m},"
        " {kind: truck, at: 225 m, distance: 0.4 m}, {kind: hedge, at: 230 m, side: left, length: 50 m}]}",
        "{position: 195 m, speed: 50 km/h}",
        0.5,
    ),
    "actors: a van ahead, a broken-down truck": (
        "{template: motorway}",
        "{lane: left, position: 200 m, speed: 100 km/h}\n"
        "  van: {type: van, ahead_of: ego, gap: 30 m, lane: left, speed: 100 km/h}\n"
        "  broken: {type: truck, ahead_of: ego, gap: 45 m, lane: right, stands: true}",
        0.1,
    ),
}
"""Road, actors and the time of the picture [s] by title."""

SIDE_FLOWS = {
    "ramp": ", ramp: 200 veh/h",
    "crossing": (sides := ", north: 200 veh/h, south: 200 veh/h"),
    "roundabout": sides,
}

TUNNEL = "{template: tunnel, tunnel_at: 300 m, tunnel_length: 300 m}"
PLACES = {"25 m before": 265, "after 8 m": 298, "in the middle": 440, "12 m before the exit": 578}
"""Where the ego begins [m], a second and 10 m before the picture, by title."""


def tunnel_pictures() -> list[tuple[str, NDArray[np.uint8]]]:
    """A tunnel in fog, by day and by night."""
    return [
        (f"{place}, {light:g} lx", picture(TUNNEL, f"{{position: {at} m, speed: 36 km/h}}", 1.0, 60, light))
        for light in (20_000.0, 1.0)
        for place, at in PLACES.items()
    ]


def picture(
    road: str, ego: str, time: float, visibility: float = 1500.0, illuminance: float = 20_000.0
) -> NDArray[np.uint8]:
    """What the ego's camera sees."""
    template = road.strip("{}").split(",")[0].removeprefix("template: ")
    flows = "same_way: 300 veh/h, oncoming: 300 veh/h" + SIDE_FLOWS.get(template, "")
    text = (
        f"name: road\nroad: {road}\ndemand: {{{flows}}}\nactors:\n  ego: {ego}\nfog: {{visibility: {visibility:g} m}}\n"
    )
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "scenario.yaml")
        file.write_text(text, encoding="utf-8")
        scenario = fogsim.load_scenario(
            file, ["camera.width=400", "camera.height=300", "renderer=cpu", f"light.illuminance_lx={illuminance}"]
        )
    with fogsim.ClosedLoop(scenario) as loop:
        step = loop.start(1)
        while step.time < time:
            step = loop.advance(step.command)
        return np.asarray(step.observation.frame.image, np.uint8)


def main() -> None:
    """Make the picture."""
    taken = [(title, picture(*scene)) for title, scene in SCENES.items()]
    sheet(taken, 3).save(PICTURES / "roads.jpg", quality=88)
    sheet(tunnel_pictures(), 4).save(PICTURES / "tunnel.jpg", quality=88)


if __name__ == "__main__":
    main()
