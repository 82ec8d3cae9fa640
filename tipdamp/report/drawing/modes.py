"""Mode shapes on the surfaces of the bodies as plain data: one picture with a choice of modes."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tipdamp.fields.surface import OuterSurface
from tipdamp.report.text import MM


@dataclass(frozen=True)
class Mode:
    """kind - group in the list; shapes {body: (n, 3)} with the largest displacement 1; amplitude -
    mm drawn for it."""

    kind: str
    label: str
    hz: float
    shapes: dict[str, np.ndarray]
    amplitude: float

    @property
    def caption(self) -> str:
        """A sentence for the line above the picture."""
        return f"{self.kind[:1].upper()}{self.kind[1:]}: {self.label}."


@dataclass(frozen=True)
class ModeShapes:
    """Modes on {body: Surface}; first - index of the mode shown at first; eye, up - as of a
    Scene."""

    kind: ClassVar[str] = "Figure"

    name: str
    title: str
    caption: str
    surfaces: dict[str, OuterSurface]
    modes: Sequence[Mode]
    first: int
    eye: tuple
    up: tuple

    def boxes(self) -> list[np.ndarray]:
        """[(2, 3) mm] of everything and of the damper alone, with room for the motion."""
        room = max(m.amplitude for m in self.modes)
        place = {body: MM * s.position for body, s in self.surfaces.items()}
        near = place.get("damper", next(iter(place.values())))
        whole = np.concatenate(list(place.values()))
        return [np.array([p.min(axis=0) - room, p.max(axis=0) + room]) for p in (whole, near)]
