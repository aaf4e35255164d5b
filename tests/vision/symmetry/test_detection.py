import math

import cv2
import numpy as np
import pytest

from fogsim.vision.symmetry.detection import (
    OUTLINES,
    Floats,
    SearchRegion,
    detect_signs,
    fitted,
    polygon_outline,
    support,
)
from fogsim.vision.symmetry.edge_kernels import NX, NY, X, Y

FINE = 8
CORNERS = {
    "disc": [(math.cos(0.1 * k), math.sin(0.1 * k)) for k in range(63)],
    "octagon": [(1.08 * math.cos((k + 0.5) * math.pi / 4), 1.08 * math.sin((k + 0.5) * math.pi / 4)) for k in range(8)],
    "square": [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)],
    "diamond": [(-1.0, 0.0), (0.0, -1.0), (1.0, 0.0), (0.0, 1.0)],
    "warning": [(0.0, -0.866), (1.0, 0.866), (-1.0, 0.866)],
    "yield": [(0.0, 0.866), (1.0, -0.866), (-1.0, -0.866)],
}


def picture(
    shape: str, u: float, v: float, radius: float, contrast: float = 40.0, noise: float = 1.0, ring: float = 0.8
) -> np.ndarray:
    """A sign darker than the sky with a brighter field in it, blurred: (120, 160) float32."""
    fine = np.full((120 * FINE, 160 * FINE), 200.0, np.float32)
    for size, level in ((1.0, contrast), (ring, 0.2 * contrast)):
        corners = [
            ((u + 0.5 + size * radius * x) * FINE, (v + 0.5 + size * radius * y) * FINE) for x, y in CORNERS[shape]
        ]
        cv2.fillPoly(fine, [np.round(np.array(corners) - 0.5).astype(np.int32)], 200.0 - level)
    drawn = cv2.GaussianBlur(cv2.resize(fine, (160, 120), interpolation=cv2.INTER_AREA), (0, 0), 0.6)
    drawn += np.random.default_rng(3).normal(0.0, noise, drawn.shape)
    return np.round(drawn).clip(0, 255).astype(np.float32)


@pytest.mark.parametrize(
    ("radius", "contrast", "shape"),
    [(5.0, 40.0, "disc"), (8.0, 8.0, "octagon"), (8.0, 8.0, "diamond"), (5.0, 40.0, "square"), (25.0, 40.0, "square")],
)
def test_middle_and_size_are_found_between_pixels(shape: str, radius: float, contrast: float) -> None:
    (found, *others) = detect_signs(picture(shape, 82.3, 57.6, radius, contrast), [SearchRegion(86, 54, 9, 9, radius)])
    assert not others
    assert math.dist((found.u, found.v), (82.3, 57.6)) < max(0.3, 0.02 * radius)
    # A border that is narrower than the blur seems to lie outside itself, an octagon looks like a disc 5 % larger, and
    # small squares like discs that are larger still.
    assert 0.0 < found.radius - radius < (0.5 + 0.15 * radius if radius >= 8.0 else 0.3 * radius)
    assert found.strength > 0.85


@pytest.mark.parametrize(("radius", "shape"), [(8.0, "warning"), (20.0, "yield")])
def test_triangles_are_found_about_the_middle_of_their_height(shape: str, radius: float) -> None:
    (found,) = detect_signs(picture(shape, 82.3, 57.6, radius), [SearchRegion(86, 54, 9, 9, radius)])
    assert math.dist((found.u, found.v), (82.3, 57.6)) < 0.06 * radius


def test_the_whole_picture_is_searched_for_signs_of_many_sizes() -> None:
    drawn = np.concatenate([picture("disc", 40.2, 30.7, 6.0), picture("octagon", 90.0, 60.0, 22.0)], axis=1)
    found = detect_signs(drawn)
    assert len(found) == 2
    for place, within in (((40.2, 30.7), 0.5), ((250.0, 60.0), 0.7)):
        assert min(math.dist((one.u, one.v), place) for one in found) < within


def test_a_sign_of_a_tenth_of_the_contrast_is_found_where_noise_is_a_tenth() -> None:
    """What counts is the picture's own noise; rounding to whole grey levels is some."""
    faint = np.random.default_rng(0).normal(200.0, 0.4, (120, 160)) - 0.06 * (200.0 - picture("disc", 82, 57, 8.0))
    region = SearchRegion(82, 57, 9, 9, 8.0)
    assert detect_signs(faint.astype(np.float32), [region])
    assert not detect_signs(picture("disc", 82, 57, 8.0, 2.4, noise=4.0), [region])


@pytest.mark.parametrize("seed", range(4))
def test_noise_and_texture_are_no_signs(seed: int) -> None:
    rng = np.random.default_rng(seed)
    noise = rng.normal(150.0, 5.0, (120, 160)).astype(np.float32)
    texture = cv2.GaussianBlur(rng.normal(0.0, 60.0, (120, 160)).astype(np.float32), (0, 0), 1.5) + 120.0
    for even in (noise, texture, np.full((120, 160), 90.0, np.float32)):
        assert detect_signs(even, [SearchRegion(80, 60, 30, 30, radius) for radius in (4.0, 8.0, 16.0)]) == ()


def test_pixels_of_any_kind_are_read_alike_and_a_sign_is_seen_by_its_colour() -> None:
    grey = picture("disc", 82.0, 57.0, 8.0)
    region = SearchRegion(80, 60, 9, 9, 8.0)
    (found,) = detect_signs(grey, [region])
    for image in (
        grey.astype(np.uint8),
        4 * grey.astype(np.uint16),
        np.repeat(grey.astype(np.uint8)[:, :, None], 3, 2),
    ):
        (same,) = detect_signs(image, [region])
        assert math.dist((same.u, same.v), (found.u, found.v)) < 0.02
    # As bright as what is behind it.
    image = np.stack((400.0 - grey, grey, grey), axis=2).astype(np.float32) - 80.0
    (found,) = detect_signs(image, [region])
    assert math.dist((found.u, found.v), (82.0, 57.0)) < 0.3


def test_regions_beyond_the_border_and_without_extent_do_no_harm() -> None:
    drawn = picture("disc", 3.0, 57.0, 8.0)
    assert detect_signs(drawn, []) == ()
    assert detect_signs(drawn, [SearchRegion(-90, 60, 9, 9, 8.0), SearchRegion(80, 900, 9, 9, 8.0)]) == ()
    detect_signs(drawn, [SearchRegion(0, 0, 0, 0, 3.0), SearchRegion(80, 60, 500, 500, 60.0)])
    detect_signs(drawn[:4, :4], [SearchRegion(2, 2, 1, 1, 8.0)])


def test_outlines_are_even_and_their_normals_point_outward() -> None:
    normals = np.linalg.norm(OUTLINES[:, :, 2:], axis=2)
    assert np.allclose(normals, 1.0, atol=1e-6)
    assert ((OUTLINES[:, :, :2] * OUTLINES[:, :, 2:]).sum(axis=2) > 0.2).all()
    square = polygon_outline([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    assert np.allclose(np.abs(square[:, :2]).max(axis=1), 1.0)


MIDDLE, RADIUS = 20.0, 6.0


def edges_of(outline: Floats, shift: float = 0.0) -> tuple[Floats, np.ndarray]:
    """Points of edges on an outline, and their numbers in a picture of 40 × 40 px."""
    points = np.zeros((len(outline), 5), np.float32)
    points[:, X], points[:, Y] = (MIDDLE + RADIUS * outline[:, :2]).T
    points[:, X] += shift
    points[:, NX], points[:, NY] = outline[:, 2], outline[:, 3]
    number = np.full((40, 40), -1, np.int32)
    for i, point in enumerate(points):
        number[round(float(point[Y])), round(float(point[X]))] = i
    return points, number


@pytest.mark.parametrize("outline", OUTLINES)
def test_an_outline_of_edges_is_borne_out_and_found_beside_its_supposed_place(outline: Floats) -> None:
    points, number = edges_of(outline, shift=0.4)
    share, right, _, larger = support(points, number, outline, MIDDLE, MIDDLE, RADIUS, 2)
    assert share > 0.7
    assert right == pytest.approx(0.4, abs=0.2)
    assert abs(larger) < 0.4


@pytest.mark.parametrize("triangle", OUTLINES[3:])
def test_a_level_side_alone_is_no_outline(triangle: Floats) -> None:
    points, number = edges_of(triangle)
    level = np.flatnonzero(triangle[:, 2] == 0.0)
    number[~np.isin(number, level)] = -1
    assert (number >= 0).sum() >= 6
    assert support(points, number, triangle, MIDDLE, MIDDLE, RADIUS, 1)[0] == 0.0
    candidate, radii = np.full(2, MIDDLE, np.float32), np.full(1, RADIUS, np.float32)
    assert fitted(points, number, triangle[None], candidate, radii).tolist() == [0.0] * 5
