"""Which expectations -k asks for."""

import pytest

from fogsim.errors import InputError
from fogsim.testing import parse_keywords


@pytest.mark.parametrize(
    ("written", "fits"),
    [
        ("fog", True),
        ("night", False),
        ("FOG and not night", True),
        ("night or (fog and safe)", True),
        ("not (night or safe)", False),
        ("not night and not truck", True),
        ("a.fog.yaml", True),
    ],
)
def test_words_with_and_or_not(written: str, fits: bool) -> None:
    assert parse_keywords(written).match("tests/a.fog.yaml motorway safe") is fits


@pytest.mark.parametrize("written", ["", "and", "fog or", "(fog", "fog)", "fog night", "not"])
def test_what_is_no_condition_is_refused(written: str) -> None:
    with pytest.raises(InputError, match="expected"):
        parse_keywords(written)
