"""The cases of a scenario file, and when all of them together pass."""

from fogsim.scenario.variation.cases import (
    KEYS,
    NONE_FAILS,
    Case,
    NoSuchCaseError,
    Variation,
    VariationKeys,
    Verdict,
    chosen_cases,
    differing_cases,
    first_of_several,
    grid_mistake,
    read_variation,
    with_case,
)
from fogsim.scenario.variation.levels import Draws, SeedLevels, Value, number_with_unit, value_text

__all__ = [
    "KEYS",
    "NONE_FAILS",
    "Case",
    "Draws",
    "NoSuchCaseError",
    "SeedLevels",
    "Value",
    "Variation",
    "VariationKeys",
    "Verdict",
    "chosen_cases",
    "differing_cases",
    "first_of_several",
    "grid_mistake",
    "number_with_unit",
    "read_variation",
    "value_text",
    "with_case",
]
