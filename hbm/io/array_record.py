"""ArrayRecord: what records of arrays have in common."""

from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, TypeVar
from zipfile import BadZipFile

import numpy as np

from tipdamp.hbm.errors import InputError, nearest
from tipdamp.hbm.io.array_files import open_npz

Record = TypeVar("Record", bound="ArrayRecord")
PLAIN = {str: str, bool: bool, int: int, float: float}  # kinds of fields that are no arrays


@dataclass(frozen=True, eq=False)
class ArrayRecord:
    """Base of a frozen dataclass with `eq=False` and array fields: these are copies that cannot be
    written to; two records are equal where all compared fields are, NaN being equal to NaN; pickles
    keep all of this."""

    def __post_init__(self) -> None:
        for f in fields(self):
            if f.type is np.ndarray:
                copy = np.array(vars(self)[f.name])
                copy.setflags(write=False)
                object.__setattr__(self, f.name, copy)

    def __reduce__(self) -> tuple:
        return type(self), tuple(vars(self)[f.name] for f in fields(self))

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(
            _equal(vars(self)[f.name], vars(other)[f.name]) for f in fields(self) if f.compare
        )


def _equal(a: Any, b: Any) -> bool:
    a, b = np.asarray(a), np.asarray(b)
    return np.array_equal(a, b, equal_nan=a.dtype.kind in "fc" and b.dtype.kind in "fc")


def column_of(name: str, names: np.ndarray, what: str) -> int:
    """Place of an output among the names (m,) of those of a record; InputError where there is none
    of that name; what : the record is, in the message."""
    known = names.tolist()
    if name not in known:
        raise InputError(f"output '{name}' is not in this {what}; {nearest(name, known)}")
    return known.index(name)


def read_record(
    kind: type[Record],
    path: str | Path,
    name: str,
    what: str,
    restored: Callable[[dict[str, Any]], dict[str, Any]] = lambda found: found,
) -> Record:
    """A record from its fields in an .npz; those that have a default may be absent.

    name, what : of the record in the messages: that it was not found, and what the file is not;
    restored : {field: value} from {field: stored value}. Raises InputError where the file is not
    there or holds something else.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{name} not found: {path}")
    try:
        with open_npz(path) as z:
            found = {
                f.name: PLAIN[f.type](z[f.name]) if f.type in PLAIN else z[f.name]
                for f in fields(kind)
                if f.name in z
            }
        return kind(**restored(found))
    except InputError:
        raise
    except (OSError, ValueError, TypeError, EOFError, BadZipFile) as error:
        raise InputError(f"{path}: is not {what} ({error})") from None
