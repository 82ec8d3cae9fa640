"""Contact laws, one file or folder each; the names below are imported when they are first used."""

from importlib import import_module
from typing import Any

LAWS = {  # those that are chosen by name, and the module of each: a new law is an entry here
    "Jenkins1D": "uncoupled.law",
    "DryFriction1T": "uncoupled.law",
    "DryFriction2T": "uncoupled.law",
    "UnilateralSpring": "uncoupled.law",
    "IsotropicFriction": "coupled.law",
    "CubicSpring": "force",
}
_HOME = {
    **dict.fromkeys(
        ("ContactState", "Contacts", "Motion", "SliderStart", "Tangents", "ContactForces"),
        "records",
    ),
    "ContactLaw": "base",
    "PlainForce": "force",
    **LAWS,
    "MixedLaw": "mixed",
}
__all__ = ["SHIPPED", *_HOME]


def __getattr__(name: str) -> Any:
    if name == "SHIPPED":  # {name: class} of those that are chosen by name
        return {law: __getattr__(law) for law in LAWS}
    if name not in _HOME:
        raise AttributeError(f"module 'tipdamp.hbm.laws' has no attribute '{name}'")
    return getattr(import_module(f"tipdamp.hbm.laws.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return __all__
