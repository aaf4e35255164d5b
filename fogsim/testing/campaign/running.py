"""Running a campaign: its cases batch by batch with any engine, resumed from the results in its directory."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fogsim.core.files.writer_lock import WriterLock
from fogsim.core.randomness import named_generator
from fogsim.core.registry.user_code import MayImport, import_anything
from fogsim.errors import InputError
from fogsim.scenario.loading import SpaceReader, read_space, scenario_file
from fogsim.scenario.variation import SeedLevels, number_with_unit
from fogsim.study.execution import Engine
from fogsim.study.plan import StudyRun
from fogsim.testing.campaign.comparison import EarlierCase, again, read_earlier
from fogsim.testing.campaign.drawing_plan import Drawn, Findings, Sequencing, Space, batches, number_of
from fogsim.testing.collection import FogTest, run_of
from fogsim.testing.odd.odd_file import OddFile, read_odd
from fogsim.testing.odd.openodd_library import Coverage
from fogsim.testing.results import CaseResult, completed_result, read_result
from fogsim.testing.session import begin_session, results_folder
from fogsim.testing.shrinking import SmallestCase, Values, case_key, smallest_case

_OUTERMOST = 0.001, 0.999
"""Places on an axis whose values are checked before the first run."""

CampaignWatch = Callable[[int, int], None]
"""Called with the numbers of completed and failed cases."""


@dataclass(frozen=True, slots=True)
class Campaign:
    """A scenario file with a space: what is drawn, or which cases of an earlier campaign are run again.

    `sequencing` is how the first cases fill the space, ``"sobol"`` or ``"latin_hypercube"``.
    """

    file: Path
    reader: SpaceReader
    seed: int
    budget: int
    sequencing: Sequencing
    earlier: tuple[EarlierCase, ...] = ()
    odd: OddFile | None = None

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
    against: Path | None = None,
    odd: str | None = None,
    may_import: MayImport = import_anything,
) -> Campaign:
    """Read a campaign, or the cases of an earlier one in the directory `against`; InputError if a file does not fit.

    `odd` is the name or binding file of the ODD whose coverage is collected.
    """
    path = scenario_file(file)
    reader = read_space(path, settings, case, may_import)
    _, scenario = reader.load({}, 0)
    if not scenario.expect:
        raise InputError(f"{path}: expect is missing; a campaign needs something that passes or fails")
    space = Space.of(reader.variation.space)
    if not space.axes:
        raise InputError(f"{path}: space has no distribution, only seeds")
    _check_ends(reader, space)
    earlier = () if against is None else read_earlier(against, space)
    for one in earlier:
        if reader.variation.drawn_case(reader.case, {}, one.seed).seed != one.seed:
            raise InputError(f"--against {against}: {path}: its cases have seeds, and space has none; add run: seeds")
    domain = None if odd is None else read_odd(odd)
    if domain is not None:
        Coverage(domain)  # refuses what does not fit before the first run
    return Campaign(path, reader, seed, len(earlier) or budget, sequencing, earlier, domain)


def _check_ends(reader: SpaceReader, space: Space) -> None:
    """Refuse a parameter whose outermost values do not fit: a campaign would end when it draws one."""
    for name, axis in space.axes.items():
        for place in _OUTERMOST:
            try:
                reader.load({name: number_with_unit(axis.on_axis(place), axis.unit)}, 0)
            except InputError as error:
                raise InputError(f"{error}\nspace.{name} reaches it; bound it with at_least and at_most") from error


def run_campaign(campaign: Campaign, out: Path, engine: Engine, watch: CampaignWatch = lambda _, __: None) -> Findings:
    """Run what is missing of a campaign in its directory; InputError if that holds something else."""
    found, failed = Findings(), 0
    with begin_session(out, resume=True, kind="campaign") as folder:
        plan = (
            again(campaign.space, campaign.earlier, found)
            if campaign.earlier
            else batches(campaign.space, campaign.seed, campaign.budget, campaign.sequencing, found)
        )
        batch = next(plan)
        while True:
            runs = _runs(campaign, batch, len(found.drawn))
            names = tuple(runs[0].scenario.expect)
            known = {run.key: completed_result(folder, run, names) for run in runs}
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
        seed = (
            campaign.earlier[number].seed
            if campaign.earlier
            else int(named_generator(campaign.seed, f"case {number}").integers(2**31))
        )
        run = run_of(campaign.file, number, *campaign.reader.load(drawn.values, seed))
        # A result without the coverage of this ODD does not count.
        runs.append(run if campaign.odd is None else replace(run, key=campaign.odd.keyed(run.key)))
    return runs


def smallest_failing(campaign: Campaign, found: Findings, out: Path, engine: Engine) -> SmallestCase | None:
    """The smallest failing case: as many parameters as possible at their medians, the others as near as possible.

    The search begins at the failing case that is nearest to the medians; None if no case failed. Results are kept in
    the campaign's directory.
    """
    failing = [one for one in found.results if one.message is None and one.has_failed]
    if not failing:
        return None
    space, first = campaign.space, campaign.reader.case.levels
    medians = np.array([axis.place(axis.quantile(0.5)) for axis in space.axes.values()])
    nearest = int(np.argmin(((space.places(failing) - medians) ** 2).sum(axis=1)))
    names = tuple(found.results[0].run.scenario.expect)

    def fails(values: Values) -> bool | None:
        drawn = {name: number_with_unit(number_of(values[name]), axis.unit) for name, axis in space.axes.items()}
        seeds = [
            int(values[name]) for name in values if isinstance(campaign.reader.variation.space.get(name), SeedLevels)
        ]
        try:
            run = run_of(campaign.file, 0, *campaign.reader.load(drawn, seeds[0] if seeds else 0))
        except InputError:
            return None
        folder = results_folder(out)
        if completed_result(folder, run, names) is None:
            engine.run([run], folder, lambda *_: None)
        result = completed_result(folder, run, names)
        return None if result is None else result.has_failed

    with WriterLock(out):
        known = {case_key(one.run.levels): one.has_failed for one in found.results if one.message is None}
        return smallest_case(failing[nearest].run.levels, first, space.axes, known, fails)


def as_test(campaign: Campaign, found: Findings) -> FogTest:
    """The cases of a campaign as a test, for the commands that run them again."""
    variation, scenario = campaign.reader.variation, found.results[0].run.scenario
    lines = {name: campaign.reader.document.where(("expect", name)) for name in scenario.expect}
    runs = tuple(one.run for one in found.results)
    return FogTest(campaign.file, scenario.name, lines, runs, variation.verdict)
