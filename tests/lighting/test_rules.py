import math

import numpy as np

from fogsim.lighting import FogLampRules, LowBeamOnly
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values import Belief, Lamp


def believe(visibility: float) -> Belief:
    cells = np.linspace(math.log(3e-4), math.log(0.3), 241)
    weight = np.exp(-0.5 * ((cells - math.log(OPTICAL_DEPTH_AT_VISIBILITY / visibility)) / 0.03) ** 2)
    return Belief(cells, weight / weight.sum())


def test_fog_lamps_by_visibility() -> None:
    rules = FogLampRules()
    assert rules.lamps(believe(300.0), Lamp.NONE) == Lamp.POSITION | Lamp.LOW_BEAM
    assert rules.lamps(believe(80.0), Lamp.NONE) == Lamp.POSITION | Lamp.LOW_BEAM | Lamp.FRONT_FOG
    assert Lamp.REAR_FOG in rules.lamps(believe(40.0), Lamp.NONE)


def test_hysteresis_keeps_a_lamp_lit_until_visibility_is_clearly_better() -> None:
    rules = FogLampRules()
    assert Lamp.REAR_FOG in rules.lamps(believe(55.0), Lamp.REAR_FOG)
    assert Lamp.REAR_FOG not in rules.lamps(believe(55.0), Lamp.NONE)
    assert Lamp.REAR_FOG not in rules.lamps(believe(65.0), Lamp.REAR_FOG)


def test_low_beam_whatever_the_fog() -> None:
    assert LowBeamOnly().lamps(believe(20.0), Lamp.NONE) == Lamp.POSITION | Lamp.LOW_BEAM
