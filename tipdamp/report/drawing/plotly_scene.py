"""Pictures in three dimensions drawn with plotly, as pieces of the HTML page."""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from tipdamp.hbm.drawing.figure import INK
from tipdamp.report.drawing.plotly import CONFIG, FONT, LEGEND, as_html, checked, plain_text, small
from tipdamp.report.drawing.scene import Points, Scale, Scene, Segments, Solid

CONFIG_3D = {
    **CONFIG,
    "modeBarButtons": [["orbitRotation", "pan3d", "zoom3d", "resetCameraDefault3d", "toImage"]],
}
AXIS = {
    "backgroundcolor": "#fbfbfc",
    "gridcolor": "#e4e7ea",
    "showbackground": True,
    "zeroline": False,
    "tickfont": {"size": 12},
    "nticks": 5,
    "showspikes": False,
    "exponentformat": "none",
}
# heights of the picture that a unit takes, seen from the distance 1 (measured on plotly.js 3)
PER_HEIGHT = 0.655
LEGEND_3D = {**LEGEND, "y": 0.0, "yanchor": "top"}
LIGHT = {"ambient": 0.8, "diffuse": 0.45, "specular": 0.08, "roughness": 0.7, "fresnel": 0.05}


def draw(scene: Scene) -> str:
    """The scene as a <div> with its script; the page must hold plotly.js."""
    return as_html(figure_of(scene), f"figure-{scene.name}", CONFIG_3D)


def figure_of(scene: Scene) -> Any:
    """The plotly figure."""
    traces = []
    seen: set[tuple[str, str]] = set()
    bars: dict[str, set[str]] = {}
    first = scene.cases[0] if scene.cases else ""
    for item, visible in zip(scene.items, _visible(scene, first), strict=True):
        name = plain_text(item.name)
        legend = {
            "name": name,
            "legendgroup": name or None,
            "showlegend": bool(name) and (name, item.case) not in seen,
        }
        seen.add((name, item.case))
        traces.append({**_DRAW[type(item)](item, bars), **legend, "visible": visible})
    layout = {
        "height": scene.height,
        "showlegend": True,
        "scene": space(scene.box, scene.eye, scene.up),
        "font": {**FONT, "color": INK},
        "margin": {"l": 0, "r": 0, "t": 70 if bars else 8, "b": 8},
        "legend": {**LEGEND_3D, "itemsizing": "constant"},
        "uirevision": scene.name,
        "updatemenus": [_menu(scene)] if len(scene.cases) > 1 else [],
    }
    return checked(traces, layout)


def _visible(scene: Scene, case: str) -> list[bool | str]:
    """Of each item while a case is chosen: what belongs to none always is."""
    found: list[bool | str] = []
    for item in scene.items:
        if item.case not in ("", case):
            found.append(False)
        else:
            found.append("legendonly" if item.name in scene.hidden else True)
    return found


def space(box: np.ndarray, eye: tuple, up: tuple) -> dict:
    """Layout of the axes in mm: true proportions, as large as the picture holds with the labels of
    the axes."""
    box = np.asarray(box, dtype=float)
    axes = {
        f"{k}axis": {
            **AXIS,
            "title": {"text": f"{k} (mm)", "font": {"size": 13}},
            "range": box[:, i].tolist(),
        }
        for i, k in enumerate("xyz")
    }
    return {
        **axes,
        "aspectmode": "manual",
        "aspectratio": _xyz(_fitted(box[1] - box[0], eye, up)),
        "dragmode": "orbit",
        "bgcolor": "#ffffff",
        "camera": {"eye": _xyz(eye), "up": _xyz(up), "projection": {"type": "orthographic"}},
    }


def _fitted(size: np.ndarray, eye: tuple, up: tuple) -> np.ndarray:
    """(3,) edges of the box so that its outline takes 0.8 of the height and 1.15 heights of the
    width: the labels stand outside it, and a printed page is 1.4 times as wide as high."""
    across = np.cross(up, eye)
    high = np.cross(eye, across)
    wide, tall = (np.abs(size * v).sum() / np.linalg.norm(v) for v in (across, high))
    return size * np.linalg.norm(eye) / PER_HEIGHT * min(0.8 / tall, 1.15 / wide)


def _xyz(vector: Iterable[float]) -> dict:
    return dict(zip("xyz", map(float, vector), strict=True))


def _places(position: np.ndarray) -> dict:
    """x, y, z of a trace."""
    return dict(zip("xyz", small(position).T, strict=True))


def solid(position: np.ndarray, triangles: np.ndarray, **more: Any) -> dict:
    """A mesh3d trace."""
    return {
        "type": "mesh3d",
        **_places(position),
        **dict(zip("ijk", np.asarray(triangles, dtype=np.int32).T, strict=True)),
        "lighting": LIGHT,
        "lightposition": {"x": 20000, "y": -40000, "z": 60000},
        **more,
    }


def marks(position: np.ndarray, marker: dict, **more: Any) -> dict:
    """A scatter3d trace of points without rims."""
    return {
        "type": "scatter3d",
        "mode": "markers",
        **_places(position),
        "marker": {"line": {"width": 0}, "opacity": 1.0, **marker},
        **more,
    }


def lines(start: np.ndarray, end: np.ndarray, color: str, width: float) -> dict:
    """A scatter3d trace of separate pieces."""
    gap = np.full_like(small(start), np.nan)
    return {
        "type": "scatter3d",
        "mode": "lines",
        **_places(np.stack([small(start), small(end), gap], axis=1).reshape(-1, 3)),
        "hoverinfo": "skip",
        "line": {"color": color, "width": width},
    }


def _solid(item: Solid, bars: dict[str, set[str]]) -> dict:
    look = _look(item, "intensity", bars)
    return solid(item.position, item.triangles, opacity=item.opacity, **look, **_hover(item))


def _points(item: Points, bars: dict[str, set[str]]) -> dict:
    marker = {"size": item.size, "symbol": item.symbol, **_look(item, "color", bars)}
    return marks(item.position, marker, **_hover(item))


def _segments(item: Segments, _: dict[str, set[str]]) -> dict:
    return lines(item.start, item.end, item.color, item.width)


def _look(item: Solid | Points, key: str, bars: dict[str, set[str]]) -> dict:
    """One colour, or those of the values, which the kind of the trace has under this key."""
    if item.values is None or item.scale is None:
        return {"color": item.color}
    return {key: small(item.values), **_colors(item.scale, item.case, bars)}


def _hover(item: Solid | Points) -> dict:
    """A text of each node, or none."""
    if not item.hover:
        return {"hoverinfo": "skip"}
    return {"text": [_lines(t) for t in item.hover], "hovertemplate": "%{text}<extra></extra>"}


def _colors(scale: Scale, case: str, bars: dict[str, set[str]]) -> dict:
    """One bar above the picture for each title, side by side; `bars` {title: cases in which it
    stands}."""
    new = case not in bars.setdefault(scale.title, set())
    bars[scale.title].add(case)
    place = list(bars).index(scale.title)
    bar = {
        "title": {"text": plain_text(scale.title), "side": "top", "font": {"size": 11.5}},
        "orientation": "h",
        "len": 0.36,
        "thickness": 11,
        "x": 0.02 + 0.42 * place,
        "xanchor": "left",
        "y": 1.0,
        "yanchor": "bottom",
        "outlinewidth": 0,
        "tickfont": {"size": 11},
        "nticks": 6,
        "exponentformat": "power",
    }
    return {
        "colorscale": scale.colors,
        "cmin": scale.low,
        "cmax": scale.high,
        "showscale": new,
        "colorbar": bar,
    }


def _menu(scene: Scene) -> dict:
    """A choice of the load case."""
    buttons = [
        {
            "label": plain_text(case),
            "method": "restyle",
            "args": [{"visible": _visible(scene, case)}],
        }
        for case in scene.cases
    ]
    return {
        "buttons": buttons,
        "x": 0.02,
        "xanchor": "left",
        "y": 0.98,
        "yanchor": "top",
        "showactive": True,
        "bgcolor": "#ffffff",
        "bordercolor": "#d9dde1",
        "font": {"size": 12},
    }


def _lines(text: str) -> str:
    """Escaped, with the line breaks that plotly knows."""
    return plain_text(text).replace("\n", "<br>")


_DRAW: dict[type, Callable[..., dict]] = {Solid: _solid, Points: _points, Segments: _segments}
