"""Text files from the templates in ``templates``."""

import base64
import functools
from pathlib import Path
from xml.sax.saxutils import quoteattr

from jinja2 import Environment, FileSystemLoader, StrictUndefined, select_autoescape


def render(template: str, **values: object) -> str:
    """The text of a template; in HTML all text in `values` is escaped."""
    return _environment().get_template(template).render(values)


def data_url(content: bytes, media_type: str) -> str:
    """URL that embeds a file in a page."""
    return f"data:{media_type};base64,{base64.b64encode(content).decode('ascii')}"


@functools.cache
def _environment() -> Environment:
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).with_name("templates")),
        autoescape=select_autoescape(["html"]),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {"data_url": data_url, "quoted": quoteattr}
    return environment
