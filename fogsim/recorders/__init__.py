"""Results to files: parquet, video, report."""

from collections.abc import Callable

from fogsim.files.atomic import write_json
from fogsim.recorders.frame_panel import FramePanel
from fogsim.recorders.manifest import Manifest, Status, versions
from fogsim.recorders.protocol import DERIVED_QUANTITIES, Derived, Recorder, RunInformation
from fogsim.recorders.recovery import recover_run
from fogsim.recorders.report import ReportRecorder
from fogsim.recorders.run_directory import RunDirectory
from fogsim.recorders.sign_map import write_sign_map
from fogsim.recorders.table import TableRecorder
from fogsim.recorders.trajectories import TrajectoryRecorder, with_trajectories
from fogsim.recorders.video import VideoRecorder, encoder_report
from fogsim.registry import Registry

RecorderFactory = Callable[[RunInformation], Recorder]
"""Makes a recorder for one run."""

RECORDERS: Registry[RecorderFactory] = Registry(
    "recorder",
    {
        "table": lambda run: TableRecorder(run.directory.table, run.methods),
        "video": lambda run: VideoRecorder(run.directory.video, run.frame_period),
        "report": ReportRecorder,
        "trajectories": lambda run: TrajectoryRecorder(run.directory.trajectories),
    },
)
"""Every recorder by name."""

USUAL_RECORDERS = ("table", "video", "report")
"""Those that write where nobody has chosen."""

__all__ = [
    "DERIVED_QUANTITIES",
    "RECORDERS",
    "USUAL_RECORDERS",
    "Derived",
    "FramePanel",
    "Manifest",
    "Recorder",
    "RecorderFactory",
    "ReportRecorder",
    "RunDirectory",
    "RunInformation",
    "Status",
    "TableRecorder",
    "TrajectoryRecorder",
    "VideoRecorder",
    "encoder_report",
    "recover_run",
    "versions",
    "with_trajectories",
    "write_json",
    "write_sign_map",
]
