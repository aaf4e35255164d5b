"""A mirrored picture of a mirrored camera gives the same extinction, to 1e-6.

The standard deviation, too.

Pictures of three renderers, with obstacles and woods on one side, roll, cameras whose principal point lies aside.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from country import draw as draw_country
from country import random_country
from flat_road import Road, photograph, scan
from windscreen import draw, small_scenes

from fogsim.estimators import make
from fogsim.values import Camera, Estimate, Frame, LeadMeasurement, Observation, Response
from tests.estimators.test_metamorphic import METHODS

RANGES = (14.0, 18.0, 22.0, 26.0, 30.0, 35.0, 40.0)
DRIVEN = Camera(400, 300, 360.0, (190.5, 149.5), 1.38, np.radians(2.0), np.radians(-3.0))


def pictures() -> Iterator[tuple[str, np.ndarray, Camera]]:
    """Pictures and told cameras; those whose mirrored form was read differently once are among them."""
    for seed in (300, 305, 308, 311, 315):
        scene, told = random_country(seed)
        yield f"country {seed}", draw_country(scene, seed, over=1), told
    for seed, scene, told in islice(small_scenes(5000), 8):
        yield f"windscreen {seed}", draw(scene, seed, over=1), told
    for seed in (1, 2, 6, 9):
        rng = np.random.default_rng(seed)
        point = (239.5 + (rng.uniform(-20.0, 20.0) if seed % 2 else 0.0), 179.5)
        roll = float(np.radians(rng.uniform(-4.0, 4.0))) if seed % 3 == 0 else 0.0
        response = (Response.LINEAR, Response.SRGB)[seed % 2]
        camera = Camera(480, 360, 433.0, point, 1.38, float(np.radians(rng.uniform(0.5, 4.0))), roll, response)
        road = Road(camera=camera, visibility=float(np.exp(rng.uniform(3.4, 6.2))), verge=seed % 4 == 1)
        yield f"flat {seed}", photograph(road, scan(road, seed, 1), seed), camera


@pytest.fixture(scope="module")
def drawn() -> list[tuple[str, np.ndarray, Camera]]:
    return list(pictures())


def mirrored(camera: Camera) -> Camera:
    u0, v0 = camera.principal_point
    return replace(camera, principal_point=(camera.width - 1 - u0, v0), roll=-camera.roll)


def same(found: Estimate, other: Estimate) -> bool:
    alike = found.extinction == pytest.approx(other.extinction, rel=1e-6)
    sure = found.standard_deviation == pytest.approx(other.standard_deviation, rel=1e-6)
    return found.valid == other.valid and alike and sure


@pytest.mark.parametrize("method", [name for name in METHODS if "lead" not in name])
def test_a_mirrored_picture_of_a_mirrored_camera_says_the_same(drawn, method: str) -> None:
    different, valid = [], 0
    for name, image, camera in drawn:
        found = make(method, camera).update(Observation(image))
        other = make(method, mirrored(camera)).update(Observation(np.ascontiguousarray(image[:, ::-1])))
        valid += found.valid
        if not same(found, other):
            different.append((name, found.extinction, other.extinction))
    assert different == []
    assert valid > 0.5 * len(drawn)


@pytest.fixture(scope="module")
def drive() -> list[tuple[np.ndarray, LeadMeasurement]]:
    """Images behind a vehicle whose range is told."""
    roads = [Road(camera=DRIVEN, lead_distance=distance + 1.7, verge=True) for distance in RANGES]
    images = [photograph(road, scan(road, index, 1), index) for index, road in enumerate(roads)]
    return [(image, LeadMeasurement(distance, 10.0)) for image, distance in zip(images, RANGES, strict=True)]


def last_of_both(method: str, drive: list[tuple[np.ndarray, LeadMeasurement]]) -> tuple[Estimate, Estimate]:
    """What is said at the end of a drive and of the mirrored one."""
    one, two = make(method, DRIVEN), make(method, mirrored(DRIVEN))
    for index, (image, lead) in enumerate(drive):
        found = one.update(Observation(Frame(0.4 * index, image, DRIVEN), 25.0, lead))
        other = two.update(Observation(Frame(0.4 * index, image[:, ::-1].copy(), mirrored(DRIVEN)), 25.0, lead))
    return found, other


@pytest.mark.parametrize("method", METHODS)
def test_a_mirrored_drive_says_the_same(drive, method: str) -> None:
    found, other = last_of_both(method, drive)
    assert found.valid
    assert same(found, other), (found, other)


def test_a_mirrored_vehicle_that_stays_in_sight_bounds_the_fog_alike(drive) -> None:
    found, other = last_of_both("gabb2014", drive)
    assert found.bounds is not None
    assert other.bounds is not None
    assert 0.0 < found.bounds.most < np.inf
    assert other.bounds.most == pytest.approx(found.bounds.most, rel=1e-6)
