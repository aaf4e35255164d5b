"""Several sessions claim an attribute of a vehicle at once; no simulation runs."""

from types import SimpleNamespace
from typing import Any

import pytest

from fogsim.traffic.sumo.claims import TIME_HEADWAY, TOP_SPEED, Claims, SessionValues, new_session

OWN = 30.0


@pytest.fixture
def api() -> Any:
    """What claims use of SUMO; the top speed of its vehicles is an attribute."""
    parameters: dict[str, str] = {}
    domain = SimpleNamespace(top_speed=OWN, parameters=parameters)
    domain.getMaxSpeed = lambda _: domain.top_speed
    domain.setMaxSpeed = lambda _, speed: setattr(domain, "top_speed", speed)
    domain.getParameter = lambda _, key: parameters.get(key, "")
    domain.setParameter = lambda _, key, value: parameters.update({key: value})
    return SimpleNamespace(vehicle=domain, simulation=domain)


def test_the_lowest_claim_holds_and_the_own_value_comes_back(api: Any) -> None:
    one, other = (Claims(api, TOP_SPEED, session) for session in "12")
    one.claim("v", 20.0)
    other.claim("v", 15.0)
    assert api.vehicle.top_speed == 15.0
    assert one.own_value("v") == other.own_value("v") == OWN
    other.withdraw("v")
    assert api.vehicle.top_speed == 20.0
    one.withdraw("v")
    assert api.vehicle.top_speed == OWN
    assert not any(api.vehicle.parameters.values())


def test_a_headway_grows_and_shrinks_and_comes_back(api: Any) -> None:
    """The claim that is farthest from the own value holds."""
    api.vehicle.getTau = lambda _: api.vehicle.top_speed
    api.vehicle.setTau = api.vehicle.setMaxSpeed
    one, other = (Claims(api, TIME_HEADWAY, session) for session in "12")
    one.claim("v", 1.3 * OWN)
    assert api.vehicle.top_speed == 1.3 * OWN
    other.claim("v", 1.5 * OWN)
    assert api.vehicle.top_speed == 1.5 * OWN
    one.claim("v", 0.5 * OWN)
    assert api.vehicle.top_speed == 0.5 * OWN
    other.claim("v", 2.0 * OWN)  # as far as the half: the lower holds
    assert api.vehicle.top_speed == 0.5 * OWN
    assert one.own_value("v") == other.own_value("v") == OWN
    one.withdraw("v")
    assert api.vehicle.top_speed == 2.0 * OWN
    other.withdraw("v")
    assert api.vehicle.top_speed == OWN
    assert not any(api.vehicle.parameters.values())


def test_a_value_that_somebody_else_sets_is_the_own_one_from_then_on(api: Any) -> None:
    claims = Claims(api, TOP_SPEED, "1")
    claims.claim("v", 50.0)  # which is above the vehicle's own
    assert api.vehicle.top_speed == OWN
    claims.claim("v", 20.0)
    api.vehicle.top_speed = 25.0
    claims.claim("v", 18.0)
    claims.withdraw("v")
    assert api.vehicle.top_speed == 25.0


def test_sessions_have_numbers_of_their_own_and_their_values_make_a_round_trip(api: Any) -> None:
    assert [new_session(api) for _ in range(3)] == ["1", "2", "3"]
    values = SessionValues[str](api, "ignored")
    values.write("v", {"1": "lead", "2": "ä"})
    assert values.read("v") == {"1": "lead", "2": "ä"}
    values.write("v", {})
    assert values.read("v") == {}
