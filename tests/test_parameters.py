"""Parameters of methods: the ranges in their annotations hold in scenario files and in Python."""

import math
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
import pytest

from fogsim.advice import ADVISERS, FixedSpeed, StoppingSightDistance
from fogsim.core import registry
from fogsim.core.parameters import Range, accepted_parameters, checked_parameters, mismatch
from fogsim.core.registry import Registry
from fogsim.errors import InputError
from fogsim.estimators import ESTIMATORS
from fogsim.fusion import FUSIONS
from fogsim.lighting import LIGHTING_POLICIES
from fogsim.scenario import load_scenario
from fogsim.values import Camera

CAMERA = Camera(64, 48, 60.0, (31.5, 23.5), 1.4)
METHODS = [
    (kind, name, key)
    for kind in (ESTIMATORS, FUSIONS, ADVISERS, LIGHTING_POLICIES)
    for name, factory in kind.items()
    for key in accepted_parameters(factory, {"camera"})
]


def test_every_parameter_of_every_method_has_a_type_and_a_range() -> None:
    for kind, name, key in METHODS:
        given = (CAMERA,) if kind is ESTIMATORS else ()
        flag = isinstance(accepted_parameters(kind[name])[key].default, bool)
        # A text may name a file, and which there are is no question of its type.
        text = [] if mismatch(accepted_parameters(kind[name])[key].annotation, "x") is None else ["x"]
        for value in (1e30, -1e30, math.nan, math.inf, *text, [], *([1] if flag else [True])):
            with pytest.raises(InputError, match=rf"^{kind[name].__name__}: {key} must be .*, got "):
                kind[name](*given, **{key: value})
            with pytest.raises(InputError, match=rf"^{kind.kind} '{name}': {key}: must be "):
                registry.make(kind, name, *given, **{key: value})


def test_a_scenario_with_a_parameter_out_of_range_is_refused() -> None:
    for setting, told in [
        ("quantile: 7", "quantile: must be a number 0 … 1, got 7"),
        ("deceleration: 0", "deceleration: must be a number 0.1 … 15 m/s², got 0"),
        ("reaction_time: .nan", "reaction_time: must be a number 0 … 60 s, got nan"),
        ("rounding: 0", "rounding: must be a number 0.01 … 50 m/s, got 0"),
        ("rounding: yes", "rounding: must be a number 0.01 … 50 m/s, got True"),
        ("rounding: '2'", "rounding: must be a number 0.01 … 50 m/s, got '2'"),
    ]:
        override = f"advice={{method: stopping_sight_distance, parameters: {{{setting}}}}}"
        with pytest.raises(InputError) as error:
            load_scenario("motorway_fog_bank", [override])
        assert str(error.value) == f"--set {override}: advice.parameters.{told}"


def test_every_wrong_parameter_is_told() -> None:
    with pytest.raises(InputError) as error:
        load_scenario(
            "motorway_fog_bank", ["estimators=[{method: joint_road, parameters: {frames: 0, pitch_deviation: 9}}]"]
        )
    frames, pitch = str(error.value).splitlines()
    assert frames.endswith(": estimators.0.parameters.frames: must be a whole number 1 … 10000, got 0")
    assert pitch.endswith(": estimators.0.parameters.pitch_deviation: must be a number 1e-06 … 0.2 rad, got 9")


def test_numbers_of_any_real_type_are_numbers() -> None:
    for value in (20, 20.0, np.float32(20), np.int64(20)):
        assert FixedSpeed(value).speed == 20.0
    assert StoppingSightDistance(2.0) == StoppingSightDistance(reaction_time=2)


def test_what_annotations_allow() -> None:
    for annotation, good, bad, told in [
        (float, [1, -1e300], [math.nan, math.inf, True, "1", None], "a number, finite"),
        (int, [1, np.int64(3)], [1.0, False, "1"], "a whole number"),
        (Annotated[float, Range(0.0, 9.0, "m")] | None, [None, 9], [9.1, "x"], "a number 0 … 9 m or nothing"),
        (bool, [True], [1, "yes"], "true or false"),
        (str, ["a"], [1], "text"),
        (Literal["a", 1], ["a", 1], ["b", True], "'a' or 1"),
        (list[int], [[1], "anything"], [], ""),
    ]:
        assert [mismatch(annotation, value) for value in good] == [None] * len(good)
        assert [mismatch(annotation, value) for value in bad] == [told] * len(bad)


def test_a_method_of_the_users_own_is_checked_where_it_is_named() -> None:
    @dataclass
    class Careful:
        speed: Annotated[float, Range(1.0, 9.0, "m/s")]

    own = Registry("adviser", {"careful": Careful})
    assert registry.make(own, "careful", speed=2).speed == 2
    with pytest.raises(InputError, match=r"adviser 'careful': speed: must be a number 1 … 9 m/s, got 10"):
        registry.make(own, "careful", speed=10)
    with pytest.raises(InputError, match=r"adviser 'careful': speed: this parameter is missing; it is required"):
        registry.make(own, "careful")


def test_a_checked_class_keeps_its_signature() -> None:
    @checked_parameters
    class Own:
        def __init__(self, size: int, *, name: str = "x") -> None:
            self.size, self.name = size, name

    assert list(accepted_parameters(Own)) == ["size", "name"]
    assert Own(3, name="y").name == "y"
    with pytest.raises(InputError, match=r"^Own: missing a required argument: 'size'$"):
        Own()
    with pytest.raises(InputError, match=r"^Own: unknown parameter 'nam'; did you mean 'name'"):
        Own(3, nam="y")
    with pytest.raises(InputError, match=r"^Own: size must be a whole number, got 'a{39} … a{39}'$"):
        Own("a" * 500)


def test_numbers_of_numpy_are_numbers_without_a_warning() -> None:
    for kind in [np.float16, np.float32, np.float64, np.int8, np.uint64]:
        assert mismatch(float, kind(3)) is None
        assert mismatch(Annotated[float, Range(0.0, 1e300)], kind(3)) is None
        assert mismatch(float, np.float32("nan")) == "a number, finite"
