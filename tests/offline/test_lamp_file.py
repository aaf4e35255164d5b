"""Files of a vehicle's lamps."""

from pathlib import Path

import pytest

from fogsim.errors import InputError
from fogsim.offline.lamp_file import load_lamps


def test_mistakes_are_told(tmp_path: Path) -> None:
    file = tmp_path / "lamps.yaml"
    for text, why in (
        ("heigth_m: 0.8\n", r"lamps.yaml:1: heigth_m: unknown key; did you mean 'height_m'"),
        ("low_beam: none.csv\n", r"none.csv: cannot be read: No such file"),
    ):
        file.write_text(text, encoding="utf-8")
        with pytest.raises(InputError, match=why):
            load_lamps(file)
