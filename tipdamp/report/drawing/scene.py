"""Pictures in three dimensions as plain data, drawn by `plotly_scene`. Coordinates in mm.

Items of one name share one entry of the legend, by which they are switched; an empty name has none.
An item with a `case` is shown only while that case is chosen from the menu above the picture.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

BODY, BLADE = "#b9c0c8", "#8fb3d1"
NORMAL, TANGENT_1, TANGENT_2 = "#D55E00", "#009E73", "#7b3f9d"


@dataclass(frozen=True, kw_only=True)
class _Nodes:
    """What nodes show: values (n,), drawn as colour on a scale instead of `color`; texts (n,) on
    hover."""

    values: np.ndarray | None = None
    scale: "Scale | None" = None
    hover: tuple = ()
    case: str = ""


@dataclass(frozen=True)
class Solid(_Nodes):
    """A surface of triangles, with what its nodes show."""

    position: np.ndarray
    triangles: np.ndarray
    name: str = ""
    color: str = BODY
    opacity: float = 1.0


@dataclass(frozen=True)
class Points(_Nodes):
    """Marks of `size` px, with what they show."""

    position: np.ndarray
    name: str = ""
    color: str = "#222222"
    size: float = 4.0
    symbol: str = "circle"


@dataclass(frozen=True)
class Segments:
    """Straight pieces from `start` to `end`, (n, 3) each."""

    start: np.ndarray
    end: np.ndarray
    name: str = ""
    color: str = "#222222"
    width: float = 2.0
    case: str = ""


@dataclass(frozen=True)
class Scale:
    """Colours of values: from 0 (or `low`) to `high`, with its title; scales of one title share one
    bar."""

    title: str
    high: float
    low: float = 0.0
    colors: str = "YlOrRd"


Item = Solid | Points | Segments


@dataclass(frozen=True)
class Scene:
    """box : (2, 3) mm - what is shown; eye - from where it is seen; up - what is drawn upwards."""

    kind: ClassVar[str] = "Figure"

    name: str
    title: str
    caption: str
    items: Sequence[Item]
    box: np.ndarray
    eye: tuple = (1.0, -1.0, 0.8)
    up: tuple = (0.0, 0.0, 1.0)
    height: int = 600
    hidden: frozenset = field(default_factory=frozenset)  # names that start switched off

    @property
    def cases(self) -> list[str]:
        """Names for the menu."""
        return list(dict.fromkeys(item.case for item in self.items if item.case))


class Viewpoint(NamedTuple):
    """eye - from where a scene is seen; up - what is drawn upwards."""

    eye: tuple
    up: tuple


def view(outward: ArrayLike, axis: ArrayLike) -> Viewpoint:
    """The view that shows both sides of a damper with its axis across the picture; outward - where
    its sides look."""
    along, out = np.asarray(axis, dtype=float), np.asarray(outward, dtype=float)
    along = along / np.linalg.norm(along)
    up = out - along * (out @ along)
    if np.linalg.norm(up) < 1e-3 * np.linalg.norm(out) + 1e-12:
        up = np.eye(3)[np.abs(along).argmin()]
    up = up / np.linalg.norm(up)
    across = np.cross(along, up)
    return Viewpoint(tuple(1.15 * up + 0.75 * across - 0.3 * along), tuple(up))


def inside(position: np.ndarray, triangles: np.ndarray, box: np.ndarray) -> np.ndarray:
    """The triangles that have a corner in the box."""
    within = ((position >= box[0]) & (position <= box[1])).all(axis=1)
    return triangles[within[triangles].any(axis=1)]
