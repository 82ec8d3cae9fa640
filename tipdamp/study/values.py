"""One value of a study file: read by its kind, checked, in SI units.

Every reader has the form f(where, value, spec, factor): `where` opens the message of its InputError, `factor` is that
of the unit.
"""

import numpy as np

from hbm.errors import InputError, nearest
from tipdamp.study.schema import Key


def read(where: str, value, spec: Key, factor: float):
    """The value of a key in SI units. Raises InputError, which says what is allowed."""
    return READ[spec.kind](where, value, spec, factor)


def _text(where, value, spec, _):
    if not isinstance(value, str) or not value:
        raise InputError(f"{where}: must be a text in quotes")
    if spec.choices and value not in spec.choices:
        raise InputError(f"{where}: {nearest(value, spec.choices)}")
    return value


def _flag(where, value, *_):
    if not isinstance(value, bool):
        raise InputError(f"{where}: must be true or false")
    return value


def _roll(where, value, *_):
    """'from_flat' becomes None: the value is worked out from the flat."""
    return None if value == "from_flat" else number(f"{where} (or 'from_flat')", value, Key("number", "", low=0))


def _each(read, alone):
    """A list of values; a single value stands for a list of one where `alone` allows it."""
    def many(where, value, spec, factor):
        items = [value] if alone and not isinstance(value, list) else value
        if not isinstance(items, list) or not items:
            raise InputError(f"{where}: must be a list that is not empty")
        return tuple(read(where, v, spec, factor) for v in items)
    return many


def number(where: str, value, spec: Key) -> float:
    """A finite number within the range of the key, in the unit of the file."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"{where}: must be a number")
    low_ok = value > spec.low if spec.open_low else value >= spec.low
    if not (np.isfinite(value) and low_ok and value <= spec.high):
        bound = f"{'above' if spec.open_low else 'at least'} {spec.low:g}" if np.isfinite(spec.low) else "finite"
        upper = f" and at most {spec.high:g}" if np.isfinite(spec.high) else ""
        raise InputError(f"{where}: must be {bound}{upper}")
    return float(value)


def _count(where, value, spec, _=1.0):
    if isinstance(value, bool) or not isinstance(value, int):
        raise InputError(f"{where}: must be a whole number from {spec.low:g} to {spec.high:g}")
    if not spec.low <= value <= spec.high:
        raise InputError(f"{where}: must lie between {spec.low:g} and {spec.high:g}")
    return value


def _stations(where, value, spec, factor):
    return value if value == "all" else _each(_count, True)(f"{where} (or 'all')", value, spec, factor)


def _vector(where, value, *_):
    if not isinstance(value, list) or len(value) != 3:
        raise InputError(f"{where}: must be three numbers")
    vector = np.array([number(where, v, Key("number", "")) for v in value])
    size = np.linalg.norm(vector)
    if size == 0:
        raise InputError(f"{where}: must not be zero")
    return tuple((vector / size).tolist())


def _triple(where, value, _, factor):
    if not isinstance(value, list) or len(value) != 3:
        raise InputError(f"{where}: must be three numbers")
    return tuple(factor * number(where, v, Key("number", "")) for v in value)


def _on_groups(numbers):
    """Rows [body, group, one number or three]."""
    last = "value" if numbers == 1 else "x, y, z"

    def rows(where, value, _, factor):
        if not isinstance(value, list) or not all(isinstance(r, list) and len(r) == 2 + numbers for r in value):
            raise InputError(f"{where}: must be a list of [body, group, {last}]")
        texts, any_number = Key("text", ""), Key("number", "")
        return tuple((*(_text(where, t, texts, 1.0) for t in r[:2]), *(factor * number(where, v, any_number)
                                                                     for v in r[2:])) for r in value)
    return rows


def _band(where, value, spec, _=1.0):
    if not isinstance(value, list) or len(value) != 2:
        raise InputError(f"{where}: must be two numbers [first, last]")
    a, b = (number(where, v, spec) for v in value)
    if a >= b:
        raise InputError(f"{where}: the band is empty: the first must be below the last")
    return a, b


def _profile(where, value, _, factor):
    try:
        table = np.array(value, dtype=float)
    except (TypeError, ValueError):
        table = np.empty(0)
    if table.ndim != 2 or table.shape[1] != 2 or len(table) < 2 or not np.isfinite(table).all():
        raise InputError(f"{where}: must be at least two rows [coordinate, gap]")
    if (np.diff(table[:, 0]) <= 0).any():
        raise InputError(f"{where}: the coordinates must ascend")
    return tuple(map(tuple, (table * factor).tolist()))


def _scaled(where, value, spec, factor):
    return factor * number(where, value, spec)


READ = {"text": _text, "choice": _text, "flag": _flag, "roll": _roll, "number": _scaled, "count": _count,
         "texts": _each(_text, False), "one_or_more": _each(_text, True),
         "numbers": _each(_scaled, False), "ratios": _each(_scaled, True),
         "counts": _each(_count, True), "stations": _stations, "vector": _vector, "triple": _triple,
         "group_values": _on_groups(1), "group_vectors": _on_groups(3), "band": _band, "table": _profile}
