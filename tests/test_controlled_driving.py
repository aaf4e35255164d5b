"""A controller in the ego: actuators, who drives without a request, and what the reference controllers do."""

import math

import gymnasium
import numpy as np
import pytest

import fogsim
import fogsim_envs  # noqa: F401 - registers the environments
from fogsim.advice import AdaptiveCruiseControl, EmergencyBrake
from fogsim.core.registry import MethodConfig
from fogsim.errors import InputError
from fogsim.fusion import FUSIONS
from fogsim.simulation.advised_driving import AdvisedDriving
from fogsim.simulation.controlled_driving import ControlledDriving
from fogsim.simulation.run_config import AdviceConfig, ControllerConfig
from fogsim.testing import check_one_case
from fogsim.values import Control, DriverWarning, LeadMeasurement, Observation
from fogsim.values.result_checks import checked_control

BARE = np.zeros((1, 1, 3), np.uint8)

SCENARIO = """
name: stands_ahead
duration: 14 s
road: {template: motorway, length: 1500 m}
actors:
  ego: {position: 50 m, speed: 90 km/h}
  truck: {type: truck, ahead_of: ego, gap: 180 m, stands: true}
fog: {visibility: 40 m}
renderer: none
sut: {estimators: [], controller: CONTROLLER, driver: none}
expect: {safe: {never: ego.collision, always: ego.gap > 1 m}}
"""


def seen(gap: float, closing: float, speed: float = 20.0) -> Observation:
    return Observation(BARE, speed, LeadMeasurement(gap, -closing))


def driven(driver: str, requests: list[float | None], **actuators: float) -> list[float | None]:
    config = ControllerConfig(MethodConfig("emergency_brake"), driver, **actuators)
    driving = ControlledDriving(AdvisedDriving(AdviceConfig(), 1), config, 0.1)
    return [driving._actuated(one) for one in requests]


def test_requests_pass_delay_lag_and_limits() -> None:
    found = driven("none", [-20.0] * 6, delay=0.2, lag=0.1, braking=8.0)
    reached = [-8.0 * (1.0 - math.exp(-steps)) for steps in (1, 2, 3, 4)]
    assert found == pytest.approx([0.0, 0.0, *reached])
    assert driven("none", [9.0], delay=0.0, lag=0.0, accelerating=2.0) == [2.0]
    part = driven("human", [-8.0, -8.0, None, None], delay=0.125, lag=0.0)
    assert part == pytest.approx([None, -6.0, -8.0, -2.0]), "a quarter of the period is still the request before"


def test_who_drives_without_a_request() -> None:
    requests, at_once = [None, -4.0, None, None], {"delay": 0.0, "lag": 0.0}
    assert driven("none", requests, **at_once) == [0.0, -4.0, 0.0, 0.0]
    assert driven("human", requests, **at_once) == [None, -4.0, None, None]
    assert driven("human_until_intervention", requests, **at_once) == [None, -4.0, 0.0, 0.0]


def test_stages_of_the_emergency_brake() -> None:
    """At 20 m/s: warned below 3 + 20 · 1.2 + 400 / 10 = 67 m, braked partially below 51 m and fully below 33.2 m."""
    wanted = {68.0: (None, None), 66.0: (None, DriverWarning.COLLISION), 50.0: (-5.0, DriverWarning.COLLISION)}
    for gap, (acceleration, warning) in {**wanted, 33.0: (-9.0, DriverWarning.COLLISION)}.items():
        assert EmergencyBrake().control(seen(gap, 20.0)) == Control(acceleration, warning=warning), gap
    braking = EmergencyBrake()
    braking.control(seen(33.0, 20.0))
    assert braking.control(seen(60.0, 5.0)).acceleration == -9.0, "no stage is left before the approach ends"
    assert braking.control(seen(60.0, 0.0)).acceleration is None
    braking.control(seen(33.0, 20.0))
    assert braking.control(seen(4.0, 0.0, speed=0.0)).acceleration == -9.0, "it holds behind what stands"
    assert braking.control(seen(6.0, -2.0, speed=0.0)).acceleration is None, "and lets go when that drives off"


def test_cruise_control_keeps_its_gap_and_slows_down_where_it_knows_nothing() -> None:
    ignorant = FUSIONS["none"]().update([], 0.0)
    control = AdaptiveCruiseControl(set_speed=30.0, unknown_speed=20.0)
    assert control.control_by_belief(Observation(BARE, 20.0), ignorant).acceleration == pytest.approx(0.0)
    assert control.control_by_belief(seen(3.0 + 1.8 * 20.0, 0.0), ignorant).acceleration == pytest.approx(0.0)
    assert control.control_by_belief(seen(29.0, 0.0), ignorant).acceleration == pytest.approx(-2.3)


@pytest.mark.parametrize(("controller", "passes"), [("emergency_brake", True), ("'mine:Late'", False)])
def test_a_standing_truck_in_fog(tmp_path, controller: str, passes: bool) -> None:
    """SUMO's own safety does not save an ego whose controller brakes too late."""
    code = "from fogsim.advice import EmergencyBrake\nclass Late(EmergencyBrake):\n"
    code += "    def control(self, seen):\n        self.response_time = -1.5\n        return super().control(seen)\n"
    (tmp_path / "mine.py").write_text(code)
    (tmp_path / "test.fog.yaml").write_text(SCENARIO.replace("CONTROLLER", controller))
    result = check_one_case(tmp_path / "test.fog.yaml")
    assert result.is_passed is passes, result.findings
    assert result.metrics["ego_collisions"] == (0 if passes else 1)


def test_the_stronger_of_driver_and_controller_brakes(tmp_path) -> None:
    """A gentle brake does not hold back a driver who sees the truck; without a driver it ends in the truck."""
    (tmp_path / "mine.py").write_text(
        "import numpy as np\nfrom fogsim.values import Control\nclass Gentle:\n"
        "    def control(self, seen):\n        return Control(acceleration=np.float32(-0.1))\n"  # a network's
    )
    for driver, collisions in (("human", 0), ("none", 1)):
        text = SCENARIO.replace("CONTROLLER", "'mine:Gentle'").replace("driver: none", f"driver: {driver}")
        (tmp_path / "test.fog.yaml").write_text(text.replace("40 m}", "1 km}"))
        assert check_one_case(tmp_path / "test.fog.yaml").metrics["ego_collisions"] == collisions


def test_a_stop_within_the_minimum_gap_is_no_collision(tmp_path) -> None:
    """SUMO by default counts each gap below 2.5 m; only contact is a collision here."""
    (tmp_path / "mine.py").write_text(
        "from fogsim.values import Control\nclass Precise:\n    def control(self, seen):\n"
        "        if seen.lead is None or seen.lead.distance > 60.0 or seen.speed < 0.1:\n"
        "            return Control(acceleration=0.0 if seen.speed > 0.1 else -1.0)\n"
        "        return Control(acceleration=-(seen.speed ** 2) / (2.0 * max(seen.lead.distance - 1.0, 0.2)))\n"
    )
    text = SCENARIO.replace("CONTROLLER", "{method: 'mine:Precise', delay: 0 s}")
    text = text.replace("always: ego.gap > 1 m", "eventually: ego.gap < 2 m")
    (tmp_path / "test.fog.yaml").write_text(text)
    result = check_one_case(tmp_path / "test.fog.yaml")
    assert result.is_passed, result.findings


def test_mistakes_name_what_is_wrong(tmp_path) -> None:
    file = tmp_path / "test.fog.yaml"
    (tmp_path / "mine.py").write_text("class Idle:\n    pass\n")
    wrong = {
        "driver goes with controller": SCENARIO.replace("controller: CONTROLLER, ", ""),
        "must have a method control\\(\\) or control_by_belief": SCENARIO.replace("CONTROLLER", "'mine:Idle'"),
        "did you mean 'emergency_brake'": SCENARIO.replace("CONTROLLER", "emergency_brak"),
        "a whole multiple of clocks.camera_period_s, got 0.25 s and 0.1 s": SCENARIO.replace(
            "CONTROLLER", "{method: emergency_brake, period: 0.25 s}"
        ),
        "braking_mps2": SCENARIO.replace("CONTROLLER", "{method: emergency_brake, braking: -3 m/s²}"),
    }
    for message, text in wrong.items():
        file.write_text(text)
        with pytest.raises(fogsim.InputError, match=message):
            fogsim.load_scenario(file)
    for request in (None, Control(math.nan), Control(1.0, 2.0), Control(lamps="low")):  # type: ignore[arg-type]
        with pytest.raises(fogsim.InputError, match="controller 'mine:Idle'"):
            checked_control("mine:Idle", request)


def test_an_environment_refuses_a_controller() -> None:
    scenario = fogsim.load_scenario("motorway_fog_bank", ["controller=emergency_brake"])
    env = gymnasium.make("fogsim/FogAdvisoryFast-v1", scenario=scenario)
    with pytest.raises(InputError, match="'emergency_brake' would drive the ego, and in an environment the agent does"):
        env.reset(seed=1)
