"""Conditions in scenario files: parsed with the file, written back as text."""

from collections.abc import Iterable
from typing import Annotated

from pydantic import PlainSerializer, PlainValidator, ValidationError, WithJsonSchema
from pydantic_core import InitErrorDetails, PydanticCustomError

from fogsim.conditions import Condition, parse_condition
from fogsim.scenario.mistakes import MISTAKE
from fogsim.scenario.plain_yaml import KeyPath

_SCHEMA = {"format": "condition", "anyOf": [{"type": "string"}, {"type": "object"}, {"type": "array"}]}


def _condition(written: object) -> Condition:
    """A condition from a file or a program."""
    return written if isinstance(written, Condition) else parse_condition(written)


WrittenCondition = Annotated[
    Condition, PlainValidator(_condition), PlainSerializer(str, return_type=str), WithJsonSchema(_SCHEMA)
]
"""A condition on the run: text, or a mapping from signals to the rest of it."""


def refuse(mistakes: Iterable[tuple[KeyPath, str]]) -> None:
    """Raise ValidationError if there are mistakes, given as key path and message."""
    details = [
        InitErrorDetails(type=PydanticCustomError(MISTAKE, "{message}", {"message": text}), loc=place, input=0)
        for place, text in mistakes
    ]
    if details:
        raise ValidationError.from_exception_data("expect", details)
