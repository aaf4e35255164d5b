"""Running a campaign: its cases batch by batch with any engine, resumed from the results in its directory."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from fogsim.core.files.writer_lock import WriterLock
from fogsim.core.randomness import named_generator
from fogsim.core.registry.user_code import MayImport, import_anything
from fogsim.errors import InputError
from fogsim.scenario.loading import SpaceReader, read_space, scenario_file
from fogsim.study.execution import Engine
from fogsim.study.plan import StudyRun
from fogsim.testing.campaign.drawing_plan import Drawn, Findings, Sequencing, Space, batches
from fogsim.testing.collection import FogTest, run_of
from fogsim.testing.results import CaseResult, read_result
from fogsim.testing.session import begin_session

CampaignWatch = Callable[[int, int], None]
"""Called with the numbers of completed and failed cases."""


@dataclass(frozen=True, slots=True)
class Campaign:
    """A scenario file with a space: what is drawn, and how much of it.

    Attributes
    ----------
    file : Path
        The file.
    reader : SpaceReader
        Reads its cases.
    seed : int
        Seed of all draws.
    budget : int
        Number of cases.
    sequencing : str
        How the first cases fill the space: ``"sobol"`` or ``"latin_hypercube"``.
    """

    file: Path
    reader: SpaceReader
    seed: int
    budget: int
    sequencing: Sequencing

    @property
    def space(self) -> Space:
        """Its parameters."""
        return Space.of(self.reader.variation.space)


def load_campaign(
    file: str | Path,
    settings: Sequence[str] = (),
    case: str = "",
    *,
    budget: int = 200,
    seed: int = 0,
    sequencing: Sequencing = "sobol",
    may_import: MayImport = import_anything,
) -> Campaign:
    """Read a campaign.

    Parameters
    ----------
    file : str or Path
        Scenario file with ``space`` and ``expect``.
    settings : sequence of str
        ``key.path=value`` each.
    case : str
        One case of ``vary``, as comma-separated ``name=value``.
    budget, seed, sequencing
        See `Campaign`.
    may_import : callable
        As in `load_scenario`.

    Raises
    ------
    InputError
        If the file does not fit.
    """
    path = scenario_file(file)
    reader = read_space(path, settings, case, may_import)
    _, scenario = reader.load({}, 0)
    if not scenario.expect:
        raise InputError(f"{path}: expect is missing; a campaign needs something that passes or fails")
    if not Space.of(reader.variation.space).axes:
        raise InputError(f"{path}: space has no distribution, only seeds")
    return Campaign(path, reader, seed, budget, sequencing)


def run_campaign(campaign: Campaign, out: Path, engine: Engine, watch: CampaignWatch = lambda _, __: None) -> Findings:
    """Run what is missing of a campaign.

    Parameters
    ----------
    campaign : Campaign
        From `load_campaign`.
    out : Path
        Directory of the results; those of an earlier call with the same cases count.
    engine : Engine
        Engine for the cases.
    watch : callable
        Called after each case.

    Raises
    ------
    InputError
        If the directory holds something else, or a drawn case does not fit.
    """
    folder, found, failed = begin_session(out, resume=True), Findings(), 0
    with WriterLock(out):
        plan = batches(campaign.space, campaign.seed, campaign.budget, campaign.sequencing, found)
        batch = next(plan)
        while True:
            runs = _runs(campaign, batch, len(found.drawn))
            names = tuple(runs[0].scenario.expect)
            known = {run.key: read_result(folder, run, names) for run in runs}
            done = len(found.drawn) + sum(one is not None for one in known.values())
            failed += sum(one is not None and one.has_failed for one in known.values())
            watch(done, failed)

            def count(run: StudyRun, _: str | None, known: dict[str, CaseResult | None] = known) -> None:
                nonlocal done, failed
                known[run.key] = one = read_result(folder, run, names)  # noqa: B023 - used before the next batch
                done, failed = done + 1, failed + (one is None or one.has_failed)
                watch(done, failed)

            engine.run([run for run in runs if known[run.key] is None], folder, count)
            try:
                batch = plan.send([known[run.key] or CaseResult(run, "no result") for run in runs])
            except StopIteration:
                return found


def _runs(campaign: Campaign, batch: Sequence[Drawn], first: int) -> list[StudyRun]:
    runs = []
    for number, drawn in enumerate(batch, first):
        # Each case has its own noise, whatever it was drawn for.
        seed = int(named_generator(campaign.seed, f"case {number}").integers(2**31))
        runs.append(run_of(campaign.file, number, *campaign.reader.load(drawn.values, seed)))
    return runs


def as_test(campaign: Campaign, found: Findings) -> FogTest:
    """The cases of a campaign as a test, for the commands that run them again."""
    variation, scenario = campaign.reader.variation, found.results[0].run.scenario
    lines = {name: campaign.reader.document.where(("expect", name)) for name in scenario.expect}
    runs = tuple(one.run for one in found.results)
    return FogTest(campaign.file, scenario.name, lines, runs, variation.verdict)
