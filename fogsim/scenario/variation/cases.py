"""The blocks ``vary`` and ``verdict``: the cases of a file, and when all of them together pass."""

import contextlib
import itertools
import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any

from pydantic import Field, ValidationError

from fogsim.errors import InputError, shown, suggest
from fogsim.scenario.document import Document
from fogsim.scenario.mistakes import mistake_lines
from fogsim.scenario.plain_yaml import KeyPath, dotted
from fogsim.scenario.section import Section, Share
from fogsim.scenario.variation.levels import (
    Draws,
    FileLevels,
    Levels,
    LevelsError,
    SeedLevels,
    Value,
    Values,
    number_with_unit,
    parse_levels,
    parse_space,
    value_text,
)
from fogsim.units.quantities import split_quantity

MOST_RUNS = 100_000
"""Maximum number of runs of a study and of cases of a scenario file."""

_MOST_NAMED = 5
_MOST_DIGITS = 15


def grid_mistake(sizes: Mapping[str, int]) -> str | None:
    """Why a grid has too many runs, from its number of levels per factor; None if it has not."""
    number = math.prod(sizes.values())
    if number <= MOST_RUNS:
        return None
    named = [f"{size} {name}" for name, size in sizes.items() if size > 1]
    factors = " × ".join([*named[:_MOST_NAMED], *(["…"] if len(named) > _MOST_NAMED else [])])
    shown = f"{number:,}" if number < 10**_MOST_DIGITS else f"more than 10^{_MOST_DIGITS}"
    return f"{factors} are {shown} runs; at most {MOST_RUNS:,} are allowed"


_PLACE = re.compile(r"\$(?:\$|\{([^{}]*)\}|([A-Za-z_][A-Za-z0-9_]*))")
"""Uses of a name: ``$name``, ``${name}``; ``$$`` is a plain ``$``."""


class Verdict(Section):
    """When all cases of a file together pass."""

    pass_rate: Annotated[Share, Field(gt=0)] = 1.0
    """Share of the cases that must pass."""

    confidence: Annotated[Share, Field(ge=0.5, lt=1)] = 0.9
    """Confidence with which the rate must be at least that, one-sided (Clopper & Pearson 1934)."""

    conclusive: Share = 0.5
    """Share of the cases in which what was to be tested must have happened."""

    @property
    def least_cases(self) -> int:
        """Number of cases from which on this verdict can be a pass, if all of them pass."""
        if self.pass_rate == 1.0:
            return 1
        return math.ceil(math.log(1.0 - self.confidence) / math.log(self.pass_rate) - 1e-9)


NONE_FAILS = Verdict()
"""All pass together when none fails."""


class VariationKeys(Section):
    """Keys of a file in addition to those of a scenario."""

    vary: dict[str, Any] = Field(default_factory=dict)
    """What differs between the cases of the file: a name and its values; ``$name`` stands for them elsewhere."""

    space: dict[str, Any] = Field(default_factory=dict)
    """What `fogsim campaign` draws: a name and its distribution, or `seeds`; elsewhere the median stands for it."""

    verdict: Verdict = NONE_FAILS
    """When all cases together pass; without it, when none fails."""


KEYS = tuple(VariationKeys.model_fields)
"""Names of these blocks."""


@dataclass(frozen=True, slots=True)
class Case:
    """One case of a file: a value for each varied name, and the seed of its run."""

    values: Mapping[str, Value]
    seed: int = 0

    @property
    def levels(self) -> dict[str, str]:
        """Value of each name, as text."""
        return {name: value_text(value) for name, value in self.values.items()}

    @property
    def label(self) -> str:
        """The case as ``--case`` names it; empty for the only case of a file without variation."""
        return ",".join(f"{name}={level}" for name, level in self.levels.items())

    @property
    def folder_name(self) -> str:
        """Name of the case's folder; ``seedN`` for a file without variation."""
        return re.sub(r"[^\w.,=-]", "_", self.label)[:100] or f"seed{self.seed}"


@dataclass(frozen=True, slots=True)
class Variation:
    """What a file varies: its cases as a grid (the last name fastest), and when they pass together."""

    cases: tuple[Case, ...]
    varied: Mapping[str, Values] = field(default_factory=dict)
    verdict: Verdict = NONE_FAILS
    space: Mapping[str, Draws | SeedLevels] = field(default_factory=dict)

    def drawn_case(self, case: Case, drawn: Mapping[str, Value], seed: int) -> Case:
        """A case with other values of the space, and a seed where the space has one."""
        names = [name for name, values in self.space.items() if isinstance(values, SeedLevels)]
        return Case({**case.values, **drawn, **dict.fromkeys(names, seed)}, seed if names else case.seed)


def read_variation(document: Document) -> Variation:
    """Read ``vary`` and ``verdict``, and check that each varied name is used somewhere."""
    written = {key: document.data[key] for key in KEYS if key in document.data}
    try:
        keys = VariationKeys.model_validate(written)
    except ValidationError as error:
        raise InputError(mistake_lines(document, VariationKeys, error)) from error
    if document.cases:
        return _of_file(document, keys)
    if not keys.vary and not keys.space:
        if "verdict" in written:
            where = document.where(("verdict",))
            raise InputError(f"{where}: verdict: goes with vary, since it is about several cases")
        return Variation((Case({}),))
    varied, mistakes = _parsed(document, keys.vary)
    space, further = _parsed_space(document, keys)
    # Without a campaign the median stands for a distribution.
    for name, values in space.items():
        if isinstance(values, Draws):
            varied[name] = Levels((number_with_unit(values.quantile(0.5), values.unit),))
        else:
            varied[name] = values
    mistakes += further + _misplaced(document, {**keys.vary, **keys.space}, varied)
    if mistakes:
        raise InputError("\n".join(mistakes))
    try:
        cases = _grid(document, varied)
    except LevelsError as error:
        raise InputError(f"{document.where(('vary',))}: vary: {error}") from error
    _check_reachable(document, keys.verdict, len(cases))
    return Variation(cases, varied, keys.verdict, space)


def _of_file(document: Document, keys: VariationKeys) -> Variation:
    """Cases of an OpenSCENARIO file that varies the parameters of another; random test runs have their numbers."""
    for key in [name for name in ("vary", "space") if getattr(keys, name)]:
        where = document.where((key,))
        raise InputError(f"{where}: {key}: the OpenSCENARIO file varies parameters itself; leave this out")
    run = next(name for name in ("run", "test_run", "number") if name not in document.cases[0])
    cases = tuple(
        Case({run: seed, **values} if document.are_runs else values, seed if document.are_runs else 0)
        for seed, values in enumerate(document.cases)
    )
    varied = {name: FileLevels(tuple(dict.fromkeys(c.values[name] for c in cases))) for name in cases[0].values}
    _check_reachable(document, keys.verdict, len(cases))
    return Variation(cases, varied, keys.verdict)


def _parsed(document: Document, written: Mapping[str, Any]) -> tuple[dict[str, Values], list[str]]:
    varied: dict[str, Values] = {}
    mistakes = []
    for name, value in written.items():
        try:
            varied[name] = parse_levels(name, value)
        except LevelsError as mistake:
            at: KeyPath = ("vary", name, *mistake.below)
            mistakes.append(f"{document.where(at)}: {dotted(at)}: {mistake}")
    seeds = [name for name, values in varied.items() if isinstance(values, SeedLevels)]
    mistakes += [
        f"{document.where(('vary', name))}: vary.{name}: {seeds[0]} has the seeds already" for name in seeds[1:]
    ]
    if not seeds and not mistakes:
        drawn = [name for name, values in varied.items() if values.is_drawn]
        mistakes += [
            f"{document.where(('vary', name))}: vary.{name}: a value is drawn for each seed, and there are none; "
            "add for example run: 20 seeds"
            for name in drawn
        ]
    return varied, mistakes


def _parsed_space(document: Document, keys: VariationKeys) -> tuple[dict[str, Draws | SeedLevels], list[str]]:
    space: dict[str, Draws | SeedLevels] = {}
    mistakes = []
    for name, value in keys.space.items():
        at: KeyPath = ("space", name)
        if name in keys.vary:
            mistakes.append(f"{document.where(at)}: {dotted(at)}: vary has {name} already")
            continue
        try:
            space[name] = parse_space(name, value)
        except LevelsError as mistake:
            at = (*at, *mistake.below)
            mistakes.append(f"{document.where(at)}: {dotted(at)}: {mistake}")
    return space, mistakes


def _misplaced(document: Document, named: Mapping[str, object], varied: Mapping[str, Values]) -> list[str]:
    """Names that are not used, and uses of unknown names."""
    used: set[str] = set()
    mistakes = []
    for at, text in _texts({key: value for key, value in document.data.items() if key not in KEYS}, ()):
        for name in _names(text):
            used.add(name)
            if name not in named:
                reason = f"unknown name ${name}; {suggest(name, named)}"
                mistakes.append(f"{document.where(at)}: {dotted(at)}: {reason}")
    for name, values in varied.items():
        if name not in used and not isinstance(values, SeedLevels):
            reason = f"${name} stands nowhere in the file, so that its cases would not differ"
            mistakes.append(f"{document.where(('vary', name))}: vary.{name}: {reason}")
    return mistakes


def _texts(value: object, at: KeyPath) -> Iterator[tuple[KeyPath, str]]:
    if isinstance(value, str):
        yield at, value
    elif isinstance(value, dict):
        for key, one in value.items():
            yield from _texts(one, (*at, key))
    elif isinstance(value, list):
        for place, one in enumerate(value):
            yield from _texts(one, (*at, place))


def _names(text: str) -> list[str]:
    return [match[1] if match[1] is not None else match[2] for match in _PLACE.finditer(text) if match[0] != "$$"]


def _grid(document: Document, varied: Mapping[str, Values]) -> tuple[Case, ...]:
    gridded = {name: values for name, values in varied.items() if not values.is_drawn}
    mistake = grid_mistake({name: len(values) for name, values in gridded.items()})
    if mistake is not None:
        raise InputError(f"{document.where(('vary',))}: vary: {mistake}")
    cells = itertools.product(*gridded.values())
    return tuple(_case(varied, dict(zip(gridded, cell, strict=True))) for cell in cells)


def _case(varied: Mapping[str, Values], chosen: Mapping[str, Value]) -> Case:
    """The case of a cell of the grid, with the draws for its seed."""
    seed = next((int(chosen[name]) for name, values in varied.items() if isinstance(values, SeedLevels)), 0)
    return Case(
        {name: values.value(seed) if values.is_drawn else chosen[name] for name, values in varied.items()}, seed
    )


def _check_reachable(document: Document, verdict: Verdict, number: int) -> None:
    if verdict.least_cases > number:
        raise InputError(
            f"{document.where(('verdict',))}: verdict: {number} cases that all pass do not show a pass rate of "
            f"{verdict.pass_rate:.4g} with a confidence of {verdict.confidence:.4g}; at least {verdict.least_cases} "
            "would, so this verdict could not be a pass"
        )


def with_case(document: Document, case: Case) -> Document:
    """Copy of a document with a case's values in place of their names, and without `KEYS`."""
    of_file = {name: str(case.values[name]) for name in document.cases[0]} if document.cases else {}
    if document.of_case is not None and of_file != document.cases[0]:
        document = document.of_case(of_file)
    data = {key: value for key, value in document.data.items() if key not in KEYS}
    return replace(document, data=data if of_file or not case.values else _put(data, case.values))


def differing_cases(document: Document) -> tuple[Case, ...]:
    """All cases of a file; only the first if they differ in nothing but their seeds."""
    cases = read_variation(document).cases
    first = with_case(document, cases[0]).data
    return cases if any(with_case(document, one).data != first for one in cases[1:]) else cases[:1]


def first_of_several(document: Document) -> str:
    """Which case of several the first one is; empty if there is no other."""
    first, *others = differing_cases(document)
    chosen = "" if document.cases else "; vary.NAME=[VALUE] chooses another"
    return f"{document.path}: {first.label} is the first of {len(others) + 1} cases{chosen}" if others else ""


def _put(value: Any, values: Mapping[str, Value]) -> Any:
    if isinstance(value, dict):
        return {key: _put(one, values) for key, one in value.items()}
    if isinstance(value, list):
        return [_put(one, values) for one in value]
    if not isinstance(value, str) or "$" not in value:
        return value
    whole = _PLACE.fullmatch(value)
    if whole is not None and whole[0] != "$$":
        return values[_names(value)[0]]
    return _PLACE.sub(lambda found: "$" if found[0] == "$$" else value_text(values[_names(found[0])[0]]), value)


class NoSuchCaseError(InputError):
    """A file has no case with the values that were asked for."""


def chosen_cases(variation: Variation, wanted: str, where: object, seed: int | None = None) -> tuple[Case, ...]:
    """Cases that match comma-separated ``name=value`` pairs, as in `Case.label`; all cases for "".

    A numeric name may have a value that is not in the grid. `where` names the file in messages, and `seed` replaces the
    seeds of the cases.
    """
    pairs = _pairs(wanted, variation, where)
    of_seeds = next((name for name, values in variation.varied.items() if isinstance(values, SeedLevels)), None)
    if seed is not None and of_seeds is not None and pairs.setdefault(of_seeds, str(seed)) != str(seed):
        raise InputError(f"--seed {seed}: --case {wanted} has another; {of_seeds} is the seed in {where}")
    cases = list(variation.cases)
    for name, text in pairs.items():
        fitting = [case for case in cases if value_text(case.values[name]) == text]
        if not fitting and (value := _beside_grid(variation.varied[name], text)) is not None:
            others = _distinct(cases, name, variation.varied)
            fitting = [_case(variation.varied, {**case.values, name: value}) for case in others]
        if not fitting:
            known = dict.fromkeys(value_text(case.values[name]) for case in cases)
            raise NoSuchCaseError(f"--case {wanted}: {where} has no {name}={text}; {suggest(text, known)}")
        cases = fitting
    return tuple(cases if seed is None else (replace(case, seed=seed) for case in cases))


def _pairs(wanted: str, variation: Variation, where: object) -> dict[str, str]:
    known = variation.cases[0].values
    pairs: dict[str, str] = {}
    for part in re.split(r",\s*(?=[A-Za-z_]\w*=)", wanted) if wanted.strip() else ():
        name, equals, text = (one.strip() for one in part.partition("="))
        if not equals or not name:
            raise InputError(f"--case {shown(wanted)}: expected name=value, with commas between, got {shown(part)}")
        if name not in known:
            raise NoSuchCaseError(f"--case {wanted}: {where} varies no {name}; {suggest(name, known)}")
        pairs[name] = text
    return pairs


def _beside_grid(values: Values, text: str) -> Value | None:
    """A text as a number for a numeric name; None if it is not one."""
    if isinstance(values, SeedLevels):
        return int(text) if text.isdecimal() else None
    if not values.is_numeric:
        return None
    with contextlib.suppress(ValueError):
        if math.isfinite(number := float(text)) or text == "inf":
            return number
    return text if split_quantity(text) else None


def _distinct(cases: Iterable[Case], name: str, varied: Mapping[str, Values]) -> list[Case]:
    """Cases that differ in several names, and the draws for their seeds."""
    kept: dict[str, Case] = {}
    for case in cases:
        rest = {key: value for key, value in case.values.items() if key != name and not varied[key].is_drawn}
        kept.setdefault(json.dumps(rest), case)
    return list(kept.values())
