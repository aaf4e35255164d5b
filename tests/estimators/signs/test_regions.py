"""Signs of the map in the picture: where they are looked for, which detection is whose, what a drive makes of it."""

import math
from dataclasses import replace

import pytest

from fogsim.estimators.signs.regions import (
    GATE,
    PoseDeviation,
    ProjectedSign,
    Registration,
    project_sightings,
    register_signs,
)
from fogsim.estimators.signs.watch import SignTracks
from fogsim.values import Camera, SignSighting
from fogsim.vision.symmetry.detection import SignDetection

CAMERA = Camera(1400, 600, 1100.0, (700.0, 280.0), 1.3)
SIGN = SignSighting("s", "speed_limit", 22.2, 48.0, -5.0, 0.9, 2.3)


def shown(camera: Camera = CAMERA, *deviations: PoseDeviation, **changes: object) -> ProjectedSign:
    (seen,) = project_sightings([replace(SIGN, **changes)], camera, 2.0, *deviations)
    return seen


def test_a_sign_is_where_a_pinhole_shows_it() -> None:
    seen = shown()
    assert seen.u == pytest.approx(700.0 + 1100.0 * 5.0 / 50.0)
    assert seen.v == pytest.approx(280.0 - 1100.0 * 1.0 / 50.0)
    assert seen.radius == pytest.approx(1100.0 * 0.45 / 50.0)
    assert seen.distance == pytest.approx(math.sqrt(50.0**2 + 5.0**2 + 1.0))
    assert seen.expected


def test_a_sign_at_the_cameras_height_is_on_the_horizon_whatever_pitch_and_roll() -> None:
    pitched = replace(CAMERA, pitch=math.radians(3.0))
    assert shown(pitched, height=1.3, lateral=0.0, distance=1e3, diameter=9.0).v == pytest.approx(pitched.horizon_row)
    rolled = replace(CAMERA, roll=math.radians(10.0))
    level, turned = shown(), shown(rolled)
    assert turned.v > level.v  # the right side is turned down
    assert math.dist((turned.u, turned.v), (700, 280)) == pytest.approx(math.dist((level.u, level.v), (700, 280)))


def test_regions_are_as_large_as_the_pose_is_unsure() -> None:
    near, far = shown(distance=18.0), shown(distance=98.0)
    assert near.deviation_u == pytest.approx(math.hypot(27.5, 0.25 * 27.5, 3.84), rel=1e-3)
    assert far.deviation_u == pytest.approx(math.hypot(5.5, 0.05 * 5.5, 3.84), rel=1e-3)
    assert far.region.half_width == pytest.approx(GATE * far.deviation_u)
    exact = shown(CAMERA, PoseDeviation(0.0, 0.0, 0.0, 0.0))
    assert (exact.deviation_u, exact.deviation_v) == (0.0, 0.0)


def test_what_the_picture_cannot_show_is_not_looked_for() -> None:
    away = [{"distance": distance} for distance in (-5.0, math.nan, 400.0)]
    for other in (*away, {"lateral": 45.0}, {"height": -60.0}, {"diameter": 0.0}):
        assert project_sightings([replace(SIGN, **other)], CAMERA, 2.0) == ()


def test_a_sign_at_the_border_is_looked_for_but_neither_expected_nor_missed() -> None:
    sign, tracks = shown(lateral=-31.8), SignTracks()
    assert not sign.expected
    tracks.update(0.0, [sign], [])
    assert tracks.tracks[0].misses == 0


def at(sign: ProjectedSign, off_u: float = 0.0, off_v: float = 0.0, size: float = 1.0) -> SignDetection:
    return SignDetection(sign.u + off_u, sign.v + off_v, size * sign.radius, 1.0)


def test_each_detection_is_one_signs_and_the_whole_is_likeliest() -> None:
    """The upper of two signs on a post is not found where both look a little lower than they should."""
    upper, lower = shown(sign_id="upper", height=3.3), shown(sign_id="lower")
    found = register_signs([upper, lower], [at(lower, off_v=5.0), at(upper, off_v=5.0)])
    assert [(one.sign, one.detection.v) for one in found] == [(upper, upper.v + 5.0), (lower, lower.v + 5.0)]
    (only,) = register_signs([upper, lower], [at(lower)])
    assert only.sign is lower


def test_nothing_is_paired_beyond_the_gate() -> None:
    one = shown()
    assert register_signs([one], [at(one, off_u=4.1 * one.deviation_u)]) == ()
    assert register_signs([one], [at(one, size=2.0)]) == ()
    assert register_signs([], [at(one)]) == register_signs([one], []) == ()


def test_confidence_falls_from_near_one_with_the_offset() -> None:
    one = shown()
    confidence = [
        register_signs([one], [at(one, off_u=off * one.deviation_u)])[0].confidence for off in (0.0, 1.0, 2.0, 3.9)
    ]
    assert confidence == sorted(confidence, reverse=True)
    assert confidence[0] > 0.98
    assert 0.01 < confidence[3] < 0.2
    assert confidence[0] == pytest.approx(register_signs([one], [at(one)])[0].confidence)


def drive(seen: str) -> SignTracks:
    """Drive towards a sign in steps of 5 m from 120 m; + where it is seen, - where not."""
    tracks = SignTracks()
    for step, mark in enumerate(seen):
        sign = shown(distance=120.0 - 5.0 * step)
        tracks.update(0.2 * step, [sign], [Registration(sign, at(sign), 0.9)] if mark == "+" else [])
    return tracks


def distance(step: int) -> float:
    return shown(distance=120.0 - 5.0 * step).distance


def test_the_first_of_confirmed_detections_counts_and_lies_before_the_last_miss() -> None:
    for seen, first, unseen, counts in [
        ("---++-+", 3, 2, (3, 4, 0)),
        ("-+----++", 6, 5, (2, 5, 0)),  # a false alarm is forgotten
        ("+++", 0, None, (3, 0, 0)),  # it may have been visible from afar
        ("-----", None, 4, (0, 5, 5)),
    ]:
        (track,) = drive(seen).tracks
        assert track.confirmed == (first is not None)
        assert track.first_seen == (None if first is None else pytest.approx(distance(first))), seen
        assert track.unseen_before == (None if unseen is None else pytest.approx(distance(unseen))), seen
        assert (track.detections, track.misses, track.misses_since) == counts, seen


def test_a_sign_that_the_map_no_longer_shows_ahead_has_been_passed() -> None:
    tracks = drive("-++")
    (passed,) = tracks.update(1.0, [], [])
    assert passed.confirmed
    assert tracks.tracks == ()


def test_of_two_signs_with_one_id_the_first_counts() -> None:
    tracks = SignTracks()
    tracks.update(0.0, [shown(distance=40.0), shown(distance=90.0)], [])
    assert [track.sign.sighting.distance for track in tracks.tracks] == [40.0]
