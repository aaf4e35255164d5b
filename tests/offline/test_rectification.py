"""Images of lenses that distort and of cameras that look aside, straightened."""

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from fogsim.calibration.staged_road import foggy_image, straight_road
from fogsim.errors import InputError
from fogsim.estimators import make
from fogsim.offline import Straightener, estimate_images, find_source, guess_camera, straightened
from fogsim.offline.camera_file import Calibration, load_calibration, load_camera
from fogsim.render import make_renderer
from fogsim.scene import build_scene
from fogsim.values import Camera, CameraPose, Observation, Response, SignMap
from tests.helpers.camera_files import camera_yaml
from tests.helpers.command import Command

CAMERA = Camera(640, 480, 577.0, (322.0, 236.0), 1.38, math.radians(2.0), response=Response.LINEAR)
WIDE = replace(CAMERA, width=2400, height=1800, focal_length=2 * CAMERA.focal_length, principal_point=(1199.5, 899.5))
BARREL = (-0.32, 0.09, 0.0011, -0.0007)
"""About what a dash camera of 60° has."""

VISIBILITY = 120.0
METHODS = ("negru2013", "zhu2015", "joint_road")
Draw = Callable[..., NDArray[np.uint8]]


@pytest.fixture(scope="module")
def draw() -> Draw:
    """Function from a camera and where it heads to its image of a straight road along x, without noise."""
    scene = build_scene(straight_road(), SignMap(()), np.random.default_rng(0))
    renderer = make_renderer("auto", scene, illuminance=10_000.0)

    def image(camera: Camera, heading: float = 0.0) -> NDArray[np.uint8]:
        pose = CameraPose((0.0, 0.0, camera.mount_height), heading)
        return foggy_image(renderer.render((), camera, pose), pose, camera, math.log(20.0) / VISIBILITY)

    return image


def through_lens(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """What the lens of `BARREL` makes of the picture of `WIDE`: Brown's formula solved by iteration, by hand."""
    k1, k2, p1, p2 = BARREL
    rows, columns = np.indices((CAMERA.height, CAMERA.width), dtype=float)
    bent = np.array([columns - CAMERA.principal_point[0], rows - CAMERA.principal_point[1]]) / CAMERA.focal_length
    x, y = bent
    for _ in range(60):
        r2 = x * x + y * y
        radial = 1.0 + k1 * r2 + k2 * r2 * r2
        x, y = (
            (bent[0] - 2.0 * p1 * x * y - p2 * (r2 + 2.0 * x * x)) / radial,
            (bent[1] - p1 * (r2 + 2.0 * y * y) - 2.0 * p2 * x * y) / radial,
        )
    u, v = (axis * WIDE.focal_length + middle for axis, middle in zip((x, y), WIDE.principal_point, strict=True))
    return cv2.remap(image, u.astype(np.float32), v.astype(np.float32), cv2.INTER_LINEAR).astype(np.uint8)


@pytest.fixture(scope="module")
def through_barrel(draw: Draw) -> NDArray[np.uint8]:
    """The road through the lens of `BARREL`."""
    return through_lens(draw(WIDE))


def difference(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> float:
    """95th percentile of the difference in the middle, the road's grain blurred [pixel values]."""
    one, other = (cv2.blur(image.astype(np.float32), (7, 7))[20:-20, 40:-40] for image in (a, b))
    return float(np.percentile(np.abs(one - other), 95))


def check_registered(found: NDArray[np.uint8], expected: NDArray[np.uint8]) -> None:
    """The same picture to much less than a shift by one row makes."""
    assert difference(found, expected) < 0.25 * difference(np.roll(expected, 1, axis=0), expected)


def visibility(image: NDArray[np.uint8], camera: Camera, method: str) -> float:
    found = make(method, camera).update(Observation(image))
    return found.visibility if found.valid else math.nan


def test_a_straight_camera_is_left_alone() -> None:
    image = np.random.default_rng(0).integers(0, 256, (480, 640, 3), dtype=np.uint8)
    straightener = Straightener(Calibration(CAMERA))
    assert straightener(image) is image
    assert straightener.camera == CAMERA
    source = find_source(__file__)
    assert straightened(source, Calibration(CAMERA)) == (source, CAMERA)


def test_distortion_is_undone(draw: Draw, through_barrel: NDArray[np.uint8]) -> None:
    straightener = Straightener(Calibration(CAMERA, BARREL))
    assert straightener.camera == CAMERA
    pinhole = draw(CAMERA)
    assert difference(through_barrel, pinhole) > 5.0
    check_registered(straightener(through_barrel), pinhole)


def test_yaw_is_undone(draw: Draw) -> None:
    """Turned to the left, the camera sees the end of the road on its right; pitch and roll are its own."""
    for pitch, roll in [(2.0, 0.0), (6.0, -3.0)]:
        for yaw in [-12.0, 4.0, 25.0]:
            camera = replace(CAMERA, pitch=math.radians(pitch), roll=math.radians(roll))
            straightener = Straightener(Calibration(camera, yaw=math.radians(yaw)))
            assert (straightener.camera.principal_point[0] > camera.principal_point[0]) == (yaw > 0)
            aside, along = draw(camera, math.radians(yaw)), draw(straightener.camera)
            check_registered(straightener(aside), along)


def test_lens_and_yaw_together_from_files(tmp_path: Path, draw: Draw) -> None:
    """What a person does: a folder of images and a camera file with both keys."""
    image = through_lens(draw(WIDE, math.radians(5.0)))
    Image.fromarray(image).save(tmp_path / "a.png")
    calibration = written(tmp_path, f"distortion: {list(BARREL)}", "yaw_deg: 5")
    assert (calibration.camera, calibration.distortion) == (CAMERA, BARREL)
    assert calibration.yaw == pytest.approx(math.radians(5.0))
    (result,) = estimate_images(tmp_path / "a.png", calibration, METHODS)
    for found in result.estimates:
        assert found.valid
        assert found.visibility == pytest.approx(VISIBILITY, rel=0.05)
    assert result.picture.image is not None
    assert not np.array_equal(result.picture.image, image)


def test_depth_and_channels_are_kept() -> None:
    for dtype in [np.uint8, np.uint16]:
        for shape in [(480, 640), (480, 640, 3)]:
            image = np.full(shape, 200, dtype)
            straight = Straightener(Calibration(CAMERA, BARREL, 0.1))(image)
            assert (straight.shape, straight.dtype) == (shape, dtype)
            assert np.all(straight == 200)


def test_highlights_stay_within_the_bits_of_the_camera() -> None:
    image = np.zeros((480, 640), np.uint16)
    image[:, 320:] = 4095
    assert Straightener(Calibration(replace(CAMERA, bits=12), BARREL, 0.1))(image).max() == 4095


def test_an_image_of_another_size_is_still_told(tmp_path: Path) -> None:
    Image.fromarray(np.zeros((100, 100), np.uint8)).save(tmp_path / "a.png")
    with pytest.raises(InputError, match="100 × 100 pixels, the camera 640 × 480"):
        list(estimate_images(tmp_path / "a.png", Calibration(CAMERA, BARREL), "negru2013"))


def test_what_a_lens_cannot_show_repeats_its_border() -> None:
    """Beyond the radius at which Brown's polynomial turns back there is nothing, and no ghost of the middle."""
    image = np.zeros((480, 640), np.uint8)
    image[200:280, 280:360] = 255
    straight = Straightener(Calibration(CAMERA, (-0.75, 0.0, 0.0, 0.0)))(image)
    assert straight[240, 320] == 255
    assert np.all(straight[:60] == 0)
    assert np.all(straight[:, :60] == 0)


def test_a_lens_that_folds_the_image_is_refused() -> None:
    for lens, told in [
        ((-2.0, 0.0, 0.0, 0.0), r"folds the image over 157 px .* goes on to 236 px"),
        ((0.1, -9.0, 0.0, 0.0), "folds"),
    ]:
        with pytest.raises(InputError, match=told):
            Straightener(Calibration(CAMERA, lens))


def written(folder: Path, *keys: str) -> Calibration:
    plain = camera_yaml((640, 480), 577, (322, 236), 1.38, 2, "linear")
    (folder / "camera.yaml").write_text("\n".join((plain.rstrip(), *keys)), encoding="utf-8")
    return load_calibration(folder / "camera.yaml")


def test_mistakes_are_told_with_their_line(tmp_path: Path) -> None:
    for keys, told in [
        ("distortion: [0.1, 0.2]", r"camera.yaml:8: distortion.* missing"),
        ("distortion: [0.1, 0.2, 0, 0, 0.3]", r"camera.yaml:8: distortion: .*4 items.* got \[0.1"),
        ("distortion: [.nan, 0, 0, 0]", r"camera.yaml:8: distortion.*finite number; got nan"),
        ("distortion: 0.1", r"camera.yaml:8: distortion: must be a list; got 0.1"),
        ("distorsion: [0, 0, 0, 0]", "did you mean 'distortion'"),
        ("yaw_deg: 90", r"camera.yaml:8: yaw_deg: .*less than 60; got 90"),
        ("yaw_deg: .inf", "yaw_deg"),
    ]:
        with pytest.raises(InputError, match=told):
            written(tmp_path, keys)


def test_whoever_needs_a_pinhole_is_not_given_another_camera(tmp_path: Path) -> None:
    written(tmp_path, "distortion: [0, 0, 0, 0]", "yaw_deg: 0")
    assert load_camera(tmp_path / "camera.yaml") == CAMERA
    written(tmp_path, "yaw_deg: 3")
    with pytest.raises(InputError, match=r"camera.yaml: distortion and yaw_deg are undone by `fogsim estimate`"):
        load_camera(tmp_path / "camera.yaml")


def test_a_guess_says_which_yaw_it_would_be(draw: Draw, tmp_path: Path) -> None:
    Image.fromarray(draw(CAMERA, math.radians(6.0))).save(tmp_path / "a.png")
    guess = guess_camera(find_source(tmp_path / "a.png"), mount_height=1.38, field_of_view=1.0124)
    (told,) = [warning for warning in guess.warnings if "yaw_deg" in warning]
    assert "turned to the left" in told
    assert float(told.partition("yaw_deg: ")[2].partition("`")[0]) == pytest.approx(6.0, abs=0.3)


def test_the_command_straightens(draw: Draw, tmp_path: Path, command: Command) -> None:
    """A camera 20° aside: told so, the method sees the road's fog, and the overlay shows the straightened image."""
    calibration = written(tmp_path, "yaw_deg: 20")
    Image.fromarray(draw(CAMERA, math.radians(20.0))).save(tmp_path / "a.png")
    asked = ["a.png", "--camera", "camera.yaml", "--method", "negru2013", "--json", "--overlay", "found.png"]
    done = command("estimate", *asked, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["visibility_m"] == pytest.approx(VISIBILITY, rel=0.05)
    with Image.open(tmp_path / "a.png") as picture:
        image = np.asarray(picture)
    verge = slice(300, 470), slice(0, 200)
    straight = Straightener(calibration)(image)
    assert not np.array_equal(straight[verge], image[verge])
    with Image.open(tmp_path / "found.png") as overlay:
        assert np.array_equal(np.asarray(overlay)[verge], straight[verge])


def test_the_page_shows_a_file_that_can_be_read(tmp_path: Path) -> None:
    page = (Path(__file__).resolve().parents[2] / "docs" / "how_to" / "own_camera.md").read_text(encoding="utf-8")
    (tmp_path / "camera.yaml").write_text(page.split("```yaml\n")[1].split("```")[0], encoding="utf-8")
    calibration = load_calibration(tmp_path / "camera.yaml")
    assert len(calibration.distortion) == 4
    assert Straightener(calibration).camera.width == 1280
