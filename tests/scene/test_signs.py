import contextlib
import dataclasses

import numpy as np
import pytest

from fogsim.render import make_renderer
from fogsim.scene.signs import SIGN_KINDS, gantries, sign_shapes
from fogsim.scene.signs.kinds import face_of, shape_name
from fogsim.scene.signs.symbols import BLACK, lettering
from fogsim.values import Batch, Camera, CameraPose, Mesh, RoadNetwork, Scene, Sign, Surface
from fogsim.values.scene import Instance
from tests.scene.conftest import LIMIT, build

ENDINGS = ["", ":far", ":tiny"]


def drawn(scene: Scene, batch: Batch, ending: str = "") -> tuple[np.ndarray, np.ndarray]:
    """Vertices and normals of the only copy of a batch in the world."""
    shape, transform = scene.shapes[batch.shape + ending], batch.transforms[0].astype(float)
    scale = np.linalg.norm(transform[:3, 0])
    return shape.positions @ transform[:3, :3].T + transform[:3, 3], shape.normals @ transform[:3, :3].T / scale


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_sign_faces_its_readers_at_its_place_and_size(motorway: RoadNetwork, ending: str) -> None:
    scene = build(motorway, LIMIT)
    (batch,) = (b for b in scene.scenery if b.shape == shape_name(LIMIT))
    assert list(batch.instance) == [4]
    places, normals = drawn(scene, batch, ending)
    front = normals[:, 0] < -0.99
    assert places[front].mean(axis=0)[1:] == pytest.approx(LIMIT.position[1:], abs=0.03)
    assert np.ptp(places[front, 1]) == np.ptp(places[front, 2]) == pytest.approx(LIMIT.diameter, rel=0.01)
    assert np.abs(places[front, 0] - LIMIT.position[0]).max() < 0.05
    surface = scene.shapes[batch.shape + ending].surface
    assert set(surface[front]) == {Surface.SHEETING}
    assert set(surface[~front]) == {Surface.MATT}


def test_red_surrounds_a_light_field_with_black_digits(motorway: RoadNetwork) -> None:
    shape = sign_shapes([LIMIT])[shape_name(LIMIT)]
    red = shape.reflectance[:, 0] > 5 * shape.reflectance[:, 1]
    black = shape.reflectance.max(axis=1) < 0.03
    assert np.ptp(shape.positions[red, 0]) == pytest.approx(0.965, abs=0.01)
    height = np.ptp(shape.positions[black, 1])
    assert 0.35 < height < 0.6
    # Readable at 30 m with 577 px: a digit is more than five pixels high.
    assert height * LIMIT.diameter * 577 / 30 > 5
    # What is printed lies before what it is printed on.
    assert shape.positions[black, 2].min() > shape.positions[red, 2].max()


def test_every_kind_fills_its_diameter_in_every_size() -> None:
    for kind in SIGN_KINDS:
        sign = dataclasses.replace(LIMIT, kind=kind)
        shapes = sign_shapes([sign])
        for ending in ENDINGS:
            positions = shapes[shape_name(sign) + ending].positions
            assert np.ptp(positions[:, 0]) == pytest.approx(1.0, abs=0.06)
            assert np.abs(positions[:, :2]).max() < 0.55
        sizes = [len(shapes[shape_name(sign) + ending].faces) for ending in ENDINGS]
        assert sizes[0] >= sizes[1] >= sizes[2]
        assert sizes[0] < 500


def test_from_afar_a_face_keeps_its_mean_colour() -> None:
    def mean(mesh: Mesh) -> np.ndarray:
        a, b, c = (mesh.positions[mesh.faces[:, i]].astype(float) for i in range(3))
        area, depth = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1), a[:, 2]
        # Of layers above one another only the uppermost shows: subtract what the next one covers.
        layers = [np.isclose(depth, z, atol=1e-3) for z in np.unique(np.round(depth, 4))]
        sums = [area[layer].sum() for layer in layers] + [0.0]
        colours = [area[layer] @ mesh.reflectance[mesh.faces[layer, 0]] / area[layer].sum() for layer in layers]
        shown = [colour * (sums[n] - sums[n + 1]) for n, colour in enumerate(colours)]
        return np.asarray(sum(shown) / sums[0])

    face = face_of(LIMIT)
    assert mean(face.tiny()) == pytest.approx(mean(face.far()), rel=0.03)


def test_codes_of_the_catalogue_have_the_faces_of_their_kinds_and_others_their_code() -> None:
    one, other = (dataclasses.replace(LIMIT, kind=kind) for kind in ("xodr.450-52", "tempo"))
    written = [face_of(sign).symbol for sign in (one, other)]
    expected = [lettering(code, BLACK) for code in ("450-52", "TEMPO")]
    for mesh, letters in zip(written, expected, strict=True):
        assert len(mesh.faces) == len(letters.faces) > 0
        assert np.ptp(mesh.positions[:, 0]) < 0.92
    outline = np.array(face_of(one).outline)
    assert np.ptp(outline, axis=0) == pytest.approx((1.0, 1.0))
    for code, kind in (("xodr.206", "stop"), ("205", "yield"), ("267", "no_entry")):
        one, other = (face_of(dataclasses.replace(LIMIT, kind=k)) for k in (code, kind))
        assert one.outline == other.outline
        assert one.field == other.field
    assert len(face_of(dataclasses.replace(LIMIT, kind="stop")).outline) == 8


def test_every_character_differs_and_stays_in_its_field() -> None:
    seen = set()
    for character in "0123456789ABCDEFGHIJKLMNPQRSTUVWXYZ-_.:/?":
        positions = lettering(character, BLACK).positions
        assert np.abs(positions[:, 0]).max() < 0.4
        assert np.abs(positions[:, 1]).max() < 0.6
        seen.add(positions.tobytes())
    assert len(seen) == 41
    assert len(lettering(" ", BLACK).faces) == 0


def test_message_signs_shine_by_night_and_printed_ones_do_not(motorway: RoadNetwork) -> None:
    camera = Camera(160, 120, 400.0, (80.0, 60.0), 1.4)
    for kind, shining in (("speed_limit", False), ("variable_speed_limit", True)):
        scene = build(motorway, dataclasses.replace(LIMIT, kind=kind))
        with contextlib.closing(make_renderer("cpu", scene, 1e-4)) as renderer:
            near, far = (renderer.render((), camera, CameraPose((x, -6.0, 2.2), 0.0)) for x in (190.0, 150.0))
            lit = [float(view.radiance[view.instance == Instance.SIGN].max()) for view in (near, far)]
        assert min(lit) > 10.0 if shining else max(lit) < 1e-4


def test_posts_reach_from_the_ground_to_the_face(motorway: RoadNetwork) -> None:
    scene = build(motorway, LIMIT)
    (posts,) = (b for b in scene.scenery if b.shape == "sign_post")
    places, _ = drawn(scene, posts)
    assert places[:, 2].min() < -0.1
    assert LIMIT.position[2] < places[:, 2].max() < LIMIT.position[2] + LIMIT.diameter / 2
    assert places[:, 0].min() > LIMIT.position[0]  # behind the face
    assert places[:, :2].mean(axis=0) == pytest.approx(LIMIT.position[:2], abs=0.2)


def test_signs_over_lanes_hang_from_one_gantry_that_spans_their_carriageway(motorway: RoadNetwork) -> None:
    over = [Sign(f"g{i}", "variable_speed_limit", 22.2, (200.0, 3.5 * i, 6.2), 0.0, 1.2) for i in range(3)]
    (gantry,) = gantries([LIMIT, *over], motorway.lanes)
    assert [sign.sign_id for sign in gantry.signs] == ["g0", "g1", "g2"]
    right, left = gantry.reach
    assert right < -1.75 - 2.5
    assert 8.75 + 1.0 < left < 8.75 + 5.0
    scene = build(motorway, *over)
    assert "sign_post" not in {batch.shape for batch in scene.scenery}
    bare = build(motorway)
    assert len(scene.ground.faces) > len(bare.ground.faces)
    assert not gantries([dataclasses.replace(over[0], heading=np.pi)], motorway.lanes)
