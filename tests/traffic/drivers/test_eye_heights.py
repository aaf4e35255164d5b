"""Eye heights by vehicle type."""

from fogsim.traffic.appearance import BODY_KINDS, EYE_HEIGHTS, SHAPE_KINDS, eye_height


def test_published_heights() -> None:
    for vehicle_class, published in [
        ("passenger", 1.08),
        ("truck", 2.33),
        ("coach", 1.8),
        ("bus", 1.8),
        ("motorcycle", 1.35),
        ("bicycle", 1.4),
    ]:
        assert eye_height(vehicle_class) == published


def test_a_type_that_says_only_by_its_shape_or_length_what_it_is() -> None:
    assert eye_height("passenger", "bus/coach") == eye_height("bus")
    assert eye_height("passenger", "", 16.5) == eye_height("trailer")
    assert eye_height("passenger", "passenger/sedan", 4.5) == eye_height("taxi") == eye_height("custom1")


def test_every_class_and_shape_that_is_known_has_a_height() -> None:
    heights = [eye_height(name) for name in BODY_KINDS] + [eye_height("passenger", shape) for shape in SHAPE_KINDS]
    assert all(1.0 < height < 3.0 for height in heights)
    assert {*BODY_KINDS.values(), *SHAPE_KINDS.values()} <= EYE_HEIGHTS.keys()
