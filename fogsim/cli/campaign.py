"""``fogsim campaign``: draw cases from a declared space, and find where a scenario fails and how often."""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fogsim.cli.printing import FAILED, INTERRUPTED, escape, stderr, stdout
from fogsim.cli.progress import STARTING, progress_bar
from fogsim.cli.scenario_options import CaseValues, CodeNotice, MethodTimeout, Settings, with_timeout
from fogsim.errors import InputError

if TYPE_CHECKING:
    from fogsim.study.execution import Engine


class CampaignEngine(StrEnum):
    """Values of `--engine`."""

    LOCAL = "local"
    RAY = "ray"


class FirstDraws(StrEnum):
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
        CampaignEngine, typer.Option(help="Where to run: processes on this machine, or a Ray cluster.")
    ] = CampaignEngine.LOCAL,
    address: Annotated[
        str | None, typer.Option(help="With --engine ray: as in fogsim study. Default: $RAY_ADDRESS, or local.")
    ] = None,
    budget: Annotated[
        int, typer.Option(min=16, max=100_000, help="Number of cases; a failure rate needs 400 or more.")
    ] = 200,
    seed: Annotated[int, typer.Option(min=0, help="Seed of all draws.")] = 0,
    first: Annotated[FirstDraws, typer.Option(help="How the first cases fill the space.")] = FirstDraws.SOBOL,
    junit: Annotated[Path | None, typer.Option(help="Write JUnit XML, a test case for each case.")] = None,
    case: CaseValues = "",
    settings: Settings = None,
    method_timeout: MethodTimeout = None,
) -> None:
    """Find where a scenario with `space:` fails, and how often; exit code 0 (all passed), 1 (not all) or 2."""
    from fogsim.core.files.output_targets import refuse_unwritable, refuse_unwritable_folder
    from fogsim.testing.campaign.outputs import counts_text, rate_text, write_campaign_junit, write_cases, write_report
    from fogsim.testing.campaign.running import load_campaign, run_campaign

    if address is not None and engine is CampaignEngine.LOCAL:
        raise InputError("--address is a Ray cluster's: give --engine ray with it")
    refuse_unwritable_folder(out)
    if junit is not None:
        refuse_unwritable(junit, "--junit", read=[], makes_folder=True)
    chosen = with_timeout(settings, method_timeout)
    campaign = load_campaign(
        file, chosen, case, budget=budget, seed=seed, sequencing=first.value, may_import=CodeNotice()
    )
    try:
        with progress_bar(stderr, stays=True) as progress:
            task = progress.add_task(STARTING, total=budget)

            def show(done: int, failed: int) -> None:
                failures = f", {failed} failed" if failed else ""
                progress.update(task, completed=done, description=f"{done} of {budget} cases{failures}")

            found = run_campaign(campaign, out, _engine(engine, address, processes), show)
    except KeyboardInterrupt:
        stdout.print("Interrupted; finished cases are kept, and the same command goes on.")
        raise typer.Exit(INTERRUPTED) from None
    write_cases(out / "cases.csv", campaign, found)
    write_report(out / "report.html", campaign, found, chosen)
    if junit is not None:
        write_campaign_junit(junit, campaign, found, chosen)
    stdout.print(f"{escape(counts_text(found))}\n{escape(rate_text(found))}", soft_wrap=True)
    for path in (out / "cases.csv", out / "report.html", junit):
        if path is not None:
            stdout.print(f"  {escape(path)}", soft_wrap=True)
    if not all(one.is_passed for one in found.results):
        raise typer.Exit(FAILED)


def _engine(chosen: CampaignEngine, address: str | None, processes: int | None) -> "Engine":
    import os

    from fogsim.study import RayCluster
    from fogsim.study.pool import ProcessPool
    from fogsim.testing.execution import check_outcome, check_to_file

    if chosen is CampaignEngine.RAY:
        return RayCluster(address, processes, check_outcome)
    return ProcessPool(processes or os.cpu_count() or 1, check_to_file)
