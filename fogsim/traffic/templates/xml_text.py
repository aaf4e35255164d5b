"""Elements of SUMO's files as text."""

import re
from xml.sax.saxutils import quoteattr

_IS_PLAIN = re.compile(r"[\w .,:+-]*", re.ASCII).fullmatch


def element(name: str, **attributes: object) -> str:
    """An element without children."""
    return opening(name, **attributes).removesuffix(">") + "/>"


def opening(name: str, **attributes: object) -> str:
    """Start tag of an element, which children and an end tag follow."""
    return f"<{name}" + "".join(f" {key.rstrip('_')}={_quoted(str(value))}" for key, value in attributes.items()) + ">"


def _quoted(text: str) -> str:
    """An attribute's value; most need no escapes."""
    return f'"{text}"' if _IS_PLAIN(text) else quoteattr(text)
