"""What is lit in a run by night whose estimator sees nothing, and in one whose camera fails."""

import pytest

from fogsim import load_scenario, run
from fogsim.values import Lamp

LOW = Lamp.POSITION | Lamp.LOW_BEAM
SETTINGS = ("expect={}", "renderer=cpu", "camera.width=160", "camera.height=120", "duration_s=6")


@pytest.mark.parametrize("policy", ["gallen2014", "fog_lamp_rules", "legal", "longest_sight"])
def test_a_method_for_the_day_lights_nothing_but_low_beams_by_night(policy: str) -> None:
    overrides = (*SETTINGS, "fog.visibility_m=60", "estimators=[joint_road]", f"lighting={policy}")
    steps = list(run(load_scenario("rural_night_alone", overrides), seed=1))
    assert len(steps) > 20
    assert not any(step.belief.is_informed() for step in steps)
    assert {step.command.lamps for step in steps} == {LOW}


def test_oncoming_lamps_leave_the_fog_to_be_seen() -> None:
    """Their glow is itself a sign of fog: the belief is informed while they shine, and the fog lamps follow it."""
    overrides = ("expect={}", "timeline=[]", "fog.visibility_m=70", "duration_s=8", "lighting=gallen2014")
    steps = list(run(load_scenario("rural_night_fog", overrides), seed=0))[15:]
    assert any(step.observation.light is not None and step.observation.light.oncoming for step in steps)
    assert all(step.belief.is_informed() for step in steps)
    assert all(step.belief.visibility_quantile(0.05) <= 70.0 <= step.belief.visibility_quantile(0.95) for step in steps)
    assert all(Lamp.FRONT_FOG in step.command.lamps for step in steps[18:])
