"""``fogsim campaign``: draw cases from a declared space, and find where a scenario fails and how often."""

from collections.abc import Mapping, Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fogsim.cli.earlier_reports import remove_earlier
from fogsim.cli.printing import FAILED, INTERRUPTED, escape, stdout
from fogsim.cli.progress import tally_bar
from fogsim.cli.scenario_options import CaseValues, CodeNotice, MethodTimeout, Settings, with_timeout
from fogsim.errors import InputError

if TYPE_CHECKING:
    from fogsim.study.execution import Engine
    from fogsim.testing.campaign.drawing_plan import Findings
    from fogsim.testing.campaign.running import Campaign
    from fogsim.testing.odd.odd_file import OddFile
    from fogsim.testing.shrinking import SmallestCase


class _CampaignEngine(StrEnum):
    """Values of `--engine`."""

    LOCAL = "local"
    RAY = "ray"


class _FirstDraws(StrEnum):
    """Values of `--first`."""

    SOBOL = "sobol"
    LATIN_HYPERCUBE = "latin_hypercube"


def campaign_command(
    file: Annotated[str, typer.Argument(help="Scenario file with space: and expect:, folder or name.")],
    out: Annotated[
        Path, typer.Option(help="Directory of the results; the same command resumes an interrupted campaign.")
    ] = Path("runs/campaign"),
    processes: Annotated[
        int | None, typer.Option("-j", "--processes", min=1, max=1024, help="Concurrent runs. Default: one per core.")
    ] = None,
    engine: Annotated[
        _CampaignEngine, typer.Option(help="Where to run: processes on this machine, or a Ray cluster.")
    ] = _CampaignEngine.LOCAL,
    address: Annotated[
        str | None, typer.Option(help="With --engine ray: as in fogsim study. Default: $RAY_ADDRESS, or local.")
    ] = None,
    budget: Annotated[
        int | None,
        typer.Option(min=16, max=100_000, help="Number of cases, 200 by default; a failure rate needs 400 or more."),
    ] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of all draws, 0 by default.")] = None,
    first: Annotated[
        _FirstDraws | None, typer.Option(help="How the first cases fill the space, sobol by default.")
    ] = None,
    against: Annotated[
        Path | None,
        typer.Option(help="Directory of an earlier campaign: run its cases again, and show which ones changed."),
    ] = None,
    junit: Annotated[Path | None, typer.Option(help="Write JUnit XML, a test case for each case.")] = None,
    odd: Annotated[
        str | None, typer.Option(help="Collect coverage of an ODD: `fog`, or a binding file. Needs the extra odd.")
    ] = None,
    case: CaseValues = "",
    settings: Settings = None,
    method_timeout: MethodTimeout = None,
) -> None:
    """Find where a scenario with `space:` fails, and how often; exit code 0 (all passed), 1 (not all) or 2."""
    from fogsim.testing.campaign.running import load_campaign, run_campaign, smallest_failing

    remove_earlier(junit)
    _refuse_clashes(file, out, junit, against, {"--budget": budget, "--seed": seed, "--first": first})
    if address is not None and engine is _CampaignEngine.LOCAL:
        raise InputError("--address is a Ray cluster's: give --engine ray with it")
    chosen = with_timeout(settings, method_timeout)
    campaign = load_campaign(
        file,
        chosen,
        case,
        budget=budget or 200,
        seed=seed or 0,
        sequencing="sobol" if first is None else first.value,
        against=against,
        odd=odd,
        may_import=CodeNotice(),
    )
    try:
        with tally_bar(campaign.budget, "cases") as show:
            found = run_campaign(campaign, out, _engine(engine, address, processes, campaign.odd), show)
            show(len(found.results), instead="searching the smallest failing case")
            # One case after another: a cluster would be connected to for each.
            smallest = smallest_failing(campaign, found, out, _engine(_CampaignEngine.LOCAL, None, 1))
    except KeyboardInterrupt:
        stdout.print("Interrupted; finished cases are kept, and the same command goes on.")
        raise typer.Exit(INTERRUPTED) from None
    _report(campaign, found, smallest, chosen, out, junit)
    if not all(one.is_passed for one in found.results):
        raise typer.Exit(FAILED)


def _refuse_clashes(
    file: str, out: Path, junit: Path | None, against: Path | None, drawing: Mapping[str, object]
) -> None:
    """Refuse before the first run what could not be written after the last, and options that do not go together."""
    from fogsim.core.files.output_targets import refuse_clashes, refuse_unwritable, refuse_unwritable_folder
    from fogsim.scenario.loading import scenario_file
    from fogsim.testing.campaign.comparison import CASES

    for option, value in drawing.items():
        if against is not None and value is not None:
            raise InputError(f"{option} does not go with --against, whose cases are drawn already")
    if against is not None and against.resolve() == out.resolve():
        raise InputError(f"--against {against}: --out is the same directory; give another, so that both are kept")
    refuse_unwritable_folder(out)
    if junit is not None:
        read = [scenario_file(file), *([] if against is None else [against / CASES])]
        refuse_unwritable(junit, "--junit", read=read, makes_folder=True)
        refuse_clashes({"--junit": junit}, {"--out": out})


def _report(
    campaign: "Campaign",
    found: "Findings",
    smallest: "SmallestCase | None",
    settings: Sequence[str],
    out: Path,
    junit: Path | None,
) -> None:
    from fogsim.testing.campaign.comparison import CASES, changes_text
    from fogsim.testing.campaign.outputs import counts_text, rate_text, write_campaign_junit, write_cases, write_report
    from fogsim.testing.campaign.running import as_test
    from fogsim.testing.odd.coverage_watch import remove_coverage, write_coverage
    from fogsim.testing.shrinking import smallest_text

    write_cases(out / CASES, campaign, found)
    write_report(out / "report.html", campaign, found, settings, smallest)
    if junit is not None:
        write_campaign_junit(junit, campaign, found, settings)
    lines = [counts_text(found), rate_text(found)]
    if (broken := next((one.message for one in found.results if one.message is not None), None)) is not None:
        lines.append(f"the first error: {broken}")
    if campaign.earlier:
        lines.append(changes_text(campaign.earlier, found))
    if smallest is not None:
        lines.append(smallest_text(as_test(campaign, found), smallest, settings))
    paths = [out / CASES, out / "report.html", *([] if junit is None else [junit])]
    if campaign.odd is None:
        remove_coverage(out)
    else:
        summary, files = write_coverage(out, campaign.odd, [one.run for one in found.results])
        lines, paths = [*lines, *summary], [*paths, *files]
    stdout.print(escape("\n".join(lines)), soft_wrap=True)
    for path in paths:
        stdout.print(f"  {escape(path)}", soft_wrap=True)


def _engine(
    chosen: _CampaignEngine, address: str | None, processes: int | None, odd: "OddFile | None" = None
) -> "Engine":
    import os

    from fogsim.study import RayCluster
    from fogsim.study.pool import ProcessPool
    from fogsim.testing.execution import CoverageCheck, check_outcome

    work = check_outcome if odd is None else CoverageCheck(odd)
    if chosen is _CampaignEngine.RAY:
        return RayCluster(address, processes, work)
    return ProcessPool(processes or os.cpu_count() or 1, work)
