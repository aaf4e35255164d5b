"""The roster is the set of vehicles on the road."""

from fogsim.traffic.sumo.libsumo_link import LibsumoLink
from fogsim.traffic.sumo.roster import Roster
from tests.traffic.common import CROWD


def test_the_roster_is_who_is_on_the_road(link: LibsumoLink) -> None:
    api = link.begin(CROWD)
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
