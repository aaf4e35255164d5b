"""Draw the pictures of docs/gallery.md and write its table: ``python docs/make_gallery.py [NAME …] [--table]``.

Each shipped scenario runs once (its first case), and its frame at the most telling moment is kept: the one that MOMENTS
has, otherwise a second after the first thing that its script does, at its first collision, or where the least is seen.
Without names all are drawn (some minutes); ``--table`` writes the table alone.
"""

import argparse
import sys
import warnings
from pathlib import Path

from PIL import Image

import fogsim
from fogsim.recorders.panel.camera_picture import scale_image, shown_image

HERE = Path(__file__).parent
PICTURES = HERE / "pictures" / "gallery"
PAGE = HERE / "gallery.md"
SIZE = (320, 240)
MOMENTS: dict[str, float] = {
    "camera_blackout": 6.8,
    "city_fog": 12.0,
    "cut_in_at_15_m": 6.8,
    "emergency_brake_in_fog": 9.4,
    "highway_99_corridor": 41.0,
    "motorcycle_at_dusk": 15.0,
    "patchy_fog": 35.4,
    "pedestrian_crossing_fog": 21.0,
    "ramp_merge": 33.0,
    "sign_missing_and_moved": 4.0,
    "single_lane_behind_truck": 22.4,
    "stopped_queue_behind_curve": 37.0,
    "tail_lamp_failure": 18.4,
    "tunnel_exit_into_fog": 17.0,
}
"""Time of the picture of a scenario whose telling moment is another [s]."""

BEGIN, END = "<!-- table: gallery -->", "<!-- end of table -->"


def telling_frame(name: str) -> Image.Image:
    """Frame of a scenario at its most telling moment."""
    scenario, best = fogsim.load_scenario(name), None
    if scenario.renderer == "none":
        scenario = fogsim.load_scenario(name, ["renderer=auto", "estimators=[joint_road]"])
    wanted, least = MOMENTS.get(name), float("inf")
    begun: float | None = None
    for step in fogsim.run(scenario, seed=0):
        if begun is None and (step.begun or step.collisions):
            begun = step.time + (0.0 if step.collisions else 1.0)
        moment = begun if wanted is None else wanted
        if moment is not None:
            best = step
            if step.time >= moment:
                break
        elif step.time >= 1.0 and step.truth.visibility_ahead < least:
            best, least = step, step.truth.visibility_ahead
        elif best is None:
            best = step
    return scale_image(shown_image(best.observation), *SIZE)


def table() -> str:
    """The gallery's table: pictures, names and what they are about."""
    rows = ["| | scenario |", "|---|---|"]
    for name in fogsim.catalogue():
        scenario = fogsim.load_scenario(name)
        picture = f"![{name}](pictures/gallery/{name}.jpg)" if (PICTURES / f"{name}.jpg").is_file() else ""
        expected = ", ".join(f"`{one}`" for one in scenario.expect)
        told = f"**[{name}](../scenarios/{name}/README.md)**: {' '.join(scenario.description.split())}"
        rows.append(f"| {picture} | {told}{f' Expects {expected}.' if expected else ''} |")
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
        picture = telling_frame(name)
        picture.convert("RGB").save(PICTURES / f"{name}.jpg", quality=80)
        sys.stdout.write(f"{name}: {picture.width} × {picture.height}\n")
    PAGE.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
