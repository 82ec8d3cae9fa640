"""Mode shapes on the surfaces of the bodies: one picture with a choice of modes, animated by modes.js."""

import base64
import html
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tipdamp.report import draw_plotly, draw_scene
from tipdamp.report.scene import view

MM = 1e3
PERIOD = 1600            # ms of one cycle on the screen
LARGEST = 0.06           # drawn displacement over the size of what moves
COLORS = [[0.0, "#e3e6e9"], [0.5, "#56a3c9"], [1.0, "#12355b"]]


@dataclass(frozen=True)
class Mode:
    """kind - group in the list; shapes {body: (n, 3)} with the largest displacement 1; amplitude - mm drawn for it."""

    kind: str
    label: str
    hz: float
    shapes: dict
    amplitude: float

    @property
    def caption(self) -> str:
        return f"{self.kind[:1].upper()}{self.kind[1:]}: {self.label}."


@dataclass(frozen=True)
class ModeShapes:
    """A picture of modes on {body: Surface}; outward, axis - for the direction of the view."""

    name: str
    title: str
    caption: str
    surfaces: dict
    modes: tuple
    outward: np.ndarray
    axis: np.ndarray


def mode_shapes(surfaces: dict, model, found, outward, axis) -> ModeShapes | None:
    """The modes of `found` (Shapes, in the order of the list), recovered on the surfaces; None where there is none."""
    modes = []
    for shapes in found:
        for kind, label, hz, q in zip(shapes.kind.tolist(), shapes.label.tolist(), shapes.hz.tolist(), shapes.q.T,
                                      strict=True):
            taking_part = {b: s for b, s in surfaces.items() if q[model.body == b].any()}
            moved = {b: s.displacement(q[model.body == b]) for b, s in taking_part.items()}
            largest = max((float(np.linalg.norm(u, axis=1).max()) for u in moved.values()), default=0.0)
            if largest > 0:
                size = np.ptp(np.concatenate([s.position for s in taking_part.values()]), axis=0)
                modes.append(Mode(kind, label, hz, {b: u / np.float32(largest) for b, u in moved.items()},
                                  LARGEST * MM * float(np.linalg.norm(size))))
    caption = ("Shapes on the surfaces of the meshes, recovered from the reduced model. Colour: displacement over its "
               "largest value; thin lines: the sharp edges at rest. The shapes are enlarged alike for both bodies. "
               "Drag to turn.")
    return ModeShapes("mode_shapes", "Mode shapes", caption, surfaces, tuple(modes), np.asarray(outward, float),
                      np.asarray(axis, float)) if modes else None


def draw(picture: ModeShapes) -> str:
    """Controls, plot and data; the page must hold plotly.js and modes.js."""
    name = picture.name
    content = json.dumps(data_of(picture), separators=(",", ":")).replace("<", "\\u003c")
    kinds = dict.fromkeys(m.kind for m in picture.modes)
    first = next((i for i, m in enumerate(picture.modes) if "tracked" in m.label), 0)
    groups = "".join(f'<optgroup label="{html.escape(kind)}">' + "".join(
        f'<option value="{i}"{" selected" * (i == first)}>{html.escape(m.label)}</option>'
        for i, m in enumerate(picture.modes) if m.kind == kind) + "</optgroup>" for kind in kinds)
    plot = figure_of(picture).to_html(full_html=False, include_plotlyjs=False, config=draw_scene.CONFIG_3D,
                                      div_id=f"{name}-plot")
    return (f'<div class="controls"><label>Mode <select id="{name}-mode">{groups}</select></label>'
            f'<button type="button" id="{name}-play">Play</button>'
            f'<label>Amplitude <input type="range" id="{name}-size" min="0" max="3" step="0.1" value="1"></label>'
            f'<label>View <select id="{name}-near"><option value="0">everything</option>'
            '<option value="1">the damper</option></select></label>'
            f'<span id="{name}-caption" class="now"></span></div>{plot}'
            f'<script>animateModes({content}, "{name}");</script>')


def figure_of(picture: ModeShapes):
    """The plotly figure at rest: the bodies, then their sharp edges."""
    out = draw_plotly.library().graph_objects.Figure()
    for body, surface in picture.surfaces.items():
        out.add_trace({**draw_scene.solid(MM * surface.position, surface.triangles), "name": body, "hoverinfo": "skip",
                       "intensity": np.zeros(len(surface.node), dtype=np.float32), "colorscale": COLORS, "cmin": 0,
                       "cmax": 1, "showscale": False, "showlegend": False})
    for surface in picture.surfaces.values():
        a, b = MM * surface.position[surface.edges].transpose(1, 0, 2)
        out.add_trace({"type": "scatter3d", "mode": "lines", **draw_scene.lines(a, b), "hoverinfo": "skip",
                       "line": {"color": "#9aa4ae", "width": 1.2}, "showlegend": False})
    whole, _ = _boxes(picture)
    seen = view(picture.outward, picture.axis)
    out.update_layout(template="simple_white", height=600, margin={"l": 0, "r": 0, "t": 4, "b": 4},
                      scene=draw_scene.space(whole, seen["eye"], seen["up"]), uirevision="modes",
                      font={"family": draw_plotly.FONT, "size": 12.5})
    return out


def data_of(picture: ModeShapes) -> dict:
    """What modes.js works on; arrays are float32 in base64, x, y, z of node after node."""
    bodies = [{"name": b, "trace": i, "rest": _packed(MM * s.position)}
              for i, (b, s) in enumerate(picture.surfaces.items())]
    outlines = [{"name": b["name"], "trace": len(bodies) + i} for i, b in enumerate(bodies)]
    modes = [{"caption": m.caption, "amplitude": m.amplitude, "shapes": {b: _packed(u) for b, u in m.shapes.items()}}
             for m in picture.modes]
    views = []
    for box in _boxes(picture):
        space = draw_scene.space(box, (1, 1, 1), (0, 0, 1))
        views.append({**{f"scene.{k}axis.range": space[f"{k}axis"]["range"] for k in "xyz"},
                      "scene.aspectratio": space["aspectratio"]})
    return {"bodies": bodies, "outlines": outlines, "modes": modes, "views": views, "period": PERIOD}


def script() -> str:
    """modes.js, to be written into the page once."""
    return Path(__file__).with_name("modes.js").read_text(encoding="utf-8")


def _boxes(picture):
    """Of everything and of the damper alone, with room for the motion."""
    room = max(m.amplitude for m in picture.modes)
    place = {b: MM * s.position for b, s in picture.surfaces.items()}
    near = place.get("damper", next(iter(place.values())))
    whole = np.concatenate(list(place.values()))
    return [np.array([p.min(axis=0) - room, p.max(axis=0) + room]) for p in (whole, near)]


def _packed(values) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f4").tobytes()).decode("ascii")
