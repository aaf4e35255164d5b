"""Fog on images from disk: against the closed form, against the loop's own fog, and what is refused."""

import dataclasses
import math
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from fogsim.atmosphere import Air
from fogsim.errors import InputError
from fogsim.offline.camera_file import load_camera
from fogsim.offline.fog_image import FogLayer, airlight_of, fog_file, fog_image
from fogsim.offline.image_files import DepthMap, range_from_planar
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, CameraPose, FogField, Response, View
from fogsim.values.camera_response import respond
from fogsim.values.pinhole import ray_from_pixel
from tests.helpers.camera_files import camera_yaml

CAMERA_YAML = camera_yaml((64, 48), 60.0, (31.5, 20.25), 1.4, 2.0, "linear")
CAMERA = Camera(64, 48, 60.0, (31.5, 20.25), 1.4, math.radians(2.0))


def noise(dtype: type, channels: int, top: int) -> NDArray[np.uint8] | NDArray[np.uint16]:
    values = np.random.default_rng(1).integers(0, top + 1, (48, 64, channels), dtype=dtype)
    return values[..., 0] if channels == 1 else values


@pytest.fixture
def distance() -> NDArray[np.float64]:
    depth = np.random.default_rng(2).uniform(1.0, 200.0, (48, 64))
    depth[:10] = np.inf
    return depth


@pytest.fixture
def folder(tmp_path: Path, distance: NDArray[np.float64]) -> Path:
    (tmp_path / "camera.yaml").write_text(CAMERA_YAML, encoding="utf-8")
    cv2.imwrite(str(tmp_path / "image.png"), noise(np.uint8, 3, 255))
    np.save(tmp_path / "range.npy", distance)
    return tmp_path


def run(folder: Path, **changed: object) -> NDArray[np.generic]:
    given = {
        "image": folder / "image.png",
        "depth": folder / "range.npy",
        "kind": "range",
        "visibility": 80.0,
        "camera": load_camera(folder / "camera.yaml"),
        "out": folder / "out.png",
        "overwrite": True,
        "airlight": (255.0,),
    }
    options = {**given, **changed}
    if "layer" in options:
        options["layer"] = FogLayer(*options["layer"])  # type: ignore[misc]
    depth = DepthMap(options.pop("depth"), options.pop("kind"), options.pop("scale", None))  # type: ignore[arg-type]
    fog_file(depth=depth, **options)  # type: ignore[arg-type]  # some are wrong on purpose
    return np.asarray(cv2.imread(str(folder / "out.png"), cv2.IMREAD_UNCHANGED))


def test_a_linear_image_from_disk_is_the_closed_form(folder: Path, distance: NDArray[np.float64]) -> None:
    transmission = np.exp(-math.log(20.0) / 80.0 * distance)[..., None]
    exact = noise(np.uint8, 3, 255) * transmission + 255.0 * (1.0 - transmission)
    assert np.abs(run(folder) - exact).max() <= 0.5 + 1e-9


def test_every_kind_of_image_is_the_closed_form_on_light(distance: NDArray[np.float64]) -> None:
    for channels in [1, 3, 4]:
        for dtype, top in [(np.uint8, 255), (np.uint16, 65535)]:
            for response in list(Response):
                image, camera = noise(dtype, channels, top), dataclasses.replace(CAMERA, response=response)
                colours = min(channels, 3)
                seen = fog_image(image, distance, 60.0, camera, np.full(colours, 0.8 * top))
                assert seen.dtype == image.dtype
                assert seen.shape == image.shape
                # Back to light by interpolation of the curve itself.
                exposures = np.linspace(0, 1, 200_001)
                curve = top * respond(exposures, response)
                light = np.interp(image.reshape(48, 64, -1)[..., :colours], curve, exposures)
                transmission = np.exp(-math.log(20.0) / 60.0 * distance)[..., None]
                exact = light * transmission + np.interp(0.8 * top, curve, exposures) * (1.0 - transmission)
                tolerance = 0.51 if dtype == np.uint8 else 3.0
                assert (
                    np.abs(seen.reshape(48, 64, -1)[..., :colours] - top * respond(exact, response)).max() <= tolerance
                )
                if channels == 4:
                    assert np.array_equal(seen[..., 3], image[..., 3])


def test_planar_depth_becomes_slant_range(folder: Path, distance: NDArray[np.float64]) -> None:
    # The length of the ray that is 1 long along the axis, from the camera's own geometry.
    ray_map = ray_from_pixel(CAMERA, CameraPose((0, 0, 1.4), 0.0))
    length = np.array([[np.linalg.norm(ray_map @ (u, v, 1.0)) for u in range(64)] for v in range(48)])
    assert np.allclose(range_from_planar(distance / length, CAMERA), distance)
    by_range = run(folder)
    np.save(folder / "planar.npy", (distance / length).astype(np.float32))
    by_planar = run(folder, depth=folder / "planar.npy", kind="planar")
    assert np.abs(by_range.astype(int) - by_planar).max() <= 1
    assert np.abs(by_range.astype(int) - run(folder, depth=folder / "planar.npy")).max() > 5


def test_sixteen_bit_depth_and_zero_for_the_sky(folder: Path, distance: NDArray[np.float64]) -> None:
    steps = np.where(np.isinf(distance), 0, np.rint(distance * 256)).astype(np.uint16)
    cv2.imwrite(str(folder / "depth.png"), steps)
    seen = run(folder, depth=folder / "depth.png", scale=1 / 256)
    assert np.all(seen[:10] == 255)
    assert np.abs(seen.astype(int) - run(folder)).max() <= 1


def test_clear_air_gives_the_image_back(folder: Path) -> None:
    assert np.array_equal(run(folder, visibility=math.inf), noise(np.uint8, 3, 255))


def test_airlight_of_the_sky_or_of_the_brightest(distance: NDArray[np.float64]) -> None:
    image = np.full((48, 64, 3), 50, np.uint8)
    image[:10] = (200, 190, 180)
    image[40, 60] = 255
    assert np.array_equal(airlight_of(image, distance), [200, 190, 180])
    assert np.all(airlight_of(image, np.full_like(distance, 20.0)) > 200)


def test_a_clear_frame_fogged_afterwards_is_the_frame_that_the_loop_fogs() -> None:
    rng = np.random.default_rng(6)
    camera = dataclasses.replace(CAMERA, response=Response.SRGB)
    distance = rng.uniform(2.0, 300.0, (48, 64)).astype(np.float32)
    radiance = rng.uniform(20.0, 3500.0, (48, 64, 3)).astype(np.float32)
    view = View(radiance, distance, np.zeros((48, 64), np.int32))
    saturation, airlight = 5000.0, (2900.0, 3000.0, 3100.0)

    def developed(light: NDArray[np.float32]) -> NDArray[np.float64]:
        return np.asarray(255.0 * respond(np.clip(light.astype(np.float64) / saturation, 0.0, 1.0), camera.response))

    clear = np.rint(developed(radiance)).astype(np.uint8)
    air = developed(np.array(airlight, dtype=np.float32))
    for visibility in (30.0, 80.0, 400.0):
        field = FogField(extinction_from_visibility(visibility), airlight)
        in_loop = developed(Air(field).radiance(view, camera, CameraPose((0.0, 0.0, 1.4), 0.0)))
        afterwards = fog_image(clear, distance.astype(np.float64), visibility, camera, air)
        assert np.abs(afterwards - in_loop).max() <= 1.0


def test_airlight_by_elevation_is_that_of_the_loop() -> None:
    rng = np.random.default_rng(7)
    distance = rng.uniform(2.0, 300.0, (48, 64))
    distance[:20] = math.inf
    clear = rng.integers(0, 256, (48, 64, 3)).astype(np.uint8)
    level = np.array([90.0, 100.0, 110.0])
    for albedo in (0.0, 0.1, 0.8):
        layer = FogLayer(albedo, 250.0)
        afterwards = fog_image(clear, distance, 80.0, CAMERA, level, layer)
        field = FogField(extinction_from_visibility(80.0), (90.0, 100.0, 110.0), top=250.0, ground_albedo=albedo)
        view = View(clear.astype(np.float32), distance.astype(np.float32), np.zeros((48, 64), np.int32))
        pose = CameraPose((0.0, 0.0, CAMERA.mount_height), 0.0)
        in_loop = np.clip(Air(field).radiance(view, CAMERA, pose), 0.0, 255.0)
        assert np.abs(afterwards - in_loop).max() <= 0.6


def test_wrong_arguments_are_refused(folder: Path) -> None:
    for changed, told in [
        ({"layer": (1.5, 250.0)}, "--ground-albedo must lie within 0 … 1, got 1.5"),
        ({"layer": (0.1, 1.0)}, "above the fog, whose top is 1 m high"),
        ({"layer": (0.1, math.nan)}, "--layer-height must be a positive length"),
        ({"visibility": 0.0}, "--visibility must be"),
        ({"visibility": math.nan}, "--visibility must be"),
        ({"kind": "plannar"}, "did you mean 'planar'"),
        ({"airlight": (300.0,)}, "0 … 255"),
        ({"airlight": (1.0, 2.0)}, "one pixel value or 3"),
        ({"scale": 0.0}, "--depth-scale must be"),
    ]:
        with pytest.raises(InputError, match=told):
            run(folder, **changed)
        assert not (folder / "out.png").exists()


def test_files_that_are_not_there_or_no_images_are_refused(folder: Path) -> None:
    (folder / "text.png").write_text("no image", encoding="utf-8")
    (folder / "text.npy").write_text("no array", encoding="utf-8")
    cv2.imwrite(str(folder / "eight.png"), noise(np.uint8, 1, 255))
    cv2.imwrite(str(folder / "steps.png"), noise(np.uint16, 1, 900))
    for changed, told in (
        ({"image": folder / "none.png"}, "none.png: cannot be read: No such file"),
        ({"image": folder / "text.png"}, "text.png: this is no image"),
        ({"depth": folder / "none.npy"}, "none.npy: cannot be read"),
        ({"depth": folder / "text.npy"}, "text.npy: cannot be read"),
        ({"depth": folder / "eight.png"}, "16 bits"),
        ({"depth": folder / "steps.png"}, "--depth-scale is missing"),
        ({"out": folder / "image.png"}, "would replace what is read"),
        ({"out": folder / "out.xyz"}, "ending '.xyz'"),
        ({"out": folder / "none" / "out.png"}, "there is no folder"),
    ):
        with pytest.raises(InputError, match=told):
            run(folder, **changed)


def test_sizes_must_agree(folder: Path) -> None:
    np.save(folder / "small.npy", np.ones((24, 64)))
    with pytest.raises(InputError, match="48 rows and 64 columns as the camera has, got 24 × 64"):
        run(folder, depth=folder / "small.npy")
    with pytest.raises(InputError, match="64 × 48 pixels, the camera 65 × 48"):
        run(folder, camera=dataclasses.replace(CAMERA, width=65))


def test_bits_must_agree(folder: Path) -> None:
    cv2.imwrite(str(folder / "left.png"), noise(np.uint16, 3, 65535))
    for name, fault in [("image.png", "image.png: the image has 8 bits, the camera 12"), ("left.png", "are 0 … 4095")]:
        with pytest.raises(InputError, match=fault):
            run(folder, image=folder / name, camera=dataclasses.replace(CAMERA, bits=12))


@pytest.mark.parametrize("wrong", [math.nan, -3.0])
def test_impossible_depths_are_refused(folder: Path, distance: NDArray[np.float64], wrong: float) -> None:
    distance[20, 30] = wrong
    np.save(folder / "wrong.npy", distance)
    with pytest.raises(InputError, match="row 20, column 30, and 1 such"):
        run(folder, depth=folder / "wrong.npy")


def test_mistakes_in_a_camera_file_are_told(folder: Path) -> None:
    for old, new, told in [
        ("focal_length_px", "focal_lenght_px", "camera.yaml:3: focal_lenght_px: unknown key; did you mean 'focal_len"),
        ("height: 48\n", "", "height: this key is missing"),
        ("width: 64", "width: 0", "camera.yaml:1: width: input should be greater than or equal to 1; got 0"),
        ("linear", "log", "response: input should be 'linear', 'gamma' or 'srgb'"),
        ("pitch_deg: 2.0", "pitch_deg: .nan", "pitch_deg"),
        ("[31.5, 20.25]", "[31.5]", "principal_point_px"),
    ]:
        (folder / "camera.yaml").write_text(CAMERA_YAML.replace(old, new, 1), encoding="utf-8")
        with pytest.raises(InputError, match=told.replace("[", r"\[")):
            load_camera(folder / "camera.yaml")
