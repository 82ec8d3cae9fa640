"""Kinds of values in a study file: how each is read and checked, how it is documented, and its JSON
schema.

A reader has the form f(value, key, factor): `factor` converts the unit of the file to SI. It raises
ValueError with what is allowed; the place in the file is added by whoever reads the section.
"""

from collections.abc import Callable, Collection
from dataclasses import MISSING, dataclass, field, fields
from typing import Any, get_args

import numpy as np
from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema, core_schema

from tipdamp.hbm.errors import InputError, nearest, shown
from tipdamp.readers.columns import parse_meanings

LONGEST = 10_000  # list of a study


@dataclass(frozen=True)
class Kind:
    """shown - its name in the documentation; read - from the value of the file; alone - whether a
    single value stands for a list of one; json - its JSON schema where that is not the one of its
    type."""

    shown: str
    read: Callable[[Any, "Key", float], Any]
    alone: bool = False
    json: Callable[[], dict] | None = None


@dataclass(frozen=True)
class Key:
    """Data sheet of one key, as metadata of a field of a section.

    text - its meaning; unit - a name in `schema.UNITS` or 'force/length'; low, high - range in the
    unit of the file sizes - of its absolute value in SI units, where it is not zero: what double
    precision and solids can carry default - as documented, where it differs from the field's own;
    choices - filled in from the Literal of the field"""

    kind: Kind
    text: str
    unit: str = ""
    low: float = -np.inf
    high: float = np.inf
    open_low: bool = False
    sizes: tuple[float, float] = (1e-30, 1e30)
    choices: tuple[str, ...] = field(default=(), compare=False)

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        def read(value: Any, info: ValidationInfo) -> Any:
            return self.kind.read(value, self.of(source), (info.context or {}).get(self.unit, 1.0))

        return core_schema.with_info_before_validator_function(read, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict:
        found = self.kind.json() if self.kind.json else _ranged(handler(schema), self)
        if self.kind.alone:
            ways = found.get("anyOf", [found])
            found = {"anyOf": [ways[0]["items"], *ways]}
        return {
            **found,
            "description": self.text
            + (f" ({self.unit}, in the unit of [units])" if self.unit else ""),
        }

    def of(self, annotation: Any) -> "Key":
        """The key with the choices of its field."""
        return (
            Key(self.kind, self.text, choices=get_args(annotation)) if self.kind is CHOICE else self
        )


def in_toml(value: Any) -> str:
    """A value as it stands in the file, in one short line."""
    return shown(" ".join(_toml(value).split()))


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        inside = ", ".join(f"{key} = {_toml(one)}" for key, one in value.items())
        return f"{{ {inside} }}" if inside else "{}"
    if isinstance(value, list):
        return f"[{', '.join(map(_toml, value))}]"
    return str(value).lower() if isinstance(value, bool) else repr(value)


# ---- readers -------------------------------------------------------------------------------------


def number(value: Any, key: Key, factor: float = 1.0) -> float:
    """A finite number within the range of the key."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError("must be a number")
    try:
        value = float(value)
    except OverflowError:
        raise ValueError("must be finite") from None
    low_ok = value > key.low if key.open_low else value >= key.low
    if not (np.isfinite(value) and low_ok and value <= key.high):
        bounds = ["finite"] * (not np.isfinite(value) or not np.isfinite(key.low))
        if np.isfinite(key.low):
            bounds.append(f"{'above' if key.open_low else 'at least'} {key.low:g}")
        if np.isfinite(key.high):
            bounds.append(f"at most {key.high:g}")
        raise ValueError(f"must be {' and '.join(bounds)}")
    found, (least, most) = factor * value, key.sizes
    if found and not least <= abs(found) <= most:
        raise ValueError(
            f"is {found:.3g} in SI units, must be between {least:g} and {most:g}; numbers are in "
            "the units of [units]"
        )
    return found


def _text(value: Any, *_: Any) -> str:
    if not isinstance(value, str) or not value:
        raise ValueError("must be a text in quotes")
    if "\0" in value:
        raise ValueError("must not hold the character NUL, which no name of a file can have")
    return value


def _choice(value: Any, key: Key, _: float) -> str:
    if _text(value) not in key.choices:
        raise ValueError(nearest(value, key.choices))
    return value


def _flag(value: Any, *_: Any) -> bool:
    if not isinstance(value, bool):
        raise ValueError("must be true or false")
    return value


def whole(value: Any, key: Key, _: float = 1.0) -> int:
    """A whole number within the range of the key."""
    if isinstance(value, bool) or not isinstance(value, int):
        raise ValueError(f"must be a whole number from {key.low:g} to {key.high:g}")
    if not key.low <= value <= key.high:
        raise ValueError(f"must lie between {key.low:g} and {key.high:g}")
    return value


def _each(read: Callable, alone: bool) -> Callable:
    """A list of values; a single value stands for a list of one where `alone` allows it."""

    def many(value: Any, key: Key, factor: float) -> tuple:
        items = [value] if alone and not isinstance(value, list) else value
        if not isinstance(items, list) or not items:
            raise ValueError("must be a list that is not empty")
        if len(items) > LONGEST:
            raise ValueError(f"has {len(items)} items, at most {LONGEST} are read")
        try:
            return tuple(read(item, key, factor) for item in items)
        except ValueError as error:
            comma = len(items) == 2 and items[0] == 0 and type(items[1]) is int
            remedy = f"; is 0.{items[1]} meant? Numbers take a decimal point" if comma else ""
            raise ValueError(f"{error}{remedy}") from None

    return many


def _or(word: str, read: Callable) -> Callable:
    """A value of another kind, or this word."""

    def either(value: Any, key: Key, factor: float) -> Any:
        if value == word:
            return value
        if isinstance(value, list) and word in value:
            raise ValueError(f"'{word}' stands alone, not in a list")
        try:
            return read(value, key, factor)
        except ValueError as error:
            raise ValueError(f"{error}, or '{word}'") from None

    return either


def _triple(value: Any, key: Key, factor: float) -> tuple[float, ...]:
    if not isinstance(value, list) or len(value) != 3:
        raise ValueError("must be three numbers")
    return tuple(number(v, key, factor) for v in value)


def _vector(value: Any, key: Key, _: float) -> tuple[float, ...]:
    """A direction: of unit length."""
    vector = np.array(_triple(value, key, 1.0))
    size = np.linalg.norm(vector)
    if size == 0:
        raise ValueError("must not be zero")
    return tuple((vector / size).tolist())


def _on_groups(numbers: int) -> Callable:
    """Rows [body, group, one number or three]."""

    def rows(value: Any, key: Key, factor: float) -> tuple:
        if not isinstance(value, list) or not all(
            isinstance(r, list) and len(r) == 2 + numbers for r in value
        ):
            raise ValueError(
                f"must be a list of [body, group, {'value' if numbers == 1 else 'x, y, z'}]"
            )
        return tuple(
            (*map(_text, row[:2]), *(number(v, key, factor) for v in row[2:])) for row in value
        )

    return rows


def _band(value: Any, key: Key, _: float) -> tuple[float, float]:
    if not isinstance(value, list) or len(value) != 2:
        raise ValueError("must be two numbers [first, last]")
    first, last = (number(v, key) for v in value)
    if first >= last:
        raise ValueError("the band is empty: the first must be below the last")
    return first, last


def _columns(value: Any, key: Key, factor: float) -> tuple[str, ...]:
    names = _each(_text, False)(value, key, factor)
    parse_meanings(names)
    return names


def _table(value: Any, _: Key, factor: float) -> tuple:
    try:
        table = np.array(value, dtype=float)
    except (TypeError, ValueError, OverflowError):
        table = np.empty(0)
    if table.ndim != 2 or table.shape[1] != 2 or len(table) < 2 or not np.isfinite(table).all():
        raise ValueError("must be at least two rows [coordinate, gap]")
    if len(table) > LONGEST or np.abs(table).max() > 1e30:
        raise ValueError(f"must have at most {LONGEST} rows, of numbers up to 1e+30")
    if (np.diff(table[:, 0]) <= 0).any():
        raise ValueError("the coordinates must ascend")
    return tuple((float(x), float(gap)) for x, gap in table * factor)


# ---- JSON schema ---------------------------------------------------------------------------------


def _ranged(schema: dict, key: Key) -> dict:
    """The schema with the range of the key on every number; None, which TOML does not know, is left
    out."""
    if schema.get("type") in ("number", "integer"):
        low = {}
        if np.isfinite(key.low):
            low = {"exclusiveMinimum" if key.open_low else "minimum": key.low}
        return {**schema, **low, **({"maximum": key.high} if np.isfinite(key.high) else {})}
    if "anyOf" in schema:
        found = [_ranged(one, key) for one in schema["anyOf"] if one.get("type") != "null"]
        return found[0] if len(found) == 1 else {"anyOf": found}
    inner: dict[str, Any] = {"items": _ranged(schema["items"], key)} if "items" in schema else {}
    if "prefixItems" in schema:
        inner["prefixItems"] = [_ranged(one, key) for one in schema["prefixItems"]]
    return {**schema, **inner}


# ---- kinds ---------------------------------------------------------------------------------------

TEXT = Kind("text", _text)
TEXTS = Kind("list of texts", _each(_text, False))
ONE_OR_MORE = Kind("text or list of texts", _each(_text, True), alone=True)
CHOICE = Kind("choice", _choice)
FLAG = Kind("true or false", _flag)
NUMBER = Kind("number", number)
NUMBERS = Kind("list of numbers", _each(number, False))
RATIOS = Kind("number or list", _each(number, True), alone=True)
COLUMNS = Kind("list of texts", _columns)
COUNT = Kind("whole number", whole)
COUNTS = Kind("whole number or list", _each(whole, True), alone=True)
STATIONS = Kind("[front, back] or 'all'", _or("all", _each(whole, True)))
ROLL = Kind("'from_flat' or number", _or("from_flat", number))
COUNTS_OR_AUTO = Kind("'auto', whole number or list", _or("auto", _each(whole, True)), alone=True)
COUNT_OR_AUTO = Kind("'auto' or whole number", _or("auto", whole))
PHASE = Kind(
    "degrees, list, 'in_phase' or 'out_of_phase'",
    _or("in_phase", _or("out_of_phase", _each(number, True))),
    alone=True,
)
VECTOR = Kind("[x, y, z]", _vector)
TRIPLE = Kind("[x, y, z]", _triple)
BAND = Kind("[first, last]", _band)
TABLE = Kind("[[coordinate, value], ...]", _table)
GROUP_VALUES = Kind("[[body, group, value], ...]", _on_groups(1))
GROUP_VECTORS = Kind("[[body, group, x, y, z], ...]", _on_groups(3))


def parameters_of(law: Any) -> dict[str, bool]:
    """{parameter of a law, a dataclass: whether it must be given}"""
    return {
        f.name: f.default is MISSING and f.default_factory is MISSING for f in fields(law) if f.init
    }


def check_parameters(law: type, stated: Collection[str]) -> None:
    """InputError for a parameter that a law does not have, and where one that it needs is
    missing."""
    own = parameters_of(law)
    for parameter in stated:
        if parameter not in own:
            raise InputError(
                f"{law.__name__} has no parameter '{parameter}'; {nearest(parameter, list(own))}"
            )
    for parameter, required in own.items():
        if required and parameter not in stated:
            raise InputError(f"the parameter '{parameter}' of {law.__name__} is missing")
