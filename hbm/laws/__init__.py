"""Contact laws, one file or folder each.

Names are imported when they are first used: see `tipdamp`, which does so in the same way.
"""

from typing import TYPE_CHECKING, Any

LAWS = (  # those that are chosen by name: a new law is a name here and an import below
    "Jenkins1D",
    "DryFriction1T",
    "DryFriction2T",
    "UnilateralSpring",
    "IsotropicFriction",
    "CubicSpring",
)

if TYPE_CHECKING:
    # isort: off
    from tipdamp.hbm.laws.base import ContactLaw as ContactLaw
    from tipdamp.hbm.laws.coupled.law import IsotropicFriction as IsotropicFriction
    from tipdamp.hbm.laws.force import CubicSpring as CubicSpring, PlainForce as PlainForce
    from tipdamp.hbm.laws.mixed import MixedLaw as MixedLaw
    from tipdamp.hbm.laws.records import (
        ContactForces as ContactForces,
        ContactState as ContactState,
        Contacts as Contacts,
        Motion as Motion,
        SliderStart as SliderStart,
        Tangents as Tangents,
    )
    from tipdamp.hbm.laws.uncoupled.law import (
        DryFriction1T as DryFriction1T,
        DryFriction2T as DryFriction2T,
        Jenkins1D as Jenkins1D,
        UnilateralSpring as UnilateralSpring,
    )
    # isort: on

    SHIPPED: dict[str, type[ContactLaw]]  # those that are chosen by name
else:  # a module __getattr__ would let type checkers accept any name
    from importlib import import_module

    _NAMES = {  # of each module
        "base": "ContactLaw",
        "coupled.law": "IsotropicFriction",
        "force": "CubicSpring PlainForce",
        "mixed": "MixedLaw",
        "records": "ContactForces ContactState Contacts Motion SliderStart Tangents",
        "uncoupled.law": "DryFriction1T DryFriction2T Jenkins1D UnilateralSpring",
    }
    _HOME = {name: module for module, names in _NAMES.items() for name in names.split()}
    __all__ = ["SHIPPED", *sorted(_HOME)]

    def __getattr__(name: str) -> Any:
        if name == "SHIPPED":
            return {law: __getattr__(law) for law in LAWS}
        if name not in _HOME:
            raise AttributeError(f"module 'tipdamp.hbm.laws' has no attribute '{name}'")
        return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)

    def __dir__() -> list[str]:
        return __all__
