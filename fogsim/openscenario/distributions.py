"""Files of parameter value distributions: the cases of another file, by values of its parameters."""

import itertools
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fogsim.core.randomness import named_generator
from fogsim.errors import InputError, shown, suggest
from fogsim.openscenario.parameters import Parameters, declared
from fogsim.openscenario.xml_tree import Findings, Node, NodeError, read_xml

_MOST_CASES = 100_000  # of a file
_SHAPES = ("Uniform", "Normal", "LogNormal", "Poisson")
_DRAWN = ("ProbabilityDistributionSet", "Histogram", *(f"{shape}Distribution" for shape in _SHAPES))
_MOST_ROUNDS = 1_000  # Draws for all test runs before limits that hardly any draw meets are refused


@dataclass(frozen=True, slots=True)
class ParameterCases:
    """Values of the parameters of the file `base` in each case; `are_drawn` if the cases are random test runs."""

    base: Path
    cases: tuple[Parameters, ...]
    are_drawn: bool


def read_parameter_cases(path: Path) -> ParameterCases | None:
    """Cases of a file with a ``ParameterValueDistribution``, all with the same parameters; None for any other file."""
    whole = read_xml(path).one("ParameterValueDistribution")
    if whole is None:
        return None
    base, root = _base(whole)
    cases: list[Parameters] = []
    are_drawn = whole.one("Stochastic") is not None
    with whole.refusing():
        cases = (_test_runs if are_drawn else _grid)(whole.need("Stochastic", "Deterministic"))
    whole.check_read()
    declarations = [one for block in root.all("ParameterDeclarations") for one in block.children]
    known = {one.name: one.attributes.get("value", "") for one in declarations}
    names = dict.fromkeys(name for case in cases for name in case)
    for name in names:
        if name not in known:
            whole.refuse(f"{base} declares no parameter {shown(name)}; {suggest(name, known)}")
    whole.findings.close(path)
    # Where a set leaves a parameter out, it has the value of its declaration.
    filled: list[Parameters] = [{name: case.get(name, known[name]) for name in names} for case in cases]
    if not are_drawn and any(one.children for one in declarations):
        filled = _allowed(filled, replace(root, children=root.all("ParameterDeclarations")), whole)
        whole.findings.close(path)
    return ParameterCases(base, tuple(filled), are_drawn)


def _allowed(cases: list[Parameters], declaring: Node, whole: Node) -> list[Parameters]:
    allowed, broken = [], ""
    for case in cases:
        declared(declaring.copy(trial := Findings()), {}, case)
        allowed += [] if trial.refused else [case]
        broken = next(iter(trial.refused), broken)
    if len(allowed) < len(cases):
        number = f"{len(cases) - len(allowed):,} of {len(cases):,}"
        (whole.remark if allowed else whole.refuse)(f"{number} cases break a ConstraintGroup and are none; {broken}")
    return allowed


def _base(whole: Node) -> tuple[Path, Node]:
    file = whole.one("ScenarioFile")
    path = whole.file.parent / (file.get("filepath").replace("\\", "/") if file else "")
    if file is None or not path.is_file():
        there = sorted(one.name for one in path.parent.glob("*.xosc")) if path.parent.is_dir() else []
        message = suggest(path.name, there) if there else f"the folder {path.parent} has no .xosc file"
        raise InputError(f"{(file or whole).where}: filepath: there is no file {shown(str(path))}; {message}")
    root = read_xml(path)
    if root.one("ParameterValueDistribution") is not None:
        raise InputError(f"{file.where}: {path} has a ParameterValueDistribution itself; expected a scenario")
    return path, root


def _grid(block: Node) -> list[Parameters]:
    """All combinations of deterministic distributions, the last one fastest; those that are the same once."""
    axes: list[list[Parameters]] = []
    for one in block.all("DeterministicSingleParameterDistribution", "DeterministicMultiParameterDistribution"):
        name, sets = one.get("parameterName"), one.one("ValueSetDistribution")
        listed = [each.all("ParameterAssignment") for each in (sets.all("ParameterValueSet") if sets else ())]
        axis: list[Parameters] = [{each.get("parameterRef"): each.get("value") for each in row} for row in listed]
        with one.refusing():
            axes.append(axis or [{name: value} for value in _values(one)])
            if {name for case in axes[-1] for name in case} & {name for axis in axes[:-1] for c in axis for name in c}:
                raise ValueError("an earlier distribution has the same parameter")
    number = math.prod(map(len, axes))
    if number > _MOST_CASES:
        raise NodeError(block, f"{number:,} cases; at most {_MOST_CASES:,} are allowed")
    merged = [{k: v for part in cell for k, v in part.items()} for cell in itertools.product(*axes)]
    return [dict(items) for items in dict.fromkeys(tuple(case.items()) for case in merged)]


def _values(node: Node) -> list[str]:
    listed, ranged = node.one("DistributionSet"), node.one("DistributionRange")
    if listed and listed.children:
        return [one.get("value") for one in listed.all("Element")]
    if ranged is None:
        raise ValueError("expected a DistributionSet, DistributionRange or ValueSetDistribution with values")
    (low, high), step = _limits(ranged), ranged.number("stepWidth")
    number = math.floor((high - low) / step + 1e-9) + 1 if step > 0.0 and math.isfinite(high - low) else 0
    if not 0 < number <= _MOST_CASES:
        raise NodeError(ranged, f"expected a stepWidth above 0 with 1 … {_MOST_CASES:,} values from lowerLimit on")
    return [f"{low + i * step:.9g}" for i in range(number)]


def _limits(node: Node) -> tuple[float, float]:
    """Lower and upper limit of a node's ``Range``, infinite without one."""
    limits = node.one("Range")
    if limits is None:
        return -math.inf, math.inf
    low, high = limits.number("lowerLimit"), limits.number("upperLimit")
    if low > high:
        raise NodeError(limits, f"expected a lowerLimit of at most the upperLimit, got {low:g} and {high:g}")
    return low, high


def _test_runs(block: Node) -> list[Parameters]:
    """Random test runs; with the same seed a parameter has the same values, whatever else is drawn."""
    number, seed = block.number("numberOfTestRuns"), block.number("randomSeed", 0.0)
    if not (number.is_integer() and 1 <= number <= _MOST_CASES):
        raise NodeError(block, f"numberOfTestRuns: expected a whole number of 1 … {_MOST_CASES:,}, got {number:g}")
    columns: dict[str, list[str]] = {}
    for one in block.some("StochasticDistribution"):
        name = one.get("parameterName")
        generator = named_generator(int(np.float64(seed).view(np.uint64)), name)
        with one.refusing():
            kind = one.need(*_DRAWN)
            if name in columns:
                raise ValueError("an earlier distribution has the same parameter")
            try:
                columns[name] = _drawn(kind, generator, int(number))
            except (ValueError, ArithmeticError) as error:
                node = getattr(error, "node", kind)
                raise NodeError(node, f"its numbers make no distribution: {error}") from error
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def _drawn(node: Node, generator: np.random.Generator, number: int) -> list[str]:
    """Values drawn from a distribution; ValueError if its numbers make none."""
    if node.tag in ("ProbabilityDistributionSet", "Histogram"):
        # Elements by their weights
        parts = node.all("Element", "Bin")
        weights = [one.number("weight") for one in parts]
        drawn = generator.choice(len(parts), number, p=np.array(weights) / (sum(weights) or 1.0))
        if node.tag != "Histogram":
            return [parts[i].get("value") for i in drawn]
        return [f"{generator.uniform(*_limits(parts[i])):.6g}" for i in drawn]
    (low, high), found = _limits(node), np.empty(0)
    for _ in range(_MOST_ROUNDS):
        drawn = _unlimited(node, generator, number)
        found = np.concatenate([found, drawn[(low <= drawn) & (drawn <= high)]])
        if len(found) >= number:
            return [f"{value:.6g}" for value in found[:number]]
    raise ValueError(f"hardly any draw is between its limits, {low:g} and {high:g}")


def _unlimited(node: Node, generator: np.random.Generator, number: int) -> Any:
    if node.tag == "UniformDistribution":
        return generator.uniform(*_limits(node), number)
    mean = node.number("expectedValue")
    if node.tag == "PoissonDistribution":
        return generator.poisson(mean, number)
    variance = node.number("variance")
    if node.tag == "NormalDistribution":
        return generator.normal(mean, math.sqrt(variance), number)
    # Expected value and variance are those of the parameter, not of its logarithm.
    of_log = math.log1p(variance / mean**2)
    return generator.lognormal(math.log(mean) - 0.5 * of_log, math.sqrt(of_log), number)
