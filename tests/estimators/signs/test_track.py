import pytest

from fogsim.estimators.signs.regions import Registration, project_sightings
from fogsim.estimators.signs.watch import SignTracks
from fogsim.values import Camera, SignSighting
from fogsim.vision.symmetry.detection import SignDetection

CAMERA = Camera(1400, 600, 1100.0, (700.0, 280.0), 1.3)


def drive(seen: str, name: str = "s") -> SignTracks:
    """Drive towards a sign in steps of 5 m from 120 m; + where it is seen, - where not."""
    tracks = SignTracks()
    for step, mark in enumerate(seen):
        signs = project_sightings([SignSighting(name, "stop", 0.0, 120.0 - 5.0 * step, -5.0, 0.9)], CAMERA, 2.0)
        hits = [Registration(one, SignDetection(one.u, one.v, one.radius, 1.0), 0.9) for one in signs]
        tracks.update(0.2 * step, signs, hits if mark == "+" else [])
    return tracks


def distance(step: int) -> float:
    (sign,) = project_sightings([SignSighting("s", "stop", 0.0, 120.0 - 5.0 * step, -5.0, 0.9)], CAMERA, 2.0)
    return sign.distance


def test_the_first_of_confirmed_detections_counts_and_lies_before_the_last_miss() -> None:
    (track,) = drive("---++-+").tracks
    assert track.confirmed
    assert track.first_seen == pytest.approx(distance(3))
    assert track.unseen_before == pytest.approx(distance(2))
    assert (track.detections, track.misses, track.misses_since) == (3, 4, 0)


def test_a_false_alarm_is_forgotten() -> None:
    (track,) = drive("-+----++").tracks
    assert track.first_seen == pytest.approx(distance(6))
    assert track.unseen_before == pytest.approx(distance(5))


def test_one_seen_at_once_may_have_been_visible_from_afar() -> None:
    (track,) = drive("+++").tracks
    assert track.unseen_before is None


def test_a_sign_that_should_be_seen_and_is_not_is_missed() -> None:
    (track,) = drive("-----").tracks
    assert track.first_seen is None
    assert not track.confirmed
    assert track.misses == 5
    assert track.unseen_before == pytest.approx(distance(4))


def test_what_the_picture_does_not_show_whole_is_not_missed() -> None:
    tracks = SignTracks()
    (sign,) = project_sightings([SignSighting("s", "stop", 0.0, 48.0, -31.8, 0.9)], CAMERA, 2.0)
    tracks.update(0.0, [sign], [])
    assert tracks.tracks[0].misses == 0


def test_a_sign_that_the_map_no_longer_shows_ahead_has_been_passed() -> None:
    tracks = drive("-++")
    (passed,) = tracks.update(1.0, [], [])
    assert passed.confirmed
    assert tracks.tracks == ()


def test_of_two_signs_with_one_id_the_first_counts() -> None:
    tracks = SignTracks()
    signs = [
        *project_sightings([SignSighting("s", "stop", 0.0, 40.0, -5.0, 0.9)], CAMERA, 2.0),
        *project_sightings([SignSighting("s", "stop", 0.0, 90.0, -5.0, 0.9)], CAMERA, 2.0),
    ]
    tracks.update(0.0, signs, [])
    assert [track.sign.sighting.distance for track in tracks.tracks] == [40.0]
