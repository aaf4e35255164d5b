"""What is truly seen in a frame, against independent ways to know it."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from early_motorway import EARLY

import fogsim
from fogsim.atmosphere import optical_depth
from fogsim.dataset import (
    SemanticClass,
    decoded_depth,
    decoded_transmission,
    depth,
    encoded_depth,
    encoded_transmission,
    instance_mask,
    read_png,
    semantic_mask,
    sign_picture,
    transmission,
)
from fogsim.dataset.directory import png
from fogsim.dataset.write import object_records
from fogsim.errors import InputError
from fogsim.values import Camera, CameraPose, FogField, Sign, SignMap, Step, Truth, View
from fogsim.values.observation import sign_map_values
from fogsim.values.pinhole import ray_from_pixel
from fogsim.values.scene import Instance
from tests.recorders.synthetic import make_step

BANK = (
    EARLY,
    "camera.width=96",
    "camera.height=72",
    "duration_s=0.2",
    "fog={outside_visibility_m: 300, banks: [{start_m: 150, end_m: 900, visibility_m: 60, edge_m: 80}], top_m: 30}",
)


@pytest.fixture(scope="module")
def step() -> Step:
    return list(fogsim.run(fogsim.load_scenario("motorway_fog_bank", BANK), seed=1))[-1]


def places(step: Step) -> np.ndarray:
    """Points that the pixels show (rows, cols, 3), those of the sky 10 000 km away."""
    truth = step.truth
    rows, cols = np.indices(step.view.distance.shape)
    rays = np.stack((cols, rows, np.ones(rows.shape)), axis=-1) @ ray_from_pixel(truth.camera, truth.pose).T
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    return np.array(truth.pose.position) + rays * np.minimum(step.view.distance, 1e7)[..., None]


def test_transmission_is_that_of_the_optical_depth_to_what_is_seen(step: Step) -> None:
    truth = step.truth
    expected = np.exp(-optical_depth(truth.fog, np.array(truth.pose.position), places(step)))
    assert transmission(step) == pytest.approx(expected, rel=2e-3, abs=2e-5)
    assert 0 < expected[np.isinf(step.view.distance)].max() < 1  # the sky is seen through the top of the fog


def test_clear_air_takes_nothing(step: Step) -> None:
    clear = dataclasses.replace(step.truth, fog=FogField(0.0, (3000.0, 3000.0, 3000.0)))
    assert np.array_equal(transmission(dataclasses.replace(step, truth=clear)), np.ones((72, 96), np.float32))


def test_masks_say_what_the_renderer_drew(step: Step) -> None:
    classes, objects = semantic_mask(step), instance_mask(step)
    assert (classes.dtype, objects.dtype) == (np.uint8, np.uint16)
    assert np.array_equal(classes == SemanticClass.SKY, np.isinf(depth(step)))
    assert np.array_equal(classes == SemanticClass.ROAD, step.view.instance == 2)
    seen = np.unique(objects[(objects > 0) & (objects <= len(step.traffic.ids))])
    assert seen.size > 2
    for number in seen:
        own = objects == number
        assert np.unique(classes[own]).tolist() == [SemanticClass[step.traffic.types[number - 1].upper()]]
        # What is seen of a vehicle lies within its length of the middle of its front bumper.
        apart = np.linalg.norm(places(step)[own] - step.traffic.position[number - 1], axis=-1)
        assert apart.max() < np.hypot(step.traffic.length[number - 1], 4.5)


def test_boxes_and_areas_are_those_of_the_pixels(step: Step) -> None:
    objects = instance_mask(step)
    records = object_records(step, objects, transmission(step))
    assert [r["instance"] for r in records] == [n for n in np.unique(objects) if n]
    for record in records:
        x, y, width, height = record["bbox"]
        own = objects == record["instance"]
        assert record["area"] == own.sum() == own[y : y + height, x : x + width].sum()
        assert own[y].any()
        assert own[y + height - 1].any()
        assert own[:, x].any()
        assert own[:, x + width - 1].any()
        assert record["distance_m"] == pytest.approx(depth(step)[own].min())
        assert 0 <= record["transmission"] <= 1


def plate(number: int, ahead: float, left: float, heading: float = 0.0) -> Sign:
    return Sign(f"sign.{number}", "speed_limit", 25.0, (ahead, left, 3.0), heading, 1.0)


def seen_signs(signs: Sequence[Sign], shown: Sequence[tuple[float, float, float]]) -> Step:
    """A step whose camera sees signs at points ahead, left and up, one pixel each."""
    camera = Camera(160, 120, 150.0, (80, 60), mount_height=1.4)
    distance = np.full((120, 160), np.inf, np.float32)
    instance = np.zeros((120, 160), np.int32)
    for ahead, left, up in shown:
        row, col = round(60 - 150 * (up - 1.4) / ahead), round(80 - 150 * left / ahead)
        distance[row, col] = np.linalg.norm((ahead, left, up - 1.4))
        instance[row, col] = SemanticClass.SIGN
    truth = Truth(
        0.0, 0.0, camera, CameraPose((0.0, 0.0, 1.4), 0.0), FogField(0.0, (1.0, 1.0, 1.0)), SignMap((*signs,))
    )
    view = View(np.zeros((120, 160, 3), np.float32), distance, instance)
    return dataclasses.replace(make_step(), truth=truth, view=view)


def test_each_sign_s_face_is_an_object_and_its_post_is_none() -> None:
    signs = [plate(0, 20.0, -5.0), plate(1, 20.0, -6.5, heading=np.pi), plate(2, 400.0, -5.0)]
    step = seen_signs(signs, [(20.0, -5.0, 3.0), (20.0, -5.3, 3.2), (20.0, -6.5, 3.0), (20.0, -5.0, 1.0)])
    objects = instance_mask(step)
    records = object_records(step, objects, transmission(step))
    assert [(r["sign_id"], r["area"], r["shows_face"]) for r in records] == [("sign.0", 2, True), ("sign.1", 1, False)]
    assert [r["instance"] for r in records] == [3, 4]  # after the two vehicles
    assert {r["category_id"] for r in records} == {SemanticClass.SIGN}
    assert (semantic_mask(step) == SemanticClass.SIGN).sum() == 4
    picture = sign_picture(step, objects)
    np.testing.assert_array_equal(picture[:, :, 0] > 0, objects == 3)
    ahead = 20.0 - float(step.traffic.position[step.ego, 0])
    assert picture[objects == 3][0].tolist() == list(sign_map_values(signs[0].kind, ahead, signs[0].diameter))


def test_traffic_lights_and_persons_have_classes_and_are_no_vehicles() -> None:
    step = make_step(0)
    shown = np.array([[Instance.TRAFFIC_LIGHT, Instance.PERSON, Instance.ROADSIDE, Instance.FIRST_VEHICLE]], np.int32)
    seen = View(np.zeros((1, 4, 3), np.float32), np.ones((1, 4), np.float32), shown)
    step = dataclasses.replace(step, view=seen)
    expected = [SemanticClass.TRAFFIC_LIGHT, SemanticClass.PERSON, SemanticClass.ROADSIDE, SemanticClass.CAR]
    assert semantic_mask(step).tolist() == [expected]
    assert instance_mask(step).tolist() == [[0, 0, 0, 1]]


def test_a_step_without_a_camera_has_no_known_transmission() -> None:
    with pytest.raises(InputError, match="only of steps that a camera in a loop has made"):
        transmission(make_step())


def test_depth_is_kept_to_half_a_centimetre_up_to_its_end() -> None:
    distance = np.array([[0.001, 1.384, 10.0, 299.996, 655.34, 655.36, 5000.0, np.inf]], np.float32)
    values = encoded_depth(distance)
    assert values.tolist() == [[1, 138, 1000, 30000, 65534, 65535, 65535, 0]]
    back = decoded_depth(values)
    assert back[0, 1:5] == pytest.approx(distance[0, 1:5], abs=0.0051)
    assert back[0, 5:].tolist() == [655.35, 655.35, np.inf]


def test_transmission_is_kept_to_its_last_step() -> None:
    share = np.linspace(0, 1, 1001, dtype=np.float32)[None]
    assert decoded_transmission(encoded_transmission(share)) == pytest.approx(share, abs=0.5 / 65535 + 1e-7)
    assert encoded_transmission(np.array([[0.0, 1.0, 1.0000001]], np.float32)).tolist() == [[0, 65535, 65535]]


@pytest.mark.parametrize("shape", [(5, 7), (5, 7, 3)])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_png_files_keep_every_bit(tmp_path: Path, shape: tuple[int, ...], dtype: type) -> None:
    image = np.random.default_rng(0).integers(0, np.iinfo(dtype).max + 1, shape).astype(dtype)
    path = tmp_path / "image.png"
    path.write_bytes(png(image))
    back = read_png(path)
    assert back.dtype == dtype
    assert np.array_equal(back, image)
