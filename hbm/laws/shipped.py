"""The laws that are chosen by name."""

from hbm.errors import InputError
from hbm.laws.base import ContactLaw
from hbm.laws.coupled.law import IsotropicFriction
from hbm.laws.cubic import CubicSpring
from hbm.laws.uncoupled.law import DryFriction1T, DryFriction2T, Jenkins1D, UnilateralSpring
from hbm.validation import brief

SHIPPED = {law.__name__: law for law in
           (Jenkins1D, DryFriction1T, DryFriction2T, UnilateralSpring, IsotropicFriction, CubicSpring)}


def check_law(law) -> ContactLaw:
    """The law; InputError where it is none."""
    if isinstance(law, ContactLaw):
        return law
    if isinstance(law, type) and issubclass(law, ContactLaw):
        raise InputError(f"law = {law.__name__}: is the class of a law; make one: {law.__name__}(...)")
    raise InputError(f"law = {brief(law)}: must be a contact law, one of {', '.join(SHIPPED)}, MixedLaw, or a class of "
                     "your own derived from hbm.laws.ContactLaw")
