"""Tolerances of the harmonic balance and its linear side, each with its reason."""

from dataclasses import dataclass

from tipdamp.hbm.hold.rigid_motion import HOLD


@dataclass(frozen=True)
class BalanceSettings:
    """Numbers that the answer does not depend on, but for the inputs that they refuse."""

    # share of the stuck stiffness that Newton's matrix adds to active mean positions
    regularisation: float = 1e-10
    # in the arc length: the mean position is nearly indeterminate in slip
    order_zero_weight: float = 0.01
    # modes above this many times the highest harmonic enter by a power series ...
    series_reach: float = 4.0
    series_terms: int = 18  # ... with so many terms: 4^-18 is below 1e-10
    # of modal entries held at once, where receptances between contacts are summed
    products: int = 1 << 20
    few_modes: int = 60  # up to which a series does not pay
    # share of the contact forces: a sampled law changes them by more with more samples
    sampling: float = 1e-11
    # components of contacts that stay open, up to which they are left in Newton's system
    few_open: int = 24
    open_rounding: float = 1e-13  # of the derivatives of their forces
    # of Newton's system: usual number of iterations of GMRES ...
    usual: int = 100
    iteration: float = 2e6  # ... what each costs beside its products, in flops, ...
    beside: float = 2.0  # ... and how much longer inverses take than their flops say
    iterations: int = 150  # at most, between two true residuals
    inner: float = 1e-5  # of the solution: what they leave
    refined: float = 1e-8  # of the solution: what the last of them leave
    refinements: int = 6  # true residuals, at most ...
    slow: float = 0.1  # ... each of which is to leave less than this share
    next_to_zero: float = 1e-3  # an eigenvalue beside 1 whose sign is not sure
    few_contacts: int = 48  # none of which is passed over as surely sticking
    # between which all of the series is made at once, not for those that move alone
    few_components: int = 300
    # sets of components whose rows of the shapes are kept, from one point to the next
    few_rows: int = 8
    # weights of receptances between contacts that are kept beside the last ones, up to so many
    # pairs of components: those of the higher orders of an estimated truncation among them
    few_reaches: int = 3
    few_between: int = 1 << 14
    kept_between: int = 1 << 24  # entries of matrices of the series between many that are kept
    # dofs up to which all poles of a damping matrix are computed ...
    few_modes_of_matrix: int = 400
    few_modes_of_ratio: int = 1000  # ... and all modes of damping ratios
    # of the frequency: how far above the present one the modes are to hold
    reduced_headroom: float = 1.5
    # of the motion: what would slip then may be taken in, for so many more
    reduced_growth: tuple = (1.25, 2.0, 4.0)
    # shares of the highest frequency where the response is to repeat ...
    reduced_checks: tuple = (0.15, 0.55, 1.0)
    reduced_change: float = 1e-10  # ... to this share of itself when the space grows ...
    # ... with damping ratios: what changes is the damping of local motions
    reduced_change_of_ratio: float = 1e-7
    reduced_share: float = 0.3  # of all dofs: from where on all modes are less work
    reduced_moments: int = 5  # with damping ratios, before ...
    # ... places between the frequencies ...
    reduced_shifts: tuple = (0.5, 0.2, 0.8, 0.35, 0.65, 0.05, 0.95)
    reduced_slowest: float = 5.0  # ... this many times the highest one, and the fastest of a dof
    # share of a mass matrix that is not zero: up to there products are sparse
    few_entries: float = 0.05
    reduced_rounding: float = 1e-12  # of a direction: what is left of it is rounding
    power_iterations: int = 100  # at most, for the softest motion of the Jacobian
    # times the rounding of the stiffness: what a restrained motion must store
    noise: float = HOLD.noise
    # share of the stiffness, for each dof, that a rigid motion must store: reduction
    loose: float = 1e-13
    # rounds too
    far_more: float = 1e3  # times that, which all elastic motions then store
    # times what a restrained motion must store: more needs no closer look
    restrained: float = 100.0
    # of a motion without mass and damping, in units of the slowest frequency
    static_pole: float = 1e18
    unseen: float = 1e-9  # of a motion: what of it is rounding at least
    # of the force scale: residual of the equation of motion at which a point is kept;
    equilibrium: float = 5e-9
    # summed in another order it stays below 1e-8
    # roundings of the terms of the equation of motion, no residual: of small elements
    terms: float = 8.0
    # K q itself is not known better
    most_doubt: float = 1e-2  # of a vibration, by which that rounding may move a point that is kept
    no_input: float = 1e-6  # of the apparent input: an input of that size is rounding
    # entries of the derivatives, of points whose residuals are made at once
    kept_at_once: int = 1 << 20
    more_steps: int = 8  # of Newton's method for a point above it
    nearby: float = 1e-3  # of the parameter: how far they may lead, or it is another point
    separations: int = 4  # at most, of the state-space modes of close poles ...
    # ... down to rounding; from where on more than the first order of it is taken
    mixed: tuple = (1e-13, 1e-3)
    # of the inverse receptance, above which poles have no modes; above the first ...
    defect: tuple = (1e-9, 1e-8)
    # ... with changes of the damping by this share: rounding over it, and its square,
    apart: float = 1e-5
    # are lost
    light: float = 1e-10  # modal mass beside the largest, below which it is rounding
    # contact springs beside the stiffest dof, above which rounding is estimated ...
    stiff: float = 1e3
    # of the largest product of shape and force: what is rounding in a mode
    unreached: float = 1e-12
    evenly: int = 41  # points of a branch along which no contact moves, and as many more ...
    around: int = 41  # ... around each of its resonances, ...
    least_width: float = 1e-7  # ... whose damping ratio may be zero
    resonance: float = 20.0  # ... with so much more motion at a resonance than beside it


DEFAULT = BalanceSettings()
