"""What methods of the user's return is checked and named."""

import dataclasses
import json
import math
from typing import Any

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.fusion import make as make_fusion
from fogsim.lighting import LIGHTING_POLICIES
from fogsim.metrics import METRICS, RunMetrics
from fogsim.offline import FrameEstimates, record_lines
from fogsim.offline.source import Picture
from fogsim.scenario import load_scenario
from fogsim.simulation.advised_driving import AdvisedDriving
from fogsim.values import (
    Command,
    Control,
    DenserFog,
    Display,
    Estimate,
    Lamp,
    LampChoice,
    OpticalDepths,
    SpeedAdvice,
    Stretch,
    StretchAdvice,
)
from fogsim.values.estimate import ExtinctionBounds
from fogsim.values.result_checks import (
    checked_advice,
    checked_belief,
    checked_command,
    checked_control,
    checked_estimate,
    checked_lamp_choice,
    checked_lamps,
    checked_recorder,
    checked_values,
)
from tests.recorders.synthetic import make_step


def test_estimates() -> None:
    for value, message in [
        (None, r"^estimator 'mine': update\(\) must be of type fogsim\.values\.Estimate, got None"),
        (0.03, "must be of type"),
        (Estimate("mine", math.nan, 0.1), r"extinction must be a finite number of at least 0 .*; got nan"),
        (Estimate("mine", -0.1, 0.1), "extinction must be .*; got -0.1"),
        (Estimate("mine", math.inf, 0.1), "extinction must be .*; got inf"),
        (Estimate("mine", "thick", 0.1), "extinction must be .*; got 'thick'"),  # type: ignore[arg-type]  # wrong
        (Estimate("mine", 0.1, math.nan), "standard_deviation must be .*; got nan"),
        (Estimate("mine", 0.1, math.inf), "standard_deviation must be .*; got inf"),
        (Estimate("mine", 0.1, 0.1, valid=None), "valid must be True or False"),  # type: ignore[arg-type]  # wrong
        (Estimate("mine", 0.1, 0.1, reach=math.nan), "reach must be at least 0 .*; got nan"),
        (Estimate("mine", 0.1, 0.1, denser=50.0), "denser must be of type .*DenserFog, or None; got 50"),  # type: ignore[arg-type]  # wrong
        (Estimate("mine", 0.1, 0.1, denser=DenserFog(math.nan, 1.0, 0.1)), "denser.distance must be .* got nan"),
        (Estimate("mine", 0.1, 0.1, bounds=ExtinctionBounds(least=-1.0)), "bounds.least must be .* got -1.0"),
        *(
            (
                Estimate("mine", 0.1, 0.1, optical_depths=OpticalDepths(*curve)),
                "optical_depths must have as many depths",
            )
            for curve in (((), (), ()), ((10.0, 20.0), (0.1,), (0.1, 0.1)), ((10.0,), (math.nan,), (0.1,)))
        ),
        *(
            (Estimate("mine", 0.1, 0.1, optical_depths=OpticalDepths(places, (0.1, 0.2), (0.1, 0.1))), "which ascend")
            for places in ((20.0, 10.0), (0.0, 10.0), ("near", "far"))
        ),
        (Estimate("other", 0.1, 0.1), "method must be its name in the registry, 'mine'; got 'other'"),
    ]:
        with pytest.raises(InputError, match=message):
            checked_estimate("mine", value)


def test_what_cannot_tell_need_not_have_numbers() -> None:
    estimate = Estimate.invalid("mine", "dark")
    assert checked_estimate("mine", estimate) is estimate


def test_numbers_of_a_network_become_those_of_python() -> None:
    """Half a float squared is 0, and JSON has neither."""
    given: Any = {"extinction": np.float16(0.125), "standard_deviation": 0, "valid": np.bool_(True)}
    diagnostics = {"horizon_row": np.float32(60)}
    found = checked_estimate("mine", Estimate("mine", **given, diagnostics=diagnostics))
    assert [type(one) for one in (found.extinction, found.standard_deviation, found.valid)] == [float, float, bool]
    picture = Picture("a.png", 0.0, np.zeros((2, 2), np.uint8))
    record = json.loads(next(record_lines(FrameEstimates(picture, (found,)))))
    assert (record["visibility_m"], record["horizon_row"]) == (pytest.approx(math.log(20.0) / 0.125, rel=1e-5), 60.0)


def test_beliefs() -> None:
    good = make_fusion("grid_filter").update([], 0.0)
    assert checked_belief("mine", good) is good
    half, backward = 0.5 * good.probability, good.log_extinction[::-1]
    unknown = np.full(len(half), math.nan)
    for change, message in (
        ({"probability": half}, "add up to 1, got .* a sum of 0.5$"),
        ({"probability": unknown}, "probability must be at least 0"),
        ({"probability": None}, r"probability must be an array \(n,\) of floats, got None"),
        ({"probability": good.probability[1:]}, "must be of one length"),
        ({"log_extinction": backward}, "ascending"),
        ({"log_extinction": unknown}, "finite"),
        ({"age": math.nan}, r"age must be at least 0 \[s\]"),
        ({"profile": unknown}, "profile must be of type .*FogProfile, or None"),
    ):
        with pytest.raises(InputError, match=message):
            checked_belief("mine", dataclasses.replace(good, **change))  # type: ignore[arg-type]  # wrong on purpose
    with pytest.raises(
        InputError, match=r"^fusion 'mine': update\(\) must be of type fogsim\.values\.Belief, got None"
    ):
        checked_belief("mine", None)


def test_advice() -> None:
    for speed in [math.nan, -1.0, None, "fast", True]:
        with pytest.raises(InputError, match=r"^adviser 'mine': advise\(\): speed must be at least 0"):
            checked_advice("mine", SpeedAdvice(speed))
        with pytest.raises(InputError, match=r"the command: advice\.speed must"):
            checked_command(Command(SpeedAdvice(speed)))
        with pytest.raises(InputError, match=r"advised_speeds\['a'\] must"):
            checked_command(Command(advised_speeds={"a": speed}))
        assert checked_command(Command()) == Command()


def test_advice_to_others() -> None:
    def one(*place: object, **shown: object) -> Command:
        return Command(stretches=(StretchAdvice(20.0, *place, **shown),))  # type: ignore[arg-type]  # wrong on purpose

    for command, message in [
        (Command(advice_reach=math.nan), r"advice_reach must be at least 0 \[m\], got nan"),
        (Command(stretches=[StretchAdvice(20.0)]), "stretches must be a tuple of StretchAdvice; got"),
        (Command(stretches=(20.0,)), r"stretches\[0\] must be of type fogsim\.values\.StretchAdvice, got 20"),
        (Command(stretches=(StretchAdvice(20.0), StretchAdvice(-1.0))), r"stretches\[1\]: speed must be at least 0"),
        (one("road"), r"stretch must be of type fogsim\.values\.Stretch, got 'ro"),
        (one(display="sign"), r"display must be a fogsim\.values\.Display; got 's"),
        (one(Stretch(-1.0)), r"stretch\.start must be .* at least 0 .*, got -1"),
        (one(Stretch(5.0, 5.0)), r"stretch\.end must lie behind its start at 5"),
        (one(Stretch(edges="e1")), r"stretch\.edges must be a tuple .*got 'e1'"),
        (one(Stretch(edges=(1,))), r"stretch\.edges must be .* ids of edges; got 1"),
    ]:
        with pytest.raises(InputError, match=f"^the command.*{message}"):
            checked_command(command)


def test_good_advice_to_others() -> None:
    stretch = Stretch(100.0, math.inf, ("a", "b"))
    good = Command(advice_reach=math.inf, stretches=(StretchAdvice(math.inf, stretch, Display.MESSAGE_SIGN),))
    assert checked_command(good) is good


def test_lamps() -> None:
    assert checked_lamps("mine", Lamp.NONE) is Lamp.NONE
    for wrong in (None, 3, "low"):
        with pytest.raises(
            InputError, match=r"^lighting policy 'mine': lamps\(\) must be of type fogsim\.values\.Lamp"
        ):
            checked_lamps("mine", wrong)
    with pytest.raises(InputError, match=r"'mine': lamps\(\): no lamp has the bits 4096; there are POSITION, LOW_BEAM"):
        checked_lamps("mine", Lamp.LOW_BEAM | Lamp(4096))
    with pytest.raises(InputError, match=r"^controller 'mine': no lamp has the bits 4096"):
        checked_control("mine", Control(lamps=Lamp(4096)))
    choice = LampChoice(Lamp.LOW_BEAM)
    assert checked_lamp_choice("mine", choice) is choice
    with pytest.raises(InputError, match=r"choose_lamps\(\): lamps must be of type"):
        checked_lamp_choice("mine", LampChoice(2))  # type: ignore[arg-type]  # what is to be refused


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (None, "must return a mapping"),
        ({"speed_mps": math.nan}, "speed_mps must be a finite number, or None .*; got nan"),
        ({"a": {"b": math.inf}}, r"a\.b must be a finite number"),
        ({"a": [1.0]}, "a must be None, a word"),
        ({"a": True}, "a must be None, a word"),
    ],
)
def test_metrics(value: object, message: str, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match=message):
        checked_values("mine", value)
    monkeypatch.setattr(type(METRICS["motion"](None)), "result", lambda _: value)  # type: ignore[arg-type]  # unused
    with pytest.raises(InputError, match=f"^metric 'motion': .*{message}"):
        RunMetrics(names=["motion"]).summary()


def test_numbers_of_numpy_are_metrics() -> None:
    found = checked_values("mine", {"a": np.int64(3), "b": {"c": np.float32(0.5)}, "d": None, "e": "word"})
    assert json.dumps(found) == '{"a": 3, "b": {"c": 0.5}, "d": null, "e": "word"}'


def test_a_metric_does_not_take_the_key_of_another(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(type(METRICS["comfort"](None)), "result", lambda _: {"duration_s": 1.0})  # type: ignore[arg-type]  # unused
    with pytest.raises(InputError, match=r"^metric 'comfort': .* another metric has the key 'duration_s'"):
        RunMetrics(names=["motion", "comfort"]).summary()


def test_the_rooms_that_ask_methods_check_them(monkeypatch: pytest.MonkeyPatch) -> None:
    config = load_scenario("motorway_fog_bank").run_config()
    step = make_step(0, time=0.0)
    driving = AdvisedDriving(config.advice, 1)
    monkeypatch.setattr(driving, "_ask_adviser", lambda *_: None)
    with pytest.raises(InputError, match="stopping_sight_distance"):
        driving.decide(step)
    for method in ("lamps", "choose_lamps"):
        without_lamps = type("Mine", (), {method: lambda *_: None})()
        monkeypatch.setattr(LIGHTING_POLICIES, "find", lambda *_, mine=without_lamps: lambda: mine)
        with pytest.raises(InputError, match=rf"'fog_lamp_rules': {method}\(\) must be of type"):
            AdvisedDriving(config.advice, 1).decide(step)


def test_recorders() -> None:
    class Half:
        def record(self) -> None: ...

    with pytest.raises(InputError, match=r"^recorder 'mine': its factory must return an object with close\(\); got <"):
        checked_recorder("mine", Half())
    with pytest.raises(InputError, match=r"with record\(\) and close\(\); got None$"):
        checked_recorder("mine", None)
