"""Cases beside their references, one module a subject. The tests hold every row to its limit; a
release prints them.

OMP_NUM_THREADS=1 python -m tests.validation [--out build/validation] [--long] [SUBJECT ...]
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np


class Row(NamedTuple):
    """case: which system, where; ours, reference: the two values; error: relative; against: the
    kind of reference."""

    case: str
    ours: object
    reference: object
    error: float
    against: str


class Miss(NamedTuple):
    """A limit that is known not to be met: largest error measured, number of rows within the limit,
    and why."""

    measured: float
    within: int
    why: str


@dataclass(frozen=True)
class Subject:
    """One page.

    title, text : what is compared, in which quantity, and the source of the reference
    rows : function without arguments that yields its rows
    limits : {against: largest error}, as asked; a key may be the beginning of an `against`. What
        has no limit is reported.
    misses : {against: Miss}, the kinds of reference against which the limit is not met
    long : its rows and more that take minutes, for the command with --long
    quick : fewer of its rows, for the tests, where all of them take a minute and more
    """

    title: str
    text: str
    rows: Callable[[], Iterable[Row]]
    limits: dict[str, float]
    misses: dict[str, Miss] = field(default_factory=dict)
    long: Callable[[], Iterable[Row]] | None = None
    quick: Callable[[], Iterable[Row]] | None = None

    def limit(self, against: str) -> float | None:
        fits = [k for k in self.limits if against.startswith(k)]
        return self.limits[max(fits, key=len)] if fits else None

    def check(self):
        """Every row within its limit, every known miss as it was measured, and where all rows are
        made no limit without one."""
        rows = list((self.quick or self.rows)())
        for row in rows:
            limit = self.limit(row.against)
            assert row.against in self.misses or limit is None or row.error <= limit, (row, limit)
        for kind in () if self.quick else self.limits:
            assert any(row.against.startswith(kind) for row in rows), kind
        for kind, miss in self.misses.items():
            errors = np.array([row.error for row in rows if row.against == kind])
            limit = self.limit(kind)
            assert limit < errors.max() <= miss.measured, (
                f"{kind}: known miss of {limit:.2g}, now {errors.max():.3g}"
            )
            assert (errors <= limit).sum() >= miss.within, (
                f"{kind}: fewer rows than before are within {limit:.2g}"
            )


def row(case, ours, reference, against, scale=None) -> Row:
    """The error is relative to the reference (norm), or to `scale`; complex values are compared
    with their phase."""
    error = np.linalg.norm(np.subtract(ours, reference, dtype=complex))
    error /= scale or max(np.linalg.norm(reference), 1e-300)
    return Row(case, np.linalg.norm(ours), np.linalg.norm(reference), float(error), against)
