"""What every block of a scenario file shares: how strict it is, and the ranges of its numbers."""

import math
from typing import Annotated

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

Share = Annotated[float, Field(ge=0, le=1)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]


def _visibility(value: object) -> object:
    """Let a visibility be written as .inf, inf or infinity."""
    return math.inf if isinstance(value, str) and value.strip().lower() in {"inf", "infinity", ".inf"} else value


Visibility = Annotated[float, Field(gt=0), BeforeValidator(_visibility)]


class Section(BaseModel):
    """A block of a scenario file: unknown keys are errors, values never change."""

    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True)
