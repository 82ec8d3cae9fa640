"""What a stage found, as a frozen record: it is stored as the JSON file of its stage, tables and
curves beside it.

Units stand in the names (_N, _m, _hz, _N_per_m); names without one are in SI. A number that is not
finite is None."""

from typing import Annotated, ClassVar, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, ValidationError

from tipdamp.engine.store import Store, plain
from tipdamp.hbm.errors import InputError

Number = Annotated[float | None, BeforeValidator(plain)]
Numbers = Annotated[tuple[float, ...], BeforeValidator(plain)]
Texts = tuple[str, ...]


class Record(BaseModel):
    """Frozen, read by attribute; a name that it does not have is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid", from_attributes=True)


class Result(Record):
    """The record of a stage: `file` in the results folder."""

    file: ClassVar[str]
    warnings: Texts = ()

    def save(self, store: Store) -> None:
        """Write the JSON file of the stage."""
        store.write_json(self.file, self.model_dump())

    @classmethod
    def load(cls, store: Store) -> Self:
        """Read the JSON file of the stage; InputError where it is absent or damaged."""
        try:
            return cls.model_validate(store.read_json(cls.file))
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(map(str, first["loc"]))
            stage = cls.file.removesuffix(".json")
            raise InputError(
                f"{store.path(cls.file)} is damaged at '{place}' ({first['msg']}); run the stage "
                f"again: tipdamp {stage} STUDY.toml --force"
            ) from None
