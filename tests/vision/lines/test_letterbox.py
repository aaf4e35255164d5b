"""Black bands above and below a picture."""

from dataclasses import replace

import numpy as np
import pytest
from flat_road import Road, photograph, scan
from numpy.typing import NDArray

from fogsim.estimators import make
from fogsim.values import Camera, Observation
from fogsim.vision.lines.letterbox import without_letterbox

CAMERA = Camera(320, 240, 288.0, (159.5, 119.5), 1.38, np.radians(2.0))
ROAD = Road(camera=CAMERA, visibility=120.0)
WHOLE: NDArray[np.uint8] = photograph(ROAD, scan(ROAD, 0, 2), 0)


def boxed(top: int, bottom: int, black: int = 0) -> NDArray[np.uint8]:
    image = WHOLE.copy()
    image[:top], image[240 - bottom :] = black, black
    return image


@pytest.mark.parametrize("method", ["joint_road", "zhu2015", "negru2013", "huang2015_rough"])
@pytest.mark.parametrize(("top", "bottom", "black"), [(80, 0, 0), (80, 40, 16)])
def test_a_band_changes_no_estimate(method: str, top: int, bottom: int, black: int) -> None:
    found, expected = (make(method, CAMERA).update(Observation(image)) for image in (boxed(top, bottom, black), WHOLE))
    assert expected.valid
    assert found.visibility == pytest.approx(expected.visibility, rel=0.1)


def test_sky_goes_on_above_a_picture_and_lanes_below_it() -> None:
    """Though a line of text is written on the band."""
    image = boxed(60, 60)
    image[20:30, 30:100] = 255
    filled = without_letterbox(image, CAMERA)
    np.testing.assert_array_equal(filled[:60], np.broadcast_to(filled[60], (60, *filled.shape[1:])))
    np.testing.assert_array_equal(filled[61:178], WHOLE[61:178])
    whole = np.asarray(WHOLE[200:], float)
    # The dashed line to the right of the lane is where it was, or a gap of it.
    assert np.abs(np.median(filled[200:], axis=1) - np.median(whole, axis=1)).max() < 15
    assert image[0].max() == 0


def test_neither_night_nor_dark_things_at_the_horizon_nor_bonnets_are_bands() -> None:
    night = np.where(np.arange(240)[:, None] > 100, 2 * (np.arange(240)[:, None] - 100), 0) * np.ones((240, 320))
    for image in (WHOLE, boxed(0, 60), boxed(108, 0), boxed(240, 0), night.astype(np.uint8)):
        assert without_letterbox(image, CAMERA) is image


def test_bands_of_deep_and_grey_images_are_found_too() -> None:
    deep = replace(CAMERA, bits=12)
    image = (16 * boxed(60, 60).astype(np.int64)).astype(np.uint16)
    assert np.array_equal(without_letterbox(image, deep) // 16, without_letterbox(boxed(60, 60), CAMERA))
    colour = np.repeat(boxed(60, 60)[..., None], 3, axis=2)
    assert np.array_equal(without_letterbox(colour, CAMERA)[..., 1], without_letterbox(boxed(60, 60), CAMERA))
