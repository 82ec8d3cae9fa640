"""What a sweep varies: keys of the study by their dotted names, each with a list or a range of
values."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict

from tipdamp.hbm.errors import nearest
from tipdamp.study.values import COUNT, LONGEST, NUMBER, Key, Kind, number, whole

RANGE = ("start", "stop", "count", "spacing")
SPACINGS = ("lin", "log")
DIGITS = 12  # of the values of a range: 0.4 and not 0.39999999999999997
END = Key(NUMBER, "")
POINTS = Key(COUNT, "", low=1, high=LONGEST)


class SweptKey(BaseModel):
    """One key of the study, 'contact.left.kn', and the values that it takes, as in the file."""

    model_config = ConfigDict(frozen=True)

    key: str
    values: tuple[Any, ...]


class SampledKey(BaseModel):
    """One key of the study and the ends between which samples of it lie; log - evenly in the
    logarithm."""

    model_config = ConfigDict(frozen=True)

    key: str
    start: float
    stop: float
    log: bool = False

    def at(self, share: np.ndarray) -> np.ndarray:
        """Values at shares 0 to 1 of the way from start to stop."""
        if not self.log:
            return self.start + share * (self.stop - self.start)
        return np.exp(np.log(self.start) + share * (np.log(self.stop) - np.log(self.start)))


def _axes(value: Any, *_: Any) -> tuple[SweptKey, ...]:
    return tuple(SweptKey(key=key, values=_values(key, one)) for key, one in _flat(value))


def _intervals(value: Any, *_: Any) -> tuple[SampledKey, ...]:
    found = []
    for key, one in _flat(value):
        if not isinstance(one, dict) or "count" in one:
            raise ValueError(f"{key} must be {{ start = ..., stop = ... }}, spacing = 'log' beside")
        found.append(_interval(key, one))
    return tuple(found)


def _flat(value: Any, above: str = "") -> Iterator[tuple[str, Any]]:
    """(dotted key, what stands there): `damper.pull = ...` is a table in a table in TOML."""
    if not isinstance(value, dict) or not value:
        raise ValueError(
            f"{above}{' ' * bool(above)}must name keys of the study, such as damper.pull = [20, 50]"
        )
    for key, one in value.items():
        name = f"{above}.{key}" if above else key
        if isinstance(one, dict) and not any(k in RANGE for k in one):
            yield from _flat(one, name)
        else:
            yield name, one


def _values(key: str, given: Any) -> tuple[Any, ...]:
    """Of a list, or of a range with both its ends."""
    if isinstance(given, list):
        if not given:
            raise ValueError(f"{key} has an empty list: give at least one value")
        return tuple(given)
    if not isinstance(given, dict):
        raise ValueError(f"{key} must be a list or {{ start = ..., stop = ..., count = ... }}")
    interval = _interval(key, given)
    if "count" not in given:
        raise ValueError(f"{key}: count is missing: the number of values from start to stop")
    try:
        count = whole(given["count"], POINTS)
    except ValueError as error:
        raise ValueError(f"{key}: count {error}") from None
    if count > 1 and interval.start == interval.stop:
        raise ValueError(f"{key}: the range is empty: start = stop = {interval.start:g}")
    values = interval.at(np.linspace(0.0, 1.0, count))
    values[0] = interval.start
    values[-1] = interval.stop if count > 1 else interval.start
    return tuple(float(f"{value:.{DIGITS}g}") for value in values)


def _interval(key: str, table: dict) -> SampledKey:
    for unknown in (name for name in table if name not in RANGE):
        raise ValueError(f"{key}: unknown key '{unknown}'; {nearest(unknown, RANGE)}")
    ends = []
    for name in ("start", "stop"):
        if name not in table:
            raise ValueError(f"{key}: {name} is missing")
        try:
            ends.append(number(table[name], END))
        except ValueError as error:
            raise ValueError(f"{key}: {name} {error}") from None
    spacing = table.get("spacing", "lin")
    if spacing not in SPACINGS:
        raise ValueError(f"{key}: spacing: {nearest(str(spacing), SPACINGS)}")
    if spacing == "log" and min(ends) <= 0:
        raise ValueError(f"{key}: spacing = 'log' needs start and stop above 0")
    return SampledKey(key=key, start=ends[0], stop=ends[1], log=spacing == "log")


def _json() -> dict:
    """Tables in one another, down to lists and ranges."""
    return {"type": "object"}


AXES = Kind("table of lists and ranges", _axes, json=_json)
INTERVALS = Kind("table of ranges", _intervals, json=_json)
