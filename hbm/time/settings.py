"""The numbers that steer time integration, the search for its steady states and the comparison with
a curve."""

from dataclasses import dataclass

from tipdamp.hbm.validation import check_numbers


@dataclass(frozen=True)
class IntegrationSettings:
    """Numbers of time integration, shooting and comparison; `IntegrationSettings(samples=256)`
    changes one.

    Event-driven integrator
    tolerance : error of the contact force within a step, relative to the largest; 1e-7 holds the
        harmonics to 1e-8. 0 takes equal steps, shorter only up to an event
    steps : longest step as a part of the period; 64 resolves 10 harmonics where nothing happens
    halvings : of the longest step; 2^-16 of it is below any transient of a mode that keeps its mass
    curvature : cubic part of the motion in a step, relative to the motion; above 0.02 two events
    may hide in one step
    tiny : closeness to which an event is located, relative to the motion; the rounding of a guard
    is some 1e-16
    max_steps : per period; chatter takes more, a regular motion some hundred
    orbit_samples : of a period, in which sliders settle on a motion of the balance; places them to
    (pi/512)^2/2 of it
    Sampled integrator
    samples : steps per period; second order, 1024 hold friction to 1e-4
    together : steps that Newton's method solves at once; more ask a law less often, but may lie
        further from where they begin than it converges
    newton_together : of its steps for them; more seldom converge, and fewer steps at once do
    same_memory : change of the memory at which that ends, relative to it, for each entry; above the
        rounding of a slider, which is a small difference
    newton_steps : of the force at the end of a step; more than 40 never converge
    newton_residual : change of the motion at which that ends, relative to it; near rounding
    short : step in which the force at the begin of a period is found, relative to the others; no
    state moves in it
    settling_periods : in which the state of a law settles on a motion of the balance; sliders need
    two
    Stuck system
    massless_above : modes above this many times the excitation follow statically; at 50 their
    inertia counts 4e-4
    foreign_share : share of the contact stiffness that other springs must add in these modes;
    below, their mass stays
    Shooting
    repeats : change of the state over a period, relative to the motion, that counts as periodic
    max_periods : integrated until the state repeats
    newton_on_map : steps of Newton on the period map; on a piecewise-linear map it ends after a few
    periods_after_newton : integrated after Newton until the state repeats; where it converged one
    is enough
    max_columns : unknowns up to which the derivative of the map is computed column by column
    difference : of the differences of the map, relative to the motion; the root of the rounding of
        a period. Larger ones reach past events that change their order: on the rig Newton stalls
        with 1e-6
    krylov : residual of Newton's step by GMRES; the map is known to `difference` only
    fractions : of Newton's step that are tried, the largest first
    Stability
    disturbance : of the differences for the multipliers, relative to the motion; rounding counts
        the more the smaller it is, events that change their order the larger it is: 1e-5 makes 4.6
        of 0.88
    resting : motion of a slider over a disturbed period, relative to the disturbance, that counts
    as none
    multipliers : leading ones sought by Arnoldi's method; more than a complex pair, or the first
    found may not lead
    arnoldi : vectors of the Krylov space; a third of a hundred multipliers of similar modulus is
    enough
    arnoldi_restarts : of it; where more are needed every column is computed
    multiplier_error : relative residual at which Arnoldi's method ends; below the error of the
    differences
    marginal : modulus above 1 up to which a multiplier counts as 1, that of a motion that nothing
    holds or drives
    Comparison
    patience : periods integrated from the orbit before Newton helps to find where they lead
    almost : change over a period below which an event-driven integration that does not repeat is
        tried again, at a hundredth of its tolerance; a damping ratio of 1e-5 makes 3e-3 of the
        errors of the steps
    elsewhere : relative difference from which on two solutions are not compared, but said to be two
    small : relative difference above which more harmonics, or samples, are advised; fewer : share
        of it that twice the samples must leave at most, where samples lack
    same : relative distance of two solutions of the balance that count as one
    unsolved : relative difference of another orbit where the balance has no solution to tell them
    by
    Raises InputError where a number is not positive (tolerance, foreign_share, max_columns and
    patience may be zero).

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> problem = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    >>> curve = follow_band(problem, np.array([5.0]), (600, 1000), outputs={"tip": [1.0]})
    >>> fewer = IntegrationSettings(patience=5, max_periods=200)
    >>> compare(curve, problem, 700.0, settings=fewer).agrees
    True
    """

    tolerance: float = 1e-7
    steps: int = 64
    halvings: int = 16
    curvature: float = 0.02
    tiny: float = 1e-12
    max_steps: int = 200000
    orbit_samples: int = 512
    samples: int = 1024
    together: int = 64
    newton_together: int = 8
    same_memory: float = 1e-10
    newton_steps: int = 40
    newton_residual: float = 1e-13
    short: float = 1e-6
    settling_periods: int = 30
    massless_above: float = 50.0
    foreign_share: float = 0.02
    repeats: float = 1e-8
    max_periods: int = 1000
    newton_on_map: int = 8
    periods_after_newton: int = 20
    max_columns: int = 80
    difference: float = 1e-8
    krylov: float = 1e-3
    fractions: tuple[float, ...] = (1.0, 0.5, 0.2, 0.05)
    disturbance: float = 1e-7
    resting: float = 1e-6
    multipliers: int = 2
    arnoldi: int = 30
    arnoldi_restarts: int = 10
    multiplier_error: float = 1e-4
    marginal: float = 1e-4
    patience: int = 40
    almost: float = 1e-2
    elsewhere: float = 0.2
    small: float = 1e-3
    fewer: float = 0.5
    same: float = 1e-6
    unsolved: float = 3e-2

    def __post_init__(self) -> None:
        check_numbers(
            self, ("tolerance", "foreign_share", "max_columns", "patience"), ("massless_above",)
        )
