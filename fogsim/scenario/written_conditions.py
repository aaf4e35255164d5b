"""Conditions in scenario files: read when the file is, written back as text."""

from typing import Annotated

from pydantic import PlainSerializer, PlainValidator, WithJsonSchema

from fogsim.conditions import Condition, Need, RunContent, parse_condition
from fogsim.scenario.section import Id

_SCHEMA = {"format": "condition", "anyOf": [{"type": "string"}, {"type": "object"}, {"type": "array"}]}

WrittenCondition = Annotated[
    Condition, PlainValidator(parse_condition), PlainSerializer(str, return_type=str), WithJsonSchema(_SCHEMA)
]
"""A condition on the run: text, or a mapping from signals to the rest of it."""

EventName = Id
"""Name of what begins in a run."""


def content_of(*, ego: bool, route: bool, methods: tuple[str, ...], banks: int, events: tuple[str, ...]) -> RunContent:
    """What conditions of a scenario may ask for.

    Parameters
    ----------
    ego : bool
        Whether there is an ego.
    route : bool
        Whether there is a way along which places count.
    methods : tuple of str
        Estimators; none if no frames are drawn.
    banks : int
        Number of fog banks.
    events : tuple of str
        What of its script can begin.
    """
    has = {Need.EGO: ego, Need.ROUTE: route, Need.FRAMES: bool(methods)}
    return RunContent(frozenset(need for need, is_there in has.items() if is_there), methods, banks, events)
