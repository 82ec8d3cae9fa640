"""NamedPoint: a point of a curve that has a name, as an entry of a plain array."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

Kind = Literal[
    "fold",
    "symmetry breaking",
    "branch point",
    "period doubling",
    "Neimark-Sacker",
    "grazing",
    "onset of slip",
    "lift-off",
    "separation",
]


@dataclass(frozen=True)
class NamedPoint:
    """One point of a curve that has a name.

    kind : 'fold' - the parameter turns back; 'symmetry breaking' - a real multiplier passes 1 and
        a motion meets the curve there that lost a symmetry: half a period later it is no longer
        its own mirror image, or equal contacts move unequally; 'branch point' - another one at
        which a real multiplier passes 1 and the curve does not fold; 'period doubling',
        'Neimark-Sacker' - a multiplier passes -1, or a complex pair the unit circle; 'grazing' -
        multipliers jump across it, as a contact touches or begins to slip;
        'onset of slip', 'lift-off' - a contact does so somewhere in the cycle on one side of the
        point; 'separation' - it is open through the whole cycle on one side and touches in a part
        of it on the other, so of a contact that is open at rest where it first touches
    parameter, frequency : of the point, Hz where the curve runs over the frequency
    within : of the parameter, what is not known of its place
    index : of the point of the curve after which it lies
    contact : index in the curve's contacts, -1 where it is none's
    multiplier : the one that passes; None for others, and where it is not known
    amplitudes : (m,) m, half of peak to peak of the outputs

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> problem = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    >>> given = dict(outputs={"tip": [1.0]}, stability="all")
    >>> curve = follow_band(problem, np.array([5.0]), (600, 1000), **given)
    >>> begin: NamedPoint = curve.named_points[0]
    >>> print(f"{begin.kind} at {begin.frequency:.2f} Hz")
    onset of slip at 835.63 Hz
    """

    kind: Kind
    parameter: float
    frequency: float
    within: float
    index: int
    contact: int
    multiplier: complex | None
    amplitudes: tuple[float, ...]


PLAIN = ("kind", "parameter", "frequency", "within", "index", "contact")


def as_table(points: Sequence[NamedPoint], outputs: int) -> np.ndarray:
    """(k,) with a column for each field; a multiplier that is not known is NaN."""
    columns = [
        ("kind", "U24"),
        *((name, float) for name in ("parameter", "frequency", "within")),
        *((name, int) for name in ("index", "contact")),
        ("multiplier", complex),
        ("amplitudes", float, (outputs,)),
    ]
    unknown = complex(np.nan, np.nan)
    rows = [
        tuple(unknown if value is None else value for value in vars(point).values())
        for point in points
    ]
    return np.array(rows, dtype=columns)


def from_table(table: np.ndarray) -> tuple[NamedPoint, ...]:
    """What `as_table` made."""
    return tuple(
        NamedPoint(
            **{name: row[name].item() for name in PLAIN},
            multiplier=None if np.isnan(row["multiplier"]) else complex(row["multiplier"]),
            amplitudes=tuple(row["amplitudes"].tolist()),
        )
        for row in table
    )
