import numpy as np
import pytest

from fogsim.scene import vehicle_batches
from fogsim.scene.bodies import BODIES, body_shapes
from fogsim.values import Lamp, Surface, TrafficState

KINDS = ("car", "van", "truck", "bus", "motorcycle", "hovercraft")
SHAPES = body_shapes()


@pytest.fixture
def state() -> TrafficState:
    count = len(KINDS)
    rng = np.random.default_rng(2)
    return TrafficState(
        time=0.0,
        ids=tuple(f"v{i}" for i in range(count)),
        types=KINDS,
        position=rng.uniform(-50, 50, (count, 3)),
        heading=rng.uniform(-np.pi, np.pi, count),
        speed=np.zeros(count),
        acceleration=np.zeros(count),
        length=rng.uniform(2, 16, count),
        width=rng.uniform(0.8, 2.6, count),
        height=rng.uniform(1.3, 4, count),
        lane=("",) * count,
        lamps=np.arange(count, dtype=np.int32),
        paint=rng.uniform(0, 1, (count, 3)),
    )


@pytest.mark.parametrize("ending", ["", ":far", ":tiny"])
def test_a_drawn_vehicle_fills_its_box_behind_its_front_bumper(state: TrafficState, ending: str) -> None:
    rows = []
    for batch in vehicle_batches(state, None):
        for transform, instance in zip(batch.transforms.astype(float), batch.instance, strict=True):
            row = int(instance) - 16
            rows.append(row)
            shape = SHAPES[batch.shape + ending].positions
            offset = shape @ transform[:3, :3].T + transform[:3, 3] - state.position[row]
            ahead = np.array([np.cos(state.heading[row]), np.sin(state.heading[row])])
            along, left = offset[:, :2] @ ahead, offset[:, :2] @ (-ahead[1], ahead[0])
            box = (-state.length[row], 0.0, -state.width[row] / 2, state.width[row] / 2, 0.0, state.height[row])
            drawn = (along.min(), along.max(), left.min(), left.max(), offset[:, 2].min(), offset[:, 2].max())
            assert drawn == pytest.approx(box, abs=1e-4)
    assert sorted(rows) == list(range(len(KINDS)))


def test_the_vehicle_with_the_camera_is_left_out(state: TrafficState) -> None:
    drawn = np.concatenate([batch.instance for batch in vehicle_batches(state, 3)])
    assert sorted(drawn) == [16, 17, 18, 20, 21]


def test_an_unknown_body_is_drawn_as_a_car(state: TrafficState) -> None:
    cars = next(batch for batch in vehicle_batches(state, None) if batch.shape == "car")
    assert list(cars.instance) == [16, 21]


def test_paint_and_lamps_follow_their_rows(state: TrafficState) -> None:
    for batch in vehicle_batches(state, None):
        rows = batch.instance - 16
        assert batch.paint == pytest.approx(state.paint[rows].astype(np.float32))
        assert np.array_equal(batch.lamps, state.lamps[rows])


@pytest.mark.parametrize("kind", BODIES)
def test_every_body_has_every_lamp_where_it_belongs(kind: str) -> None:
    shape = SHAPES[kind]
    for surface, rear in (
        (Surface.LAMP_POSITION_REAR, True),
        (Surface.LAMP_STOP, True),
        (Surface.LAMP_REAR_FOG, True),
        (Surface.LAMP_HEAD, False),
    ):
        place = shape.positions[shape.surface == surface]
        assert len(place)
        assert (place[:, 0].mean() < -0.8) == rear
        assert place[:, 1].mean() == pytest.approx(0.0, abs=1e-5)
    assert shape.positions[shape.surface == Surface.LAMP_INDICATOR_LEFT, 1].min() > 0
    assert shape.positions[shape.surface == Surface.LAMP_INDICATOR_RIGHT, 1].max() < 0


def test_an_empty_road_has_no_batches(state: TrafficState) -> None:
    empty = TrafficState(
        0.0, (), (), *[np.zeros((0, 3))], *[np.zeros(0)] * 6, (), np.zeros(0, np.int32), np.zeros((0, 3))
    )
    assert vehicle_batches(empty, None) == ()
    assert Lamp.NONE == 0
