import numpy as np
import pytest

from fogsim.estimators import make
from fogsim.values import Observation
from fogsim.vision.light.luminance import linear_pixels
from fogsim.vision.lines.horizon import Horizon
from fogsim.vision.strips.joint_fit import fit_own
from fogsim.vision.strips.shade import divided_road, is_sure, shade_levels
from fogsim.vision.strips.strip_curves import strip_curves
from tests.vision.strips.koschmieder_strips import AIRLIGHT, CAMERA, GEOMETRY, PRIOR, curves

ROWS, COLS = np.indices((480, 640))
BELOW = np.maximum(ROWS - CAMERA.horizon_row, 1e-3)
AHEAD = CAMERA.row_distance / BELOW
ACROSS = (COLS - 319.5) * AHEAD / CAMERA.focal_length
EDGES = {
    "aside": ACROSS + 0.5 * np.sin(AHEAD / 4.0) > 0.3,
    "aslant": np.abs(AHEAD - 25.0 - 2.0 * ACROSS) < 8.0,
    "crowns": np.sin(AHEAD / 3.0) + np.sin(ACROSS / 1.2) > 0.5,
}
TOLD = Horizon(CAMERA.horizon_row, 1.0)


def picture(extinction, luminance, noise=1.0):
    """A picture of a road of some luminance without fog below a sky of the airlight's."""
    light = AIRLIGHT + (luminance - AIRLIGHT) * np.exp(-extinction * np.hypot(AHEAD, ACROSS))
    light = np.where(CAMERA.horizon_row < ROWS, light, AIRLIGHT)
    return np.clip(np.rint(light + np.random.default_rng(1).normal(0.0, noise, light.shape)), 0, 255).astype(np.uint8)


def levels_on(image):
    pixels = linear_pixels(image, CAMERA)
    return shade_levels(pixels, strip_curves(pixels, GEOMETRY, 1.0, CAMERA), GEOMETRY, PRIOR, 1.0)


@pytest.mark.parametrize(("edge", "visibility"), [*zip(EDGES, (60.0, 150.0, 300.0), strict=False)])
def test_fog_before_a_road_in_sun_and_shade_is_that_before_either(edge, visibility):
    truth = np.log(20.0) / visibility
    image = picture(truth, np.where(EDGES[edge], 30.0, 110.0))
    pixels = linear_pixels(image, CAMERA)
    levels = levels_on(image)
    assert (levels.lit, levels.shaded) == pytest.approx((110.0, 30.0), abs=12.0)
    assert levels.extinction == pytest.approx(truth, rel=0.15)
    seen = strip_curves(pixels, GEOMETRY, 1.0, CAMERA)
    road = divided_road(pixels, seen, GEOMETRY, CAMERA, (PRIOR,), TOLD, 1.0, np.inf)
    assert road.fit.extinction == pytest.approx(truth, rel=0.06)
    assert road.geometry.path.shape == road.curves.luminance.shape == road.fit.used.shape
    found = make("joint_road", CAMERA).update(Observation(image))
    assert found.extinction == pytest.approx(truth, rel=0.06)


@pytest.mark.parametrize("visibility", [60.0, 200.0])
def test_neither_texture_nor_repairs_nor_a_bank_are_shade(visibility):
    k, rng = np.log(20.0) / visibility, np.random.default_rng(2)
    assert levels_on(picture(k, 60.0 * rng.normal(1.0, 0.15, ROWS.shape))) is None
    assert levels_on(picture(k, np.where(EDGES["aslant"], 45.0, 60.0))) is None
    assert levels_on(picture(k * np.where(AHEAD > 30.0, 4.0 - 90.0 / AHEAD, 1.0), 60.0)) is None


def test_a_road_that_its_fit_explains_needs_no_shade():
    seen = curves(0.03)
    assert is_sure(fit_own(seen, GEOMETRY, (PRIOR,)), seen)
    assert not is_sure(None, seen)
