"""Text that a user's files can have a say in."""

import pytest
from rich.text import Text

from fogsim.cli.printing import escape
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
def test_what_terminals_would_obey_is_escaped(text: str, shown: str) -> None:
    assert printable(text) == shown
    assert printable(shown) == shown


def test_lines_end_unless_they_must_not() -> None:
    assert printable("a\nb") == "a\nb"
    assert printable("a\nb", in_one_line=True) == r"a\nb"


@pytest.mark.parametrize("text", ["[bold]fog[/]", "a[/]b", "[link=x]y", r"back\slash [red]"])
def test_rich_shows_as_it_is_what_looks_like_its_markup(text: str) -> None:
    assert Text.from_markup(escape(text)).plain == text
