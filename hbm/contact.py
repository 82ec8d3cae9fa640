"""ContactTable: one row per node pair. The CSV that it is stored as *is* the preload map.

This file alone states the conventions of contact. In the frame of a pair (rows t1 along the damper
axis, t2 across, n; right-handed) n points from the damper into the blade and

    u = frame @ (u_damper - u_blade),     u_n > 0 closes,     N = max(0, preload + kn u_n).
"""

import csv
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from tipdamp.hbm import tables
from tipdamp.hbm.drawing import pictures
from tipdamp.hbm.errors import InputError, nearest, shown
from tipdamp.hbm.io.csv_table import read_table
from tipdamp.hbm.points import placing
from tipdamp.hbm.validation import brief

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

GROUND = "ground"

_TEXT = ("side", "blade_body", "damper_body")
_FORMULA = ("=", "+", "-", "@")  # with which a cell begins that a spreadsheet computes
_WHOLE = ("station", "row", "blade_node", "damper_node")
_VECTOR = {
    "position": ("x", "y", "z"),
    "t1": ("t1x", "t1y", "t1z"),
    "t2": ("t2x", "t2y", "t2z"),
    "n": ("nx", "ny", "nz"),
}
_NUMBER = ("gap", "kn", "kt", "mu", "preload", "weight", "area")
COLUMNS = (
    *_TEXT[:1],
    "station",
    "row",
    "blade_body",
    "blade_node",
    "damper_body",
    "damper_node",
    *(c for names in _VECTOR.values() for c in names),
    *_NUMBER,
)
_DEFAULT = {"row": 0, "gap": 0.0, "preload": 0.0, "weight": 1.0, "area": 0.0}


@dataclass(frozen=True)
class ContactTable:
    """P node pairs between blades and damper.

    side : (P,) str - name of the contact side, e.g. 'left'
    station, row : (P,) int - index along the axis from 0; index across the side, 0 = lower edge
    line
    blade_body, damper_body : (P,) str - 'ground' is a fixed counterpart
    blade_node, damper_node : (P,) int - node numbers of the user's meshes
    position : (P, 3) m
    frame : (P, 3, 3) - rows t1, t2, n, orthonormal and right-handed
    gap : (P,) m - initial gap g0 (crown, wear); 0 where the surfaces touch
    kn, kt : (P,) N/m - nodal normal and tangential stiffness [Zucca 2016, sec. 7.1]; inf: hard
    contact (statics alone)
    mu : (P,) - friction coefficient
    preload : (P,) N - signed static normal force; negative = open by -preload/kn
    weight : (P,) in [0, 1] - 1 carries, 0 is detached; multiplies kn and kt
    area : (P,) m2 - of the surface that a contact point stands for; 0 for pairs of nodes, which
    know none

    >>> model, pairs = two_blades()
    >>> rough = pairs.replace(mu=[0.6, 0.6])
    >>> rough.select(rough.side == "left").save("left.csv").name
    'left.csv'
    >>> ContactTable.load("left.csv")
    <ContactTable: 1 pairs (left 1), 1 carry; preload 52.3 to 52.3 N>
    """

    side: np.ndarray
    station: np.ndarray
    row: np.ndarray
    blade_body: np.ndarray
    blade_node: np.ndarray
    damper_body: np.ndarray
    damper_node: np.ndarray
    position: np.ndarray
    frame: np.ndarray
    gap: np.ndarray
    kn: np.ndarray
    kt: np.ndarray
    mu: np.ndarray
    preload: np.ndarray
    weight: np.ndarray
    area: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        if not len(self.area):
            object.__setattr__(self, "area", np.zeros(len(self.side)))
        for name, given in list(vars(self).items()):
            kind = _kind(name)
            dtype: type = np.int64 if kind is int else kind
            try:
                object.__setattr__(self, name, np.asarray(given, dtype=dtype))
            except (TypeError, ValueError):
                raise InputError(
                    f"contact table: {name} = {brief(given)}, must hold a "
                    f"{'text' if kind is str else 'number'} for each pair"
                ) from None
        for name, column in vars(self).items():
            if len(column) != len(self):
                raise InputError(
                    f"contact table: {name} has {len(column)} rows, side has {len(self)}"
                )
        self._check_texts()
        self._check_numbers()
        self._check_frames()

    def _check_texts(self) -> None:
        for name in _TEXT:
            for text in dict.fromkeys(vars(self)[name].tolist()):
                if text[:1] in _FORMULA or not text.isprintable():
                    raise InputError(
                        f"contact table: {name} '{shown(text)}': must be a printable name that "
                        f"does not begin with {' '.join(_FORMULA)}, as the formulas of a "
                        "spreadsheet do"
                    )
                if text != text.strip():
                    raise InputError(
                        f"contact table: {name} '{shown(text)}': has blanks at an end, which a "
                        "file does not keep"
                    )

    def _check_numbers(self) -> None:
        for name in ("kn", "kt", "mu", "weight", "area", "gap", "preload"):
            values, low = vars(self)[name], -np.inf if name in ("gap", "preload") else 0
            high = 1 if name == "weight" else np.inf
            # contact without a spring, in statics alone
            hard = (name in ("kn", "kt")) & np.isposinf(values)
            bad = ~(np.isfinite(values) | hard) | (values < low) | (values > high)
            if bad.any():
                i = int(np.flatnonzero(bad)[0])
                allowed = "finite" if np.isinf(low) else f"finite and between {low:g} and {high:g}"
                raise InputError(
                    f"contact table, pair {i + 1}: {name} = {values[i]:g}, must be {allowed}"
                )

    def _check_frames(self) -> None:
        off = np.abs(self.frame @ self.frame.transpose(0, 2, 1) - np.eye(3)).max(
            axis=(1, 2), initial=0.0
        )
        if not (off <= 1e-6).all():
            i = int(np.where(np.isnan(off), np.inf, off).argmax())
            raise InputError(
                f"contact table, pair {i + 1}: t1, t2, n are not orthonormal (off by {off[i]:.1e})"
            )
        left = np.linalg.det(self.frame) < 0
        if left.any():
            raise InputError(
                f"contact table, pair {int(left.argmax()) + 1}: t1, t2, n are left-handed, t1 x "
                "t2 must be n"
            )

    def __len__(self) -> int:
        return len(self.side)

    def __repr__(self) -> str:
        sides = ", ".join(f"{side} {int((self.side == side).sum())}" for side in self.sides)
        load = (
            f"preload {self.preload.min():.3g} to {self.preload.max():.3g} N"
            if len(self)
            else "empty"
        )
        return (
            f"<ContactTable: {len(self)} pairs ({sides}), {int(self.carrying.sum())} carry; {load}>"
        )

    def plot(self, side: str | None = None, ax: "Axes | None" = None) -> "Axes":
        """Draw the preload map of a side (the first without a name) along its rows, one by one:
        closed pairs filled, open ones hollow.

        ax : axes of matplotlib to draw on; new ones without
        Returns the axes. Raises InputError where matplotlib is not installed or the side is none.
        """
        side = self.sides[0] if side is None and len(self) else side
        if side not in self.sides:
            raise InputError(f"side '{side}': {nearest(str(side), self.sides)}")
        return pictures.preload_map(self, side, ax)

    def to_pandas(self) -> "pandas.DataFrame":
        """A row for each pair: the columns of its file but for the frame. Raises InputError where
        pandas is not installed."""
        columns = {name: one for name, one in vars(self).items() if one.ndim == 1}
        return tables.frame(columns | dict(zip("xyz", self.position.T, strict=True)), "pair")

    def _repr_html_(self) -> str:
        rows = {
            f"side '{side}'": f"{int((self.side == side).sum())} pairs, "
            f"{self.preload[self.side == side].sum():.4g} N"
            for side in self.sides
        }
        caption = f"{len(self)} contact pairs, {int(self.carrying.sum())} carry"
        return tables.notebook_table(caption, rows)

    @property
    def normal(self) -> np.ndarray:
        """(P, 3) from the damper into the blade."""
        return self.frame[:, 2]

    @property
    def sides(self) -> list[str]:
        """Names of the sides in the order of the table."""
        return list(dict.fromkeys(self.side.tolist()))

    @property
    def on_surface(self) -> np.ndarray:
        """(P,) bool - contact points of unlike surfaces; the others are pairs of nodes."""
        return self.area > 0

    @property
    def to_ground(self) -> np.ndarray:
        """(P,) bool - pairs with a fixed counterpart, such as a stop beside the damper."""
        return (self.blade_body == GROUND) | (self.damper_body == GROUND)

    @property
    def stops(self) -> np.ndarray:
        """(P,) bool - pairs of the sides to ground whose stations are not those of a side between
        two bodies: they lie beside the damper, and are not detached with its stations."""
        between = self.select(~self.to_ground)
        lines = {frozenset(between.station[between.side == s].tolist()) for s in between.sides}
        beside = [
            s
            for s in self.select(self.to_ground).sides
            if lines and frozenset(self.station[self.side == s].tolist()) not in lines
        ]
        return self.to_ground & np.isin(self.side, beside)

    @property
    def stations(self) -> int:
        """Number of stations along the damper."""
        return int(self.station[~self.stops].max()) + 1

    @property
    def carrying(self) -> np.ndarray:
        """(P,) bool - pairs that are not detached."""
        return self.weight > 0

    def select(self, rows: "ArrayLike") -> "ContactTable":
        """The rows picked by a mask or by indices."""
        return ContactTable(**{name: column[rows] for name, column in vars(self).items()})

    def replace(self, **columns: Any) -> "ContactTable":
        """The table with other columns."""
        return replace(self, **columns)

    def save(self, path: str | Path) -> Path:
        """One CSV line per pair, numbers with 17 digits so that nothing is lost."""
        path = Path(path)
        vectors = {
            "position": self.position,
            "t1": self.frame[:, 0],
            "t2": self.frame[:, 1],
            "n": self.frame[:, 2],
        }
        columns = {name: vars(self)[name] for name in (*_TEXT, *_WHOLE, *_NUMBER)}
        for name, labels in _VECTOR.items():
            columns.update({label: vectors[name][:, k] for k, label in enumerate(labels)})
        with open(path, "w", newline="", encoding="utf-8") as f:
            writer = csv.writer(f)
            stated = [c for c in COLUMNS if c != "area" or self.area.any()]
            writer.writerow(stated)
            for i in range(len(self)):
                writer.writerow([_text(columns[c][i]) for c in stated])
        return path

    @classmethod
    def load(cls, path: str | Path) -> "ContactTable":
        """Read a CSV with a header line; gap, preload, row, weight and area may be left out.
        Columns are separated by commas or tabs, or by semicolons with decimal commas. Raises
        InputError with line and column where a row does not fit the header, a column is there twice
        or a value is none."""
        path = Path(path)
        if not path.is_file():
            raise InputError(f"contact table not found: {path}")
        table = read_table(path, _kind)
        if not table.rows:
            raise InputError(f"{path}: holds no contact pairs")
        for h in table.header:
            if h not in COLUMNS:
                raise InputError(f"{path}: unknown column '{shown(h)}'; {nearest(h, COLUMNS)}")
        missing = [c for c in COLUMNS if c not in table.header and c not in _DEFAULT]
        if missing:
            raise InputError(
                f"{path}: column '{missing[0]}' is missing; needed: {', '.join(COLUMNS)}"
            )
        columns: dict = {c: [_DEFAULT[c]] * len(table.rows) for c in _DEFAULT}
        for name in table.header:
            columns[name] = (
                [text.removeprefix("'") for text in table.texts(name)]
                if name in _TEXT
                else table.numbers(name, _kind(name))
            )
        vectors = {
            name: np.column_stack([columns.pop(label) for label in labels])
            for name, labels in _VECTOR.items()
        }
        frame = np.stack([vectors["t1"], vectors["t2"], vectors["n"]], axis=1)
        return cls(position=vectors["position"], frame=frame, **columns)


class Moves(Protocol):
    """What `relative_motion` asks of a model: how its nodes and contact points move with its
    dofs."""

    @property
    def size(self) -> int:
        """Number of dofs."""

    def motion_of(self, body: str, numbers: "ArrayLike") -> sp.csr_matrix:
        """(3n, size): x, y, z of each node or contact point in turn."""


def relative_motion(model: Moves, pairs: ContactTable) -> sp.csr_matrix:
    """B (3P, r): rows t1, t2, n of each pair in turn, u = B q = frame @ (u_damper - u_blade)."""
    P = len(pairs)
    apart = sp.csr_matrix((3 * P, model.size))
    for bodies, numbers, sign in (
        (pairs.damper_body, pairs.damper_node, 1.0),
        (pairs.blade_body, pairs.blade_node, -1.0),
    ):
        for body in np.unique(bodies[bodies != GROUND]):
            mine = np.flatnonzero(bodies == body)
            apart = apart + placing(mine, P, sign) @ model.motion_of(body, numbers[mine])
    turn = sp.bsr_matrix(
        (pairs.frame, np.arange(P), np.arange(P + 1)), shape=(3 * P, 3 * P)
    ).tocsr()
    B = turn @ apart
    B.sort_indices()
    return B


def check_distinct(where: str, pairs: ContactTable) -> None:
    """InputError where stations or rows are negative, a place of a side is there twice, or two
    nodes are a pair twice with the same normal: its stiffness would count twice. where : 'file:
    key'."""
    low = (pairs.station < 0) | (pairs.row < 0)
    if low.any():
        i = int(low.argmax())
        raise InputError(
            f"{where}, pair {i + 1}: station {pairs.station[i]}, row {pairs.row[i]}: must be 0 or "
            "more"
        )
    sides = np.unique(pairs.side, return_inverse=True)[1]
    _refuse_twice(
        where,
        np.column_stack([sides, pairs.station, pairs.row]),
        pairs,
        lambda i: f"side '{pairs.side[i]}', station {pairs.station[i]}, row {pairs.row[i]}",
        "give each its own station or row",
    )
    check_pairs_once(where, pairs)


def check_pairs_once(where: str, pairs: ContactTable) -> None:
    """InputError where two nodes are a pair twice with the same normal."""
    names = np.unique([pairs.blade_body, pairs.damper_body], return_inverse=True)[1].reshape(2, -1)
    nodes = np.column_stack(
        [names[0], pairs.blade_node, names[1], pairs.damper_node, np.round(pairs.normal, 3) + 0.0]
    )
    _refuse_twice(
        where,
        nodes[pairs.carrying],
        pairs.select(pairs.carrying),
        lambda i: f"blade node {pairs.blade_node[i]} and damper node {pairs.damper_node[i]}",
        "its stiffness would count twice; take it off one side",
    )


def _refuse_twice(
    where: str, keys: np.ndarray, pairs: ContactTable, named: Callable, remedy: str
) -> None:
    _, first, of = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    again = np.flatnonzero(first[of.ravel()] != np.arange(len(keys)))
    if len(again):
        i, j = int(first[of.ravel()[again[0]]]), int(again[0])
        sides = (
            ""
            if pairs.side[i] == pairs.side[j]
            else f", on the sides '{pairs.side[i]}' and '{pairs.side[j]}'"
        )
        raise InputError(
            f"{where}: {named(i)} is there twice (pairs {i + 1} and {j + 1}{sides}; {len(again)} "
            f"such); {remedy}"
        )


def without_normal_motion(B: sp.spmatrix, pairs: ContactTable, springs: np.ndarray) -> str:
    """A sentence on the pairs along whose normal the model has no dof, but the law a spring; empty
    where there are none. B (3P, r); springs (P,) N/m, of the law along the normal."""
    fixed = np.flatnonzero((abs(B[2::3]).sum(axis=1).A1 == 0) & (springs > 0))
    if not len(fixed):
        return ""
    p, more = fixed[0], f" and {len(fixed) - 1} more" * (len(fixed) > 1)
    n = ", ".join(f"{v:.2g}" for v in pairs.normal[p])
    return (
        f"pair {p + 1} ({pairs.side[p]}, station {pairs.station[p]}){more}: the model has no dof "
        f"along the normal ({n}) at its nodes, so the normal load stays at the preload and "
        "nothing can lift off"
    )


def _text(value: float | str) -> str:
    if isinstance(value, str):
        # reading takes one apostrophe off, by which a cell is text and no formula in a spreadsheet
        return "'" + value if value[:1] == "'" else value
    return repr(float(value)) if isinstance(value, np.floating | float) else str(value)


def _kind(column: str) -> type:
    if column in _TEXT:
        return str
    return int if column in _WHOLE else float
