"""The block ``sut``: another way to write what is under test, which are keys of their own."""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from fogsim.errors import InputError, shown, suggest
from fogsim.scenario.document import Document, parse_override

BLOCK = "sut"
"""Name of the block."""

KEYS = ("estimators", "fusion", "advice", "lighting", "controller", "driver")
"""Keys that may stand in it."""


def without_sut(document: Document) -> Document:
    """Copy of a document in which the keys of ``sut`` stand by themselves."""
    if BLOCK not in document.data:
        return document
    block = document.data[BLOCK]
    if not isinstance(block, dict):
        raise InputError(f"{document.where((BLOCK,))}: {BLOCK}: must be a block of keys; got {shown(block)}")
    mistakes = [
        f"{document.where((BLOCK, key))}: {BLOCK}.{key}: "
        + (f"unknown key; {suggest(str(key), KEYS)}" if key not in KEYS else f"{key} stands outside {BLOCK} too")
        for key in block
        if key not in KEYS or key in document.data
    ]
    if mistakes:
        raise InputError("\n".join(mistakes))
    data = {key: value for key, value in document.data.items() if key != BLOCK}
    origins = {at[1:] if at[:1] == (BLOCK,) and len(at) > 1 else at: origin for at, origin in document.origins.items()}
    return replace(document, data={**data, **block}, origins=origins)


def without_sut_in_path(override: str) -> Iterator[str]:
    """An override of ``sut`` or of a key in it as overrides of the keys themselves."""
    if override.partition("=")[0].strip() != BLOCK:
        yield override.strip().removeprefix(f"{BLOCK}.")
        return
    written = Document(Path(), {BLOCK: parse_override(override)[1]}, {}).overridden((override,))
    yield from (f"{key}={json.dumps(value)}" for key, value in without_sut(written).data.items())
