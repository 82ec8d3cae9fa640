"""The templates of the pages, filled by jinja2 with autoescape on."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tipdamp.report.libraries import need

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup

FOLDER = Path(__file__).with_name("templates")


def render(name: str, **values: Any) -> Markup:
    """A template of templates/ filled with values; every text among them is escaped, Markup is
    taken as it is.

    Raises InputError where jinja2 is not installed.
    """
    need("jinja2")
    return markup(_environment().get_template(name).render(**values))


def markup(text: str) -> Markup:
    """HTML made by a library, to be taken as it is."""
    from markupsafe import Markup

    return Markup(text)


def source(name: str) -> Markup:
    """A style sheet or script of templates/, to be written into the page."""
    return markup((FOLDER / name).read_text(encoding="utf-8"))


@cache
def _environment() -> Environment:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    return Environment(
        loader=FileSystemLoader(FOLDER),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
