"""What every block of a scenario file shares: how strict it is, and the types and ranges of its values.

The ranges are wide, but physical: what lies beyond them is a slip of the pen, or another unit. Truth values are no
numbers, text is neither, and only what says so may be infinite.
"""

import math
from typing import Annotated

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field

FARTHEST = 1e6
"""Longest length, and longest time, that a scenario may name [m, s]."""

Flag = Annotated[bool, Field(strict=True)]
"""true or false."""

Whole = Annotated[int, Field(strict=True)]
"""A whole number."""

Seed = Annotated[Whole, Field(ge=0, le=2**63 - 1)]
"""Seed of random numbers."""

Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
"""A finite number."""

Share = Annotated[Number, Field(ge=0, le=1)]
"""A share [-]."""

Time = Annotated[Number, Field(ge=0, le=FARTHEST)]
"""A time from zero [s]."""

Period = Annotated[Number, Field(ge=0.001, le=FARTHEST)]
"""A time that must pass [s]; SUMO counts milliseconds."""

Moment = Annotated[Number, Field(ge=-FARTHEST, le=FARTHEST)]
"""A time, also before the beginning [s]."""

Distance = Annotated[Number, Field(ge=0, le=FARTHEST)]
"""A length from zero [m]."""

Length = Annotated[Number, Field(ge=0.001, le=FARTHEST)]
"""A length that cannot be zero [m]."""

Place = Annotated[Number, Field(ge=-FARTHEST, le=FARTHEST)]
"""A height, or a place along a road [m]."""

SpeedKmh = Annotated[Number, Field(ge=0, le=500)]
"""A speed [km/h]."""

Deceleration = Annotated[Number, Field(ge=0.01, le=50)]
"""How hard a vehicle brakes [m/s²]."""

Pixels = Annotated[Number, Field(ge=1, le=1e6)]
"""A length in the image [px]."""

PixelPlace = Annotated[Number, Field(ge=-1e6, le=1e6)]
"""A row or column, also beside the image [px]."""

Luminance = Annotated[Number, Field(ge=1e-6, le=1e9)]
"""A luminance [cd/m²]."""

Text = Annotated[str, Field(max_length=1000)]
"""Text of some lines."""

Id = Annotated[str, Field(min_length=1, max_length=200)]
"""Id of something in SUMO's files."""


def _infinity(value: object) -> object:
    """Let what has no end be written as inf, infinity or .inf."""
    return math.inf if isinstance(value, str) and value.strip().lower() in {"inf", "infinity", ".inf"} else value


def _far_or_endless(value: float) -> float:
    if FARTHEST < value < math.inf:
        raise ValueError(f"must be at most {FARTHEST:g} m, or inf")
    return value


def _endless(least: float) -> object:
    """Range of a length of at least so much [m] that may be infinite, for the schema's readers."""
    return Field(strict=True, ge=least, json_schema_extra={"maximum": FARTHEST, "or": "inf"})


Visibility = Annotated[float, _endless(1.0), BeforeValidator(_infinity), AfterValidator(_far_or_endless)]
"""A meteorological visibility [m]; inf is clear air."""

Top = Annotated[float, _endless(-FARTHEST), BeforeValidator(_infinity), AfterValidator(_far_or_endless)]
"""A height that may be without end [m]."""


class Section(BaseModel):
    """A block of a scenario file: unknown keys are errors, values never change."""

    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True)
