"""SUMO's own variable speed signs, which hold for whole lanes, in a scenario's additional files."""

from pathlib import Path

from early_motorway import EARLY

import fogsim
from fogsim.values import Step

QUIET = (
    "renderer=none",
    "estimators=[]",
    "traffic.events=[]",
    "clocks.camera_period_s=1",
    "clocks.decision_period_s=1",
    EARLY,
    "duration_s=45",
    "fog.visibility_m=3000",
)
LIMIT = 15.0


def end_of_run(*settings: str) -> Step:
    *_, last = fogsim.run(fogsim.load_scenario("motorway_fog_bank", [*QUIET, *settings]), 1)
    return last


def test_the_ego_and_others_keep_to_what_they_show(tmp_path: Path) -> None:
    signs = tmp_path / "limits.add.xml"
    lanes = " ".join(f"bank_{i}" for i in range(3))
    step = f'<step time="0" speed="{LIMIT}"/>'
    signs.write_text(
        f'<additional><variableSpeedSign id="limit" lanes="{lanes}">{step}</variableSpeedSign></additional>'
    )
    free, limited = end_of_run(), end_of_run(f"traffic.additional=[signs.add.xml, {signs}]")
    assert free.speed_limit > 30.0
    assert limited.speed_limit == LIMIT
    assert float(limited.traffic.speed[limited.ego]) < 1.2 * LIMIT < float(free.traffic.speed[free.ego])
    there = [i for i, lane in enumerate(limited.traffic.lane) if lane.startswith("bank")]
    assert len(there) > 3
    assert limited.traffic.speed[there].mean() < 1.2 * LIMIT
