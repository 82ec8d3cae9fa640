"""Moving bodies drawn with plotly and animated by templates/moving.js."""

import base64
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.report.drawing import plotly, plotly_scene
from tipdamp.report.drawing.moving import MovingBodies, MovingContacts, PeriodicMotion
from tipdamp.report.templating import markup, render
from tipdamp.report.text import MM

PERIOD = 1600  # ms of one cycle on the screen
COLORS = [[0.0, "#e3e6e9"], [0.5, "#56a3c9"], [1.0, "#12355b"]]


def draw(picture: MovingBodies) -> str:
    """Controls, plot and data; the page must hold plotly.js and moving.js."""
    kinds: dict[str, list] = {}
    for i, one in enumerate(picture.motions):
        kinds.setdefault(one.kind, []).append((i, one.label))
    plot = plotly.as_html(figure_of(picture), f"{picture.name}-plot", plotly_scene.CONFIG_3D)
    return render(
        "moving.html", picture=picture, kinds=kinds, plot=markup(plot), data=data_of(picture)
    )


def figure_of(picture: MovingBodies) -> Any:
    """The plotly figure at rest: the bodies, their sharp edges, the contacts."""
    traces = [
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
        for body, surface in picture.surfaces.items()
    ]
    for surface in picture.surfaces.values():
        a, b = MM * surface.position[surface.edges].transpose(1, 0, 2)
        traces.append({**plotly_scene.lines(a, b, "#9aa4ae", 1.2), "showlegend": False})
    if picture.contacts is not None:
        traces += _contacts(picture.contacts)
    layout = {
        "height": 600,
        "margin": {"l": 0, "r": 0, "t": 4, "b": 4},
        "scene": plotly_scene.space(picture.boxes()[0], picture.eye, picture.up),
        "legend": plotly_scene.LEGEND_3D,
        "uirevision": picture.name,
        "font": plotly.FONT,
    }
    return plotly.checked(traces, layout)


def _contacts(contacts: MovingContacts) -> Iterator[dict]:
    """Markers of all, which moving.js colours, and an entry of the legend for each state."""
    nowhere = {k: [None] for k in "xyz"}
    first = next(iter(contacts.states.values()))
    yield {**_marks(contacts, first), "showlegend": False}
    for name, color in contacts.states.items():
        yield {**_marks(contacts, color), **nowhere, "name": name, "showlegend": True}


def _marks(contacts: MovingContacts, color: str) -> dict:
    marker = {"size": 6, "color": color}
    return plotly_scene.marks(MM * contacts.position, marker, hoverinfo="skip")


def data_of(picture: MovingBodies) -> dict:
    """What moving.js works on; arrays are float32 in base64, x, y, z of node after node."""
    bodies = [
        {"name": b, "trace": i, "rest": _packed(MM * s.position)}
        for i, (b, s) in enumerate(picture.surfaces.items())
    ]
    outlines = [{"name": b["name"], "trace": len(bodies) + i} for i, b in enumerate(bodies)]
    contacts = picture.contacts and {
        "body": picture.contacts.body,
        "trace": 2 * len(bodies),
        "rest": _packed(MM * picture.contacts.position),
        "near": picture.contacts.near.tolist(),
        "colors": list(picture.contacts.states.values()),
    }
    spaces = [plotly_scene.space(box, picture.eye, picture.up) for box in picture.boxes()]
    views = [
        {
            **{f"scene.{k}axis.range": space[f"{k}axis"]["range"] for k in "xyz"},
            "scene.aspectratio": space["aspectratio"],
        }
        for space in spaces
    ]
    return {
        "bodies": bodies,
        "outlines": outlines,
        "contacts": contacts,
        "motions": [_motion(one) for one in picture.motions],
        "views": views,
        "period": PERIOD,
    }


def _motion(one: PeriodicMotion) -> dict:
    return {
        "caption": one.caption,
        "amplitude": one.amplitude,
        "orders": one.orders,
        "shapes": {body: _packed(u) for body, u in one.shapes.items()},
        "shades": {body: _packed(share) for body, share in one.shades.items()},
        "states": None if one.states is None else one.states.tolist(),
    }


def _packed(values: ArrayLike) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f4").tobytes()).decode("ascii")
