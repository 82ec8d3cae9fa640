"""Mode shapes drawn with plotly and animated by templates/modes.js."""

import base64
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.report.drawing import plotly, plotly_scene
from tipdamp.report.drawing.modes import ModeShapes
from tipdamp.report.templating import markup, render
from tipdamp.report.text import MM

PERIOD = 1600  # ms of one cycle on the screen
COLORS = [[0.0, "#e3e6e9"], [0.5, "#56a3c9"], [1.0, "#12355b"]]


def draw(picture: ModeShapes) -> str:
    """Controls, plot and data; the page must hold plotly.js and modes.js."""
    kinds: dict[str, list] = {}
    for i, mode in enumerate(picture.modes):
        kinds.setdefault(mode.kind, []).append((i, mode.label))
    plot = figure_of(picture).to_html(
        full_html=False,
        include_plotlyjs=False,
        config=plotly_scene.CONFIG_3D,
        div_id=f"{picture.name}-plot",
    )
    return render(
        "modes.html", picture=picture, kinds=kinds, plot=markup(plot), data=data_of(picture)
    )


def figure_of(picture: ModeShapes) -> Any:
    """The plotly figure at rest: the bodies, then their sharp edges."""
    out = plotly.library().graph_objects.Figure()
    for body, surface in picture.surfaces.items():
        out.add_trace(
            {
                **plotly_scene.solid(MM * surface.position, surface.triangles),
                "name": body,
                "hoverinfo": "skip",
                "intensity": np.zeros(len(surface.node), dtype=np.float32),
                "colorscale": COLORS,
                "cmin": 0,
                "cmax": 1,
                "showscale": False,
                "showlegend": False,
            }
        )
    for surface in picture.surfaces.values():
        a, b = MM * surface.position[surface.edges].transpose(1, 0, 2)
        out.add_trace(
            {
                "type": "scatter3d",
                "mode": "lines",
                **plotly_scene.lines(a, b),
                "hoverinfo": "skip",
                "line": {"color": "#9aa4ae", "width": 1.2},
                "showlegend": False,
            }
        )
    out.update_layout(
        template="simple_white",
        height=600,
        margin={"l": 0, "r": 0, "t": 4, "b": 4},
        scene=plotly_scene.space(picture.boxes()[0], picture.eye, picture.up),
        uirevision="modes",
        font={"family": plotly.FONT, "size": 12.5},
    )
    return out


def data_of(picture: ModeShapes) -> dict:
    """What modes.js works on; arrays are float32 in base64, x, y, z of node after node."""
    bodies = [
        {"name": b, "trace": i, "rest": _packed(MM * s.position)}
        for i, (b, s) in enumerate(picture.surfaces.items())
    ]
    outlines = [{"name": b["name"], "trace": len(bodies) + i} for i, b in enumerate(bodies)]
    modes = [
        {
            "caption": m.caption,
            "amplitude": m.amplitude,
            "shapes": {b: _packed(u) for b, u in m.shapes.items()},
        }
        for m in picture.modes
    ]
    views = []
    for box in picture.boxes():
        space = plotly_scene.space(box, picture.eye, picture.up)
        views.append(
            {
                **{f"scene.{k}axis.range": space[f"{k}axis"]["range"] for k in "xyz"},
                "scene.aspectratio": space["aspectratio"],
            }
        )
    return {
        "bodies": bodies,
        "outlines": outlines,
        "modes": modes,
        "views": views,
        "period": PERIOD,
    }


def _packed(values: ArrayLike) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f4").tobytes()).decode("ascii")
