"""The roster is the set of vehicles on the road."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from fogsim.traffic.sumo.libsumo_link import LibsumoLink
from fogsim.traffic.sumo.roster import Roster

FOLDER = Path(__file__).resolve().parents[3] / "scenarios" / "motorway_fog_bank"


STEP = 0.1


ARGUMENTS = (
    *("--net-file", str(FOLDER / "motorway.net.xml"), "--route-files", str(FOLDER / "motorway.rou.xml")),
    *("--step-length", str(STEP), "--seed", "5", "--no-step-log", "true", "--no-warnings", "true"),
)


@pytest.fixture
def link() -> Iterator[LibsumoLink]:
    link = LibsumoLink()
    yield link
    link.end()


def test_the_roster_is_who_is_on_the_road(link: LibsumoLink) -> None:
    api = link.begin(ARGUMENTS)
    roster = Roster(api)
    mark, came = 0, set()
    for step in range(900):
        link.step()
        # A step in a hundred is missed, and once somebody is taken away.
        if step % 100:
            roster.update()
            new, mark = roster.entered_since(mark)
            came.update(new)
            assert roster.present == set(api.vehicle.getIDList())
        if step == 450:
            api.vehicle.remove(min(roster.present))
    assert roster.present < came
    assert roster.removals > 0
