"""Glare of oncoming head lamps on a two-way road of a real SUMO, and none where nothing comes."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fogsim.traffic import DriverSight
from fogsim.traffic.appearance import EYE_HEIGHTS
from fogsim.traffic.drivers.lamp_intensity import beam_intensity
from fogsim.traffic.sumo.libsumo_link import LibsumoLink
from fogsim.traffic.sumo.roster import Roster
from fogsim.traffic.sumo_drivers.oncoming_glare import LAMP_HEIGHT, MOST_GLARE, OncomingGlare, most_glare
from fogsim.traffic.sumo_drivers.perception import LeaderSight
from fogsim.traffic.sumo_drivers.vehicle_sight import DriversView, OwnLamps
from fogsim.traffic.sumo_lanes.directions import OppositeEdges
from fogsim.units import extinction_from_visibility
from fogsim.values import Lamp
from fogsim.values.light import ALL_LAMPS, Side, dark_on
from tests.traffic.common import DATA, even

NET = DATA / "grid" / "grid.net.xml"
ROUTES = """<routes><vType id="c" length="5" width="1.8"/><route id="r" edges="B0C0"/><route id="s" edges="C0B0"/>
  <vehicle id="leader" type="c" route="r" depart="0" departPos="65" departLane="0" color="0,0,0"/>
  <vehicle id="me" type="c" route="r" depart="0" departPos="10" departLane="0"/>
  <vehicle id="coming" type="c" route="s" depart="0" departPos="40" departLane="0"/></routes>"""
ALL_DARK = sum(dark_on(int(ALL_LAMPS), side) for side in Side)
HIGH_BEAM: OwnLamps = {"coming": int(Lamp.LOW_BEAM | Lamp.HIGH_BEAM)}


@pytest.fixture
def api(tmp_path: Path) -> Iterator[Any]:
    routes = tmp_path / "two_way.rou.xml"
    routes.write_text(ROUTES, encoding="utf-8")
    link = LibsumoLink()
    begun = link.begin(["--net-file", str(NET), "--route-files", str(routes), "--no-step-log", "true"])
    link.step()
    yield begun
    link.end()


def view(api: Any, visibility: float, headlamp_reach: float = 55.0) -> DriversView:
    return DriversView(api, even(visibility), DriverSight(0.01, headlamp_reach), Roster(api))


def veil(api: Any, observer: str, target: str, visibility: float, own_lamps: OwnLamps) -> float:
    return OncomingGlare(view(api, visibility)).veil(observer, target, own_lamps)


def test_the_other_side_of_a_road_leads_back_and_by_day_nothing_dazzles(api: Any) -> None:
    opposite = OppositeEdges(api)
    assert opposite.of("B0C0") == ("C0B0",)
    assert opposite.of(":B0_0") == opposite.of("") == ()
    assert [most_glare(lux) for lux in (1000.0, 999.0)] == [0.0, MOST_GLARE]


def test_the_veil_is_that_of_the_lamps_that_come(api: Any) -> None:
    """CIE 146's general formula, written out for 25 years and brown eyes, E of two low beams through the fog."""
    eyes, lamps, target = (np.array(api.vehicle.getPosition3D(v)) for v in ("me", "coming", "leader"))
    apart = lamps - eyes + np.array([0.0, 0.0, LAMP_HEIGHT - EYE_HEIGHTS["car"]])
    distance = float(np.linalg.norm(apart))
    theta = math.degrees(math.atan2(apart[1], apart[0]) - math.atan2(*(target - eyes)[1::-1]))
    light = 2.0 * beam_intensity(int(Lamp.LOW_BEAM), math.degrees(math.atan2(abs(apart[1]), apart[0]))) / distance**2
    for visibility in (math.inf, 60.0):
        seen = light * math.exp(-extinction_from_visibility(visibility) * distance)
        by_age = (5.0 / theta**2 + 0.05 / theta) * (1.0 + (25.0 / 62.5) ** 4)
        expected = seen * (10.0 / theta**3 + by_age + 0.00125)
        assert veil(api, "me", "leader", visibility, {}) == pytest.approx(expected, rel=1e-6)


def test_only_lit_head_lamps_that_face_the_driver_dazzle(api: Any) -> None:
    assert veil(api, "me", "leader", 300.0, {"coming": ALL_DARK}) == 0.0
    assert veil(api, "coming", "me", 300.0, {"me": 0, "leader": ALL_DARK}) == 0.0
    assert veil(api, "me", "leader", 300.0, HIGH_BEAM) > 5.0 * veil(api, "me", "leader", 300.0, {})
    assert veil(api, "me", "leader", 1e6, HIGH_BEAM) <= MOST_GLARE
    one_dead = {"coming": int(Lamp.LOW_BEAM) | dark_on(int(Lamp.LOW_BEAM), Side.LEFT)}
    assert veil(api, "me", "leader", 300.0, one_dead) == pytest.approx(0.5 * veil(api, "me", "leader", 300.0, {}))


def test_high_beams_that_follow_dazzle_in_the_mirrors(api: Any) -> None:
    """0.8 of 2 × 34 kcd at 55 m lay 18 lx on the eye, at 40° 0.1 cd/m²: a third of oncoming low beams', and no less."""
    following = {"me": int(Lamp.HIGH_BEAM), "coming": ALL_DARK}
    in_mirrors = veil(api, "leader", "leader", math.inf, following)
    assert 0.05 < in_mirrors < 0.2
    assert in_mirrors > veil(api, "leader", "leader", 60.0, following) > 0.0
    assert veil(api, "leader", "leader", math.inf, {**following, "me": int(Lamp.LOW_BEAM)}) == 0.0
    assert veil(api, "me", "leader", math.inf, {"leader": int(Lamp.HIGH_BEAM), "coming": ALL_DARK}) == 0.0


def test_own_high_beams_show_an_unlit_leader_from_farther_and_a_dazzled_driver_sees_it_later(api: Any) -> None:
    """The same leader, 50 m ahead: in thin fog it is seen by head lamps alone, and not against high beams."""
    pairs = [("me", "leader", 50.0 - api.vehicle.getMinGap("me"))]
    dark: OwnLamps = {"leader": ALL_DARK, "coming": ALL_DARK}

    def assess(visibility: float, reach: float, lamps: OwnLamps) -> tuple[list[bool], list[float]]:
        return LeaderSight(view(api, visibility, reach), api.vehicle.getSpeed, 0.5).assess(pairs, {**dark, **lamps})

    for visibility, lamp, seen in (
        (3000.0, Lamp.LOW_BEAM, False),
        (3000.0, Lamp.HIGH_BEAM, True),
        (100.0, Lamp.HIGH_BEAM, False),
    ):
        assert assess(visibility, 40.0, {"me": int(lamp)})[0] == [seen]
    assert assess(1e5, 55.0, {}) == ([True], [0.0])
    assert assess(1e5, 55.0, HIGH_BEAM)[0] == [False]
