"""Rigid motions that a study holds: a motion alone, or a table with its stiffness, or a list of
these."""

from typing import Any

from pydantic import BaseModel, ConfigDict

from tipdamp.hbm.errors import InputError, nearest
from tipdamp.hbm.hold.rigid_motion import ALLOWED, parse_motion
from tipdamp.study.values import NUMBER, Key, Kind, number

KEYS = ("motion", "stiffness", "mean")
STIFFNESS = Key(NUMBER, "", low=0, open_low=True)


class HoldChoice(BaseModel):
    """motion - as `tipdamp.hbm.hold.rigid_motion.parse_motion` takes it; stiffness - N/m, of
    rotations N m/rad, None: the default; mean - whether the mean alone is held."""

    model_config = ConfigDict(frozen=True)

    motion: str | tuple[float, float, float]
    stiffness: float | None = None
    mean: bool = False


def _read(value: Any, _: Key, factor: float) -> tuple[HoldChoice, ...]:
    several = (
        isinstance(value, list) and value and not all(isinstance(v, int | float) for v in value)
    )
    return tuple(_one(given, factor) for given in (value if several else [value]))


def _one(given: dict[str, Any] | str, factor: float) -> HoldChoice:
    table: dict[str, Any] = given if isinstance(given, dict) else {"motion": given}
    for key in table:
        if key not in KEYS:
            raise ValueError(f"unknown key '{key}'; {nearest(key, KEYS)}")
    if "motion" not in table:
        raise ValueError("motion is missing: the direction, or the name of the motion")
    try:
        _, unit, coefficients = parse_motion(table["motion"])
    except InputError as error:
        raise ValueError(
            f'{error}; or a table such as {{ motion = "y", stiffness = 1e3 }}, or a list of these'
        ) from None
    if not isinstance(table.get("mean", False), bool):
        raise ValueError("mean must be true or false")
    stiffness = table.get("stiffness")
    if stiffness is not None:
        try:
            stiffness = number(stiffness, STIFFNESS, factor if unit == "N" else 1.0)
        except ValueError as error:
            raise ValueError(f"stiffness {error}") from None
    motion = (
        table["motion"] if isinstance(table["motion"], str) else tuple(coefficients[:3].tolist())
    )
    return HoldChoice(motion=motion, stiffness=stiffness, mean=table.get("mean", False))


def _json() -> dict:
    motion = {
        "anyOf": [
            {"type": "string"},
            {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3},
        ],
        "description": ALLOWED,
    }
    table = {
        "type": "object",
        "additionalProperties": False,
        "required": ["motion"],
        "properties": {
            "motion": motion,
            "stiffness": {"type": "number", "exclusiveMinimum": 0},
            "mean": {"type": "boolean"},
        },
    }
    return {"anyOf": [motion, table, {"type": "array", "items": {"anyOf": [motion, table]}}]}


HOLD = Kind("motion, table or list", _read, json=_json)
