"""No echo from behind what is solid; leaves shorten the radar's reach by what they take from its waves."""

import numpy as np
import pytest

from fogsim.sensors import LeadSensor, RadarShadow, measure_lead
from fogsim.sensors.lead import foliage_loss
from fogsim.values import Leader, Structure, StructureKind

RADAR, REAR = (0.0, 0.0, 0.6), ((100.0, -1.0, 0.6), (100.0, 0.0, 0.6), (100.0, 1.0, 0.6))


def across(kind: str, y: tuple[float, float] = (-20.0, 20.0), width: float = 1.2, top: float = 2.2) -> Structure:
    line = np.array([[50.0, y[0], 0.0], [50.0, y[1], 0.0]])
    return Structure("one", StructureKind(kind), line, width, 0.0, top)


@pytest.mark.parametrize("kind", ["wall", "building", "truck", "tunnel"])
def test_no_echo_from_behind_what_is_solid(kind: str) -> None:
    shadow = RadarShadow([across(kind)])
    assert shadow.share_of_reach(RADAR, REAR) == 0.0
    rng = np.random.default_rng(0)
    assert measure_lead(Leader("lead", 100.0, 20.0), 25.0, LeadSensor(), rng, share_of_reach=0.0) is None


def test_half_a_rear_is_enough() -> None:
    assert RadarShadow([across("wall", (-20.0, 0.3))]).share_of_reach(RADAR, REAR) == 1.0


def test_a_hedge_shortens_the_reach_and_sixty_metres_of_it_end_it() -> None:
    # 1.2 m: 0.45 · 77^0.284 · 1.2 = 1.85 dB on each way, 10^(−3.71 / 40) of the reach.
    assert foliage_loss(1.2) == pytest.approx(1.854, abs=0.001)
    assert RadarShadow([across("hedge")]).share_of_reach(RADAR, REAR) == pytest.approx(0.808, abs=0.001)
    assert RadarShadow([across("hedge", width=60.0)]).share_of_reach(RADAR, REAR) < 0.01
    rng = np.random.default_rng(0)
    near, far = (
        measure_lead(Leader("lead", gap, 20.0), 25.0, LeadSensor(), rng, share_of_reach=0.8) for gap in (159.0, 161.0)
    )
    assert near is not None
    assert far is None


def test_foliage_loss_is_published_and_grows() -> None:
    # Weissberger's two branches meet at 14 m within 0.5 dB at 1 GHz; without leaves there is no loss.
    assert foliage_loss(14.0, 1.0) == pytest.approx(foliage_loss(14.001, 1.0), abs=0.5)
    assert foliage_loss(14.0, 1.0) == pytest.approx(6.3)
    assert foliage_loss(0.0) == 0.0
    assert foliage_loss(5.0) < foliage_loss(15.0) < foliage_loss(60.0)


def test_nothing_in_the_way_leaves_every_measurement_as_it_is() -> None:
    assert not RadarShadow(())
    assert RadarShadow(()).share_of_reach(RADAR, REAR) == 1.0
    assert RadarShadow([across("wall", (5.0, 20.0))]).share_of_reach(RADAR, REAR) == 1.0
    one, other = np.random.default_rng(1), np.random.default_rng(1)
    lead = Leader("lead", 60.0, 20.0)
    assert measure_lead(lead, 25.0, LeadSensor(), one) == measure_lead(lead, 25.0, LeadSensor(), other, 0.0, 1.0)
