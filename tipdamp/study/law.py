"""The contact law of a study: any law that ships with hbm, by its name, with parameters checked
like other keys."""

from dataclasses import MISSING, fields
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ConfigDict

from tipdamp.hbm.errors import nearest
from tipdamp.study.values import Key, Kind, number

if TYPE_CHECKING:
    from tipdamp.hbm.laws import ContactLaw

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
        from tipdamp.hbm.laws import SHIPPED

        return str(SHIPPED[self.name].__doc__).splitlines()[0]

    def make(self) -> "ContactLaw":
        """The law itself."""
        from tipdamp.hbm.laws import SHIPPED

        return SHIPPED[self.name](**self.parameters)


def laws_with_sliders() -> list[str]:
    """Names of the laws that can start from friction forces."""
    from tipdamp.hbm.laws import SHIPPED

    return [name for name, law in SHIPPED.items() if law.sliders]


def _read(value: Any, key: Key, _: float) -> LawChoice:
    from tipdamp.hbm.laws import SHIPPED

    given = {"name": value} if isinstance(value, str) else value
    if not isinstance(given, dict) or not isinstance(given.get("name"), str):
        raise ValueError(
            "must be the name of a law, or a table with its name and parameters, such as "
            '{ name = "CubicSpring", cubic = 1e12 }'
        )
    name = given["name"]
    if name not in SHIPPED:
        raise ValueError(f"no law '{name}'; {nearest(name, list(SHIPPED))}")
    own = _parameters(SHIPPED[name])
    stated = {k: v for k, v in given.items() if k != "name"}
    for parameter in stated:
        if parameter not in own:
            raise ValueError(
                f"{name} has no parameter '{parameter}'; {nearest(parameter, list(own))}"
            )
    for parameter, required in own.items():
        if required and parameter not in stated:
            raise ValueError(f"the parameter '{parameter}' of {name} is missing")
    choice = LawChoice(name=name, parameters={k: _parameter(k, v, key) for k, v in stated.items()})
    choice.make()
    return choice


def _parameters(law):
    """{parameter: whether it must be given}"""
    return {
        f.name: f.default is MISSING and f.default_factory is MISSING for f in fields(law) if f.init
    }


def _parameter(name, value, key):
    try:
        return number(value, key)
    except ValueError as error:
        raise ValueError(f"{name} {error}") from None


def _json() -> dict:
    from tipdamp.hbm.laws import SHIPPED

    needed = {
        name: [p for p, required in _parameters(law).items() if required]
        for name, law in SHIPPED.items()
    }
    tables = [
        {
            "type": "object",
            "additionalProperties": False,
            "required": ["name", *needed[name]],
            "properties": {
                "name": {"const": name},
                **dict.fromkeys(_parameters(law), {"type": "number"}),
            },
        }
        for name, law in SHIPPED.items()
    ]
    return {
        "oneOf": [
            {"enum": [name for name, parameters in needed.items() if not parameters]},
            *tables,
        ]
    }


LAW = Kind("text or table", _read, json=_json)
