import numpy as np
import pytest

from fogsim.scene import vehicle_batches
from fogsim.scene.vehicles import body_of, body_shapes
from fogsim.values import TrafficState
from tests.helpers.vehicles import vehicles

KINDS = ("car", "van", "truck", "bus", "motorcycle", "hovercraft")
SHAPES = body_shapes()


@pytest.fixture
def state() -> TrafficState:
    count = len(KINDS)
    rng = np.random.default_rng(2)
    return vehicles(
        rng.uniform(-50, 50, (count, 3)),
        kinds=KINDS,
        heading=rng.uniform(-np.pi, np.pi, count),
        size=rng.uniform((2, 0.8, 1.3), (16, 2.6, 4), (count, 3)),
        lamps=np.arange(count),
        paint=rng.uniform(0, 1, (count, 3)),
    )


@pytest.mark.parametrize("ending", ["", ":far", ":tiny", ":speck"])
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
            # A level has the area of its body; handlebars and mirrors that stick out are spread over its zones.
            room = 1e-4 if not ending else (0.35 if batch.shape == "motorcycle" else 0.06) * state.width[row]
            assert drawn == pytest.approx(box, abs=room)
    assert sorted(rows) == list(range(len(KINDS)))


def test_paint_and_lamps_follow_their_rows_and_the_vehicle_with_the_camera_is_left_out(state: TrafficState) -> None:
    drawn = np.concatenate([batch.instance for batch in vehicle_batches(state, 3)])
    assert sorted(drawn) == [16, 17, 18, 20, 21]
    assert vehicle_batches(vehicles([]), None) == ()
    for batch in vehicle_batches(state, None):
        rows = batch.instance - 16
        assert batch.paint == pytest.approx(state.paint[rows].astype(np.float32))
        assert np.array_equal(batch.lamps, state.lamps[rows])


def test_cars_come_in_four_shapes_that_stay_with_their_vehicles() -> None:
    names, again = ([body_of(f"v{i}", "car", 4.4, 1.5) for i in range(400)] for _ in range(2))
    assert names == again
    shares = {name: names.count(name) / 400 for name in set(names)}
    assert set(shares) == {"hatchback", "saloon", "estate", "suv"}
    assert min(shares.values()) > 0.12


def test_size_tells_what_a_vehicle_is() -> None:
    assert {body_of(f"v{i}", "car", 3.8, 1.5) for i in range(50)} == {"hatchback"}
    assert {body_of(f"v{i}", "car", 4.5, 1.7) for i in range(50)} == {"suv"}
    assert "hatchback" not in {body_of(f"v{i}", "car", 5.0, 1.5) for i in range(50)}
    assert {body_of(f"v{i}", "truck", 16.5, 4.0) for i in range(50)} == {"semitrailer", "semitrailer_curtain"}
    assert body_of("v", "truck", 8.5, 3.6) == "rigid_truck"
    assert body_of("v", "truck", 7.1, 2.4) == "flatbed_truck"
    for length, height in ((3.9, 1.4), (4.5, 1.5), (5.0, 1.5), (4.6, 1.8)):
        assert body_of("v", "hovercraft", length, height) == body_of("v", "car", length, height)
