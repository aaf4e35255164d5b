"""Inputs that `tools/fuzz.py` found once end in a result or one clear error."""

from pathlib import Path

import pytest

import fuzz


@pytest.mark.parametrize("name", sorted(folder.name for folder in fuzz.CORPUS.iterdir()))
def test_what_was_found_once_stays_mended(name: str, tmp_path: Path) -> None:
    entry = fuzz.entries()[name]
    for path in sorted((fuzz.CORPUS / name).iterdir()):
        fuzz.try_input(entry, path.read_bytes(), tmp_path)
