"""The run as a report to read."""

from collections.abc import Mapping

from fogsim.files.atomic import write_text
from fogsim.recorders.manifest import versions
from fogsim.recorders.protocol import Derived, RunInformation
from fogsim.recorders.report_data import Album, Curves
from fogsim.recorders.report_figures import draw_figures
from fogsim.recorders.report_page import ReportContent, render_report
from fogsim.values import Step


class ReportRecorder:
    """Writes ``report.html``: metrics, figures and pictures in one file that opens without a network.

    Parameters
    ----------
    information : RunInformation
        The run.
    """

    def __init__(self, information: RunInformation) -> None:
        self._information = information
        self._curves = Curves(estimates={method: [] for method in information.methods})
        self._album = Album()
        self._not_played: list[str] = []
        self._open = True

    def record(self, step: Step, derived: Derived) -> None:
        """Remember a step."""
        self._curves.add(step, derived)
        self._album.add(step)
        self._not_played = step.unplayed.lines

    def close(self, complete: bool) -> None:
        """Write the report; it says so if the run was cut short."""
        if not self._open:
            return
        last = self._curves.time[-1] if self._curves.time else 0.0
        content = ReportContent(
            title=self._information.title,
            description=self._information.description,
            interrupted_at=None if complete else last,
            not_played=self._not_played,
            metrics=self._information.summary(),
            meanings=self._information.meanings,
            # Figures take longer than somebody waits who has pressed Ctrl-C.
            figures=draw_figures(self._curves) if self._curves.time and complete else [],
            pictures=self._album.chosen(),
            footer=_footer(self._information.seed),
        )
        write_text(self._information.directory.report, render_report(content))
        self._open = False


def _footer(seed: int) -> Mapping[str, str]:
    return {"seed": str(seed), **{name: version or "not installed" for name, version in versions().items()}}
