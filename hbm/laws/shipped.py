"""The laws that are chosen by name."""

from importlib import import_module

from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws import LAWS
from tipdamp.hbm.laws.base import ContactLaw
from tipdamp.hbm.validation import brief

SHIPPED: dict[str, type[ContactLaw]] = {
    name: getattr(import_module(f"tipdamp.hbm.laws.{module}"), name)
    for name, module in LAWS.items()
}


def check_law(law: ContactLaw) -> ContactLaw:
    """The law; InputError where it is none."""
    if isinstance(law, ContactLaw):
        return law
    if isinstance(law, type) and issubclass(law, ContactLaw):
        raise InputError(
            f"law = {law.__name__}: is the class of a law; make one: {law.__name__}(...)"
        )
    raise InputError(
        f"law = {brief(law)}: must be a contact law, one of {', '.join(SHIPPED)}, MixedLaw, or a "
        "class of your own derived from hbm.laws.ContactLaw"
    )
