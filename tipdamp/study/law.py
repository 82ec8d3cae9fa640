"""The contact law of a study: any law that ships with hbm, by its name, with parameters checked like other keys."""

from dataclasses import MISSING, fields
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ConfigDict

from hbm.errors import nearest
from tipdamp.study.values import Key, Kind, number

if TYPE_CHECKING:
    from hbm.laws import ContactLaw

DEFAULT = "DryFriction2T"


class LawChoice(BaseModel):
    """name - of a shipped law; parameters {name: value in SI units}, those of the study alone."""

    model_config = ConfigDict(frozen=True)

    name: str = DEFAULT
    parameters: dict[str, float] = {}

    def __str__(self) -> str:
        return self.name

    @property
    def meaning(self) -> str:
        """First line of the law's own description."""
        from hbm.laws import SHIPPED

        return str(SHIPPED[self.name].__doc__).splitlines()[0]

    def make(self) -> "ContactLaw":
        """The law itself."""
        from hbm.laws import SHIPPED

        return SHIPPED[self.name](**self.parameters)


def _read(value: Any, key: Key, _: float) -> LawChoice:
    from hbm.laws import SHIPPED

    given = {"name": value} if isinstance(value, str) else value
    if not isinstance(given, dict) or not isinstance(given.get("name"), str):
        raise ValueError("must be the name of a law, or a table with its name and parameters, such as "
                         "{ name = \"CubicSpring\", cubic = 1e12 }")
    name = given["name"]
    if name not in SHIPPED:
        raise ValueError(f"no law '{name}'; {nearest(name, list(SHIPPED))}")
    own = {f.name: f for f in fields(SHIPPED[name]) if f.init}
    stated = {k: v for k, v in given.items() if k != "name"}
    for parameter in stated:
        if parameter not in own:
            raise ValueError(f"{name} has no parameter '{parameter}'; {nearest(parameter, list(own))}")
    for parameter, f in own.items():
        if parameter not in stated and f.default is MISSING and f.default_factory is MISSING:
            raise ValueError(f"the parameter '{parameter}' of {name} is missing")
    choice = LawChoice(name=name, parameters={k: _parameter(k, v, key) for k, v in stated.items()})
    choice.make()
    return choice


def _parameter(name, value, key):
    try:
        return number(value, key)
    except ValueError as error:
        raise ValueError(f"{name} {error}") from None


def _json() -> dict:
    from hbm.laws import SHIPPED

    names = {"enum": list(SHIPPED)}
    table = {"type": "object", "properties": {"name": names}, "required": ["name"],
             "additionalProperties": {"type": "number"}}
    return {"anyOf": [names, table]}


LAW = Kind("text or table", _read, json=_json)
