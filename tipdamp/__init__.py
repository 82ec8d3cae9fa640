"""Friction dampers between turbine blades: preload map, detachment tuning, forced response.

    from tipdamp import ContactTable, DryFriction2T, ReducedModel, forced_response

The names that a script needs; `help` of each has an example, which takes `import numpy as np` and
`from tipdamp import *` for granted. Each is loaded when it is first asked for, so that matrices
need no finite elements; type checkers and editors read the imports below, a test holds both lists
together.
"""

import os
import sys
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

__version__ = "0.3.0"


def _same_bits_anywhere_in_memory() -> None:
    """Let numpy 1.24 multiply complex numbers alike wherever they lie.

    Its AVX-512 loops round once where two arrays of complex numbers are 64 bytes or more apart and
    twice where they are nearer: the same calls, repeated, then differ in their last bits. Numpy 2
    does not. The variable takes effect when numpy is imported, here and in the processes that are
    started from here.
    """
    if "numpy" in sys.modules:
        return
    numpy = find_spec("numpy")
    if numpy is None or numpy.origin is None:
        return
    if os.path.isdir(os.path.join(os.path.dirname(numpy.origin), "_core")):  # numpy 2
        return
    try:
        with open("/proc/cpuinfo", encoding="ascii", errors="replace") as processors:
            flags = processors.read(4096)
    except OSError:
        return
    if "avx512f" in flags:
        os.environ.setdefault("NPY_DISABLE_CPU_FEATURES", "AVX512F")


_same_bits_anywhere_in_memory()

if TYPE_CHECKING:
    # one statement for each module: sorted, names given again would have one each
    # isort: off
    from tipdamp.hbm.balance.contact_setting import ContactSetting as ContactSetting
    from tipdamp.hbm.balance.parameter import (
        Damping as Damping,
        ForceParameter as ForceParameter,
        Frequency as Frequency,
        Level as Level,
        ModelParameter as ModelParameter,
        Parameter as Parameter,
    )
    from tipdamp.hbm.balance.problem import (
        ContactProblem as ContactProblem,
        contact_problem as contact_problem,
    )
    from tipdamp.hbm.balance.receptance import (
        linear_response as linear_response,
        natural_frequencies as natural_frequencies,
    )
    from tipdamp.hbm.balance.varying import ForceTable as ForceTable, Unbalance as Unbalance
    from tipdamp.hbm.comparison import Comparison as Comparison, compare as compare
    from tipdamp.hbm.contact import ContactTable as ContactTable
    from tipdamp.hbm.continuation.settings import Settings as Settings
    from tipdamp.hbm.curve.cycles import (
        ContactCycles as ContactCycles,
        contact_cycles as contact_cycles,
        energy_balance as energy_balance,
        whole_motion as whole_motion,
    )
    from tipdamp.hbm.curve.energy import EnergyBalance as EnergyBalance
    from tipdamp.hbm.curve.folds_and_transitions import named_points as named_points
    from tipdamp.hbm.curve.options import CurveOptions as CurveOptions
    from tipdamp.hbm.curve.peaks import find_peaks as find_peaks
    from tipdamp.hbm.curve.solutions import (
        solutions_at as solutions_at,
        time_history as time_history,
    )
    from tipdamp.hbm.errors import Doubt as Doubt, InputError as InputError
    from tipdamp.hbm.example import cantilever as cantilever, two_blades as two_blades
    from tipdamp.hbm.fitting.fit import fit_damping as fit_damping
    from tipdamp.hbm.fitting.result import (
        DampingFit as DampingFit,
        MeasuredResponse as MeasuredResponse,
    )
    from tipdamp.hbm.following.follow import follow_fold as follow_fold, follow_peak as follow_peak
    from tipdamp.hbm.following.options import FollowOptions as FollowOptions
    from tipdamp.hbm.following.result import Followed as Followed
    from tipdamp.hbm.hold.spring import (
        HeldMotion as HeldMotion,
        Hold as Hold,
        held_motions as held_motions,
    )
    from tipdamp.hbm.influence import Derivatives as Derivatives
    from tipdamp.hbm.io.nlvib import (
        from_nlvib as from_nlvib,
        read_nlvib as read_nlvib,
        to_nlvib as to_nlvib,
    )
    from tipdamp.hbm.laws.base import ContactLaw as ContactLaw
    from tipdamp.hbm.laws.coordinates import OwnForce as OwnForce, Polynomial as Polynomial
    from tipdamp.hbm.laws.coupled.law import IsotropicFriction as IsotropicFriction
    from tipdamp.hbm.laws.force import CubicSpring as CubicSpring, PlainForce as PlainForce
    from tipdamp.hbm.laws.mixed import MixedLaw as MixedLaw
    from tipdamp.hbm.laws.records import ContactState as ContactState, Contacts as Contacts
    from tipdamp.hbm.laws.uncoupled.law import (
        DryFriction1T as DryFriction1T,
        DryFriction2T as DryFriction2T,
        Jenkins1D as Jenkins1D,
        UnilateralSpring as UnilateralSpring,
    )
    from tipdamp.hbm.matrices_out import write_model as write_model
    from tipdamp.hbm.model import ReducedModel as ReducedModel
    from tipdamp.hbm.modes.backbone import backbone as backbone
    from tipdamp.hbm.modes.derivatives import (
        peak_derivatives as peak_derivatives,
        point_derivatives as point_derivatives,
        stuck_frequency_derivatives as stuck_frequency_derivatives,
    )
    from tipdamp.hbm.modes.result import Backbone as Backbone
    from tipdamp.hbm.modes.synthesis import Synthesis as Synthesis, synthesis as synthesis
    from tipdamp.hbm.named_point import NamedPoint as NamedPoint
    from tipdamp.hbm.periodic_solution import PeriodicSolution as PeriodicSolution
    from tipdamp.hbm.problem import Problem as Problem
    from tipdamp.hbm.response import (
        follow_band as follow_band,
        follow_parameter as follow_parameter,
        forced_response as forced_response,
        solve_at as solve_at,
    )
    from tipdamp.hbm.result import ForcedResponse as ForcedResponse
    from tipdamp.hbm.search.beside import Search as Search
    from tipdamp.hbm.search.branches import branch_from as branch_from
    from tipdamp.hbm.search.curves import (
        CurvesBeside as CurvesBeside,
        curves_beside as curves_beside,
    )
    from tipdamp.hbm.self_excited import limit_cycle as limit_cycle
    from tipdamp.hbm.testing import check_force as check_force, check_law as check_law
    from tipdamp.hbm.time.settings import IntegrationSettings as IntegrationSettings
    from tipdamp.measured.damping import half_power as half_power
    from tipdamp.modal.body import Body as Body
    from tipdamp.modal.craig_bampton import assemble as assemble, craig_bampton as craig_bampton
    from tipdamp.modal.elasticity import Material as Material, elastic_body as elastic_body
    from tipdamp.modal.mesh import Mesh as Mesh
    from tipdamp.modal.reduction import Reduction as Reduction
    from tipdamp.static_contact.contact.contact_forces import Preload as Preload
    from tipdamp.static_contact.contact.preload import preload as preload
    from tipdamp.static_contact.tuning.station_detachment import (
        Detachment as Detachment,
        detach_until as detach_until,
    )
    from tipdamp.static_contact.tuning.stuck_assembly import StuckAssembly as StuckAssembly
    from tipdamp.study.own_law import code_allowed as code_allowed
    from tipdamp.study.study import load_study as load_study
    # isort: on
else:  # a module __getattr__ would let type checkers accept any name
    from importlib import import_module

    _NAMES = {  # of each module
        "tipdamp.hbm.balance.contact_setting": "ContactSetting",
        "tipdamp.hbm.balance.parameter": (
            "Damping ForceParameter Frequency Level ModelParameter Parameter"
        ),
        "tipdamp.hbm.balance.problem": "ContactProblem contact_problem",
        "tipdamp.hbm.balance.receptance": "linear_response natural_frequencies",
        "tipdamp.hbm.balance.varying": "ForceTable Unbalance",
        "tipdamp.hbm.comparison": "Comparison compare",
        "tipdamp.hbm.contact": "ContactTable",
        "tipdamp.hbm.continuation.settings": "Settings",
        "tipdamp.hbm.curve.cycles": "ContactCycles contact_cycles energy_balance whole_motion",
        "tipdamp.hbm.curve.energy": "EnergyBalance",
        "tipdamp.hbm.curve.folds_and_transitions": "named_points",
        "tipdamp.hbm.curve.options": "CurveOptions",
        "tipdamp.hbm.curve.peaks": "find_peaks",
        "tipdamp.hbm.curve.solutions": "solutions_at time_history",
        "tipdamp.hbm.errors": "Doubt InputError",
        "tipdamp.hbm.example": "cantilever two_blades",
        "tipdamp.hbm.fitting.fit": "fit_damping",
        "tipdamp.hbm.fitting.result": "DampingFit MeasuredResponse",
        "tipdamp.hbm.following.follow": "follow_fold follow_peak",
        "tipdamp.hbm.following.options": "FollowOptions",
        "tipdamp.hbm.following.result": "Followed",
        "tipdamp.hbm.hold.spring": "HeldMotion Hold held_motions",
        "tipdamp.hbm.influence": "Derivatives",
        "tipdamp.hbm.io.nlvib": "from_nlvib read_nlvib to_nlvib",
        "tipdamp.hbm.laws.base": "ContactLaw",
        "tipdamp.hbm.laws.coordinates": "OwnForce Polynomial",
        "tipdamp.hbm.laws.coupled.law": "IsotropicFriction",
        "tipdamp.hbm.laws.force": "CubicSpring PlainForce",
        "tipdamp.hbm.laws.mixed": "MixedLaw",
        "tipdamp.hbm.laws.records": "ContactState Contacts",
        "tipdamp.hbm.laws.uncoupled.law": "DryFriction1T DryFriction2T Jenkins1D UnilateralSpring",
        "tipdamp.hbm.matrices_out": "write_model",
        "tipdamp.hbm.model": "ReducedModel",
        "tipdamp.hbm.modes.backbone": "backbone",
        "tipdamp.hbm.modes.derivatives": (
            "peak_derivatives point_derivatives stuck_frequency_derivatives"
        ),
        "tipdamp.hbm.modes.result": "Backbone",
        "tipdamp.hbm.modes.synthesis": "Synthesis synthesis",
        "tipdamp.hbm.named_point": "NamedPoint",
        "tipdamp.hbm.periodic_solution": "PeriodicSolution",
        "tipdamp.hbm.problem": "Problem",
        "tipdamp.hbm.response": "follow_band follow_parameter forced_response solve_at",
        "tipdamp.hbm.result": "ForcedResponse",
        "tipdamp.hbm.search.beside": "Search",
        "tipdamp.hbm.search.branches": "branch_from",
        "tipdamp.hbm.search.curves": "CurvesBeside curves_beside",
        "tipdamp.hbm.self_excited": "limit_cycle",
        "tipdamp.hbm.testing": "check_force check_law",
        "tipdamp.hbm.time.settings": "IntegrationSettings",
        "tipdamp.measured.damping": "half_power",
        "tipdamp.modal.body": "Body",
        "tipdamp.modal.craig_bampton": "assemble craig_bampton",
        "tipdamp.modal.elasticity": "Material elastic_body",
        "tipdamp.modal.mesh": "Mesh",
        "tipdamp.modal.reduction": "Reduction",
        "tipdamp.static_contact.contact.contact_forces": "Preload",
        "tipdamp.static_contact.contact.preload": "preload",
        "tipdamp.static_contact.tuning.station_detachment": "Detachment detach_until",
        "tipdamp.static_contact.tuning.stuck_assembly": "StuckAssembly",
        "tipdamp.study.own_law": "code_allowed",
        "tipdamp.study.study": "load_study",
    }
    _HOME = {name: home for home, names in _NAMES.items() for name in names.split()}
    __all__ = sorted(_HOME)

    def __getattr__(name: str) -> Any:
        if name not in _HOME:
            raise AttributeError(f"module 'tipdamp' has no attribute '{name}'")
        return getattr(import_module(_HOME[name]), name)

    def __dir__() -> list[str]:
        return [*__all__, "__version__"]
