"""Conditions over time, what is not known, and what cannot be otherwise."""

import contextlib
from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fogsim.conditions import Condition, Need, RunContent, Watch, condition_mistakes, outcomes, parse_condition
from fogsim.conditions.logic import combined
from fogsim.conditions.signal import Kind
from fogsim.conditions.signals import SIGNALS
from fogsim.conditions.syntax import AllOf, AnyOf, Comparison, Delayed, Edge, Flag, Held, Not, Quantity, Reference, Word
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values import Estimate
from tests.recorders.synthetic import make_step


def over(condition: str, speeds: Sequence[float]) -> list[bool | None]:
    watch = Watch(parse_condition(condition))
    return [watch.update(make_step(i, time=0.5 * i, speed=speed)) for i, speed in enumerate(speeds)]


def test_passing_a_value() -> None:
    assert over("ego.speed falls below 20 m/s", [25, 20, 19, 18, 22, 19]) == [False, False, True, False, False, True]
    assert over("ego.speed rises above 20 m/s", [25, 20, 21, 25]) == [False, False, True, False]
    assert over("ego.speed becomes 20 m/s", [20, 21, 20, 20]) == [False, False, True, False]
    assert over("ego.speed changes", [20, 20, 21]) == [False, False, True]
    # What is below at the beginning has not fallen.
    assert over("ego.speed falls below 20 m/s", [5, 4]) == [False, False]


def test_a_signal_passes_another_one_whichever_of_both_moves() -> None:
    watch = Watch(parse_condition("ego.speed rises above advice"))
    advised = 33.0, 33.0, 15.0, 15.0, 33.0, 20.0
    found = [watch.update(make_step(i, time=0.5 * i, speed=25.0, advised=one)) for i, one in enumerate(advised)]
    assert found == [False, False, True, False, False, True]


def test_one_signal_in_two_tests_is_read_once() -> None:
    both = "ego.speed falls below 20 m/s and not ego.speed falls below 20 m/s"
    assert over(both, [25, 15, 25]) == [False, False, False]
    either = "ego.speed falls below 20 m/s or ego.speed falls below 10 m/s"
    assert over(either, [25, 15, 5]) == [False, True, True]


def test_held_for_a_time() -> None:
    assert over("ego.speed < 20 m/s for 1 s", [10, 10, 10, 30, 10, 10, 10]) == [
        False, False, True, False, False, False, True
    ]  # fmt: skip


def test_what_is_not_known() -> None:
    for condition, known in (
        ("ghost.speed > 3 m/s", None),
        ("not ghost.speed > 3 m/s", None),
        ("ghost.speed > 3 m/s and time > 99 s", False),
        ("ghost.speed > 3 m/s or time < 99 s", True),
        ("ghost.speed > 3 m/s or time > 99 s", None),
        ("ego.speed > ghost.speed", None),
        ("ghost.speed changes", None),
        ("ghost.speed > 3 m/s for 1 s", None),
    ):
        assert over(condition, [1.0]) == [known], condition
    watch = Watch(parse_condition("estimate(m).valid becomes true"))
    assert [watch.update(make_step(i)) for i in range(2)] == [None, None]


@pytest.mark.parametrize("how", ["falls below 50 m", "becomes 30 m", "changes"])
def test_nothing_is_passed_over_a_gap(how: str) -> None:
    watch = Watch(parse_condition(f"estimate(m).visibility {how}"))
    k = OPTICAL_DEPTH_AT_VISIBILITY
    seen = k / 60.0, k / 60.0, None, k / 30.0, k / 30.0, k / 60.0, k / 30.0
    estimates = [() if one is None else (Estimate("m", one, 0.01, valid=True),) for one in seen]
    held = [watch.update(make_step(time=0.5 * i, estimates=one)) for i, one in enumerate(estimates)]
    assert held == [False, False, None, None, False, how == "changes", True]


def test_values_are_told_in_the_units_that_were_written() -> None:
    watch = Watch(parse_condition("ego.speed > 20 m/s and ego.speed <= advice and belief.error < 20 %"))
    assert watch.update(make_step(speed=25.0, advised=15.0)) is False
    assert watch.readings() == "ego.speed = 25 m/s, advice = 15 m/s, belief.error = unknown"
    level = Watch(parse_condition("ego.speed > 0"))
    level.update(make_step(speed=25.0))
    assert level.readings() == "ego.speed = 90 km/h"


TRUE, FALSE, BOTH = {True}, {False}, {True, False}


def test_what_a_condition_can_be() -> None:
    for condition, possible in [
        ("ego.speed >= 0", TRUE),
        ("ego.speed < 0", FALSE),
        ("ego.speed <= 600 km/h", TRUE),
        ("ego.ttc < inf", BOTH),
        ("gap(ego, a) >= 0", BOTH),
        ("ego.speed > 50 km/h and ego.speed < 30 km/h", FALSE),
        ("ego.speed > 50 km/h or ego.speed < 80 km/h", TRUE),
        ("ego.collision or not ego.collision", TRUE),
        ("ego.lane == right or ego.lane != right", TRUE),
        ("ego.lane == right and ego.lane == 2", FALSE),
        ("ego.lane == right and ego.lane == left", BOTH),
        ("ego.lane < 0", FALSE),
        ("lamps include stop or not lamps include stop", TRUE),
        ("ending == arrived and ending == collision", FALSE),
        ("ego.leader == a", BOTH),
        ("ego.speed <= ego.speed", TRUE),
        ("ego.speed < ego.speed", FALSE),
        ("ego.speed <= advice", BOTH),
        ("ego.speed falls below 0", FALSE),
        ("ego.speed rises above 600 km/h", FALSE),
        ("ego.speed becomes 600 km/h", FALSE),
        ("ego.speed falls below 3 m/s", BOTH),
        ("ego.speed >= 0 for 2 s", TRUE),
    ]:
        assert outcomes(parse_condition(condition)) == possible
    # One of very many cases is held to be open.
    many = " and ".join(f"v{n}.speed >= 0" for n in range(12))
    assert outcomes(parse_condition(many)) == BOTH
    with pytest.raises(TypeError, match="expected and, or, or not"):
        combined(Flag(Reference("time")), lambda _: None)


def test_what_a_run_cannot_tell() -> None:
    for condition, told in [
        ("ego.ttc > 3 s", []),
        ("belief.visibility > 3 m", ["belief.visibility needs frames, and this run has none"]),
        ("fog.bank(1)", ["fog.bank(1): there is no fog.banks.1; the fog has 1 banks"]),
        ("happened(cut)", ["happened(cut): unknown event 'cut'; did you mean 'cut_in'? Known: timeline.0, cut_in"]),
    ]:
        content = RunContent(frozenset({Need.EGO, Need.ROUTE}), (), 1, ("timeline.0", "cut_in"))
        assert list(condition_mistakes(parse_condition(condition), content)) == told
    # Without an ego, none is called so.
    content = RunContent(frozenset())
    (told,) = condition_mistakes(parse_condition("distance(ego, a) < 3 m"), content)
    assert told == "distance(ego, a) needs an ego, and this run has none"
    assert not list(condition_mistakes(parse_condition("distance(b, a) < 3 m"), content))


# Any condition, by its grammar: as text it is read as what it was.

NAMES = st.text("abcXYZ019_.-:# é", min_size=1, max_size=8).filter(lambda name: name.strip() == name)


@st.composite
def references(draw: st.DrawFn, kind: Kind | None = None) -> Reference:
    signal = draw(st.sampled_from([name for name, found in SIGNALS.items() if kind in (None, found.kind)]))
    places = SIGNALS[signal].places
    special = {"BANK": "3", "LENGTH": "4.8 m"}
    arguments = (st.just(special[place.name]) if place.name in special else NAMES for place in places)
    return Reference(signal, tuple(draw(one) for one in arguments))


@st.composite
def single_tests(draw: st.DrawFn) -> Condition:
    left = draw(references())
    signal = SIGNALS[left.signal]
    if signal.kind is Kind.FLAG:
        return draw(st.sampled_from([Flag(left), Comparison(left, "==", Word("false")), Edge(left, "changes")]))
    if signal.kind is Kind.WORD:
        word = Word(draw(st.sampled_from(signal.words)) if signal.words else draw(NAMES))
        return Comparison(left, draw(st.sampled_from(["==", "!="])), word)
    if signal.kind is Kind.WORDS:
        return Comparison(left, "include", Word(draw(st.sampled_from(signal.words))))
    number = draw(st.integers(-99, 99))
    quantity = Quantity(float(number), str(number), signal.unit)
    relation = draw(st.sampled_from(["<", "<=", ">", ">=", "==", "!="]))
    return draw(st.sampled_from([Comparison(left, relation, quantity), Edge(left, "rises above", quantity)]))


def joined(inner: st.SearchStrategy[Condition]) -> st.SearchStrategy[Condition]:
    single = inner.filter(lambda part: not isinstance(part, AllOf | AnyOf))
    return st.one_of(
        inner.map(Not),
        inner.map(lambda part: Held(part, Quantity(2.0, "2", "s"))),
        inner.map(lambda part: Delayed(part, Quantity(2.0, "2", "s"))),
        st.lists(inner.filter(lambda part: not isinstance(part, AllOf)), min_size=2, max_size=3).map(
            lambda parts: AllOf(tuple(parts))
        ),
        st.lists(single, min_size=2, max_size=3).map(lambda parts: AnyOf(tuple(parts))),
    )


@given(st.recursive(single_tests(), joined, max_leaves=5))
def test_a_condition_as_text_is_read_as_what_it_was(condition: Condition) -> None:
    assert parse_condition(str(condition)) == condition


@given(st.text("abego.speed<>= ()0123 m/sand'\",", max_size=30))
def test_any_text_is_read_or_refused(text: str) -> None:
    with contextlib.suppress(ValueError):
        condition = parse_condition(text)
        assert parse_condition(str(condition)) == condition
