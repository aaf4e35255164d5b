"""Belief to advised speed, and controllers that drive by what the vehicle knows."""

from collections.abc import Callable

from fogsim.advice.agent import trained_agent
from fogsim.advice.controllers import AdaptiveCruiseControl, BeliefController, Controller, EmergencyBrake, SightLimiter
from fogsim.advice.osi_controller import OsiController
from fogsim.advice.protocol import Adviser, VehicleAdviser
from fogsim.advice.sight_distance import FixedSpeed, NoAdvice, StoppingSightDistance
from fogsim.advice.step_tables import (
    AlabamaI10,
    ChinaArticle81,
    FiftyBelowFifty,
    NetherlandsA16,
    StepTable,
    TennesseeI75,
    VirginiaI77,
)
from fogsim.core.registry import Registry

ADVISERS: Registry[Callable[..., Adviser | VehicleAdviser]] = Registry(
    "adviser",
    {
        "stopping_sight_distance": StoppingSightDistance,
        "step_table": StepTable,
        "netherlands_a16": NetherlandsA16,
        "alabama_i10": AlabamaI10,
        "tennessee_i75": TennesseeI75,
        "virginia_i77": VirginiaI77,
        "china_article_81": ChinaArticle81,
        "france_r413_4": FiftyBelowFifty,
        "germany_stvo_3": FiftyBelowFifty,
        "fixed_speed": FixedSpeed,
        "none": NoAdvice,
    },
    group="fogsim.advice",
    methods=("advise|advise_vehicle",),
)

CONTROLLERS: Registry[Callable[..., Controller | BeliefController]] = Registry(
    "controller",
    {
        "emergency_brake": EmergencyBrake,
        "cruise_control": AdaptiveCruiseControl,
        "sight_limiter": SightLimiter,
        "osi": OsiController,
    },
    group="fogsim.advice.controllers",
    methods=("control|control_by_belief",),
    files={"onnx": trained_agent},
)

__all__ = [
    "ADVISERS",
    "CONTROLLERS",
    "AdaptiveCruiseControl",
    "Adviser",
    "BeliefController",
    "Controller",
    "EmergencyBrake",
    "FixedSpeed",
    "NoAdvice",
    "SightLimiter",
    "StepTable",
    "StoppingSightDistance",
    "VehicleAdviser",
]
