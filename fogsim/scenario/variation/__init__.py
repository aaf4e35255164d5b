"""What differs between the cases of a scenario file, and when all of them together pass."""

from fogsim.scenario.variation.cases import (
    KEYS,
    NONE_FAILS,
    Case,
    Variation,
    VariationKeys,
    Verdict,
    chosen_cases,
    read_variation,
    value_text,
    with_case,
)
from fogsim.scenario.variation.levels import number_with_unit

__all__ = [
    "KEYS",
    "NONE_FAILS",
    "Case",
    "Variation",
    "VariationKeys",
    "Verdict",
    "chosen_cases",
    "number_with_unit",
    "read_variation",
    "value_text",
    "with_case",
]
