"""The methods of a study in words and tables, derived from its scenarios, as a paper's methods section needs them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from fogsim.core.files.atomic import write_text
from fogsim.recorders.manifest import versions
from fogsim.scenario import Scenario, build
from fogsim.scenario.wording.non_defaults import Setting, non_default_settings
from fogsim.scenario.wording.sentences import SENTENCES
from fogsim.study.comparison import RESAMPLES
from fogsim.study.plan import Study, file_digests
from fogsim.study.report_tables import Table

_MOST_VARIANTS = 10
_DISTRIBUTIONS = {"fogsim": "FogSim", "libsumo": "SUMO (libsumo)", "python": "Python"}


@dataclass(frozen=True, slots=True)
class Methods:
    """Paragraphs by their headings, and tables of text by their captions."""

    paragraphs: Mapping[str, str]
    tables: Mapping[str, Table]

    def markdown(self, title: str) -> str:
        """Text of ``methods.md``."""
        parts = [f"# {title}", *(f"**{name}.** {text}" for name, text in self.paragraphs.items())]
        for caption, table in self.tables.items():
            lines = [table.head, ["---"] * len(table.head), *table.rows]
            cells = [[str(cell).replace("|", "\\|").replace("\n", " ") for cell in row] for row in lines]
            parts += [f"## {caption}", "\n".join(f"| {' | '.join(row)} |" for row in cells)]
        return "\n\n".join(parts) + "\n"


def write_methods(study: Study, folder: Path) -> Methods:
    """Write ``methods.md`` and return its content."""
    found = study_methods(study)
    write_text(folder / "methods.md", found.markdown(f"Methods of the study {study.name}"))
    return found


def study_methods(study: Study) -> Methods:
    """Methods of a study."""
    scenarios = list(study.cells().values())
    paragraphs = {
        "Design": _design(study),
        **{heading: _by_level(study, words) for heading, words in SENTENCES.items()},
        "Statistics": _statistics(study),
        "Software": _software(),
    }
    levels = [
        [factor, level, ", ".join(given) or "–"]
        for factor, of_factor in study.level_settings.items()
        for level, given in of_factor.items()
    ]
    settings = [[key, one.value, one.default or "(required)", one.meaning] for key, one in _common(scenarios).items()]
    digests = dict(item for one in scenarios for item in file_digests(one).items())
    tables = {
        "Factors": Table(["factor", "level", "settings"], levels),
        "Settings of all runs that differ from FogSim's defaults": Table(
            ["key", "value", "default", "meaning"], settings
        ),
        "Input files": Table(["file", "SHA-256 (first 20 digits)"], list(digests.items())),
    }
    return Methods(paragraphs, {caption: table for caption, table in tables.items() if table.rows})


def _software() -> str:
    found = {_DISTRIBUTIONS.get(name, name): version for name, version in versions().items() if version}
    return "; ".join(f"{name} {version}" for name, version in found.items()) + "."


def _common(scenarios: Sequence[Scenario]) -> dict[str, Setting]:
    """Non-default settings that all scenarios have in common."""
    first, *others = [non_default_settings(one) for one in scenarios]
    return {key: one for key, one in first.items() if all(other.get(key) == one for other in others)}


def _by_level(study: Study, words: Callable[[Scenario], str]) -> str:
    """Words on the scenarios of all cells: once if they agree, else by the levels of the factor that they depend on."""
    texts = [(run.levels, words(run.scenario)) for run in {id(run.scenario): run for run in study.runs}.values()]
    cells_of: dict[str, list[Mapping[str, str]]] = {}
    for levels, text in texts:
        cells_of.setdefault(text, []).append(levels)
    if len(cells_of) == 1:
        return texts[0][1]
    if len(cells_of) > _MOST_VARIANTS:
        return f"{texts[0][1]} (The first cell, {_levels(texts[0][0])}; the table of factors has what varies.)"
    for factor in study.factors:
        of_text = {text: list(dict.fromkeys(at[factor] for at in cells)) for text, cells in cells_of.items()}
        if sum(map(len, of_text.values())) == len(study.factors[factor]):
            return " ".join(f"{factor} {', '.join(levels)}: {text}" for text, levels in of_text.items())
    return " ".join(f"{'; '.join(map(_levels, cells))}: {text}" for text, cells in cells_of.items())


def _levels(levels: Mapping[str, str]) -> str:
    return ", ".join(f"{factor} {level}" for factor, level in levels.items())


def _design(study: Study) -> str:
    shape = "; ".join(f"{name}: {', '.join(levels)}" for name, levels in study.factors.items())
    seeds = list(dict.fromkeys(run.seed for run in study.runs))
    is_range = len(seeds) > 1 and seeds == list(range(seeds[0], seeds[-1] + 1))
    numbered = f"{seeds[0]} to {seeds[-1]}" if is_range else ", ".join(map(str, seeds))
    return (
        f"Every combination of the factors ({shape}) was run with {len(seeds)} seeds ({numbered}), {len(study.runs)} "
        f"runs in all. The baseline is {_levels(study.baseline)}. Runs of the same seed have the same demand, the "
        "same drivers and the same sensor noise."
    )


def _statistics(study: Study) -> str:
    standards = dict.fromkeys(build.safety_standard(one) for one in study.cells().values())
    judged = "; ".join(
        f"reaction time {one.reaction_time:g} s and deceleration {one.deceleration:g} m/s² in stopping sight "
        f"distances, time to collision {one.time_to_collision:g} s"
        for one in standards
    )
    return (
        "Differences to the baseline are means over pairs of runs with the same seed. Intervals: "
        f"{100.0 * study.confidence:g} %, bias-corrected and accelerated bootstrap of {RESAMPLES:,} resamples "
        "(Efron 1987). p-values: two-sided paired permutation tests, adjusted among the main metrics by Benjamini & "
        "Hochberg (1995). "
        f"Thresholds of the safety metrics: {judged}."
    )
