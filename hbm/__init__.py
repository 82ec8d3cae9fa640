"""Harmonic balance of reduced models with friction contacts; needs numpy, scipy and numba alone.

    from hbm import ContactTable, DryFriction2T, ReducedModel, forced_response

The public names are loaded when they are first asked for.
"""

from importlib import import_module

_HOME = {
    "CurveOptions": "curve.options", "ReducedModel": "model", "ContactTable": "contact", "InputError": "errors",
    **dict.fromkeys(("ContactProblem", "contact_problem"), "problem"),
    **dict.fromkeys(("Hold", "HeldMotion", "held_motions"), "hold.spring"),
    **dict.fromkeys(("ContactLaw", "ContactState", "Contacts"), "laws.base"),
    **dict.fromkeys(("forced_response", "follow_band", "follow_parameter", "solve_at"), "response"),
    **dict.fromkeys(("linear_response", "natural_frequencies"), "balance.receptance"),
    **dict.fromkeys(("Parameter", "Frequency", "Level", "ContactSetting", "Damping", "ModelParameter",
                     "ForceParameter"), "parameter"),
    **dict.fromkeys(("ForcedResponse", "PeriodicSolution"), "result"),
    **dict.fromkeys(("solutions_at", "time_history"), "solutions"),
    **dict.fromkeys(("contact_cycles", "energy_balance", "whole_motion"), "cycles"),
    "find_peaks": "peaks", "compare": "time.comparison", "IntegrationSettings": "time.settings",
    "Settings": "continuation.settings", "MixedLaw": "laws.mixed",
    "PlainForce": "laws.force",
    **{law: f"laws.{home}" for law, home in import_module("hbm.laws").LAWS.items()},
}
__all__ = sorted(_HOME)


def __getattr__(name):
    if name not in _HOME:
        raise AttributeError(f"module 'hbm' has no attribute '{name}'")
    return getattr(import_module(f"hbm.{_HOME[name]}"), name)


def __dir__():
    return __all__
