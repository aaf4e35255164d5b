from fogsim.traffic.appearance import (
    BODY_KINDS,
    EYE_HEIGHTS,
    LARGE_SECTION,
    PAINTS,
    SHAPE_KINDS,
    body_kind,
    cross_section,
    eye_height,
    lamps_from_many_signals,
    lamps_from_signals,
    paint,
)
from fogsim.values import Lamp


def test_body_kinds_by_class_or_by_the_shape_or_length_where_the_class_is_left_at_cars() -> None:
    classes = ("passenger", "delivery", "trailer", "coach", "bicycle", "tram", "emergency", "taxi")
    assert [body_kind(c) for c in classes] == ["car", "van", "truck", "bus", "motorcycle", "bus", "van", "car"]
    shapes = ("truck/semitrailer", "bus/coach", "passenger/sedan", "passenger/van", "unknown")
    assert [body_kind("passenger", shape) for shape in shapes] == ["truck", "bus", "car", "van", "car"]
    assert body_kind("bus", "truck") == "bus"
    assert [body_kind("passenger", "passenger", length) for length in (5.0, 12.0)] == ["car", "truck"]
    assert cross_section("truck", 1.8, 1.5) == LARGE_SECTION
    assert cross_section("truck", 2.3, 1.5) == (2.3, 1.5)
    assert cross_section("car", 1.8, 1.5) == (1.8, 1.5)


def test_paint_is_sumos_colour_or_one_of_the_common_ones() -> None:
    assert paint("a", (255, 255, 0, 255)) in PAINTS
    assert paint("a", (255, 255, 0, 255)) == paint("a", (255, 255, 0, 255))
    assert paint("a", (255, 0, 0, 255)) == (1.0, 0.0, 0.0)


def test_signals_to_lamps() -> None:
    """SUMO's signal bits: 0 blinker right, 1 left, 3 brake, 4 front, 5 fog, 6 high beam."""
    assert Lamp(lamps_from_signals(0b1010)) == Lamp.STOP | Lamp.INDICATOR_LEFT
    assert Lamp(lamps_from_signals(1 << 5)) == Lamp.REAR_FOG
    assert lamps_from_signals(0) == 0
    signals = [*range(128), 1 << 13, (1 << 13) | 8]
    assert lamps_from_many_signals(signals).tolist() == [lamps_from_signals(s) for s in signals]


def test_eye_heights_are_the_published_ones_by_class_shape_or_length() -> None:
    classes = ("passenger", "truck", "coach", "bus", "motorcycle", "bicycle")
    assert [eye_height(one) for one in classes] == [1.08, 2.33, 1.8, 1.8, 1.35, 1.4]
    assert eye_height("passenger", "bus/coach") == eye_height("bus")
    assert eye_height("passenger", "", 16.5) == eye_height("trailer")
    assert eye_height("passenger", "passenger/sedan", 4.5) == eye_height("taxi") == eye_height("custom1")
    heights = [eye_height(name) for name in BODY_KINDS] + [eye_height("passenger", shape) for shape in SHAPE_KINDS]
    assert all(1.0 < height < 3.0 for height in heights)
    assert {*BODY_KINDS.values(), *SHAPE_KINDS.values()} <= EYE_HEIGHTS.keys()
