"""Text that a user's files can have a say in, made safe for terminals."""

from rich.markup import escape as escape_markup


def printable(text: str, *, in_one_line: bool = False) -> str:
    r"""Escape, as Python writes it, what is no character to be seen.

    Control characters would be obeyed by terminals, and bytes of names that are no text cannot be printed.

    Parameters
    ----------
    text : str
        Any text.
    in_one_line : bool
        Escape ends of lines, too.
    """
    kept = "" if in_one_line else "\n"
    return "".join(
        one if one.isprintable() or one in kept else one.encode("unicode_escape", "backslashreplace").decode("ascii")
        for one in text
    )


def escape(text: str, *, in_one_line: bool = False) -> str:
    """`printable` text that is no markup for rich either."""
    return escape_markup(printable(text, in_one_line=in_one_line))
