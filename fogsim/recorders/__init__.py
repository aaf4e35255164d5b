"""Results to files: parquet, video, report."""

from collections.abc import Callable

from fogsim.core.files.atomic import write_json
from fogsim.core.registry import Registry
from fogsim.recorders.events import EventRecorder
from fogsim.recorders.exchange.osi import OsiRecorder
from fogsim.recorders.manifest import Manifest, Status, versions
from fogsim.recorders.panel.camera_picture import draw_restored_picture
from fogsim.recorders.panel.frame_panel import PICTURE_SIZE, FramePanel
from fogsim.recorders.panel.view_from_above import draw_view_from_above
from fogsim.recorders.protocol import (
    DERIVED_QUANTITIES,
    AnyStep_contra,
    Derived,
    Recorder,
    RunInformation,
    StepRecorder,
    TrafficRecorder,
)
from fogsim.recorders.recovery import recover_run
from fogsim.recorders.report import ReportRecorder
from fogsim.recorders.run_directory import RunDirectory
from fogsim.recorders.sign_marks import write_sign_map
from fogsim.recorders.table import StepTable, TableRecorder
from fogsim.recorders.table_columns import traffic_table_columns
from fogsim.recorders.traffic_report import TrafficReportRecorder
from fogsim.recorders.trajectories import OpenScenarioRecorder, TrajectoryRecorder, with_trajectories
from fogsim.recorders.video import VideoRecorder, encoder_report

RecorderFactory = Callable[[RunInformation], Recorder]
"""Makes a recorder for one run about an ego."""

TrafficRecorderFactory = Callable[[RunInformation], TrafficRecorder]
"""Makes a recorder for one run of traffic alone."""

RECORDERS: Registry[RecorderFactory] = Registry(
    "recorder",
    {
        "table": lambda run: TableRecorder(run.directory.file("table"), run.methods),
        "video": lambda run: VideoRecorder(run.directory.file("video"), run.frame_period),
        "restored_video": lambda run: VideoRecorder(
            run.directory.file("restored_video"), run.frame_period, draw_restored_picture
        ),
        "report": ReportRecorder,
        "trajectories": lambda run: TrajectoryRecorder(run.directory.file("trajectories")),
        "events": lambda run: EventRecorder(run.directory.file("events")),
        "openscenario": lambda run: OpenScenarioRecorder(run.directory.file("openscenario"), run.title),
        "osi": lambda run: OsiRecorder(run.directory.file("osi")),
    },
)
"""Every recorder of runs about an ego, by name."""

TRAFFIC_RECORDERS: Registry[TrafficRecorderFactory] = Registry(
    "recorder of traffic alone",
    {
        "table": lambda run: StepTable(run.directory.file("table"), traffic_table_columns()),
        "report": TrafficReportRecorder,
        "trajectories": lambda run: TrajectoryRecorder(run.directory.file("trajectories")),
        "events": lambda run: EventRecorder(run.directory.file("events")),
        "openscenario": lambda run: OpenScenarioRecorder(run.directory.file("openscenario"), run.title),
        "osi": lambda run: OsiRecorder(run.directory.file("osi")),
    },
)
"""Every recorder of runs without an ego, by name."""

USUAL_RECORDERS = ("table", "video", "report")
"""Those that write of a run about an ego where no one has chosen."""

USUAL_TRAFFIC_RECORDERS = ("table", "report")
"""Those that write of traffic alone where no one has chosen."""

__all__ = [
    "DERIVED_QUANTITIES",
    "PICTURE_SIZE",
    "RECORDERS",
    "TRAFFIC_RECORDERS",
    "USUAL_RECORDERS",
    "USUAL_TRAFFIC_RECORDERS",
    "AnyStep_contra",
    "Derived",
    "EventRecorder",
    "FramePanel",
    "Manifest",
    "Recorder",
    "RecorderFactory",
    "ReportRecorder",
    "RunDirectory",
    "RunInformation",
    "Status",
    "StepRecorder",
    "StepTable",
    "TableRecorder",
    "TrafficRecorder",
    "TrafficRecorderFactory",
    "TrafficReportRecorder",
    "TrajectoryRecorder",
    "VideoRecorder",
    "draw_view_from_above",
    "encoder_report",
    "recover_run",
    "versions",
    "with_trajectories",
    "write_json",
    "write_sign_map",
]
