"""Faces of a contact side: the name of a group, or a table that picks them by geometry."""

from dataclasses import fields
from typing import Any

from tipdamp.hbm.errors import nearest
from tipdamp.static_contact.surfaces.pick import FacePick
from tipdamp.study.values import NUMBER, Key, Kind, number

LENGTH = Key(NUMBER, "", low=0, open_low=True)
KEYS = tuple(field.name for field in fields(FacePick))
EXAMPLE = (
    "such as { plane = [0, 0, 1], point = [0, 0, 5] }, { within = 0.1 } or { box = [[0, 0, 0], "
    "[9, 9, 1]] }"
)


def _read(value: Any, key: Key, factor: float) -> str | FacePick:
    if isinstance(value, str) and value:
        return value
    if not isinstance(value, dict):
        raise ValueError(
            f"must be the name of a group, or a table of what the faces fulfil, {EXAMPLE}"
        )
    for name in value:
        if name not in KEYS:
            raise ValueError(f"unknown key '{name}'; {nearest(name, KEYS)}")
    if not set(value) & {"plane", "cylinder", "within", "box"}:
        raise ValueError(f"one of plane, cylinder, within and box is needed, {EXAMPLE}")
    for one, other in (
        ("cylinder", "radius"),
        ("radius", "cylinder"),
        ("cylinder", "point"),
        ("plane", "point"),
    ):
        if one in value and other not in value:
            raise ValueError(f"{other} is missing: {one} needs it")
    if not isinstance(value.get("group", ""), str):
        raise ValueError("group must be a text in quotes")
    found: dict[str, Any] = {"group": value.get("group", "")}
    for name, read in (
        ("plane", _direction),
        ("cylinder", _direction),
        ("point", _place),
        ("radius", _length),
        ("tolerance", _length),
        ("within", _length),
        ("box", _box),
    ):
        if name in value:
            try:
                found[name] = read(value[name], factor)
            except ValueError as error:
                raise ValueError(f"{name} {error}") from None
    return FacePick(**found)


def _length(value: float, factor: float) -> float:
    return number(value, LENGTH, factor)


def _place(value: Any, factor: float) -> tuple[float, ...]:
    if not isinstance(value, list) or len(value) != 3:
        raise ValueError("must be three numbers")
    return tuple(number(v, Key(NUMBER, ""), factor) for v in value)


def _direction(value: Any, _: float) -> tuple[float, ...]:
    found = _place(value, 1.0)
    if not any(found):
        raise ValueError("must not be zero")
    return found


def _box(value: Any, factor: float) -> tuple[tuple[float, ...], ...]:
    if not isinstance(value, list) or len(value) != 2:
        raise ValueError("must be two corners [[x, y, z], [x, y, z]]")
    return tuple(_place(corner, factor) for corner in value)


def _json() -> dict:
    place = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
    length = {"type": "number", "exclusiveMinimum": 0}
    box = {"type": "array", "items": place, "minItems": 2, "maxItems": 2}
    kinds = dict(
        zip(
            KEYS,
            (place, place, place, length, length, length, box, {"type": "string"}),
            strict=True,
        )
    )
    return {
        "anyOf": [
            {"type": "string"},
            {"type": "object", "additionalProperties": False, "properties": kinds},
        ]
    }


FACES = Kind("name of a group, or table", _read, json=_json)
