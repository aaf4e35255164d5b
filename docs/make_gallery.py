"""Draw the pictures of docs/gallery.md and write its table: ``python docs/make_gallery.py [NAME …] [--table]``.

Each shipped scenario runs once (its first case), and its frame at the most telling moment is kept: the one that MOMENTS
has, otherwise a second after the first thing that its script does, at its first collision, or where the least is seen.
Of those in LOOPS all frames within `AROUND` of it are kept, as a moving picture; of those in READOUTS also what the
methods read, since the frame does not show the fault.
Without names all are drawn (some minutes); ``--table`` writes the table alone.
"""

import argparse
import sys
import warnings
from pathlib import Path

from PIL import Image

import fogsim
from fogsim.metrics import step_metrics
from fogsim.recorders import FramePanel
from fogsim.recorders.panel.camera_picture import scale_image, shown_image
from fogsim.values import Step

HERE = Path(__file__).parent
PICTURES = HERE / "pictures" / "gallery"
PAGE = HERE / "gallery.md"
SIZE = (320, 240)
MOMENTS: dict[str, float] = {
    "camera_blackout": 6.8,
    "city_fog": 12.0,
    "cut_in_at_15_m": 6.8,
    "emergency_brake_in_fog": 11.4,
    "frozen_camera": 11.8,
    "highway_99_corridor": 58.6,
    "motorcycle_at_dusk": 15.0,
    "patchy_fog": 35.4,
    "pedestrian_crossing_fog": 21.0,
    "radar_dropout": 8.0,
    "ramp_merge": 33.0,
    "sign_missing_and_moved": 4.0,
    "single_lane_behind_truck": 22.4,
    "standing_lead_in_a_bank": 79.0,
    "stopped_queue_behind_curve": 37.0,
    "tail_lamp_failure": 18.4,
    "traffic_lights": 13.6,
    "tunnel_exit_into_fog": 17.4,
    "unsignalised_crossing": 14.6,
}
"""Time of the picture of a scenario whose telling moment is another [s]."""

LOOPS = {
    "camera_blackout", "cut_in_at_15_m", "emergency_brake_in_fog", "motorcycle_at_dusk", "pedestrian_crossing_fog",
    "ramp_merge", "stopped_queue_behind_curve", "tail_lamp_failure", "tunnel_exit_into_fog", "unsignalised_crossing",
}  # fmt: skip
AROUND = 2.5
"""Time before and after its moment that a moving picture shows [s]."""

READOUTS = {"frozen_camera", "radar_dropout"}
FRAME, READOUT = (0, 0, 640, 480), (640, 113, 1024, 233)
"""The camera's frame and the visibilities in a frame of a run's video [px]."""

BEGIN, END = "<!-- table: gallery -->", "<!-- end of table -->"


def telling_frames(name: str) -> list[Image.Image]:
    """Frame of a scenario at its most telling moment, or those about it."""
    scenario = fogsim.load_scenario(name)
    if scenario.renderer == "none":
        scenario = fogsim.load_scenario(name, ["renderer=auto", "estimators=[joint_road]"])
    around, moment = (AROUND if name in LOOPS else 0.0), MOMENTS.get(name)
    steps: list[Step] = []
    panel, drawn = FramePanel(), None
    for step in fogsim.run(scenario, seed=0):
        steps.append(step)
        if name in READOUTS:
            drawn = panel.draw(step, step_metrics(step))
        if moment is None and (step.begun or step.collisions):
            moment = step.time + (0.0 if step.collisions else 1.0)
        if moment is not None and step.time >= moment + around:
            break
    if drawn is not None:
        return [_with_readout(Image.fromarray(drawn))]
    if moment is None:
        moment = min(steps[1:], key=lambda one: (one.time < 1.0, one.truth.visibility_ahead)).time
    shown = [one for one in steps if abs(one.time - moment) <= around] or [steps[-1]]
    return [scale_image(shown_image(one.observation), *SIZE).convert("RGB") for one in shown]


def _with_readout(panel: Image.Image) -> Image.Image:
    """Camera frame above the visibilities that the methods read."""
    parts = [panel.crop(box) for box in (FRAME, READOUT)]
    parts = [one.resize((SIZE[0], round(one.height * SIZE[0] / one.width)), Image.Resampling.LANCZOS) for one in parts]
    image = Image.new("RGB", (SIZE[0], sum(one.height for one in parts)))
    image.paste(parts[0])
    image.paste(parts[1], (0, parts[0].height))
    return image


def picture_of(name: str) -> Path:
    """File of the picture of a scenario."""
    return PICTURES / f"{name}.{'webp' if name in LOOPS else 'jpg'}"


def draw(name: str) -> None:
    """Draw the picture of a scenario."""
    first, *others = telling_frames(name)
    duration = 2e3 * AROUND / max(len(others), 1)
    more = {"save_all": True, "append_images": others, "duration": round(duration), "loop": 0}
    first.save(picture_of(name), quality=60 if others else 80, **(more if others else {}))


def table() -> str:
    """The gallery's table: pictures, names and what they are about."""
    rows = ["| | scenario |", "|---|---|"]
    for name in fogsim.catalogue():
        scenario = fogsim.load_scenario(name)
        file = picture_of(name)
        picture = f"![{name}](pictures/gallery/{file.name})" if file.is_file() else ""
        title = f"**[{name}](../scenarios/{name}/README.md)**{' (test)' if scenario.expect else ''}"
        rows.append(f"| {picture} | {title}: {' '.join(scenario.description.split())} |")
    return "\n".join(rows)


def page() -> str:
    """The gallery with the table of today."""
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    return f"{before}{BEGIN}\n\n{table()}\n\n{END}{rest.partition(END)[2]}"


def main() -> None:
    """Draw and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="scenarios to draw; all by default")
    parser.add_argument("--table", action="store_true", help="write the table alone")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    PICTURES.mkdir(exist_ok=True)
    for name in () if arguments.table else arguments.names or fogsim.catalogue():
        draw(name)
        sys.stdout.write(f"{picture_of(name).name}: {picture_of(name).stat().st_size / 1e6:.2f} MB\n")
    PAGE.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
