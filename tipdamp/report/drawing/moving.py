"""Bodies that move periodically, as plain data: one picture with a choice of motions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

import numpy as np

from tipdamp.fields.surface import OuterSurface
from tipdamp.report.text import MM


@dataclass(frozen=True)
class PeriodicMotion:
    """kind - group in the list; shapes {body: (k, n, 3)}, one for each of `orders`: h > 0 times
    cos(h tau), -h times -sin(h tau); the largest displacement of the period is 1.

    amplitude - mm drawn for it; shades {body: (n,) 0 to 1}, colour of the nodes; states (T, P) -
    index into the states of the picture's contacts, from each of T instants of the period on."""

    kind: str
    label: str
    hz: float
    orders: tuple[int, ...]
    shapes: Mapping[str, np.ndarray]
    amplitude: float
    shades: Mapping[str, np.ndarray] = field(default_factory=dict)
    states: np.ndarray | None = None

    @property
    def caption(self) -> str:
        """A sentence for the line above the picture."""
        return f"{self.kind[:1].upper()}{self.kind[1:]}: {self.label}."


class MovingContacts(NamedTuple):
    """position (P, 3) m of points that move with the nodes `near` (P,) of a body; states - {name:
    colour}."""

    position: np.ndarray
    body: str
    near: np.ndarray
    states: Mapping[str, str]


@dataclass(frozen=True)
class MovingBodies:
    """Motions of {body: surface}; first - index of the motion shown at first; eye, up - as of a
    Scene."""

    kind: ClassVar[str] = "Figure"

    name: str
    title: str
    caption: str
    surfaces: Mapping[str, OuterSurface]
    motions: Sequence[PeriodicMotion]
    first: int
    eye: tuple
    up: tuple
    contacts: MovingContacts | None = None

    def boxes(self) -> list[np.ndarray]:
        """[(2, 3) mm] of everything and, beside other bodies, of the damper alone, with room for
        the motion."""
        room = max(one.amplitude for one in self.motions)
        place = {body: MM * s.position for body, s in self.surfaces.items()}
        whole = np.concatenate(list(place.values()))
        seen = [whole, *([place["damper"]] if "damper" in place and len(place) > 1 else [])]
        return [np.array([p.min(axis=0) - room, p.max(axis=0) + room]) for p in seen]
