"""The ego's lamps as SUMO is told them."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import pytest

import fogsim
from fogsim.scenario import scenario_from_config
from fogsim.traffic.sumo_behaviour.scripted_actions import LampPublisher
from fogsim.values import Lamp
from tests.traffic.common import DATA


def test_lamps_are_told_when_they_change_and_the_ego_is_there() -> None:
    told: list[tuple[str, ...]] = []
    api: Any = SimpleNamespace(vehicle=SimpleNamespace(setParameter=lambda *what: told.append(what)))
    lamps = LampPublisher(api)
    for lit, present in (
        (Lamp.LOW_BEAM, {"other"}),
        (Lamp.LOW_BEAM, {"ego"}),
        (Lamp.LOW_BEAM, {"ego"}),
        (Lamp.LOW_BEAM | Lamp.FRONT_FOG, {"ego", "other"}),
        (Lamp.NONE, {"ego"}),
    ):
        lamps.publish({"ego": lit, "gone": Lamp.NONE}, present)
    assert [what[2] for what in told] == ["low_beam", "low_beam+front_fog", ""]
    assert {what[:2] for what in told} == {("ego", "fogsim-lamps")}


def test_sumo_itself_has_them(monkeypatch: pytest.MonkeyPatch) -> None:
    found = []
    publish = LampPublisher.publish

    def spied(self: LampPublisher, lamps: Mapping[str, Lamp], present: set[str]) -> None:
        publish(self, lamps, present)
        found.append(self._api.vehicle.getParameter("ego", "fogsim-lamps"))

    monkeypatch.setattr(LampPublisher, "publish", spied)
    settings = ["duration_s=1", "renderer=none", "estimators=[]", "fog.visibility_m=9000", "lighting=always_high"]
    list(fogsim.run(scenario_from_config(DATA / "off_lanes" / "two.sumocfg", "ego", settings), seed=1))
    assert found[-1] == "position+high_beam"
