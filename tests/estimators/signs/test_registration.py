import pytest

from fogsim.estimators.signs.regions import project_sightings, register_signs
from fogsim.values import Camera, SignSighting
from fogsim.vision.symmetry.detection import SignDetection

CAMERA = Camera(1400, 600, 1100.0, (700.0, 280.0), 1.3)


def sign(name: str, distance: float, height: float = 2.3):
    (seen,) = project_sightings([SignSighting(name, "stop", 0.0, distance, -5.0, 0.9, height)], CAMERA, 2.0)
    return seen


def at(projected, off_u: float = 0.0, off_v: float = 0.0, size: float = 1.0, strength: float = 1.0) -> SignDetection:
    return SignDetection(projected.u + off_u, projected.v + off_v, size * projected.radius, strength)


def test_each_detection_is_one_signs_and_the_whole_is_likeliest() -> None:
    """The upper of two signs on a post is not found where both look a little lower than they should."""
    upper, lower = sign("upper", 48.0, 3.3), sign("lower", 48.0, 2.3)
    found = register_signs([upper, lower], [at(lower, off_v=5.0), at(upper, off_v=5.0)])
    assert [(one.sign.sighting.sign_id, one.detection.v) for one in found] == [
        ("upper", upper.v + 5.0),
        ("lower", lower.v + 5.0),
    ]
    (only,) = register_signs([upper, lower], [at(lower)])
    assert only.sign is lower


def test_nothing_is_paired_beyond_the_gate() -> None:
    one = sign("one", 48.0)
    assert register_signs([one], [at(one, off_u=4.1 * one.deviation_u)]) == ()
    assert register_signs([one], [at(one, size=2.0)]) == ()
    assert register_signs([], [at(one)]) == register_signs([one], []) == ()


def test_confidence_falls_from_near_one_with_the_offset() -> None:
    one = sign("one", 48.0)
    confidence = [
        register_signs([one], [at(one, off_u=off * one.deviation_u)])[0].confidence for off in (0.0, 1.0, 2.0, 3.9)
    ]
    assert confidence == sorted(confidence, reverse=True)
    assert confidence[0] > 0.98
    assert 0.01 < confidence[3] < 0.2
    assert confidence[0] == pytest.approx(register_signs([one], [at(one)])[0].confidence)
