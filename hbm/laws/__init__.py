"""The contact laws, one file or folder each; the names below are loaded when they are first asked for."""

from importlib import import_module

_HOME = {
    "Contacts": "hbm.laws.base", "Tangents": "hbm.laws.base",
    "CorridorLaw": "hbm.laws.uncoupled.law", "Jenkins1D": "hbm.laws.uncoupled.law",
    "DryFriction2T": "hbm.laws.uncoupled.law", "UnilateralSpring": "hbm.laws.uncoupled.law",
    "LAWS": "hbm.laws.uncoupled.law",
    "IsotropicFriction": "hbm.laws.coupled.law",
    "SampledLaw": "hbm.laws.sampled", "CubicSpring": "hbm.laws.sampled",
    "MixedLaw": "hbm.laws.mixed",
}
__all__ = list(_HOME)


def __getattr__(name):
    if name not in _HOME:
        raise AttributeError(f"module 'hbm.laws' has no attribute '{name}'")
    return getattr(import_module(_HOME[name]), name)


def __dir__():
    return __all__
