"""What the check of a file has found, in lines that name file, line, key, value and what is allowed."""

from collections.abc import Sequence
from typing import Any, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from fogsim.errors import nearest, shown, suggest
from fogsim.scenario.document import Document
from fogsim.scenario.plain_yaml import KeyPath, dotted
from fogsim.scenario.section import MISTAKE
from fogsim.scenario.sensors.faults import AnyFault
from fogsim.scenario.traffic_schema import AnyEvent

MOST_TOLD = 50
"""Most mistakes of a file that are told one by one."""

WORDED = {
    "model_type": "must be a block of keys",
    "dict_type": "must be a block of keys",
    "tuple_type": "must be a list",
    "too_short": "must have at least one entry",
    "path_type": "must be a path",
}
"""Messages of pydantic in the words of a file's reader."""


def mistake_lines(
    document: Document,
    model: type[BaseModel],
    error: ValidationError,
    further: Sequence[str] = (),
    beside: Sequence[str] = (),
) -> str:
    """Every mistake in a line of its own, without those that are there for another's sake.

    A list whose entries are wrong is not too short, and a key whose name is misspelt is not missing.

    Parameters
    ----------
    document : Document
        What was checked.
    model : type
        Its schema.
    error : ValidationError
        What was found.
    further : sequence of str
        Lines about what else was found.
    beside : sequence of str
        Keys that may stand in the file beside those of its schema.
    """
    details = error.errors(include_url=False)
    blocks = {detail["loc"][:length] for detail in details for length in range(len(detail["loc"]))}
    own = [detail for detail in details if detail["loc"] not in blocks]
    unknown = [detail["loc"] for detail in own[:MOST_TOLD] if detail["type"] == "extra_forbidden"]
    meant = {(*place[:-1], nearest(str(place[-1]), known_keys(model, place[:-1]))) for place in unknown}
    told = [
        _mistake_line(document, model, d, beside)
        for d in own[:MOST_TOLD]
        if d["type"] != "missing" or d["loc"] not in meant
    ]
    if len(own) > MOST_TOLD:
        told.append(f"{document.path}: and {len(own) - MOST_TOLD} more mistakes")
    return "\n".join([*told, *further])


def _mistake_line(document: Document, model: type[BaseModel], detail: ErrorDetails, beside: Sequence[str]) -> str:
    """One mistake in one line."""
    location: KeyPath = tuple(detail["loc"])
    key_path = _without_kinds(location)
    where = f"{document.where(key_path)}: {dotted(key_path) or 'scenario'}"
    if detail["type"] == "extra_forbidden":
        known = [*known_keys(model, location[:-1]), *(beside if len(location) == 1 else ())]
        return f"{where}: unknown key; {suggest(str(key_path[-1]), known)}"
    if detail["type"] == "union_tag_invalid":
        context = detail["ctx"]
        allowed = [kind.strip(" '") for kind in str(context["expected_tags"]).split(",")]
        key = _discriminator(context)
        return f"{where}.{key}: unknown {key} {shown(context['tag'])}; {suggest(str(context['tag']), allowed)}"
    if detail["type"] == "union_tag_not_found":
        return f"{where}.{_discriminator(detail['ctx'])}: this key is missing; it is required"
    if detail["type"] == "missing":
        return f"{where}: this key is missing; it is required"
    if detail["type"] == MISTAKE:
        return f"{where}: {detail['msg']}"
    message = WORDED.get(detail["type"], detail["msg"].removeprefix("Value error, "))
    value = detail["input"]
    if isinstance(value, dict | BaseModel):
        # A message about a whole block names the values that it is about itself.
        got = "; got a block of keys" if detail["type"].endswith("_type") else ""
    else:
        got = f"; got {shown(value)}"
    return f"{where}: {message[0].lower()}{message[1:]}{got}"


def _discriminator(context: dict[str, Any]) -> str:
    """Key by which blocks of a list are told apart, as pydantic names it."""
    return str(context["discriminator"]).strip("'")


def _without_kinds(location: KeyPath) -> KeyPath:
    """Key path of a mistake: pydantic puts the kind of a list's entry behind its place, where files have no key."""
    kinds = _kinds()
    return tuple(
        key
        for key, before in zip(location, (None, *location), strict=False)
        if not (isinstance(before, int) and key in kinds)
    )


def _kinds() -> dict[str, type[BaseModel]]:
    """Models of list entries by their kind."""
    return {
        str(get_args(model.model_fields[key].annotation)[0]): model
        for key, union in (("kind", AnyEvent), ("fault", AnyFault))
        for model in get_args(get_args(union)[0])
    }


def known_keys(root: type[BaseModel], location: Sequence[str | int]) -> list[str]:
    """Keys that a schema allows at a location.

    Parameters
    ----------
    root : type
        The schema.
    location : sequence of str or int
        The location in it, as pydantic has it.
    """
    model: Any = root
    is_name = False
    for before, key in zip((None, *location), location, strict=False):
        if isinstance(key, int) or is_name:
            # A place in a list, or a name in a block of entries by name.
            is_name = False
            continue
        if isinstance(before, int) and key in _kinds():
            model = _kinds()[str(key)]
        else:
            annotation = model.model_fields[key].annotation
            model, is_name = _model_in(annotation), get_origin(annotation) is dict
    return [field.alias or name for name, field in model.model_fields.items() if not field.exclude]


def _model_in(annotation: object) -> Any:
    """First model class inside an annotation such as ``tuple[Bank, ...]``."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((model for part in get_args(annotation) if (model := _model_in(part)) is not None), None)
