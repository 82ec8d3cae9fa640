"""Results as notebooks show them: a table of what one asks first."""

from collections.abc import Mapping
from html import escape


def table(caption: str, rows: Mapping[str, str]) -> str:
    """HTML of a caption and rows {what: value}, all of them plain text."""
    body = "".join(
        f"<tr><th style='text-align:left'>{escape(what)}</th>"
        f"<td style='text-align:left'>{escape(value)}</td></tr>"
        for what, value in rows.items()
    )
    return f"<table><caption><b>{escape(caption)}</b></caption>{body}</table>"
