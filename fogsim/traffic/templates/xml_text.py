"""Elements of SUMO's files as text."""

from xml.sax.saxutils import quoteattr


def element(name: str, **attributes: object) -> str:
    """An element without children."""
    return opening(name, **attributes).removesuffix(">") + "/>"


def opening(name: str, **attributes: object) -> str:
    """Start tag of an element, which children and an end tag follow."""
    return (
        f"<{name}" + "".join(f" {key.rstrip('_')}={quoteattr(str(value))}" for key, value in attributes.items()) + ">"
    )
