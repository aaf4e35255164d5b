"""Shapes of vehicles: the data, and the models that they are made from."""

from dataclasses import fields, replace

import numpy as np
import pytest

from fogsim.scene.vehicles import LIT_AREAS, bodies, body_of, body_shapes
from fogsim.values import Surface
from make_bodies import FILE, pack_bodies
from vehicle_bodies import MODELS, body_meshes
from vehicle_bodies.lamp_patches import lamp_patches, lamp_quads

SHAPES = body_shapes()
PIECES = "tractor", "trailer", "carriage"
DARK_BEHIND, DARK_AHEAD = {"tractor"}, {"trailer", "trailer_curtain"}
ENDINGS = ("", ":far", ":tiny", ":speck")


def test_a_body_of_the_data_is_what_its_model_makes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vehicle_bodies.MODELS", {"van": MODELS["van"]})
    for name, made in body_meshes().items():
        for field in fields(made):
            assert np.array_equal(getattr(made, field.name), getattr(SHAPES[name], field.name)), field.name


@pytest.mark.nightly
def test_the_data_are_what_the_tool_makes_to_the_bit() -> None:
    made = pack_bodies()
    with np.load(FILE) as packed:
        assert packed.files == list(made)
        for name, array in made.items():
            assert (packed[name].dtype, packed[name].shape) == (array.dtype, array.shape)
            assert packed[name].tobytes() == array.tobytes(), f"{name}: run tools/make_bodies.py"


def test_shapes_cannot_be_changed_and_are_read_once() -> None:
    for name, shape in body_shapes().items():
        assert shape is SHAPES[name]
        for field in fields(shape):
            array = getattr(shape, field.name)
            assert array.flags.c_contiguous
            assert not array.flags.writeable


def test_every_vehicle_has_a_shape_with_all_its_levels() -> None:
    assert list(SHAPES) == [name + ending for name in bodies() for ending in ENDINGS]
    sizes = [(3.9, 1.4), (4.5, 1.5), (5.0, 1.5), (4.6, 1.8), (7.1, 2.4), (8.5, 3.6), (16.5, 4.0)]
    chosen = {
        body_of(f"v{number}", kind, length, height)
        for kind in ("car", "van", "truck", "bus", "motorcycle", *PIECES)
        for length, height in sizes
        for number in range(20)
    }
    assert chosen == set(bodies())


def test_lamps_lie_on_the_surfaces_of_their_shapes() -> None:
    for name, body in bodies().items():
        shape = SHAPES[name]
        for lamp in body.lamps:
            own = shape.positions[shape.surface == lamp.surface]
            assert np.all(own.min(axis=0) - 1e-6 <= lamp.centre)
            assert np.all(lamp.centre <= own.max(axis=0) + 1e-6)
            assert lamp.front == (lamp.centre[0] > -0.5)
            assert 0.0 < lamp.area < 0.05


def test_little_is_drawn_of_what_is_far_and_plates_send_light_back() -> None:
    for name in bodies():
        for ending, most in zip(ENDINGS, (800, 165, 132, 98), strict=True):
            assert len(SHAPES[name + ending].faces) < most
    for name in bodies().keys() - {"tractor", "carriage"}:
        assert SHAPES[name].positions[SHAPES[name].surface == Surface.SHEETING, 0].min() < -0.95


def test_lit_surfaces_have_the_areas_of_lamps() -> None:
    for name in bodies():
        for ending in ENDINGS:
            _, width, height = bodies()[name].size
            for patch in lamp_patches(SHAPES[name + ending]):
                area = patch.area * width * height
                assert area < 1.06 * LIT_AREAS[patch.surface]
                if name != "motorcycle" and patch.surface is not Surface.LAMP_STOP:
                    assert area > 0.35 * LIT_AREAS[patch.surface]


def test_every_body_has_every_lamp_where_it_belongs() -> None:
    for kind in bodies():
        for ending in ENDINGS:
            shape = SHAPES[kind + ending]
            for surface, rear in (
                (Surface.LAMP_POSITION_REAR, True),
                (Surface.LAMP_STOP, True),
                (Surface.LAMP_REAR_FOG, True),
                (Surface.LAMP_HEAD, False),
            ):
                place = shape.positions[shape.surface == surface]
                if kind in (DARK_BEHIND if rear else DARK_AHEAD):
                    assert not len(place)
                    continue
                assert len(place)
                assert (place[:, 0].mean() < -0.8) == rear
                assert place[:, 1].mean() == pytest.approx(0.0, abs=1e-5)
            assert shape.positions[shape.surface == Surface.LAMP_INDICATOR_LEFT, 1].min() > 0
            assert shape.positions[shape.surface == Surface.LAMP_INDICATOR_RIGHT, 1].max() < 0


def test_a_hair_aside_gives_a_body_no_other_lamps() -> None:
    """Lamps in the middle are neither left nor right, wherever rounding has put their centres."""
    for kind in bodies():
        middle, *moved = (
            lamp_quads(replace(SHAPES[kind], positions=SHAPES[kind].positions + np.float32((0.0, aside, 0.0))))
            for aside in (0.0, 1e-6, -1e-6)
        )
        for quads in moved:
            assert np.array_equal(quads.faces, middle.faces)
            np.testing.assert_allclose(quads.positions, middle.positions, atol=2e-6)
