"""A page of numbered figures and tables that needs no other file: the report, and the look at what was read."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import tipdamp
from tipdamp.report.drawing import plotly, plotly_modes, plotly_scene
from tipdamp.report.drawing.figure import Figure
from tipdamp.report.drawing.modes import ModeShapes
from tipdamp.report.drawing.scene import Scene
from tipdamp.report.drawing.table import Table
from tipdamp.report.templating import markup, render, source
from tipdamp.study.view import Study

Block = Figure | Scene | ModeShapes | Table
B = TypeVar("B")
DRAW: dict[type, Callable[[Any], str]] = {
    Figure: plotly.draw, Scene: plotly_scene.draw, ModeShapes: plotly_modes.draw, Table: lambda _: ""}


@dataclass(frozen=True)
class Section(Generic[B]):
    """name - its anchor in the page; blocks - figures and tables in their order."""

    name: str
    title: str
    blocks: Sequence[B]


@dataclass(frozen=True)
class Shown:
    """A figure or table with its number on the page; drawn - HTML of a figure."""

    number: int
    block: Block
    drawn: str


def page(template: str, study: Study, sections: Sequence[Section[Block]], **values: Any) -> str:
    """A template that extends page.html, filled with the sections and with values of its own.

    Raises InputError where plotly or jinja2 is not installed.
    """
    return render(template, title=study.title, study_file=study.path.name, version=tipdamp.__version__,
                  sections=_numbered(sections), style=source("style.css"),
                  plotly_script=markup(plotly.plotly_script()), modes_script=source("modes.js"),
                  print_script=source("print.js"), **values)


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
