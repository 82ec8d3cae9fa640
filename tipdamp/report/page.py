"""A page of numbered figures and tables that needs no other file: the report, and the look at what
was read."""

import base64
import hashlib
import re
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import tipdamp
from tipdamp.hbm.drawing.figure import Figure
from tipdamp.report.drawing import plotly, plotly_moving, plotly_scene
from tipdamp.report.drawing.moving import MovingBodies
from tipdamp.report.drawing.scene import Scene
from tipdamp.report.drawing.table import Table
from tipdamp.report.templating import markup, render, source

Block = Figure | Scene | MovingBodies | Table
B = TypeVar("B")
SCRIPT = re.compile(r"<script[^>]*>(.*?)</script>", re.DOTALL)
DRAW: dict[type, Callable[[Any], str]] = {
    Figure: plotly.draw,
    Scene: plotly_scene.draw,
    MovingBodies: plotly_moving.draw,
    Table: lambda _: "",
}


@dataclass(frozen=True)
class Section(Generic[B]):
    """name - its anchor in the page; blocks - figures and tables in their order."""

    name: str
    title: str
    blocks: Sequence[B]


T = TypeVar("T")
Parts = Sequence[tuple[str, str, Sequence[Callable[[T], Iterable[Block]]]]]


def filled(parts: Parts[T], subject: T) -> list[Section[Block]]:
    """The sections that have something to show; parts - (anchor, title, functions of the subject
    that yield blocks) of each."""
    found = [
        Section(name, title, [block for part in each for block in part(subject)])
        for name, title, each in parts
    ]
    return [section for section in found if section.blocks]


@dataclass(frozen=True)
class Shown:
    """A figure or table with its number on the page; drawn - HTML of a figure."""

    number: int
    block: Block
    drawn: str


def page(
    template: str, title: str, about: str, sections: Sequence[Section[Block]], **values: Any
) -> str:
    """A template that extends page.html, filled with the sections and with values of its own.

    about - the study file, or files, below the title

    Raises InputError where plotly or jinja2 is not installed.
    """
    numbered = _numbered(sections)
    scripts = {
        "plotly_script": markup(plotly.plotly_script()),
        "moving_script": source("moving.js"),
        "print_script": source("print.js"),
    }
    drawn = [
        text
        for section in numbered
        for shown in section.blocks
        for text in SCRIPT.findall(shown.drawn)
    ]
    return render(
        template,
        title=title,
        about=about,
        version=tipdamp.__version__,
        sections=numbered,
        style=source("style.css"),
        policy=policy([*scripts.values(), *drawn]),
        **scripts,
        **values,
    )


def policy(scripts: Iterable[str]) -> str:
    """Content security policy of a page: these scripts alone run, and nothing is fetched.

    Names of a study that came through as markup would not be among them.
    """
    hashes = (base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in scripts)
    allowed = " ".join(f"'sha256-{one}'" for one in dict.fromkeys(hashes))
    return (
        f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; img-src data: "
        "blob:; base-uri 'none'; form-action 'none'"
    )


def _numbered(sections: Sequence[Section[Block]]) -> list[Section[Shown]]:
    count: Counter[str] = Counter()
    numbered = []
    for section in sections:
        shown = []
        for block in section.blocks:
            count[block.kind] += 1
            shown.append(Shown(count[block.kind], block, markup(DRAW[type(block)](block))))
        numbered.append(Section(section.name, section.title, shown))
    return numbered
