"""Conditions as people write them: what they become, what they are as text, and what is refused."""

import pytest

from fogsim.conditions import parse_condition, parse_signal, signals_of
from fogsim.conditions.parsing import DEEPEST, mended
from fogsim.conditions.syntax import AllOf, AnyOf, Comparison, Delayed, Edge, Flag, Held, Not, Quantity, Reference, Word

EGO_SPEED = Reference("X.speed", ("ego",))


def test_one_test_of_a_signal() -> None:
    for written, read in [
        ("ego.speed > 90 km/h", Comparison(EGO_SPEED, ">", Quantity(25.0, "90", "km/h"))),
        ("ego.speed<=advice", Comparison(EGO_SPEED, "<=", Reference("advice"))),
        ("ego.collision", Flag(Reference("X.collision", ("ego",)))),
        ("not ego.collision", Not(Flag(Reference("X.collision", ("ego",))))),
        ("gap(ego, slow) < -3 m", Comparison(Reference("gap(X, Y)", ("ego", "slow")), "<", Quantity(-3.0, "-3", "m"))),
        ("flow.0.speed < -3 m/s", Comparison(Reference("X.speed", ("flow.0",)), "<", Quantity(-3.0, "-3", "m/s"))),
        ("warning is fog_ahead", Comparison(Reference("warning"), "==", Word("fog_ahead"))),
        ("warning is  not none", Comparison(Reference("warning"), "!=", Word("none"))),
        ('"0".lane == right', Comparison(Reference("X.lane", ("0",)), "==", Word("right"))),
        ('ego.speed > "0".speed', Comparison(EGO_SPEED, ">", Reference("X.speed", ("0",)))),
        ("distance(0, '1 2') > 5 m", Comparison(Reference("distance(X, Y)", ("0", "1 2")), ">", Quantity(5, "5", "m"))),
        (
            "fog.visibility_at_camera  falls   below 100 m",
            Edge(Reference("fog.visibility_at_camera"), "falls below", Quantity(100.0, "100", "m")),
        ),
        ("slow.lane changes", Edge(Reference("X.lane", ("slow",)), "changes")),
        ("fog.bank(0) becomes true", Edge(Reference("fog.bank(N)", ("0",)), "becomes", Word("true"))),
        ("lamps includes rear_fog", Comparison(Reference("lamps"), "include", Word("rear_fog"))),
        ("happened(timeline.0)", Flag(Reference("happened(EVENT)", ("timeline.0",)))),
        ("estimate(a.b:C).valid", Flag(Reference("estimate(METHOD).valid", ("a.b:C",)))),
        ("belief.error > 20 %", Comparison(Reference("belief.error"), ">", Quantity(0.2, "20", "%"))),
        ("ego.collision delayed 2 s", Delayed(Flag(Reference("X.collision", ("ego",))), Quantity(2.0, "2", "s"))),
        ("ego.collision for 2 s", Held(Flag(Reference("X.collision", ("ego",))), Quantity(2.0, "2", "s"))),
    ]:
        assert parse_condition(written) == read


def test_and_binds_closer_than_or_and_not_closest() -> None:
    a, b, c = (parse_condition(f"{name}.collision") for name in "abc")
    assert parse_condition("a.collision or b.collision and not c.collision") == AnyOf((a, AllOf((b, Not(c)))))
    assert parse_condition("(a.collision or b.collision) and c.collision") == AllOf((AnyOf((a, b)), c))
    assert parse_condition("(a.collision and b.collision) and c.collision") == AllOf((a, b, c))


def test_mappings_and_lists() -> None:
    for written, text in [
        ({"gap(ego, slow)": "< 80 m"}, "gap(ego, slow) < 80 m"),
        # What YAML makes of the same between braces.
        ({"gap(ego": None, "slow)": "< 80 m"}, "gap(ego, slow) < 80 m"),
        ({"ego.speed": "> 90 km/h", "ego.collision": False}, "ego.speed > 90 km/h and not ego.collision"),
        ({"ego.lane": 1, "ego.collision": None}, "ego.lane == 1 and ego.collision"),
        ({"ego.speed": "falls below 3 km/h"}, "ego.speed falls below 3 km/h"),
        ({"any": ["time > 3 s", {"ego.collision": True}]}, "time > 3 s or ego.collision"),
        ({"all": ["time > 3 s", {"not": "ego.collision"}]}, "time > 3 s and not ego.collision"),
        (["time > 3 s", "ego.collision"], "time > 3 s and ego.collision"),
    ]:
        assert str(parse_condition(written)) == text


def test_what_yaml_tears_apart_is_mended() -> None:
    torn = {"whenever": "gap(a", "b) < 3 m": None, "within": "2 s", "f(1": None, "2": None, "3)": "x", "d": None}
    assert mended(torn) == {"whenever": "gap(a, b) < 3 m", "within": "2 s", "f(1, 2, 3)": "x", "d": None}
    assert mended({"gap(a": None}) == {"gap(a": None}


def test_what_is_refused() -> None:
    for written, told in [
        ("ego.spede > 3 m/s", "did you mean 'ego.speed'"),
        ("fog.visibility_ahed < 3 m", "did you mean 'fog.visibility_ahead'"),
        ("gap(ego) < 3 m", r"it is gap\(X, Y\)"),
        ("bfog > 3 m", "unknown signal 'bfog'"),
        ("slow.speed > 3", "'3' has no unit"),
        ("ego.speed > 3 kg", "the unit 'kg' does not fit"),
        ("ego.speed > 3 blubb", "unknown unit 'blubb'"),
        ("ego.lane == rigt", "did you mean 'right'"),
        ("ego.lane == 1.5", "whole number, right or left"),
        ("lamps include fog", "did you mean 'rear_fog'|did you mean 'front_fog'"),
        ("time < limit", r"time \[s\] does not compare with limit \[m/s\]"),
        ("ego.collision > 3", "goes with ==, !=, becomes, changes, not with '>'"),
        ("ego.speed", "expected <, <="),
        ("ego.speed > ", "got the end"),
        ("time > 3 s and", "expected a signal"),
        ("(time > 3 s", r"expected '\)'"),
        ("not ego.collision for 3 s", r"write '\(not …\) for …' or 'not \(… for …\)'"),
        ("not (time > 3 s) delayed 1 s", r"write '\(not …\) delayed …'"),
        ("time > 3 s time > 4 s", "expected 'and', 'or', 'for', 'delayed' or the end"),
        ("fog.bank(first)", "named by its number"),
        ("gap(a b", "expected ',' or"),
        ("gap(,", "expected a name"),
        ("", "expected a signal"),
        ("3 m < ego.gap", "expected a signal"),
        ("ego.leader == and", "expected a word"),
        (3, "expected a condition"),
        ({}, "expected a condition"),
        ([], "expected a condition"),
        ({"ego.speed": ["> 3 m/s"]}, "expected a quantity"),
        ("(" * (DEEPEST + 1) + "time > 3 s" + ")" * (DEEPEST + 1), "deep inside one another"),
        ("time > 3 s and " * 1000, "at most 10000 characters"),
    ]:
        with pytest.raises(ValueError, match=told):
            parse_condition(written)
    written: object = "time > 3 s"
    for _ in range(DEEPEST + 1):
        written = [written]
    with pytest.raises(ValueError, match="deep inside one another"):
        parse_condition(written)


def test_the_signals_of_a_condition() -> None:
    told = signals_of(parse_condition("ego.speed > advice and (gap(ego, b) < 3 m or not ego.speed > 3 m/s) for 2 s"))
    assert [str(signal) for signal in told] == ["ego.speed", "advice", "gap(ego, b)"]


def test_one_signal_by_itself() -> None:
    assert parse_signal("gap(ego, b)") == Reference("gap(X, Y)", ("ego", "b"))
    assert str(parse_signal("ego.curvature")) == "ego.curvature"
    for written, message in (("ego.sped", "did you mean 'ego.speed'"), ("ego.speed > 3", "the end"), ("", "a signal")):
        with pytest.raises(ValueError, match=message):
            parse_signal(written)
