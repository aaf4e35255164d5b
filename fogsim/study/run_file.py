"""Files of runs, checked when they are read again: a run whose file is missing or damaged is run again."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from fogsim.core.files.readers import read_json
from fogsim.errors import InputError
from fogsim.metrics.road_speeds import ROAD_COLUMNS
from fogsim.study.profiles import CLASSES, COLLISION_COLUMNS, PATH_COLUMNS

T = TypeVar("T")

Word = Annotated[str, Field(strict=True)]
Finite = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Value = Word | Annotated[int, Field(strict=True)] | Finite | None
"""Value of a metric, or of a cell of a study's table."""

Metrics = Annotated[dict[str, Value], Field(min_length=1)]
"""Metrics of a run by name, as `RunSummary.flat` gives them."""

_ByClass = Annotated[list[Finite], Field(min_length=CLASSES, max_length=CLASSES)]


def _with_columns(names: Sequence[str]) -> AfterValidator:
    """Validator of columns: these names, all of one length."""

    def check(columns: dict[str, list[Any]]) -> dict[str, list[Any]]:
        if tuple(columns) != tuple(names) or len({len(column) for column in columns.values()}) > 1:
            raise ValueError(f"expected columns of one length: {', '.join(names)}")
        return columns

    return AfterValidator(check)


class RunRecord(BaseModel):
    """A part of a run file with exactly these keys."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class _TimeToCollision(RunRecord):
    class_s: Finite
    moving_s: _ByClass
    queue_s: _ByClass


class _Profiles(RunRecord):
    vehicle_time_s: Finite
    time_to_collision: _TimeToCollision
    road: Annotated[dict[str, list[Finite]], _with_columns(ROAD_COLUMNS)]
    path: Annotated[dict[str, list[Finite]], _with_columns(PATH_COLUMNS)]
    collisions: Annotated[dict[str, list[Finite | Word | None]], _with_columns(COLLISION_COLUMNS)]
    collision_count: Annotated[int, Field(strict=True, ge=0)]


class FailedRun(RunRecord):
    """A failed run."""

    status: Literal["failed"]
    message: Annotated[Word, Field(min_length=1)]
    duration_s: Finite = 0.0


class CompleteRun(RunRecord):
    """A completed run of a study."""

    status: Literal["complete"]
    metrics: Metrics
    profiles: _Profiles


STUDY_RUN: TypeAdapter[CompleteRun | FailedRun] = TypeAdapter(
    Annotated[CompleteRun | FailedRun, Field(discriminator="status")]
)
"""Schema of a run file of a study."""


def read_run(path: Path, schema: TypeAdapter[T]) -> T | None:
    """Content of a run's file; None if it is missing or damaged, so that the run is run again."""
    try:
        return schema.validate_python(read_json(path))
    except (InputError, ValidationError):
        return None
