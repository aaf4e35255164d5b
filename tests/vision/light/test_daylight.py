"""Whether lamps light the road: by night always said, by day never."""

from collections import Counter
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from country import draw as draw_country
from country import random_country
from flat_road import Road, photograph, scan
from windscreen import draw, small_scenes

import fogsim
from fogsim.estimators import ESTIMATORS, make
from fogsim.offline import NIGHT_METHODS
from fogsim.values import Camera, LeadMeasurement, Observation, Step
from fogsim.vision.light.daylight import lit_by_lamps
from fogsim.vision.lines.horizon import levelled

SMALL = ("camera.width=320", "camera.height=240", "clocks.camera_period_s=4", "clocks.decision_period_s=4")
CAMERA = Camera(320, 240, 288.0, (159.5, 119.5), 1.38, np.radians(2.0))


def drive(*settings: str) -> list[Step]:
    """The night scenario in frames 4 s apart, with every method of the day."""
    methods = ", ".join(f"{{method: {name}}}" for name in sorted(set(ESTIMATORS) - set(NIGHT_METHODS)))
    scenario = fogsim.load_scenario("night_motorway_fog", [*SMALL, f"estimators=[{methods}]", *settings])
    return list(fogsim.run(scenario, seed=1))


def test_by_night_every_daytime_method_says_that_it_cannot_tell() -> None:
    """Glow of oncoming lamps along the horizon and the lit lane below it look like an airlight and its inflection."""
    steps = drive("duration_s=12")
    reasons: Counter[str] = Counter()
    for step in steps:
        assert not any(estimate.valid for estimate in step.estimates)
        reasons.update(str(estimate.diagnostics["reason"]) for estimate in step.estimates)
    # Lamps show in every frame; in most methods other reasons come before them, as a sky that is too dark.
    assert all("lamps" in lit_by_lamps(step.observation.image, step.observation.frame.camera) for step in steps)
    assert sum(n for reason, n in reasons.items() if "lamps" in reason) > 0
    # Nothing was measured, so nothing is believed beyond what was before.
    assert steps[-1].belief.visibility == pytest.approx(steps[0].belief.visibility)


@pytest.mark.parametrize("light", ["street_lamps=true", "light.illuminance_lx=1"])
def test_a_road_that_lamps_light_is_told(light: str) -> None:
    for step in drive("duration_s=4", "fog.visibility_m=100", "estimators=[negru2013]", light):
        assert "lamps" in lit_by_lamps(step.observation.image, step.observation.frame.camera)


@pytest.mark.parametrize(
    ("asphalt", "visibility"), [(10.0, 8.0), (60.0, 25.0), (190.0, 100.0), (10.0, 1000.0), (190.0, 1000.0)]
)
def test_by_day_no_road_is_taken_for_one_that_lamps_light(visibility: float, asphalt: float) -> None:
    """Black or nearly as bright as the sky, and in whatever fog."""
    road = Road(camera=CAMERA, visibility=visibility, asphalt=asphalt, terrain=20.0)
    assert not lit_by_lamps(photograph(road, scan(road, 0, 2), 0), CAMERA)


def test_by_day_neither_woods_nor_lenses_nor_bonnets_are_taken_for_lamps() -> None:
    pictures = [(draw(scene, seed, over=1), told) for seed, scene, told in islice(small_scenes(5000), 5)]
    country = [(seed, *random_country(seed)) for seed in range(300, 305)]
    pictures += [(draw_country(scene, seed, over=1), told) for seed, scene, told in country]
    assert [index for index, (image, told) in enumerate(pictures) if lit_by_lamps(levelled(image, told), told)] == []


def test_a_lit_lane_below_a_glow_is_told_and_a_mirrored_one_too() -> None:
    """Pictures that FogSim did not draw: a beam on the road, its sides dark, and a bright haze along the horizon."""
    row, col = np.indices((240, 320))
    below = row - CAMERA.horizon_row
    beam = 120.0 * np.exp(-0.5 * ((col - 159.5) / (0.6 * np.maximum(below, 1.0) + 20.0)) ** 2)
    glow = 250.0 * np.exp(-np.hypot(below, 0.3 * (col - 120.0)) / 14.0) + 8.0
    image = np.clip(np.where(below > 0, beam + 3.0, glow), 0, 255).astype(np.uint8)
    mirrored = replace(CAMERA, principal_point=(319.0 - 159.5, 119.5))
    assert lit_by_lamps(image, CAMERA) == lit_by_lamps(image[:, ::-1], mirrored) != ""
    for method in ("negru2013", "joint_road", "zhu2015", "huang2015_rough"):
        assert not make(method, CAMERA).update(Observation(image)).valid


@pytest.mark.parametrize("height", [20, 40, 239])
def test_an_image_that_shows_little_of_sky_or_road_is_no_trouble(height: int) -> None:
    camera = replace(CAMERA, height=height, principal_point=(159.5, 2.0), pitch=0.0)
    assert lit_by_lamps(np.full((height, 320), 90, np.uint8), camera) == ""


def test_under_a_ceiling_that_is_darker_than_the_road_there_is_no_daylight() -> None:
    """As in a tunnel: bright walls reach up to the height of the sky, and lamps shine under the ceiling.

    The dark rear of a truck right ahead is no ceiling.
    """
    picture = np.full((240, 320, 3), 190, np.uint8)
    picture[130:] = 110
    open_air, truck = picture.copy(), picture.copy()
    picture[:110, 130:190] = 50
    picture[40:44, 150:170] = 255
    assert "lamps" in lit_by_lamps(picture, CAMERA)
    assert "lamps" in lit_by_lamps(picture, CAMERA, LeadMeasurement(60.0, 0.0))
    assert not lit_by_lamps(open_air, CAMERA)
    truck[:120, 110:210] = 50
    assert not lit_by_lamps(truck, CAMERA, LeadMeasurement(6.0, 0.0))


def test_fog_seen_out_of_a_tunnel_is_not_read() -> None:
    """Walls and road inside are hardly lit; bands on both sides of a picture leave its road as it is."""
    road = Road(camera=CAMERA, visibility=100.0, asphalt=90.0)
    image = photograph(road, scan(road, 0, 2), 0)
    inside, bands = np.minimum(image, 6), image.copy()
    inside[70:126, 110:210] = image[70:126, 110:210]
    bands[:, :60] = bands[:, 260:] = 0
    assert "as a tunnel does" in lit_by_lamps(inside, CAMERA)
    for method in ("negru2013", "joint_road", "zhu2015", "huang2015_rough"):
        assert not make(method, CAMERA).update(Observation(inside)).valid
    assert not lit_by_lamps(bands, CAMERA)


@pytest.mark.parametrize("left", [0, 110, 60])
def test_a_mirror_or_visor_before_the_sky_is_no_ceiling(left: int) -> None:
    """Sky shows below them, over the lane and to its sides; where they hide it all, the reason says so."""
    road = Road(camera=CAMERA, visibility=100.0, asphalt=90.0)
    image, clear = photograph(road, scan(road, 0, 2), 0).copy(), photograph(road, scan(road, 0, 2), 0)
    image[:80, left : 320 - left] = 25
    assert not lit_by_lamps(image, CAMERA)
    found, expected = (make("joint_road", CAMERA).update(Observation(one)) for one in (image, clear))
    assert found.visibility == pytest.approx(expected.visibility, rel=0.1)
    image[:110, left : 320 - left] = 25
    assert "something hides the sky" in lit_by_lamps(image, CAMERA)
