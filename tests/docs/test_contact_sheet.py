"""The pictures on the page about frames are what both renderers draw today."""

import dataclasses
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from PIL import Image

from fogsim.errors import MissingDependencyError
from fogsim.render import gl_report
from fogsim.values import Lamp

pytestmark = pytest.mark.nightly

DOCS = Path(__file__).resolve().parents[2] / "docs"
TOLERANCE = 2.0
"""Difference that JPEG and another computer's rounding may make [levels of 255]."""

TITLES = (
    "day, clear",
    "day, V_met 50 m",
    "junction of a town, clear",
    "night, V_met 100 m, high beam",
    "street lamps, V_met 100 m",
)


@pytest.fixture(scope="module")
def sheets() -> Iterator[ModuleType]:
    """docs/contact_sheet.py, which is a script and no package."""
    sys.path.insert(0, str(DOCS))
    yield import_module("contact_sheet")
    sys.path.remove(str(DOCS))


def kept(sheets: ModuleType, renderer: str) -> dict[str, np.ndarray]:
    """Pictures of the kept sheet by their titles."""
    with Image.open(DOCS / "pictures" / f"contact_sheet_{renderer}.jpg") as opened:
        whole = np.asarray(opened.convert("RGB"))
    width, height = sheets.SIZE
    pictures = {}
    for number, shot in enumerate(sheets.SHOTS):
        left, top = import_module("staging").corner(number, sheets.COLUMNS, sheets.SIZE)
        pictures[shot.title] = whole[top : top + height, left : left + width]
    return pictures


def difference(one: np.ndarray, other: np.ndarray) -> float:
    """Mean absolute difference in that sixty-fourth of two pictures where it is largest.

    It is taken of means over 5 × 5 pixels, in which little is left of the noise that JPEG does not keep.
    """
    rows, columns = (side // 5 for side in one.shape[:2])
    means = [picture.reshape(rows, 5, columns, 5, 3).mean(axis=(1, 3)) for picture in (one, other)]
    return float(np.abs(means[0] - means[1]).reshape(8, rows // 8, 8, columns // 8, 3).mean(axis=(1, 3, 4)).max())


@pytest.mark.parametrize("renderer", ["cpu", "opengl"])
@pytest.mark.parametrize("title", TITLES)
def test_kept_pictures_are_those_drawn_today(sheets: ModuleType, renderer: str, title: str) -> None:
    if renderer == "opengl":
        try:
            gl_report()
        except MissingDependencyError as error:
            pytest.skip(str(error))
    (shot,) = (one for one in sheets.SHOTS if one.title == title)
    drawn, known = sheets.tile(shot, renderer), kept(sheets, renderer)
    assert difference(drawn, known.pop(title)) < TOLERANCE


@pytest.mark.parametrize(
    ("title", "change"),
    [
        ("day, clear", {"vehicles": ()}),
        ("day, V_met 50 m", {"settings": ("fog={visibility_m: 55}",)}),
        ("junction of a town, clear", {"station": 79.0}),
        ("night, V_met 100 m, high beam", {"lamps": Lamp.POSITION | Lamp.LOW_BEAM}),
        ("street lamps, V_met 100 m", {"settings": ("light.illuminance_lx=0.05", "fog={visibility_m: 100}")}),
    ],
)
def test_other_pictures_do_not_pass(sheets: ModuleType, title: str, change: dict[str, Any]) -> None:
    (shot,) = (one for one in sheets.SHOTS if one.title == title)
    drawn = sheets.tile(dataclasses.replace(shot, **change), "cpu")
    assert difference(drawn, kept(sheets, "cpu")[title]) > TOLERANCE
