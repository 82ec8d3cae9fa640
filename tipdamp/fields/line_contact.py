"""Contact along a line: force per length, and the half-width and peak pressure that Hertz gives it.

On a round side the strip in contact is narrower than a row of nodes: nodal force over tributary
area is a matter of the mesh there, force per length is not. [Hertz 1881; Johnson, Contact Mechanics
(1985), section 4.2]
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import pdist

from tipdamp.fields.pressure import PressurePatch, patches
from tipdamp.hbm.contact import ContactTable
from tipdamp.static_contact.stiffness.rounded_punch import hertz_half_width, hertz_peak_pressure

HOLES = 0.05  # of the stations between those that carry, above which holes are worth a word


@dataclass(frozen=True)
class LineContact:
    """One round side, station by station along the axis.

    rows : the pairs of each station, as rows of the contact table
    along, length : (s,) m - place along the axis, and what of it belongs to a station
    radius, E_star : m, Pa - of the two bodies together
    spacing : m - mean distance of neighbouring rows; inf where each station has one
    """

    side: str
    rows: tuple[np.ndarray, ...]
    along: np.ndarray
    length: np.ndarray
    radius: float
    E_star: float
    spacing: float

    def load(self, force: np.ndarray) -> np.ndarray:
        """(s,) N/m from the forces of the pairs of the table, (P,) N; open pairs carry nothing."""
        closed = np.maximum(force, 0.0)
        return np.array([closed[rows].sum() for rows in self.rows]) / self.length

    def loaded(self, force: np.ndarray) -> slice:
        """From the first station that carries to the last; empty where none does."""
        carrying = np.flatnonzero(self.load(force))
        return slice(carrying[0], carrying[-1] + 1) if len(carrying) else slice(0)

    def mean_load(self, force: np.ndarray) -> float:
        """N/m over the length from the first station that carries to the last; where points lie
        near the line only here and there, stations scatter about it."""
        mine = self.loaded(force)
        length = self.length[mine].sum()
        return float(self.load(force)[mine] @ self.length[mine] / length) if length else 0.0

    def half_width(self, force: np.ndarray) -> np.ndarray:
        """(s,) m"""
        return hertz_half_width(self.load(force), self.radius, self.E_star)

    def mean_peak(self, force: np.ndarray) -> float:
        """Pa on the centre line under the mean force per length."""
        return float(self._peak(np.array([self.mean_load(force)]))[0])

    def peak(self, force: np.ndarray) -> np.ndarray:
        """(s,) Pa on the centre line, 0 where a station is open."""
        return self._peak(self.load(force))

    def _peak(self, load: np.ndarray) -> np.ndarray:
        half_width = hertz_half_width(load, self.radius, self.E_star)
        pressed = np.where(half_width > 0, half_width, 1.0)
        return np.asarray(hertz_peak_pressure(load, pressed))

    def patch(self, pairs: ContactTable) -> PressurePatch:
        """A line of the stations, each at its pair nearest to the middle."""
        middle = [
            rows[np.linalg.norm(place - place.mean(axis=0), axis=1).argmin()]
            for rows in self.rows
            if len(place := pairs.position[rows])
        ]
        steps = np.arange(len(middle))
        cells = np.column_stack([steps[:-1], steps[1:]])
        return PressurePatch(
            self.side, np.array(middle), cells, self.length, self.length, self.rows
        )


def line_contacts(
    pairs: ContactTable, axis: np.ndarray, round_sides: Mapping[str, tuple[float, float]]
) -> list[LineContact]:
    """Of the sides {name: (radius m, E* Pa)} those with two stations or more along the unit axis
    (3,)."""
    found = []
    for side, (radius, e_star) in round_sides.items():
        mine = np.flatnonzero(pairs.side == side)
        stations = np.unique(pairs.station[mine])
        rows = tuple(mine[pairs.station[mine] == k] for k in stations)
        along = np.array([float((pairs.position[r] @ axis).mean()) for r in rows])
        if len(along) < 2 or not np.ptp(along):
            continue
        order = np.argsort(along)
        edge = np.r_[along[order][0], (along[order][1:] + along[order][:-1]) / 2, along[order][-1]]
        ordered = tuple(rows[k] for k in order)
        spacing = float(np.median([_step(pairs.position[r]) for r in rows]))
        found.append(
            LineContact(side, ordered, along[order], np.diff(edge), radius, e_star, spacing)
        )
    return found


def narrow_lines(
    pairs: ContactTable,
    axis: np.ndarray,
    radius: Mapping[str, float | None],
    E_star: Mapping[str, float | None],
) -> list[LineContact]:
    """The round sides on which, under the preload of the pairs, the strip in contact is narrower
    than a row of them; radius {side: m} of the cylinders, E_star {side: Pa}, where they are
    known."""
    known = {
        side: (r, e)
        for side, r in radius.items()
        if r is not None and (e := E_star.get(side)) is not None
    }
    lines = line_contacts(pairs, axis, known)
    return [one for one in lines if 2 * one.half_width(pairs.preload).max() < one.spacing]


def hole_warnings(lines: Sequence[LineContact], force: np.ndarray) -> Iterator[str]:
    """A sentence for each of the lines with stations that carry nothing between others that do,
    under the forces of the pairs of the table, (P,) N."""
    for line in lines:
        inside = line.load(force)[line.loaded(force)]
        empty = int((inside == 0).sum())
        if empty > HOLES * len(inside):
            yield (
                f"round side '{line.side}': {empty} of {len(inside)} stations "
                f"({empty / len(inside):.0%}) carry nothing between others that do: no contact "
                "point lies near enough to the line in which it touches, their neighbours carry "
                "what is theirs, and force per length scatters with the mesh, here up to "
                f"{inside.max() / line.mean_load(force):.2g} times its mean; a row of points along "
                "that line keeps it even"
            )


def shown_patches(
    pairs: ContactTable, hard: bool, lines: Sequence[LineContact]
) -> list[PressurePatch]:
    """As `patches`, those in contact along a line by their stations."""
    on_line = {line.side: line.patch(pairs) for line in lines}
    return [on_line.get(patch.side, patch) for patch in patches(pairs, hard)]


def _step(place: np.ndarray) -> float:
    return float(pdist(place).max()) / (len(place) - 1) if len(place) > 1 else np.inf
