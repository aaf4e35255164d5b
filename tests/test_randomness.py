import numpy as np

from fogsim.core.randomness import spawn_streams


def test_streams_and_seeds_differ() -> None:
    streams = spawn_streams(7)
    assert not np.array_equal(streams.camera.random(5), streams.sensors.random(5))
    assert streams.traffic_seed != spawn_streams(8).traffic_seed


def test_vehicles_of_a_run_share_its_patches_of_fog() -> None:
    assert spawn_streams(7, "car1").patch_seed == spawn_streams(7).patch_seed != spawn_streams(8).patch_seed


def test_sumo_takes_the_traffic_seed() -> None:
    assert all(0 <= spawn_streams(seed).traffic_seed < 2**31 for seed in range(50))


def test_streams_that_came_later_leave_the_earlier_ones_as_they_were() -> None:
    """Faults and satellite positioning came last: noise of camera and radar is as it was without them."""
    streams, earlier = spawn_streams(7), np.random.SeedSequence(7).spawn(5)
    for name, seed in zip(("camera", "sensors", "driver"), earlier[2:], strict=True):
        assert getattr(streams, name).random() == np.random.default_rng(seed).random()
