"""Draw the pictures of the README and the docs again: ``python docs/make_pictures.py`` (about a minute)."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

import fogsim
from fogsim.metrics import step_metrics
from fogsim.offline import FrameEstimates, Picture
from fogsim.offline.overlay import Overlay
from fogsim.recorders import FramePanel
from fogsim.scenario import build

OUT = Path(__file__).resolve().parent / "pictures"
SHEET = (("inf", 30), ("400", 120), ("200", 120), ("100", 330), ("50", 100), ("30", 100))
"""Visibilities [m] of the contact sheet, and the frame of the run that is shown for each."""


FAULTS = (
    ("clean glass", ()),
    ("dirty_lens", ("{fault: dirty_lens}",)),
    ("wet_lens", ("{fault: wet_lens}",)),
    ("glare", ("{fault: glare, azimuth: 6 deg, elevation: 7 deg}",)),
    ("glare on dirty glass", ("{fault: glare, azimuth: 6 deg, elevation: 7 deg, haze: 10}", "{fault: dirty_lens}")),
    ("calibration", ("{fault: calibration, roll: 4 deg, pitch: 2 deg}",)),
)
"""Faults of the sheet of faults, in fog of 150 m."""


def frame(visibility: str, index: int, *settings: str) -> NDArray[np.uint8]:
    """One camera frame of the motorway in homogeneous fog."""
    scenario = fogsim.load_scenario("motorway_fog_bank", [f"fog.visibility_m={visibility}", *settings])
    for step in fogsim.run(scenario, seed=1):
        if step.index == index:
            return step.observation.image
    raise SystemExit(f"the run at {visibility} m ended before frame {index}")


def contact_sheet() -> Image.Image:
    """Six visibilities, 480×360 each."""
    sheet = Image.new("RGB", (3 * 480, 2 * 360))
    for place, (visibility, index) in enumerate(SHEET):
        picture = Image.fromarray(frame(visibility, index)).resize((480, 360), Image.Resampling.LANCZOS)
        sheet.paste(picture, (place % 3 * 480, place // 3 * 360))
    return sheet


def fault_sheet() -> Image.Image:
    """What faults of the camera look like, 480×360 each, with their names."""
    sheet = Image.new("RGB", (3 * 480, 2 * 360))
    for place, (name, faults) in enumerate(FAULTS):
        taken = frame("150", 90, f"sensors.faults=[{', '.join(faults)}]")
        picture = Image.fromarray(taken).resize((480, 360), Image.Resampling.LANCZOS)
        ImageDraw.Draw(picture).text((10, 6), name, fill=(20, 20, 20), font=ImageFont.load_default(18))
        sheet.paste(picture, (place % 3 * 480, place // 3 * 360))
    return sheet


def demo_frame(time: float) -> Image.Image:
    """A frame of the demo's video."""
    panel, scenario = FramePanel(), fogsim.load_scenario("motorway_fog_bank")
    standard = build.safety_standard(scenario)
    for step in fogsim.run(scenario, seed=1):
        drawn = panel.draw(step, step_metrics(step, standard))
        if step.time >= time - 1e-9:
            return Image.fromarray(drawn)
    raise SystemExit(f"the demo ended before {time} s")


def overlay(visibility: str, index: int) -> Image.Image:
    """What ``fogsim estimate --overlay`` draws over a camera frame."""
    scenario = fogsim.load_scenario("motorway_fog_bank", [f"fog.visibility_m={visibility}"])
    for step in fogsim.run(scenario, seed=1):
        if step.index == index:
            camera = step.observation.frame.camera
            estimate = fogsim.estimators.make("negru2013", camera).update(step.observation)
            picture = Picture(f"drive/{index:04d}.png", step.time, step.observation.image)
            return Overlay(camera, ["negru2013"]).draw(FrameEstimates(picture, (estimate,)))
    raise SystemExit(f"the run at {visibility} m ended before frame {index}")


def main() -> None:
    """Draw and save."""
    OUT.mkdir(exist_ok=True)
    contact_sheet().save(OUT / "visibilities.jpg", quality=88)
    overlay("120", 6).save(OUT / "estimate.jpg", quality=88)
    fault_sheet().save(OUT / "sensor_faults.jpg", quality=88)
    demo_frame(39.5).save(OUT / "denser_fog.jpg", quality=88)
    demo_frame(98.0).save(OUT / "demo.jpg", quality=88)


if __name__ == "__main__":
    main()
