"""SUMO's own variable speed signs, which hold for whole lanes, in a scenario's additional files."""

from pathlib import Path

from early_motorway import EARLY

import fogsim

LIMIT = 15.0
"""Far below the limits and speeds of the motorway, 30 m/s and more [m/s]."""


def test_the_ego_and_others_keep_to_what_they_show(tmp_path: Path) -> None:
    signs = tmp_path / "limits.add.xml"
    lanes = " ".join(f"bank_{i}" for i in range(3))
    step = f'<step time="0" speed="{LIMIT}"/>'
    signs.write_text(
        f'<additional><variableSpeedSign id="limit" lanes="{lanes}">{step}</variableSpeedSign></additional>'
    )
    blind = ("renderer=none", "estimators=[]", "traffic.events=[]", "fog.visibility_m=3000")
    clocks = ("clocks.camera_period_s=1", "clocks.decision_period_s=1", "duration_s=45", EARLY)
    settings = [*blind, *clocks, f"traffic.additional=[signs.add.xml, {signs}]"]
    *_, last = fogsim.run(fogsim.load_scenario("motorway_fog_bank", settings), 1)
    assert last.speed_limit == LIMIT
    assert float(last.traffic.speed[last.ego]) < 1.2 * LIMIT
    there = [i for i, lane in enumerate(last.traffic.lane) if lane.startswith("bank")]
    assert len(there) > 3
    assert last.traffic.speed[there].mean() < 1.2 * LIMIT
