"""Pictures in three dimensions drawn with plotly, as pieces of the HTML page."""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from tipdamp.hbm.drawing.figure import INK
from tipdamp.report.drawing.plotly import CONFIG, FONT, as_html, checked, plain_text, small
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
LIGHT = {"ambient": 0.8, "diffuse": 0.45, "specular": 0.08, "roughness": 0.7, "fresnel": 0.05}


def draw(scene: Scene) -> str:
    """The scene as a <div> with its script; the page must hold plotly.js."""
    return as_html(figure_of(scene), f"figure-{scene.name}", CONFIG_3D)


def figure_of(scene: Scene) -> Any:
    """The plotly figure."""
    traces = []
    seen: set[tuple[str, str]] = set()
    bars: dict[str, set[str]] = {}
    for item in scene.items:
        name = plain_text(item.name)
        first = not item.case or item.case == scene.cases[0]
        legend = {
            "name": name,
            "legendgroup": name or None,
            "showlegend": bool(name) and (name, item.case) not in seen,
        }
        seen.add((name, item.case))
        shown = ("legendonly" if item.name in scene.hidden else True) if first else False
        traces.append({**_DRAW[type(item)](item, bars), **legend, "visible": shown})
    layout = {
        "height": scene.height,
        "showlegend": True,
        "scene": space(scene.box, scene.eye, scene.up),
        "font": {"family": FONT, "size": 12.5, "color": INK},
        "margin": {"l": 0, "r": 0, "t": 70 if bars else 8, "b": 8},
        "legend": {
            "orientation": "h",
            "x": 0.5,
            "y": 0.0,
            "xanchor": "center",
            "yanchor": "top",
            "itemsizing": "constant",
        },
        "uirevision": scene.name,
        "updatemenus": [_menu(scene)] if len(scene.cases) > 1 else [],
    }
    return checked(traces, layout)


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


def solid(position: np.ndarray, triangles: np.ndarray, **more: Any) -> dict:
    """A mesh3d trace."""
    x, y, z = small(position).T
    i, j, k = np.asarray(triangles, dtype=np.int32).T
    return {
        "type": "mesh3d",
        "x": x,
        "y": y,
        "z": z,
        "i": i,
        "j": j,
        "k": k,
        "lighting": LIGHT,
        "lightposition": {"x": 20000, "y": -40000, "z": 60000},
        **more,
    }


def lines(start: np.ndarray, end: np.ndarray) -> dict:
    """x, y, z of a scatter3d trace of separate pieces."""
    gap = np.full_like(small(start), np.nan)
    x, y, z = np.stack([small(start), small(end), gap], axis=1).reshape(-1, 3).T
    return {"x": x, "y": y, "z": z}


def _solid(item: Solid, bars: dict[str, set[str]]) -> dict:
    look = {"color": item.color, "opacity": item.opacity, "hoverinfo": "skip"}
    if item.values is not None and item.scale is not None:
        look = {
            "intensity": small(item.values),
            "opacity": item.opacity,
            **_colors(item.scale, item.case, bars),
            "hoverinfo": "skip",
        }
    if item.hover:
        look.update(
            hoverinfo=None,
            text=[_lines(t) for t in item.hover],
            hovertemplate="%{text}<extra></extra>",
        )
    return solid(item.position, item.triangles, **look)


def _points(item: Points, bars: dict[str, set[str]]) -> dict:
    x, y, z = small(item.position).T
    color = (
        {"color": item.color}
        if item.values is None or item.scale is None
        else {"color": small(item.values), **_colors(item.scale, item.case, bars)}
    )
    hover = (
        {"text": [_lines(t) for t in item.hover], "hovertemplate": "%{text}<extra></extra>"}
        if item.hover
        else {"hoverinfo": "skip"}
    )
    return {
        "type": "scatter3d",
        "mode": "markers",
        "x": x,
        "y": y,
        "z": z,
        **hover,
        "marker": {
            "size": item.size,
            "symbol": item.symbol,
            "line": {"width": 0},
            "opacity": 1.0,
            **color,
        },
    }


def _segments(item: Segments, _: dict[str, set[str]]) -> dict:
    return {
        "type": "scatter3d",
        "mode": "lines",
        **lines(item.start, item.end),
        "hoverinfo": "skip",
        "line": {"color": item.color, "width": item.width},
    }


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
    """A choice of the load case; what belongs to none stays as it is."""

    def visible(case: str) -> list[bool | str]:
        return [
            ("legendonly" if i.name in scene.hidden else True) if i.case in ("", case) else False
            for i in scene.items
        ]

    buttons = [
        {"label": plain_text(case), "method": "restyle", "args": [{"visible": visible(case)}]}
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
