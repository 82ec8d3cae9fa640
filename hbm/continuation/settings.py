"""Settings of the continuation: every tolerance with its reason."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Numbers of the method; `replace(DEFAULT, max_calls=500)` changes one.

    Steps are arc lengths: a step of 0.1 changes the unknowns by a tenth of their size, or the
    parameter by a tenth of `parameter_share` of its range.

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> problem = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    >>> given = dict(outputs={"tip": [1.0]}, harmonics=1)
    >>> curve = follow_band(problem, np.array([5.0]), (600, 1000), **given)
    >>> small = Settings(largest_step=0.05)
    >>> finer = follow_band(problem, np.array([5.0]), (600, 1000), settings=small, **given)
    >>> len(finer.frequency) > len(curve.frequency)
    True
    """

    first_step: float = 0.05
    largest_step: float = 0.25
    smallest_step: float = 1e-5
    parameter_share: float = 0.1  # of the range: by how much a unit step moves the parameter
    widest: float = 100.0  # times the parameter: the range, for that, of a band that is wider still
    # of the parameter: how far it must move for a growth of the unknowns to be no runaway
    apart: float = 0.01
    tolerance: float = 1e-10  # of the residual, relative to the weighted unknowns
    aim: float = 1.2e-3  # error of a predicted point to which the steps are fitted
    largest_error: float = 0.024  # of a predicted point, 20 times that: a step above it is refused
    highest_order: int = 5  # of the predicting polynomials
    max_iterations: int = 12  # of the corrector; Newton near a smooth branch needs two or three
    # of its iterations that do not halve the residual; a shorter step is cheaper
    max_stalls: int = 1
    patient_stalls: int = 6  # the same between two solved points, where no shorter step exists
    patient_calls: int = 60  # of damped Newton between two points, where Newton fails ...
    patient_residual: float = 1e-13  # ... and its tolerance
    max_points: int = 5000
    # of the residual from 400 unknowns on, (400/n)^2 times as many below; and for each
    max_calls: int = 2000
    # point as many more as the next line says
    calls_per_point: int = 12
    max_first_calls: int = 20000  # until a first point is found, however few the unknowns
    large: int = 400  # unknowns from which on the calls hold as they are
    # residual calls without a new point after which progress is reported
    progress_interval: int = 20
    # of damped Newton for a first point or a restart: where it converges it takes 80
    start_calls: int = 120
    # of a period integrated for a first point, with 100 motions of contacts; (100/n)^2
    start_steps: int = 1000
    # times as many with n, a step costs as n^2; steady motions take some hundred
    max_gaps: int = 3  # places without a solution before the branch counts as lost
    places_ahead: int = 7  # at most 7, at which a solution is looked for beyond a gap
    max_restarts: int = 12
    # unknowns this many times those of the start, where stiff contacts may have stuck: no
    runaway: float = 1e12
    # bounded solution exists further on
    # points without progress before the branch is left; twice as many each time in vain
    patience: int = 250
    # share of the points from which on a wide hole is left rather than more points tried
    late: float = 0.6
    # share of the range by which a branch must advance to be worth following
    progress: float = 3e-3
    # how far out of the band a branch is followed, relative to the parameter at its start
    outside: float = 0.5
    # arc length below which the last Newton step is taken without evaluating again
    last_step: float = 1e-4
    safety: float = 8.0  # factor on the error that is estimated after such a step
    drift_points: int = 20  # points over which the parameter stands still ...
    drift_still: float = 1e-6  # ... to this share of its unit step, while the unknowns ...
    drift_far: float = 0.05  # ... change by this arc length: rigid-body drift
    # share of the range without a solution that marks a restarted branch as failed
    hole: float = 0.02
    # in unit steps of the parameter, over which a folding branch is left at first
    restart_distance: float = 0.1
    points_back: int = 400  # within which a solution found ahead is followed back
    max_bisections: int = 40  # of the interval around a crossing; beyond that it is rounding
    max_loops: int = 6  # times that the way between two points is halved where a loop may lie in it
    max_peak_points: int = 60  # solved in one bracket around a maximum; a kink takes most
    # of the residual in one bracket; beyond that the maximum counts as unsolved
    max_peak_calls: int = 400
    max_ripple_points: int = 200  # added around a maximum of sampled laws to tell its ripples apart
    # times the error of the cubic through two points: how far a ripple may exceed it
    ripple_margin: float = 4.0
    # of a part of the branch with one kink, after which no ripple is expected in it
    concave_halvings: int = 5
    # of the step from one end of a bracket, where the plane between meets no solution
    max_halvings: int = 30
    # of the value: by how much a point may still lie below the maximum
    peak_tolerance: float = 1e-10
    peak_step: float = 1e-9  # arc length of the last Newton step of the points around a maximum ...
    # ... after so many at most; where the springs are stiff the residual does not tell
    max_polish: int = 4
    # share of the largest value by which a point may lie below it and be searched from
    peak_window: float = 0.02
    # of the largest value, of a curve linked by PCHIP; a line on paper is wider
    drawn_error: float = 1e-3
    drawn_passes: int = 6  # of points for that: each halves what is left beside a kink, or more
    shortest_chord: float = 1e-13  # arc length of a bracket that is not divided any more: rounding
    peak_noise: float = 1e-9  # of the motion of the whole model: an output below it is rounding


DEFAULT = Settings()
