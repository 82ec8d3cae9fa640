"""ArrayRecord: what records of arrays have in common."""

from dataclasses import dataclass, fields

import numpy as np


@dataclass(frozen=True, eq=False)
class ArrayRecord:
    """Base of a frozen dataclass with `eq=False` and array fields: these are copies that cannot be
    written to; two records are equal where all compared fields are, NaN being equal to NaN; pickles
    keep all of this."""

    def __post_init__(self):
        for f in fields(self):
            if f.type is np.ndarray:
                copy = np.array(vars(self)[f.name])
                copy.setflags(write=False)
                object.__setattr__(self, f.name, copy)

    def __reduce__(self):
        return type(self), tuple(vars(self)[f.name] for f in fields(self))

    def __eq__(self, other) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(
            _equal(vars(self)[f.name], vars(other)[f.name]) for f in fields(self) if f.compare
        )


def _equal(a, b) -> bool:
    a, b = np.asarray(a), np.asarray(b)
    return np.array_equal(a, b, equal_nan=a.dtype.kind in "fc" and b.dtype.kind in "fc")
