"""Text that a user's files can have a say in."""

import pytest

from fogsim.errors import printable


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("fog 80 m – Ω", "fog 80 m – Ω"),
        ("\x1b[31mred", r"\x1b[31mred"),
        ("a\tb", r"a\tb"),
        ("bell\a", r"bell\x07"),
        ("\udcff", r"\udcff"),
    ],
)
def test_what_terminals_would_obey_is_escaped_and_lines_end_unless_they_must_not(text: str, shown: str) -> None:
    assert printable(text) == shown
    assert printable(shown) == shown
    assert printable("a\nb") == "a\nb"
    assert printable("a\nb", in_one_line=True) == r"a\nb"
