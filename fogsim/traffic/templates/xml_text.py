"""Elements of SUMO's files as text."""

from xml.sax.saxutils import quoteattr


def element(name: str, **attributes: object) -> str:
    """An element without children.

    Parameters
    ----------
    name : str
        Its name.
    **attributes : object
        Its attributes; an underscore at the end of a name, as Python needs it (``from_``), is left out.
    """
    return opening(name, **attributes).removesuffix(">") + "/>"


def opening(name: str, **attributes: object) -> str:
    """Start tag of an element, which children and an end tag follow.

    Parameters
    ----------
    name, **attributes
        As of `element`.
    """
    return (
        f"<{name}" + "".join(f" {key.rstrip('_')}={quoteattr(str(value))}" for key, value in attributes.items()) + ">"
    )
