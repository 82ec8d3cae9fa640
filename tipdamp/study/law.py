"""The contact law of a study: any law that ships with hbm, by its name, with parameters checked
like other keys; or one of the user's own, by file and name."""

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ConfigDict, Field

from tipdamp.hbm.errors import InputError, nearest
from tipdamp.study.values import Key, Kind, check_parameters, number, parameters_of

if TYPE_CHECKING:
    from tipdamp.hbm.laws import ContactLaw

DEFAULT = "DryFriction2T"
OWN = r"\.py:[A-Za-z_]\w*$"  # names of laws of one's own


class LawChoice(BaseModel):
    """name - of a shipped law, or 'my_law.py:Dahl'; parameters {name: value in SI units}, those of
    the study alone; content - fingerprint of the file of a law of one's own, '' of a shipped one;
    folder - of the study, to which the file is relative"""

    model_config = ConfigDict(frozen=True)

    name: str = DEFAULT
    parameters: dict[str, float] = {}
    content: str = ""
    folder: Path | None = Field(default=None, exclude=True)

    @property
    def file(self) -> str:
        """Of a law of one's own; '' of a shipped one."""
        return self.name.rpartition(":")[0]

    def beside(self, study: Path) -> "LawChoice":
        """The same for the study of this path; InputError where it has no such file, and where the
        file may run and holds no such law."""
        if not self.file:
            return self
        from tipdamp.study.own_law import ALLOWED, content_of

        content = content_of(study.parent / self.file)
        found = self.model_copy(update={"content": content, "folder": study.parent.absolute()})
        if ALLOWED.get():
            found._by_file()
        return found

    def refuse_code(self) -> None:
        """InputError where the law is a file that may not run."""
        if self.file and self.folder is not None:
            from tipdamp.study.own_law import refuse_code

            refuse_code(self.folder / self.file)

    def __str__(self) -> str:
        return self.name

    @property
    def meaning(self) -> str:
        """First sentence of the law's own description, with its sources."""
        from tipdamp.hbm.laws import SHIPPED

        if self.file:
            return f"a law of the study's own, in a file with the fingerprint {self.content[:12]}."
        description = str(SHIPPED[self.name].__doc__)
        first = re.split(r"(?<=\.)\s*\n|\n\s*\n", description, maxsplit=1)[0]
        return " ".join(first.split())

    def make(self) -> "ContactLaw":
        """The law itself; InputError where its file may not run, or holds no such law."""
        from tipdamp.hbm.laws import SHIPPED

        if self.file and self.folder is not None:
            try:
                return self._by_file()
            except InputError as error:
                raise InputError(f"[respond] law = '{self.name}': {error}") from None
        return SHIPPED[self.name](**self.parameters)

    def _by_file(self) -> "ContactLaw":
        from tipdamp.study.own_law import own_law

        assert self.folder is not None
        name = self.name.rpartition(":")[2]
        return own_law(self.folder / self.file, self.content, name, self.parameters)


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
            '{ name = "CubicSpring", cubic = 1e12 }; of your own "dahl.py:Dahl"'
        )
    name = given["name"]
    if ":" in name:
        file, _, own_name = name.rpartition(":")
        if not file.endswith(".py") or not own_name.isidentifier():
            raise ValueError("a law of your own is named by file and class: dahl.py:Dahl")
        stated = {k: _parameter(k, v, key) for k, v in given.items() if k != "name"}
        return LawChoice(name=name, parameters=stated)
    if name.endswith(".py"):
        raise ValueError(f"names a file, not a law in it: write '{name}:NAME', NAME of its class")
    if name not in SHIPPED:
        raise ValueError(f"no law '{name}'; {nearest(name, list(SHIPPED))}")
    stated = {k: v for k, v in given.items() if k != "name"}
    check_parameters(SHIPPED[name], stated)
    choice = LawChoice(name=name, parameters={k: _parameter(k, v, key) for k, v in stated.items()})
    choice.make()
    return choice


def _parameter(name: str, value: float, key: Key) -> float:
    try:
        return number(value, key)
    except ValueError as error:
        raise ValueError(f"{name} {error}") from None


def _json() -> dict:
    from tipdamp.hbm.laws import SHIPPED

    needed = {
        name: [p for p, required in parameters_of(law).items() if required]
        for name, law in SHIPPED.items()
    }
    tables = [
        {
            "type": "object",
            "additionalProperties": False,
            "required": ["name", *needed[name]],
            "properties": {
                "name": {"const": name},
                **dict.fromkeys(parameters_of(law), {"type": "number"}),
            },
        }
        for name, law in SHIPPED.items()
    ]
    return {
        "oneOf": [
            {"enum": [name for name, parameters in needed.items() if not parameters]},
            *tables,
            {"type": "string", "pattern": OWN},
            {
                "type": "object",
                "additionalProperties": {"type": "number"},
                "required": ["name"],
                "properties": {"name": {"type": "string", "pattern": OWN}},
            },
        ]
    }


LAW = Kind("text or table", _read, json=_json)
