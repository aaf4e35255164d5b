from dataclasses import dataclass, replace

import numpy as np
import pytest

from fogsim.estimators.tracked_vehicle import LOST, SmoothedRanges, TrackedVehicle
from fogsim.values.observation import LeadMeasurement

TIME = np.arange(0.0, 13.0, 0.5)
TRUE = 25.0 + 5.0 * TIME + 0.15 * TIME**2
SPEED = 5.0 + 0.3 * TIME


def smoothed(distance, speed, time=TIME, deviation=0.25):
    ranges = SmoothedRanges(deviation)
    numbers = [
        ranges.add(t, LeadMeasurement(float(d), float(v))) for t, d, v in zip(time, distance, speed, strict=True)
    ]
    return ranges.smoothed(numbers, np.asarray(distance))


def noisy(seed):
    rng = np.random.default_rng(seed)
    return TRUE + rng.normal(0.0, 0.25, TIME.size), SPEED + rng.normal(0.0, 0.1, TIME.size)


def test_ranges_without_noise_stay():
    assert smoothed(TRUE, SPEED) == pytest.approx(TRUE, abs=1e-9)


def test_noise_is_at_least_halved():
    errors = [smoothed(*noisy(seed)) - TRUE for seed in range(40)]
    assert np.std(errors) < 0.5 * 0.25
    assert abs(np.mean(errors)) < 0.02


def test_a_jump_of_the_sensor_stays_a_jump():
    distance, speed = noisy(1)
    jumped = distance + np.where(TIME > 6.0, 4.0, 0.0)
    found = smoothed(jumped, speed) - np.where(TIME > 6.0, 4.0, 0.0)
    assert np.abs(found - TRUE).max() < 0.5


def test_one_wrong_range_leaves_the_others():
    distance, speed = noisy(2)
    distance[10] += 6.0
    found = smoothed(distance, speed)
    assert found[10] == distance[10]
    assert np.abs(np.delete(found - TRUE, 10)).max() < 0.5


@pytest.mark.parametrize(("told", "period"), [(0.0, 0.04), (-5.0, 0.1), (np.nan, 0.5)])
def test_speeds_that_are_not_of_these_ranges_are_not_believed(told, period):
    time = np.arange(0.0, 10.0, period)
    distance = 25.0 + 5.0 * time + np.random.default_rng(3).normal(0.0, 0.25, time.size)
    found = smoothed(distance, np.full(time.size, told), time)
    assert np.abs(found - distance).max() < 1.5


def test_pictures_without_a_time_keep_their_ranges():
    distance, speed = noisy(4)
    assert smoothed(distance, speed, np.zeros(TIME.size)) == pytest.approx(distance)


def test_what_is_too_old_keeps_its_range():
    ranges = SmoothedRanges(0.25)
    for i in range(600):
        ranges.add(0.1 * i, LeadMeasurement(30.0 + 0.2 * (-1) ** i, 0.0))
    found = ranges.smoothed([0, 599], np.array([30.2, 29.8]))
    assert found[0] == 30.2
    assert found[1] == pytest.approx(30.0, abs=0.1)


def test_without_noise_nothing_is_smoothed():
    distance, speed = noisy(5)
    assert smoothed(distance, speed, deviation=0.0) is distance


@dataclass(frozen=True)
class Look:
    number: int
    distance: float
    picture: object
    ratio: float = 1.0


class Track(TrackedVehicle[Look]):
    def _compare(self, reference, detection):
        ratio = detection.distance / reference.distance
        return None if ratio > 2.0 else replace(detection, ratio=ratio)

    def see(self, *distances, reference=0):
        for number, distance in enumerate(distances):
            self._keep(Look(number, distance, object()))
            if number == reference:
                self._compare_all(self.detections[-1])


def test_all_are_compared_with_the_reference_and_what_cannot_be_is_dropped():
    track = Track(SmoothedRanges(0.0), 9)
    track.see(10.0, 30.0, 20.0, reference=2)
    assert [one.ratio for one in track.detections] == [0.5, 1.5, 1.0]
    track._compare_all(track.detections[0])
    assert [(one.distance, one.ratio) for one in track.detections] == [(10.0, 1.0), (20.0, 2.0)]


def test_with_a_picture_that_shows_nothing_the_track_begins_anew():
    track = Track(SmoothedRanges(0.0), 9)
    track.see(10.0, 12.0)
    track._compare_all(Look(2, 1.0, object()))
    assert not track.detections
    assert track.reference is None


@pytest.mark.parametrize(("keeps_reference", "kept"), [(False, [2.0, 3.0]), (True, [1.0, 3.0])])
def test_the_oldest_gives_way(keeps_reference, kept):
    track = Track(SmoothedRanges(0.0), 2, keeps_reference=keeps_reference)
    track.see(1.0, 2.0, 3.0)
    assert [one.distance for one in track.detections] == kept


def test_likely_distances_are_from_where_detections_are_measured():
    distance, speed = noisy(6)
    ranges = SmoothedRanges(0.25)
    track = Track(ranges, 99, offset=1.7)
    for t, d, v in zip(TIME, distance, speed, strict=True):
        number = ranges.add(t, LeadMeasurement(float(d), float(v)))
        track._keep(Look(number, float(d) + 1.7, object()))
    assert track.likely_distances() - 1.7 == pytest.approx(smoothed(distance, speed))


def test_a_vehicle_is_lost_after_so_many_frames_without_it():
    track = Track(SmoothedRanges(0.0), 9)
    assert [track.miss() for _ in range(LOST)] == [False] * (LOST - 1) + [True]
