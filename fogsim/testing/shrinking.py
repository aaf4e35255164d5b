"""The smallest failing case: as many names as possible at their first values, numbers as near to them as possible."""

import contextlib
from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from fogsim.conditions import FindingVerdict
from fogsim.errors import InputError
from fogsim.scenario.loading import load_cases
from fogsim.scenario.variation import number_with_unit, value_text
from fogsim.study.execution import Engine
from fogsim.testing.collection import FogTest, collect
from fogsim.testing.judgement import Judgement
from fogsim.testing.page import command_text
from fogsim.testing.results import CaseResult, read_result
from fogsim.testing.session import FileOutcome
from fogsim.units.quantities import split_quantity

_HALVINGS = 5
"""Maximum number of bisection steps between a number and its first value."""

Values = Mapping[str, str]
"""Names and their values, as text, without those that are drawn for the seed."""

Fails = Callable[[Values], bool | None]
"""Whether a case fails; None if there is no such case, or its run went wrong."""


@dataclass(frozen=True, slots=True)
class SmallestCase:
    """The smallest case that fails, after `tried` further cases.

    `passes_at` has, for each number that is not at its first value, the nearest one towards it with which the case did
    not fail.
    """

    values: Values
    passes_at: Values
    tried: int


def smallest_text(test: FogTest, found: SmallestCase, settings: Sequence[str] = ()) -> str:
    """The smallest case in words, with the command that runs it."""
    passes = ", ".join(f"{name}={value}" for name, value in found.passes_at.items())
    limit = f", which no longer fails with {passes}" if passes else ""
    run = replace(test.runs[0], levels=found.values)
    return f"smallest failing case after {found.tried} more runs{limit}: {command_text(test, run, settings)}"


def shrink(
    outcome: FileOutcome, judgement: Judgement, settings: Sequence[str], engine: Engine, out: Path
) -> SmallestCase:
    """Search for the smallest case of a sweep in which a clause fails; further results go to `out`."""
    path = outcome.test.path
    variation = load_cases(path, settings).variation
    gridded = [name for name, values in variation.varied.items() if not values.is_drawn]
    first = {name: value_text(variation.varied[name].value(0)) for name in gridded}
    failing = [_values(result, gridded) for result in outcome.results if _fails(result, judgement)]
    start = min(failing, key=lambda values: sum(values[name] != first[name] for name in gridded))
    completed = [result for result in outcome.results if result.message is None]
    known = {case_key(_values(result, gridded)): _fails(result, judgement) for result in completed}
    divisible = {name for name in gridded if variation.varied[name].is_divisible}
    return smallest_case(
        start, first, divisible, known, lambda values: _run(path, settings, values, judgement, engine, out)
    )


def smallest_case(
    start: Values, first: Values, divisible: Container[str], known: Mapping[str, bool], run: Fails
) -> SmallestCase:
    """The smallest failing case from `start` down; `divisible` names are searched between their values.

    `known` outcomes, by `case_key`, are not run again.
    """
    outcomes: dict[str, bool | None] = {**known}
    tried = 0

    def fails(values: Values) -> bool | None:
        nonlocal tried
        key = case_key(values)
        if key not in outcomes:
            tried += 1
            outcomes[key] = run(values)
        return outcomes[key]

    values, passes_at = _at_first_values(start, first, fails), {}
    for name in first:
        nearer = _nearer(values, name, first[name], fails) if name in divisible else None
        if nearer is not None:
            values, passes_at[name] = nearer
    # With the values that others have since, it may fail there; and there may be no such case.
    passing = {name: value for name, value in passes_at.items() if fails({**values, name: value}) is False}
    return SmallestCase(values, passing, tried)


def _values(result: CaseResult, gridded: Sequence[str]) -> Values:
    return {name: result.run.levels[name] for name in gridded}


def case_key(values: Values) -> str:
    """A case as text, whatever the order of its names."""
    return repr(sorted(values.items()))


def _fails(result: CaseResult, judgement: Judgement) -> bool:
    return any(
        (one.name, one.clause) == (judgement.name, judgement.clause) and one.verdict is FindingVerdict.FAILED
        for one in result.findings
    )


def _run(
    path: Path, settings: Sequence[str], values: Values, judgement: Judgement, engine: Engine, out: Path
) -> bool | None:
    label = ",".join(f"{name}={value}" for name, value in values.items())
    with contextlib.suppress(InputError):
        (test,) = collect([path], settings, label)
        engine.run(test.runs, out, lambda *_: None)
        result = read_result(out, test.runs[0], [judgement.name])
        if result is not None and result.message is None:
            return _fails(result, judgement)
    return None


def _at_first_values(values: Values, first: Values, fails: Fails) -> Values:
    """A failing case in which no single name can be reset to its first value."""
    changed = True
    while changed:
        changed = False
        for name in first:
            simpler = {**values, name: first[name]}
            if values[name] != first[name] and fails(simpler):
                values, changed = simpler, True
    return values


def _nearer(values: Values, name: str, first: str, fails: Fails) -> tuple[Values, str] | None:
    """A failing case with a number nearer to its first value, and the nearest with which it did not fail."""
    if values[name] == first:
        return None
    bad, good = split_quantity(values[name]), split_quantity(first)
    if bad is None or good is None or bad[1] != good[1]:
        return None
    failing, passing = bad[0], good[0]
    for _ in range(_HALVINGS):
        middle = value_text(number_with_unit((failing + passing) / 2, bad[1]))
        found = fails({**values, name: middle})
        if found is None:
            break
        failing, passing = ((failing + passing) / 2, passing) if found else (failing, (failing + passing) / 2)
    ends = [value_text(number_with_unit(one, bad[1])) for one in (failing, passing)]
    return {**values, name: ends[0]}, ends[1]
