"""Reports of an earlier call: they must not stay where a new one ends before its own."""

import contextlib
from pathlib import Path

_STARTS = ('<?xml version="1.0" encoding="utf-8"?>\n<testsuites', "<!doctype html>")
"""Beginnings of FogSim's reports; a file that begins otherwise may be another, given by mistake."""


def remove_earlier(*reports: Path | None) -> None:
    """Remove JUnit XML and pages at these paths."""
    for path in reports:
        if path is None or not path.is_file():
            continue
        with contextlib.suppress(OSError), path.open(encoding="utf-8", errors="replace") as file:
            if file.read(100).lower().startswith(_STARTS):
                path.unlink()
