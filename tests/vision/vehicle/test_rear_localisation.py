import numpy as np
import pytest

from fogsim.values import Camera
from fogsim.vision.vehicle.rear_localisation import localise_rear, search_window

CAMERA = Camera(640, 480, 600.0, (319.5, 239.5), 1.4, np.radians(2.0))


def road(depth, rear, visibility, noise, seed, aside=0.0, light=0.1, camera=CAMERA):
    """Luminance of a foggy road with a rear of a width [m], grain and lane marks; and the rear's sides."""
    rng = np.random.default_rng(seed)
    v, u = np.mgrid[: camera.height, : camera.width].astype(float)
    below = v - camera.horizon_row
    ground = np.where(below > 0.2, camera.row_distance / np.maximum(below, 0.2), 1e4)
    x = (u - camera.principal_point[0]) * ground / camera.focal_length
    shade = np.where(np.abs(np.abs(x) - 1.75) < 0.1, 0.7, 0.3 + 0.02 * rng.normal(size=v.shape))
    scale = camera.focal_length / depth
    foot = camera.horizon_row + camera.row_distance / depth
    middle = camera.principal_point[0] + aside * scale
    left, right = middle - 0.5 * rear * scale, middle + 0.5 * rear * scale
    # Shares of a column's pixels, so that sides lie between them.
    inside = np.clip(np.minimum(u + 0.5, right) - np.maximum(u - 0.5, left), 0, 1)
    inside *= np.clip(np.minimum(v + 0.5, foot) - np.maximum(v - 0.5, foot - 1.5 * scale), 0, 1)
    k = np.log(20.0) / visibility
    far, near = np.exp(-k * np.minimum(ground, 1e5)), np.exp(-k * depth)
    behind = shade * far + 1.0 - far
    image = 200.0 * (inside * (light * near + 1.0 - near) + (1.0 - inside) * behind)
    return (image + rng.normal(0.0, noise, v.shape)).astype(np.float32), left, right


def found(image, depth, noise=1.0, camera=CAMERA):
    rows, cols = search_window(camera, depth)
    return localise_rear(image[rows, cols], (cols.start, rows.start), camera, depth, noise)


@pytest.mark.parametrize(
    ("rear", "depth", "visibility"),
    [
        (0.65, 12, 30),
        (0.9, 12, 300),
        (1.6, 25, 60),
        (1.9, 50, 60),
        (2.5, 50, 300),
        (1.6, 80, 120),
        (0.65, 80, 300),
        (2.5, 12, 30),
    ],
)
def test_rears_from_motorcycles_to_lorries_are_found_within_a_pixel(rear, depth, visibility):
    image, left, right = road(depth, rear, visibility, 1.0, 1, aside=0.4)
    window = found(image, depth + 0.3)
    assert window is not None
    assert window.column == pytest.approx(0.5 * (left + right), abs=1.0)
    assert window.width == pytest.approx(right - left, abs=2.0)


@pytest.mark.parametrize("light", [0.05, 0.9])
def test_dark_and_light_vehicles_are_found(light):
    image, left, right = road(30.0, 1.8, 200.0, 1.0, 2, light=light)
    window = found(image, 30.0)
    assert window is not None
    assert window.column == pytest.approx(0.5 * (left + right), abs=1.0)


@pytest.mark.parametrize("visibility", [50.0, 200.0, 1000.0])
def test_empty_roads_hold_no_vehicle(visibility):
    wrong = 0
    for seed, depth in enumerate((15.0, 25.0, 40.0, 60.0, 90.0)):
        image, _, _ = road(depth, 0.0, visibility, 1.0, seed)
        wrong += found(image, depth) is not None
    assert wrong <= 1


def test_what_fog_hides_is_not_found_and_regions_lie_in_the_image():
    image, _, _ = road(90.0, 1.8, 30.0, 1.0, 3)
    assert found(image, 90.0) is None
    rows, cols = search_window(CAMERA, 20.0)
    assert 0 <= rows.start < rows.stop <= CAMERA.height
    assert 0 <= cols.start < cols.stop <= CAMERA.width
    assert search_window(CAMERA, 2.0) is None
    assert search_window(CAMERA, 2000.0) is None
