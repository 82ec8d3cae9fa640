"""What may be asked of a curve: the keywords of the functions of `tipdamp.hbm.response`, typed, and
their checked record."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, dataclass, fields
from inspect import Parameter, signature
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.curve.enough_harmonics import Harmonics
from tipdamp.hbm.curve.guess import Guess
from tipdamp.hbm.curve.journal import Journal
from tipdamp.hbm.curve.keywords import CommonKeywords
from tipdamp.hbm.errors import InputError, nearest

Function = TypeVar("Function", bound=Callable)
Options = TypeVar("Options")
NEEDED = {
    "outputs": (
        "{name: a dof, two dofs (a, b), or the row that takes the output out of q}, for example "
        "outputs={'x': 0}; a ReducedModel gives rows: "
        "{'tip': model.displacement_row('blades', 2, [0, 1, 0])}"
    ),
    "band": "(from, to) Hz",
}
PointsOfInterest = Literal["none", "peaks", "all"]


class CurveKeywords(CommonKeywords, total=False):
    """The fields of CurveOptions as keywords, which editors and type checkers know by name;
    `outputs` must be given."""

    harmonics: Harmonics
    periods: int
    tolerance: float
    guess: Guess | None
    at: tuple | list | np.ndarray
    beyond: float | None
    contact: bool
    truncation: bool
    stability: PointsOfInterest
    peaks: Sequence[Sequence[str]] | None
    derivatives: Sequence[str]
    journal: Journal | None


@dataclass(frozen=True)
class CurveOptions:
    """What may be asked of a curve beside the problem, the forcing and the band: the keywords of
    `tipdamp.hbm.response`.

    outputs : {name: a dof, two dofs (a, b) for q_a - q_b, or the (r,) row that takes the output
        out of q}
    harmonics : H, orders 0..H are kept; 'auto' takes as many as `tolerance` needs
    periods : of the excitation in one of the motion: 2 for subharmonic motions of the order 1/2.
        `harmonics` are then counted in the frequency of the motion, the excitation stands at that
        many times its orders, multipliers are those of the longer period, and frequencies stay
        those of the excitation
    tolerance : of harmonics = 'auto': relative `truncation` at 99 % of the points
    guess : (n,) unknowns of a solution that is near (`PeriodicSolution.unknowns`, or a row of
        `ForcedResponse.unknowns`, of as many orders or fewer) where the band begins, or (value,
        unknowns) of one at a value inside it: the curve is then followed from there both ways, once
        round where it is closed. None starts from the stuck response, then raises the force from
        zero, then integrates in time, then comes from other frequencies. They are a flat (P, nd,
        2 h + 1), h orders of the relative motion in m of the P contacts that carry, in the order of
        the problem; of each the nd components of the law (`law.components`; with several laws t1,
        t2, n and what else they have, a single row being n or t1); of each [mean, a_1, b_1, ...,
        a_h, b_h] of mean + sum a_k cos k tau - b_k sin k tau: the sine with a minus, so that a + i
        b is the coefficient of `contact_motion`. tau runs at the frequency of the excitation over
        `periods`. See the example of `solve_at`
    start : where the sliders start, before the first of two periods: 'zero_slider', the default (T
        = 0 at q = 0), 'zero_force' (T = 0 at the position of t = 0: means then depend on the phase
        of the force) or positions (P, nt) in m
    at : frequencies in Hz, or values of the parameter, at which every crossing of the curve is
    solved
    beyond : frequency in Hz, or value of the parameter, past the end of the band, up to which the
        branch is followed: to a fold there and back, to what of it lies inside; None ends it with
        the band
    samples : of a cycle, at least 8 and 4 H; None takes the number of the law. They separate the
        events of an event-driven law and do not change its result; a law of sampled forces is as
        accurate as its samples
    contact : whether to keep the harmonics of the force of every contact too
    truncation : whether to estimate what the orders above H would change at every point
    (`ForcedResponse.truncation`)
    stability : the points whose Floquet multipliers are found: 'none', the solved 'peaks' or 'all'
        (`ForcedResponse.multipliers`, `stable`)
    peaks : groups of names of outputs, of each of which the largest and the smallest peak is
        solved, as of the nodes of a patch; None solves the peak of every output. `find_peaks`
        solves any other afterwards
    derivatives : names of outputs of whose highest peak the derivatives are kept with the curve
        (`peak_derivatives`, `ForcedResponse.derivatives`); one that has none is warned of
    progress : function (value, step, calls), called at each point with the residual calls that it
        took, and at every 20 calls between points with step 0 and the calls since; None shows a
        line in a terminal or a notebook, once it takes two seconds, False none
    settings : of the continuation: steps, points, budget; None takes
    `tipdamp.hbm.continuation.settings.DEFAULT`
    journal : of a curve that may be interrupted, to continue it later (`tipdamp.hbm.curve.journal`)

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> problem = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    >>> options = CurveOptions(outputs={"tip": [1.0]}, harmonics=1, truncation=False)
    >>> for level in (1.0, 5.0):  # one set of options for several curves
    ...     print(follow_band(problem, np.array([level]), (600, 1000), **vars(options)).ended)
    reached the end of the band
    reached the end of the band
    """

    outputs: "Mapping[str, ArrayLike]"
    harmonics: Harmonics = 5
    periods: int = 1
    tolerance: float = 1e-3
    guess: Guess | None = None
    start: str | np.ndarray | None = None
    at: tuple | list | np.ndarray = ()
    beyond: float | None = None
    samples: int | None = None
    contact: bool = False
    truncation: bool = True
    stability: PointsOfInterest = "none"
    peaks: Sequence[Sequence[str]] | None = None
    derivatives: Sequence[str] = ()
    progress: Callable | bool | None = None
    settings: Settings | None = None
    journal: Journal | None = None


def curve_options(given: CurveKeywords) -> CurveOptions:
    """InputError for an option that does not exist, and where `outputs` is missing."""
    return given_options(CurveOptions, given, ("outputs",))


def given_options(
    kind: Callable[..., Options], given: Mapping[str, Any], needed: Sequence[str]
) -> Options:
    """A record of options from keywords; InputError for one that does not exist, and where one that
    is needed is missing."""
    known = list(signature(kind).parameters)
    for name in given:
        if name not in known:
            raise InputError(f"option {name}: is unknown; {nearest(name, known)}")
    for name in needed:
        if name not in given:
            raise InputError(f"{name} is missing: {NEEDED[name]}")
    return kind(**given)


def options_named(kind: type) -> Callable[[Function], Function]:
    """For a function whose `**options` are the fields of a record: its signature, as `help` and
    editors show it, names each of them with its type and default."""
    options = [
        Parameter(
            f.name,
            Parameter.KEYWORD_ONLY,
            default=Parameter.empty if f.default is MISSING else f.default,
            annotation=f.type,
        )
        for f in fields(kind)
    ]

    def named(function: Function) -> Function:
        own = signature(function)
        before = [p for p in own.parameters.values() if p.kind is not Parameter.VAR_KEYWORD]
        vars(function)["__signature__"] = own.replace(parameters=[*before, *options])
        return function

    return named


with_options_named = options_named(CurveOptions)
