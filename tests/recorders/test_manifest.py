import json
import platform
from datetime import datetime, timedelta, timezone

import numpy as np

from fogsim.core.files.writer_lock import WritingProcess
from fogsim.recorders import Manifest, Status, versions
from fogsim.values import Ending, Reason, Unplayed, UnplayedEvent

STARTED = datetime(2024, 11, 5, 7, 30, tzinfo=timezone(timedelta(hours=1)))


def test_a_manifest_says_what_was_run_and_how_it_ended() -> None:
    manifest = Manifest(
        status=Status.COMPLETE,
        seed=3,
        scenario={"name": "motorway_fog_bank", "camera": {"width": 640}},
        started=STARTED,
        ended=STARTED + timedelta(seconds=90),
        ending=Ending.ARRIVED,
        command_line=("fogsim", "run", "motorway_fog_bank"),
        process=WritingProcess(4711, "here", "b-4", 12),
        failed_recorders={"video": "no space"},
        unplayed=Unplayed((UnplayedEvent("traffic.events.0", Reason.LEFT),), ("truck7",)),
    )
    content = json.loads(json.dumps(manifest.to_json()))
    assert content["versions"] == versions()
    del content["versions"]
    assert content == {
        "status": "complete",
        "message": "",
        "ending": "arrived",
        "events_not_fired": ["traffic.events.0: the vehicle left the road before"],
        "vehicles_never_seen": ["truck7"],
        "seed": 3,
        "started": "2024-11-05T06:30:00+00:00",
        "ended": "2024-11-05T06:31:30+00:00",
        "command_line": ["fogsim", "run", "motorway_fog_bank"],
        "failed_recorders": {"video": "no space"},
        "process": {"id": 4711, "host": "here", "boot": "b-4", "start_time": 12},
        "scenario": {"name": "motorway_fog_bank", "camera": {"width": 640}},
    }


def test_the_manifest_of_a_running_run_has_no_end() -> None:
    running = Manifest(Status.RUNNING, 0, {}, STARTED).to_json()
    assert (running["status"], running["ended"], running["ending"]) == ("running", None, None)


def test_versions_come_from_what_is_installed() -> None:
    found = versions()
    assert found["numpy"] == np.__version__
    assert found["python"] == platform.python_version()
    assert set(found) >= {"fogsim", "libsumo", "pyrender", "opencv-python-headless", "gymnasium", "platform"}
