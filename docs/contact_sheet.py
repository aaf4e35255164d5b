"""Draw contact_sheet_cpu.jpg, contact_sheet_opengl.jpg and antialiasing.png of docs/pictures (takes a minute).

The same pictures by both renderers. tests/docs/test_contact_sheet.py draws some of them again and compares.
"""

import dataclasses
import math

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from staging import LIT, PICTURES, Board, Shot, Vehicle, magnified, photograph, sheet

from fogsim.scenario import build
from fogsim.values import Lamp

SIZE = (480, 360)
COLUMNS = 4
NIGHT = "light.illuminance_lx=0.05"
HIGH = Lamp.POSITION | Lamp.HIGH_BEAM
BRAKING = LIT | Lamp.STOP
OTHERS = (
    Vehicle("car", 28.0, 0.0, BRAKING),
    Vehicle("van", 45.0, 3.75),
    Vehicle("truck", 60.0, -3.75),
    Vehicle("car", 95.0, 0.0),
    Vehicle("bus", 130.0, -3.75),
    Vehicle("car", 70.0, 11.5, oncoming=True),
    Vehicle("truck", 110.0, 15.25, oncoming=True),
)
TOWNSFOLK = (Vehicle("car", 22.0, 0.0, BRAKING), Vehicle("van", 34.0, 6.4, oncoming=True), Vehicle("car", 60.0, 0.0))
BOARDS = (Board("speed_limit", 62.0, value=100.0), Board("fog_warning", 38.0, diameter=1.2))


def fog(visibility: str) -> str:
    """Setting of homogeneous fog."""
    return f"fog={{visibility_m: {visibility}}}"


def sign(distance: float) -> Shot:
    """Three signs at one distance."""
    boards = (
        Board("speed_limit", distance, -8.0, 80.0),
        Board("curve_right", distance, -9.3, diameter=1.2),
        Board("stop", distance, -6.7),
    )
    return Shot(f"signs at {distance:g} m, V_met 400 m", (fog("400"),), boards=boards)


SHOTS = (
    Shot("day, clear", (), vehicles=OTHERS, boards=BOARDS),
    Shot("day, V_met 200 m", (fog("200"),), vehicles=OTHERS, boards=BOARDS),
    Shot("day, V_met 100 m", (fog("100"),), vehicles=OTHERS, boards=BOARDS),
    Shot("day, V_met 50 m", (fog("50"),), vehicles=OTHERS, boards=BOARDS),
    Shot(
        "curve, V_met 1000 m",
        (fog("1000"),),
        "bend",
        92.0,
        (Vehicle("car", 30.0), Vehicle("truck", 60.0, 3.5, oncoming=True)),
    ),
    Shot("junction of a town, clear", (), "town", 78.0, TOWNSFOLK),
    Shot("truck 12 m ahead, V_met 100 m", (fog("100"),), vehicles=(Vehicle("truck", 12.0),)),
    sign(30.0),
    sign(60.0),
    sign(120.0),
    Shot("night, clear, low beam", (NIGHT,), vehicles=OTHERS, boards=BOARDS),
    Shot("night, clear, high beam", (NIGHT,), vehicles=OTHERS, boards=BOARDS, lamps=HIGH),
    Shot("night, V_met 100 m, low beam", (NIGHT, fog("100")), vehicles=OTHERS, boards=BOARDS),
    Shot("night, V_met 100 m, high beam", (NIGHT, fog("100")), vehicles=OTHERS, boards=BOARDS, lamps=HIGH),
    Shot("street lamps, clear", (NIGHT, "street_lamps=true"), "town", 20.0, TOWNSFOLK),
    Shot("street lamps, V_met 100 m", (NIGHT, "street_lamps=true", fog("100")), "town", 20.0, TOWNSFOLK),
)


def tile(shot: Shot, renderer: str) -> NDArray[np.uint8]:
    """Picture of a shot; signs, which are small, are shown a second time."""
    taken = photograph(shot, renderer, SIZE)
    if not shot.title.startswith("signs"):
        return taken.image
    stop = shot.boards[1]
    camera = build.camera_config(taken.scenario).on()
    depth = stop.ahead + build.camera_config(taken.scenario).mount().setback
    u = round(camera.principal_point[0] - camera.focal_length * shot.boards[0].left / depth)
    v = round(camera.principal_point[1] - camera.focal_length * (math.tan(camera.pitch) + (2.4 - 1.38) / depth))
    across = max(12, 2 * round(0.5 * camera.focal_length * 5.0 / depth))
    return magnified(taken.image, (u, v), (across, across // 2), 228 // across, (6, 6))


def contact_sheet(renderer: str) -> Image.Image:
    """All pictures by one renderer."""
    return sheet([(shot.title, tile(shot, renderer)) for shot in SHOTS], COLUMNS)


def antialiasing() -> Image.Image:
    """The middle of a picture with 1, 2 and 3 samples a pixel side, pixel by pixel."""
    shot = Shot("", (fog("400"),), vehicles=OTHERS, boards=BOARDS)
    pictures = []
    for side in (1, 2, 3):
        sampled = dataclasses.replace(shot, settings=(*shot.settings, f"camera.samples={side}"))
        part = photograph(sampled, "cpu", SIZE).image[130:200, 150:310]
        pictures.append((f"camera.samples: {side}", np.kron(part, np.ones((4, 4, 1), np.uint8))))
    return sheet(pictures, 3)


def main() -> None:
    """Draw and save."""
    for renderer in ("cpu", "opengl"):
        contact_sheet(renderer).save(PICTURES / f"contact_sheet_{renderer}.jpg", quality=88, subsampling=0)
    antialiasing().save(PICTURES / "antialiasing.png")


if __name__ == "__main__":
    main()
