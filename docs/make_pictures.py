"""Draw the pictures of the README and the docs again: ``python docs/make_pictures.py [NAME …]`` (some minutes)."""

import argparse
import math
import tempfile
from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from contact_sheet import HIGH, NIGHT, fog
from numpy.typing import NDArray
from PIL import Image
from staging import LIT, PICTURES, Shot, Vehicle, photograph, sheet

import fogsim
from fogsim.metrics import step_metrics
from fogsim.offline import FrameEstimates, Picture
from fogsim.offline.overlay import Overlay
from fogsim.recorders import FramePanel
from fogsim.traffic import DriverSight
from fogsim.traffic.drivers.adaptation import adaptation, contrast_ratio
from fogsim.traffic.drivers.lamp_intensity import rear_intensity
from fogsim.traffic.drivers.sight import inherent_contrast
from fogsim.units import extinction_from_visibility
from fogsim.values import DriverWarning, Lamp, Step

Titled = list[tuple[str, NDArray[np.uint8]]]

SEEN = (("inf", 30), ("400", 120), ("200", 120), ("100", 330), ("50", 100), ("30", 100))
"""Visibilities [m], and the frame of the run that is shown for each."""

GLARE = "fault: glare, azimuth: 6 deg, elevation: 7 deg"
FAULTS = {
    "clean glass": "",
    "dirty_lens": "{fault: dirty_lens}",
    "wet_lens": "{fault: wet_lens}",
    "glare": f"{{{GLARE}}}",
    "glare on dirty glass": f"{{{GLARE}, haze: 10}}, {{fault: dirty_lens}}",
    "calibration": "{fault: calibration, roll: 4 deg, pitch: 2 deg}",
}
OBSTRUCTIONS = (
    "{template: crossing, obstructions: [{kind: building, at: 240 m, length: 40 m, distance: 4 m},"
    " {kind: truck, at: 225 m, distance: 0.4 m}, {kind: hedge, at: 230 m, side: left, length: 50 m}]}"
)
ACTORS = (
    "{lane: left, position: 200 m, speed: 100 km/h}\n"
    "  van: {type: van, ahead_of: ego, gap: 30 m, lane: left, speed: 100 km/h}\n"
    "  broken: {type: truck, ahead_of: ego, gap: 45 m, lane: right, stands: true}"
)
ROADS = {
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
    "obstructions": (OBSTRUCTIONS, "{position: 195 m, speed: 50 km/h}", 0.5),
    "actors: a van ahead, a broken-down truck": ("{template: motorway}", ACTORS, 0.1),
}
"""Road, actors and the time of the picture [s] by title."""

SIDE_FLOWS = {"ramp": ", ramp: 200 veh/h"}
SIDE_FLOWS |= dict.fromkeys(("crossing", "roundabout"), ", north: 200 veh/h, south: 200 veh/h")
TUNNEL = "{template: tunnel, tunnel_at: 300 m, tunnel_length: 300 m}"
PLACES = {"25 m before": 265, "after 8 m": 298, "in the middle": 440, "12 m before the exit": 578}
"""Where the ego begins [m], a second and 10 m before the picture, by title."""

ONCOMING = tuple(Vehicle("car", 40.0 + 45.0 * n, 11.5 + 3.75 * (n % 2), LIT, oncoming=True) for n in range(4))
CAR, REAR_FOG = Vehicle("car", 35.0), Vehicle("car", 35.0, lamps=LIT | Lamp.REAR_FOG)
COLOURS = ("#1b6ca8", "#d1495b", "#edae49", "#444444")


def step_at(visibility: str, index: int, *settings: str) -> Step:
    """A step of the motorway in homogeneous fog."""
    scenario = fogsim.load_scenario("motorway_fog_bank", [f"fog.visibility_m={visibility}", *settings])
    return next(step for step in fogsim.run(scenario, seed=1) if step.index == index)


def shrunk(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """A frame of 480×360."""
    return np.asarray(Image.fromarray(image).resize((480, 360), Image.Resampling.LANCZOS))


def visibilities() -> Image.Image:
    """Six visibilities."""
    titles = {"inf": "clear air"}
    seen = ((titles.get(one, f"V_met {one} m"), step_at(one, index).observation.image) for one, index in SEEN)
    return sheet([(title, shrunk(image)) for title, image in seen], 3)


def sensor_faults() -> Image.Image:
    """Faults of the camera, in fog of 150 m."""
    seen = ((name, step_at("150", 90, f"sensors.faults=[{fault}]").observation.image) for name, fault in FAULTS.items())
    return sheet([(title, shrunk(image)) for title, image in seen], 3)


def estimate() -> Image.Image:
    """What ``fogsim estimate --overlay`` draws over a camera frame."""
    step = step_at("120", 6)
    camera = step.observation.frame.camera
    found = fogsim.estimators.make("negru2013", camera).update(step.observation)
    picture = Picture("drive/0006.png", step.time, step.observation.image)
    return Overlay(camera, ["negru2013"]).draw(FrameEstimates(picture, (found,)))


def demo_when(begins: Callable[[Step], bool]) -> Callable[[], Image.Image]:
    """The first frame of the demo's video at which something holds."""

    def draw() -> Image.Image:
        panel, scenario = FramePanel(), fogsim.load_scenario("motorway_fog_bank")
        for step in fogsim.run(scenario, seed=1):
            drawn = panel.draw(step, step_metrics(step))
            if begins(step):
                return Image.fromarray(drawn)
        raise SystemExit("the demo ended before that moment")

    return draw


def _warns_of_fog(step: Step) -> bool:
    return step.command.warning is DriverWarning.FOG_AHEAD


def _nears_stopped_lead(step: Step) -> bool:
    return step.leader is not None and step.leader.speed < 0.1 and step.leader.gap < 35.0


def road_picture(
    road: str, ego: str, time: float, visibility: float = 1500.0, illuminance: float = 20_000.0
) -> NDArray[np.uint8]:
    """A road as the ego's camera sees it."""
    template = road.strip("{}").split(",")[0].removeprefix("template: ")
    flows = "same_way: 300 veh/h, oncoming: 300 veh/h" + SIDE_FLOWS.get(template, "")
    text = (
        f"name: road\nroad: {road}\ndemand: {{{flows}}}\nactors:\n  ego: {ego}\nfog: {{visibility: {visibility:g} m}}"
    )
    settings = ["camera.width=400", "camera.height=300", "renderer=cpu", f"light.illuminance_lx={illuminance}"]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "scenario.yaml")
        file.write_text(text + "\n", encoding="utf-8")
        scenario = fogsim.load_scenario(file, settings)
    with fogsim.ClosedLoop(scenario) as loop:
        step = loop.start(1)
        while step.time < time:
            step = loop.advance(step.command)
        return np.asarray(step.observation.frame.image, np.uint8)


def roads() -> Image.Image:
    """Every template of roads."""
    return sheet([(title, road_picture(*scene)) for title, scene in ROADS.items()], 3)


def tunnel() -> Image.Image:
    """A tunnel in fog, by day and by night."""
    seen = [(place, at, light) for light in (20_000.0, 1.0) for place, at in PLACES.items()]
    ego = "{{position: {} m, speed: 36 km/h}}"
    taken = [(f"{p}, {lux:g} lx", road_picture(TUNNEL, ego.format(at), 1.0, 60, lux)) for p, at, lux in seen]
    return sheet(taken, 4)


def night_fog() -> Image.Image:
    """Four visibilities by five kinds of light."""
    kinds = {
        "low beam": Shot("", vehicles=(CAR,)),
        "high beam": Shot("", vehicles=(CAR,), lamps=HIGH),
        "high beam, oncoming cars": Shot("", vehicles=(CAR, *ONCOMING), lamps=HIGH),
        "low beam, street lamps": Shot("", ("street_lamps=true",), vehicles=(CAR,)),
        "low beam, rear fog lamp ahead": Shot("", vehicles=(REAR_FOG,)),
    }
    taken: Titled = []
    for visibility in (500, 200, 100, 50):
        for name, kind in kinds.items():
            settings = (NIGHT, fog(str(visibility)), *kind.settings)
            shot = Shot("", settings, vehicles=kind.vehicles, lamps=kind.lamps)
            taken.append((f"V_met {visibility} m, {name}", photograph(shot, "cpu", (400, 300)).image))
    return sheet(taken, 5)


def drivers_sight() -> Image.Image:
    """Distance at which a leader is first seen over the light of the sky, and what the eye needs."""
    mpl.rcParams.update({"font.size": 9, "axes.titlesize": 9, "legend.fontsize": 7.5, "legend.frameon": False})
    figure, axes = plt.subplots(1, 3, figsize=(12, 3.4), dpi=100, layout="constrained")
    lux, paint = np.geomspace(0.01, 1e5, 281), inherent_contrast((0.1, 0.1, 0.1))
    titles = {"leader without lamps, own head lamps lit": 0.0}
    titles["leader with tail lamps (8 cd)"] = rear_intensity(int(Lamp.POSITION))
    for place, (title, intensity) in zip(axes, titles.items(), strict=False):
        for visibility, colour in zip((30.0, 60.0, 120.0, math.inf), COLOURS, strict=True):
            k = extinction_from_visibility(visibility)
            seen = [DriverSight(one).seen_distance(k, paint, intensity) for one in lux]
            name = "clear air" if math.isinf(visibility) else f"V_met {visibility:g} m"
            place.plot(lux, seen, color=colour, label=name)
        place.set(ylabel="first seen at [m]", ylim=(9, 2000), title=title)
    eyes = [adaptation(one) for one in lux]
    for distance, style in ((20.0, "-"), (200.0, "--")):
        ratios = [contrast_ratio(eye, distance) for eye in eyes]
        axes[2].plot(lux, ratios, style, color=COLOURS[0], label=f"contrast, car {distance:g} m away")
    thresholds = [eye.eye_threshold / eyes[-1].eye_threshold for eye in eyes]
    axes[2].plot(lux, thresholds, color=COLOURS[1], label="light of a lamp")
    axes[2].set(ylabel="threshold over that by day", title="thresholds (Adrian 1989)")
    for place in axes:
        place.set(xscale="log", yscale="log", xlabel="illuminance [lx]")
        place.legend()
    figure.canvas.draw()
    return Image.fromarray(np.asarray(figure.canvas.buffer_rgba())[..., :3].copy())


DRAWN: dict[str, Callable[[], Image.Image]] = {
    "visibilities.jpg": visibilities,
    "estimate.jpg": estimate,
    "sensor_faults.jpg": sensor_faults,
    "denser_fog.jpg": demo_when(_warns_of_fog),
    "demo.jpg": demo_when(_nears_stopped_lead),
    "roads.jpg": roads,
    "tunnel.jpg": tunnel,
    "night_fog.jpg": night_fog,
    "drivers_sight.png": drivers_sight,
}


def main() -> None:
    """Draw and save."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(DRAWN))
    names = parser.parse_args().names or list(DRAWN)
    if unknown := [name for name in names if name not in DRAWN]:
        parser.error(f"no picture is called {', '.join(unknown)}; there are {', '.join(DRAWN)}")
    for name in names:
        DRAWN[name]().save(PICTURES / name, quality=88)


if __name__ == "__main__":
    main()
