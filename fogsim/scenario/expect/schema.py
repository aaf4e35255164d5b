"""The schema of the block ``expect``: what must hold in a run."""

import math
import re
from collections.abc import Iterator, Mapping
from typing import Annotated, Self

from pydantic import BeforeValidator, ConfigDict, Field, WithJsonSchema, field_validator, model_validator

from fogsim.conditions import (
    EGO,
    Always,
    Clause,
    Condition,
    Eventually,
    Happened,
    Limits,
    MetricCheck,
    Whenever,
    mended,
    outcomes,
    pointless_parts,
)
from fogsim.conditions.logic import compared
from fogsim.conditions.parsing import OPERATORS
from fogsim.errors import shown, suggest
from fogsim.scenario.expect.conditions import WrittenCondition, refuse
from fogsim.scenario.plain_yaml import KeyPath
from fogsim.scenario.section import Flag, Id, Section, Time, Whole
from fogsim.units import clock_time
from fogsim.units.quantities import UNIT_OF_SUFFIX, is_quantity, parse_quantity
from fogsim.values import Ending

_CLAUSES = ("always", "never", "eventually", "whenever", "happened", "metric")

_GOES_WITH = {
    "while": ("always", "never", "eventually"),
    "for_at_least_s": ("always", "never"),
    "within_s": ("whenever", "eventually", "happened"),
    "require": ("whenever",),
    "throughout": ("whenever",),
    "at_least": ("whenever",),
}

_WANTED: Mapping[str, Mapping[str, bool]] = {
    "always": {"cannot fail": True, "cannot pass": False},
    "never": {"cannot fail": False, "cannot pass": True},
    "eventually": {"cannot fail": True, "cannot pass": False},
    "require": {"cannot fail": True, "cannot pass": False},
    "whenever": {"would test nothing": False},
    "while": {"would test nothing": False},
}
"""Meaning of a clause whose condition is always true, or always false."""

_TIMES = re.compile(r"\s*(\d+)\s*times?\s*\Z")

_METRIC = re.compile(r"\s*([A-Za-z_][^\s<>=!]*)\s*(<=|>=|==|!=|<|>)\s*(\S.*?)\s*\Z")


_SHARE = (0.0, 1.0)
"""Range of metrics whose keys end in ``_share``."""

_RATIO = "traffic_delay_share"
"""The only share that may exceed 1: time lost in proportion to the time at free flow."""


def _number_of_times(value: object) -> object:
    """Accept a number of times as ``3 times`` or ``once``."""
    match = _TIMES.match(value) if isinstance(value, str) else None
    return int(match[1]) if match else 1 if value == "once" else value


_TIMES_SCHEMA = {"anyOf": [{"type": "integer", "minimum": 1, "maximum": 1_000_000}, {"type": "string"}]}

Times = Annotated[Whole, Field(ge=1, le=1_000_000), BeforeValidator(_number_of_times), WithJsonSchema(_TIMES_SCHEMA)]
"""A number of times, perhaps written ``3 times``."""


RequirementId = Annotated[str, Field(pattern=r"^\S(.*\S)?$", max_length=100)]
"""Id of a requirement, such as ``SYS-REQ-042``."""


def _listed(value: object) -> object:
    """Accept a single id for a list of one."""
    return [value] if isinstance(value, str) else value


class Expectation(Section):
    """What is expected of a run: one clause or several."""

    model_config = ConfigDict(serialize_by_alias=True, validate_by_name=True, validate_by_alias=True)

    always: WrittenCondition | None = None
    """Holds at every step at which it is known."""

    never: WrittenCondition | None = None
    """Holds at no step."""

    eventually: WrittenCondition | None = None
    """Holds at some step, before the run or the time `within` is over."""

    during: WrittenCondition | None = Field(default=None, alias="while")
    """Only steps at which this holds count for `always`, `never` and `eventually`."""

    for_at_least_s: Time = 0.0
    """Time that must count for `always` and `never`; with less the result is inconclusive."""

    whenever: WrittenCondition | None = None
    """Each time this becomes true, `require` must hold."""

    require: WrittenCondition | None = None
    """What must hold then: at once, once `within` a time, or all that time with `throughout`."""

    within_s: Time | None = None
    """Time after `whenever` became true; for `eventually` and `happened` since the run began."""

    throughout: Flag = False
    """Whether `require` must hold all the time `within`."""

    at_least: Times = 1
    """How often `whenever` must have been tried; with fewer times the result is inconclusive."""

    happened: Id | None = None
    """Name of an entry of the timeline that must begin; if it never does, the result is inconclusive."""

    metric: Annotated[str, Field(max_length=200)] | None = None
    """A key of metrics.json with what it must be: `minimum_gap_m >= 5`."""

    requirement: Annotated[tuple[RequirementId, ...], BeforeValidator(_listed)] = ()
    """Ids of the requirements that it verifies, one or a list; properties of its test cases in JUnit XML."""

    @model_validator(mode="before")
    @classmethod
    def _mended(cls, written: object) -> object:
        return mended(written) if isinstance(written, Mapping) else written

    @field_validator("metric")
    @classmethod
    def _readable_metric(cls, value: str | None) -> str | None:
        if value is not None:
            metric_check("", value)
        return value

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        refuse(self._mistakes())
        return self

    def _mistakes(self) -> Iterator[tuple[KeyPath, str]]:
        # A resolved scenario has every default written out.
        fields = type(self).model_fields.items()
        given = {self._key(name) for name, field in fields if getattr(self, name) != field.default}
        if not given & set(_CLAUSES):
            yield (), f"expects nothing; it needs one of {', '.join(_CLAUSES)}"
        for key, goes_with in _GOES_WITH.items():
            if key in given and not given & set(goes_with):
                yield (key,), f"goes with {' or '.join(goes_with)}, which is missing"
        if "whenever" in given and "require" not in given:
            yield ("whenever",), "needs require: what must hold then"
        if self.throughout and not self.within_s:
            yield ("throughout",), "needs within: the time for which it must hold"

    def pointless(self, limits: Limits, ego: str = EGO) -> Iterator[tuple[str, str]]:
        """Conditions, by their keys, that cannot fail, cannot pass, or never apply in a run.

        Parameters
        ----------
        limits : mapping from str to (float, float)
            Ranges of signals in the run, as for `outcomes`; ``time`` among them.
        ego : str
            Id of the ego.
        """
        begin, end = limits["time"]
        within = min(self.within_s or 0.0, end - begin)
        until = {"eventually": within or end, "whenever": clock_time(end - within)}
        for key, condition in self.conditions():
            last = until.get(key, end)
            here = {**limits, "time": (begin, last)}
            possible, reason = outcomes(condition, here), next(pointless_parts(condition, here, ego), None)
            word = next((word for word, outcome in _WANTED[key].items() if possible == {outcome}), None)
            if word is not None:
                value = "true" if True in possible else "false"
                limit = f" (within {within:g} s in a run of {end:g} s)" if last < end else ""
                yield key, f"this {word}: {reason or f'{condition} is always {value}'}{limit}"
            elif reason is not None:
                yield key, reason

    def conditions(self) -> Iterator[tuple[str, Condition]]:
        """Its conditions, by their keys."""
        for name in ("always", "never", "eventually", "during", "whenever", "require"):
            condition = getattr(self, name)
            if condition is not None:
                yield self._key(name), condition

    @classmethod
    def _key(cls, name: str) -> str:
        return cls.model_fields[name].alias or name

    def clauses(self, name: str) -> Iterator[Clause]:
        """Its clauses as plain values.

        Parameters
        ----------
        name : str
            Name of the expectation.
        """
        within = math.inf if self.within_s is None else self.within_s
        for condition, is_never in ((self.always, False), (self.never, True)):
            if condition is not None:
                yield Always(name, condition, is_never, self.during, self.for_at_least_s)
        if self.eventually is not None:
            yield Eventually(name, self.eventually, self.during, within)
        if self.whenever is not None and self.require is not None:
            yield Whenever(name, self.whenever, self.require, self.within_s or 0.0, self.throughout, self.at_least)
        if self.happened is not None:
            yield Happened(name, self.happened, within)
        if self.metric is not None:
            yield metric_check(name, self.metric)


Expectations = dict[Annotated[str, Field(pattern=r"^[A-Za-z0-9_.-]+$", max_length=100)], Expectation]
"""Expectations by their names."""


def metric_check(name: str, written: str) -> MetricCheck:
    """Parse ``minimum_gap_m >= 5``, with an optional unit; ValueError if every value would pass, or none."""
    match = _METRIC.match(written)
    if match is None:
        raise ValueError(f"expected a key of metrics.json, one of {' '.join(OPERATORS)} and a value")
    key, relation, value = match.groups()
    if key == "ending" and value not in (endings := [one.value for one in Ending]):
        raise ValueError(f"unknown value {shown(value)} of ending; {suggest(value, endings)}")
    if not is_quantity(value):
        if relation not in ("==", "!="):
            raise ValueError(f"expected a number after {relation}, got {shown(value)}")
        return MetricCheck(name, key, relation, value)
    unit = UNIT_OF_SUFFIX.get(key.rpartition("_")[2], "")
    has_unit = re.search(r"[^\W\d_]\s*\Z|[%°]\s*\Z", value) is not None and not value.endswith("inf")
    # A bare number is in the unit at the end of the key.
    number = parse_quantity(value, unit if has_unit else "")
    possible = {compared(one, relation, number) for one in (*_SHARE, 0.5, min(max(number, 0.0), 1.0))}
    if key.endswith("_share") and key != _RATIO and len(possible) == 1:
        raise ValueError(
            f"this cannot {'fail' if True in possible else 'pass'}: {key} is at least 0 % and at most 100 %"
        )
    return MetricCheck(name, key, relation, number)


def clauses_of(expect: Mapping[str, Expectation]) -> tuple[Clause, ...]:
    """Clauses of expectations, in order."""
    return tuple(clause for name, expectation in expect.items() for clause in expectation.clauses(name))
