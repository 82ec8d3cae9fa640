"""Damping ratios of modes, and on demand friction and stiffness of the contacts, by least squares
on measured responses.

The contacts are in the model: what friction takes is not counted as damping again, as half-power
does on a curve on which contacts slip.
"""

import warnings
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.hbm.balance.problem import AnyProblem, ContactProblem, contact_problem_of
from tipdamp.hbm.balance.receptance import ratios
from tipdamp.hbm.curve.watched import watched
from tipdamp.hbm.errors import Doubt, InputError
from tipdamp.hbm.fitting.minima import Minimum, least
from tipdamp.hbm.fitting.residuals import Residuals, Unknown
from tipdamp.hbm.fitting.result import DampingFit, MeasuredResponse
from tipdamp.hbm.validation import check_settings, check_whole, in_hz

WEAK = np.log(2.0)  # half width of an interval of a factor on the contacts, which is told
STIFFNESS = ("kn", "kt")


def fit_damping(
    problem: AnyProblem,
    force: "ArrayLike",
    measured: Sequence[MeasuredResponse],
    *,
    modes: Sequence[int] | None = None,
    mu: bool = False,
    stiffness: bool = False,
    scatter: bool = False,
    band: tuple[float, float] | None = None,
    omega: tuple[float, float] | None = None,
    harmonics: int = 5,
    start: str | np.ndarray = "zero_slider",
    samples: int | None = None,
    progress: Callable[[float, float, int], None] | bool | None = None,
) -> DampingFit:
    """Damping ratios with which a problem, its contacts included, responds as was measured.

    problem : with the values to start from; its damping_ratio says which are unknown: one for all
        modes, or one for each of the first, the last for all others
    force : (r,) N - of the level 1
    modes : of the stuck system, 1 the lowest, whose ratios alone are unknown
    mu, stiffness : whether a factor on mu, or on kn and kt, of all contacts is unknown, too; each
        is looked for from a third to three times what it starts from, as one fit may end at a
        minimum that is not the least: 7 more solutions of all measured points, and at most two
        more fits
    scatter : whether each measured curve has a factor of its own on its amplitudes and, where the
        stiffness is known, on its frequencies, as from one mounting to the next
    band : Hz, or omega : rad/s, of the measured points that count; default: all
    harmonics, start, samples : as in CurveOptions
    progress : function (hz, step, calls), called at each point of the curves that are followed and
        at each measured one; without one a terminal or a notebook shows a line, and False shows
        nothing

    Raises InputError where no measured point lies in the band, there are not more values than
    unknowns, or the curves do not tell an unknown, which is named.

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01)
    >>> damped = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=4.0)
    >>> curve = damped.force(0, 5.0).follow_band((600, 1000), outputs={"tip": 0})
    >>> run = MeasuredResponse(curve.frequency, abs(curve.harmonics[:, 0, 1]), [1.0], level=5.0)
    >>> from dataclasses import replace
    >>> guess = replace(damped.contact_problem, damping_ratio=0.02)
    >>> print(fit_damping(guess, [1.0], [run], mu=True).values.round(4))
    [0.01 1.  ]
    """
    given = contact_problem_of(problem)
    given.check_plain("fit_damping")
    if given.damping_ratio is None:
        raise InputError("fit_damping: finds damping ratios, the problem has a matrix C")
    if omega is not None:
        band = in_hz("band", band, omega)
    inside = [one if band is None else one.within(*band) for one in measured]
    options = {"harmonics": harmonics, "start": start, "samples": samples}
    unknowns = _unknowns(given, modes, mu, stiffness)
    if scatter:
        unknowns += _scattering(len(inside), () if stiffness else ("frequency",))
    fit = Residuals(given, np.asarray(force), inside, unknowns, options)
    values = sum(one.values for one in inside)
    if values <= len(fit.unknowns):
        raise InputError(
            f"fit_damping: {values} measured values for {len(fit.unknowns)} unknowns "
            f"({', '.join(fit.names)}): more values than unknowns are needed"
        )
    check_settings(None, progress)
    hz = np.concatenate([one.hz for one in inside])
    with watched(progress, hz.min(), hz.max(), " Hz") as told:
        fit.progress = told or False
        best, as_good = least(fit)
    result = _result(fit, best, as_good)
    for doubt in result.doubts:
        warnings.warn(f"fit_damping: {doubt}", Doubt, stacklevel=2)
    return result


def _result(fit: Residuals, best: Minimum, as_good: list[list[float]]) -> DampingFit:
    """What the best fit has found; as_good : logarithms of values of each unknown that fit as
    well."""
    half = fit.half_widths(best.solved)
    low, high = best.theta - half, best.theta + half
    lowest = np.array([min(values, default=np.inf) for values in as_good])
    highest = np.array([max(values, default=-np.inf) for values in as_good])
    wide = (half > WEAK) & [bool(one.settings) for one in fit.unknowns]
    weak = (lowest < low) | (highest > high) | wide
    first = np.array([one.start for one in fit.unknowns])
    found = first * np.exp(best.theta)
    return DampingFit(
        names=fit.names,
        values=found,
        low=first * np.exp(np.minimum(low, lowest)),
        high=first * np.exp(np.maximum(high, highest)),
        start=first,
        measured=tuple(fit.measured),
        computed=tuple(best.solved.computed),
        misfit=tuple(
            _misfit(one, computed)
            for one, computed in zip(fit.measured, best.solved.computed, strict=True)
        ),
        iterations=best.steps,
        converged=best.converged,
        problem=fit.problem_at(best.theta),
        weak=tuple(name for name, one in zip(fit.names, weak, strict=True) if one),
    )


def _misfit(one: MeasuredResponse, computed: np.ndarray) -> float:
    """Root mean square of the difference, weighted as in the fit, over the largest amplitude."""
    weights = np.asarray(one.deviation, dtype=float) ** -2.0
    squared = np.average(np.abs(computed - one.response) ** 2, weights=weights)
    return float(np.sqrt(squared) / np.abs(one.response).max())


def _unknowns(
    problem: ContactProblem, modes: Sequence[int] | None, mu: bool, stiffness: bool
) -> list[Unknown]:
    given = np.atleast_1d(np.asarray(problem.damping_ratio))
    count = len(problem.receptance().ratio)
    every, last = ratios(given, count), len(given) - 1
    for mode in modes or ():
        if check_whole("modes", mode, 1) > count:
            raise InputError(f"modes = {mode}: the stuck system has {count}, the lowest is 1")
    single = [mode - 1 for mode in modes] if modes is not None else range(last)
    groups: dict[str, tuple[int, ...]] = {f"damping ratio of mode {k + 1}": (k,) for k in single}
    if modes is None:
        name = f"damping ratio of modes {last + 1} and up" if last else "damping ratio"
        groups[name] = tuple(range(last, count))
    found = [Unknown(name, float(every[at[0]]), modes=at) for name, at in groups.items()]
    for one in found:
        if not one.start > 0:
            raise InputError(f"fit_damping: {one.name} starts at {one.start:g}, must be above 0")
    found += [Unknown("mu", 1.0, ("mu",))] * mu
    found += [Unknown("stiffness", 1.0, STIFFNESS)] * stiffness
    if not found:
        raise InputError("fit_damping: nothing is unknown: give modes, mu or stiffness")
    return found


def _scattering(curves: int, further: Sequence[str]) -> list[Unknown]:
    """Factors on the amplitude of each measured curve, and on what else scatters."""
    return [
        Unknown(f"{of} of measured curve {k + 1}", 1.0, of=of, curve=k)
        for of in ("amplitude", *further)
        for k in range(curves)
    ]
