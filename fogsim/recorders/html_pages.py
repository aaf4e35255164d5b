"""HTML pages from the templates in ``templates``: escaped, and complete in one file."""

import base64
import functools
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined


def render_page(template: str, **values: object) -> str:
    """The page of a template; all text in `values` is escaped."""
    return _environment().get_template(template).render(values)


def data_url(content: bytes, media_type: str) -> str:
    """URL that embeds a file in a page."""
    return f"data:{media_type};base64,{base64.b64encode(content).decode('ascii')}"


@functools.cache
def _environment() -> Environment:
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).with_name("templates")),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["data_url"] = data_url
    return environment
