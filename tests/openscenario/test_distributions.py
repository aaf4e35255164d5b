"""Files of parameter value distributions: their cases, the values of each, and what is refused."""

import re
import shutil
import statistics
from pathlib import Path

import pytest

from fogsim.errors import InputError, LeftOutWarning
from fogsim.openscenario import read_parameter_cases
from fogsim.openscenario.distributions import ParameterCases
from fogsim.scenario import Scenario
from fogsim.scenario.loading import load_cases, load_scenario
from fogsim.testing.collection import collect
from tests.openscenario.writing import DATA, HEADER, QUIET


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    shutil.copytree(DATA, tmp_path, dirs_exist_ok=True)
    return tmp_path


def _file(folder: Path, definition: str) -> Path:
    file = folder / "varied.xosc"
    file.write_text(
        f'{HEADER}<ParameterValueDistribution><ScenarioFile filepath="cut_in_in_fog.xosc"/>{definition}'
        "</ParameterValueDistribution></OpenSCENARIO>",
        encoding="utf-8",
    )
    return file


def _read(folder: Path, definition: str) -> ParameterCases | None:
    return read_parameter_cases(_file(folder, definition))


def _single(name: str, inner: str) -> str:
    tag = "DeterministicSingleParameterDistribution"
    return f'<{tag} parameterName="{name}">{inner}</{tag}>'


SETS = (
    "<DeterministicMultiParameterDistribution><ValueSetDistribution>"
    '<ParameterValueSet><ParameterAssignment parameterRef="faster" value="1.5"/>'
    '<ParameterAssignment parameterRef="brake_headway" value="0.7"/></ParameterValueSet>'
    '<ParameterValueSet><ParameterAssignment parameterRef="faster" value="1.1"/></ParameterValueSet>'
    "</ValueSetDistribution></DeterministicMultiParameterDistribution>"
)
RANGE = '<DistributionRange stepWidth="0.1"><Range lowerLimit="0.3" upperLimit="0.6"/></DistributionRange>'
SPEEDS = '<DistributionSet><Element value="72"/><Element value="90"/></DistributionSet>'


def _stochastic(name: str, inner: str, runs: int = 400, seed: float = 5.0) -> str:
    return (
        f'<Stochastic numberOfTestRuns="{runs}" randomSeed="{seed}"><StochasticDistribution parameterName="{name}">'
        f"{inner}</StochasticDistribution></Stochastic>"
    )


def _speed(scenario: Scenario) -> float:
    """Speed with which the other vehicle begins: the ego's times the parameter `faster` [km/h]."""
    (doing,) = scenario.timeline[0].do["Overtaker"]
    return doing.speed.to_kmh


def test_sets_ranges_and_value_sets_are_a_grid(folder: Path) -> None:
    read = _read(folder, f"<Deterministic>{SETS}{_single('cut_in_headway', RANGE)}</Deterministic>")
    assert read.base == folder / "cut_in_in_fog.xosc"
    assert [tuple(case.values()) for case in read.cases] == [
        # A set that leaves a parameter out has the value of its declaration, 0.8.
        (faster, brake, headway)
        for faster, brake in (("1.5", "0.7"), ("1.1", "0.8"))
        for headway in ("0.3", "0.4", "0.5", "0.6")
    ]


def test_cases_run_with_their_values(folder: Path) -> None:
    faster = RANGE.replace("0.3", "1.5").replace("0.6", "1.6")
    file = _file(folder, f"<Deterministic>{_single('ego_kmh', SPEEDS)}{_single('faster', faster)}</Deterministic>")
    assert load_scenario(file, QUIET).name == "cut_in_in_fog"
    (case, scenario), *_ = load_cases(file, QUIET, "ego_kmh=90,faster=1.5").cases
    assert (case.label, case.seed) == ("ego_kmh=90,faster=1.5", 0)
    assert _speed(scenario) == pytest.approx(90.0 * 1.5)


def test_a_yaml_file_lays_expectations_upon_every_case(folder: Path) -> None:
    _file(folder, f"<Deterministic>{_single('ego_kmh', SPEEDS)}</Deterministic>")
    test = folder / "a.fog.yaml"
    written = "scenario: varied.xosc\nrenderer: none\nestimators: []\nexpect: {cuts_in: {happened: cut_in}}\n"
    test.write_text(written, encoding="utf-8")
    (found,) = collect([test])
    assert [run.levels for run in found.runs] == [{"ego_kmh": "72"}, {"ego_kmh": "90"}]
    assert {tuple(run.scenario.expect) for run in found.runs} == {("cuts_in",)}
    test.write_text(f"{written}vary: {{run: 2 seeds}}\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"a.fog.yaml:5: vary: the OpenSCENARIO file varies parameters itself"):
        collect([test])


@pytest.mark.parametrize(
    ("inner", "mean", "deviation"),
    [
        ('<NormalDistribution expectedValue="72" variance="16"/>', 72.0, 4.0),
        ('<LogNormalDistribution expectedValue="72" variance="16"/>', 72.0, 4.0),
        ('<UniformDistribution><Range lowerLimit="60" upperLimit="84"/></UniformDistribution>', 72.0, 24.0 / 12**0.5),
        ('<PoissonDistribution expectedValue="72"/>', 72.0, 72.0**0.5),
        (
            '<ProbabilityDistributionSet><Element value="60" weight="1"/><Element value="80" weight="3"/>'
            "</ProbabilityDistributionSet>",
            75.0,
            20.0 * (0.25 * 0.75) ** 0.5,
        ),
        (
            '<Histogram><Bin weight="1"><Range lowerLimit="50" upperLimit="60"/></Bin>'
            '<Bin weight="1"><Range lowerLimit="80" upperLimit="90"/></Bin></Histogram>',
            70.0,
            (15.0**2 + 100.0 / 12.0) ** 0.5,
        ),
    ],
)
def test_draws_have_the_moments_of_their_distribution(folder: Path, inner: str, mean: float, deviation: float) -> None:
    drawn = [float(case["ego_kmh"]) for case in _read(folder, _stochastic("ego_kmh", inner)).cases]
    assert len(drawn) == 400
    # Four standard errors of the mean, and of the deviation.
    assert statistics.fmean(drawn) == pytest.approx(mean, abs=4.0 * deviation / 400**0.5)
    assert statistics.stdev(drawn) == pytest.approx(deviation, rel=4.0 / (2.0 * 400) ** 0.5)


def test_limits_and_seeds_of_draws(folder: Path) -> None:
    limited = '<NormalDistribution expectedValue="72" variance="16"><Range lowerLimit="70" upperLimit="75"/>'
    drawn = [_stochastic("ego_kmh", f"{limited}</NormalDistribution>", 50, seed) for seed in (1.0, 1.0, 1.5)]
    first, again, other = ([case["ego_kmh"] for case in _read(folder, one).cases] for one in drawn)
    assert first == again != other
    assert all(70.0 <= float(one) <= 75.0 for one in first)


def test_test_runs_have_their_numbers_as_seeds(folder: Path) -> None:
    inner = '<UniformDistribution><Range lowerLimit="60" upperLimit="84"/></UniformDistribution>'
    loaded = load_cases(_file(folder, _stochastic("ego_kmh", inner, runs=3)), QUIET)
    assert [case.seed for case, _ in loaded.cases] == [0, 1, 2]
    assert [case.levels["run"] for case, _ in loaded.cases] == ["0", "1", "2"]
    speeds = [_speed(scenario) for _, scenario in loaded.cases]
    assert speeds == pytest.approx([1.25 * float(case.levels["ego_kmh"]) for case, _ in loaded.cases], rel=1e-5)


def test_what_is_no_distribution_is_told(folder: Path) -> None:
    normal, beyond = '<NormalDistribution expectedValue="1" variance="1">', '<Range lowerLimit="90" upperLimit="91"/>'
    for definition, told in [
        (f"<Deterministic>{_single('ego_kmhh', SPEEDS)}</Deterministic>", "declares no parameter 'ego_kmhh'; did you"),
        (f"<Deterministic>{_single('faster', SPEEDS) * 2}</Deterministic>", "an earlier distribution has the same"),
        (f"<Deterministic>{_single('faster', RANGE.replace('0.1', '-1'))}</Deterministic>", "a stepWidth above 0"),
        (f"<Deterministic>{_single('faster', '<DistributionSet/>')}</Deterministic>", "with values"),
        (_stochastic("faster", '<UserDefinedDistribution type="mine"/>'), "expected ProbabilityDistributionSet or"),
        (_stochastic("faster", '<NormalDistribution expectedValue="1" variance="-1"/>'), "make no distribution"),
        (_stochastic("faster", '<LogNormalDistribution expectedValue="0" variance="1"/>'), "make no distribution"),
        (_stochastic("faster", "<ProbabilityDistributionSet/>"), "make no distribution"),
        (_stochastic("faster", f"{normal}{beyond}</NormalDistribution>"), "is between its limits, 90 and 91"),
        (_stochastic("faster", '<PoissonDistribution expectedValue="1"/>', runs=0), "whole number of 1 … 100,000"),
        ('<Stochastic numberOfTestRuns="3"/>', "expected StochasticDistribution inside, got nothing"),
        ("", "expected Stochastic or Deterministic inside, got "),
    ]:
        with pytest.raises(InputError, match=r"varied.xosc:1: /OpenSCENARIO/ParameterValueDistribution") as refused:
            read_parameter_cases(_file(folder, definition))
        assert told in str(refused.value)


def test_a_missing_base_is_told_with_what_is_there(folder: Path) -> None:
    file = _file(folder, "<Deterministic/>")
    file.write_text(file.read_text(encoding="utf-8").replace("cut_in_in_fog", "cut_in_fog"), encoding="utf-8")
    with pytest.raises(InputError, match=r"there is no file '.*cut_in_fog.xosc'; did you mean 'cut_in_in_fog.xosc'"):
        load_scenario(file)


def test_the_base_scenarios_mistakes_name_the_case(folder: Path) -> None:
    two = '<DistributionSet><Element value="a"/><Element value="b"/></DistributionSet>'
    with pytest.raises(InputError, match=r"cut_in_in_fog.xosc:.*\n*in the case ego_kmh=a of .*varied.xosc"):
        load_scenario(_file(folder, f"<Deterministic>{_single('ego_kmh', two)}</Deterministic>"))


def _constrain(folder: Path, name: str, rule: str, limit: str) -> None:
    """Give a parameter of the varied file a constraint."""
    file = folder / "cut_in_in_fog.xosc"
    declared = re.search(f'<ParameterDeclaration name="{name}".*"/>', text := file.read_text(encoding="utf-8"))
    group = f'<ConstraintGroup><ValueConstraint rule="{rule}" value="{limit}"/></ConstraintGroup>'
    file.write_text(text.replace(declared[0], f"{declared[0][:-2]}>{group}</ParameterDeclaration>"), encoding="utf-8")


@pytest.mark.parametrize(
    ("name", "limit", "kept"), [("ego_kmh", "85", "72"), ("faster", "${$ego_kmh / 64}", "90"), ("ego_kmh", "20", "")]
)
def test_combinations_that_break_a_constraint_are_no_cases(folder: Path, name: str, limit: str, kept: str) -> None:
    _constrain(folder, name, "lessThan", limit)
    varied, told = f"<Deterministic>{_single('ego_kmh', SPEEDS)}</Deterministic>", "of 2 cases break a ConstraintGroup"
    if not kept:
        with pytest.raises(InputError, match=f"2 {told} and are none; .* wants lessThan 20"):
            _read(folder, varied)
        return
    with pytest.warns(LeftOutWarning, match=f"1 {told} and are none; .* wants lessThan"):
        assert [case["ego_kmh"] for case in _read(folder, varied).cases] == [kept]
