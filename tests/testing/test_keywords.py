"""Which expectations -k asks for."""

import pytest

from fogsim.errors import InputError
from fogsim.testing import parse_keywords


def test_words_with_and_or_not() -> None:
    for written, fits in [
        ("fog", True),
        ("night", False),
        ("FOG and not night", True),
        ("night or (fog and safe)", True),
        ("not (night or safe)", False),
        ("not night and not truck", True),
        ("a.fog.yaml", True),
    ]:
        assert parse_keywords(written).match("tests/a.fog.yaml motorway safe") is fits


def test_what_is_no_condition_is_refused() -> None:
    for written in ["", "and", "fog or", "(fog", "fog)", "fog night", "not"]:
        with pytest.raises(InputError, match="expected"):
            parse_keywords(written)
