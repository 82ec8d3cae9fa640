"""The checked input of a curve or of a single solution, before the first thing that takes time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from tipdamp.hbm.balance.differences import check_derivatives
from tipdamp.hbm.balance.equation import Equation
from tipdamp.hbm.balance.parameter import Frequency
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.curve.journal import Journal
from tipdamp.hbm.curve.options import CurveOptions
from tipdamp.hbm.curve.recorded import RecordedBalance
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.memory import check_harmonics_fit
from tipdamp.hbm.validation import (
    MOST_HARMONICS,
    check_forcing,
    check_groups,
    check_harmonics,
    check_kind,
    check_outputs,
    check_settings,
    check_whole,
)

Forcing = np.ndarray | Mapping[int, np.ndarray]  # (r,) N of order 1, or {order: (r,)}


def forcing_of(
    own: Mapping[int, np.ndarray], whole: ContactProblem, given: Forcing | None
) -> Forcing:
    """The forces that are given, or a problem's own; InputError where it has none."""
    if given is not None:
        return given
    varying = whole.varying.forces if whole.varying else ()
    if not own and not varying:
        raise InputError("no excitation: force(where, amplitude) of a Problem, or give a forcing")
    none = {k: np.zeros(len(whole.K), dtype=complex) for k, *_ in varying}
    return {**none, **own}


@dataclass(frozen=True)
class CheckedInput:
    """The checked input of a curve: H, forces {harmonic: (r,)}, names and rows (m, r) of the
    outputs, groups of their columns (`peaks`), settings."""

    H: int
    forces: dict
    names: list
    rows: np.ndarray
    groups: list
    settings: Settings

    @classmethod
    def checked(
        cls, problem: ContactProblem, forcing: Forcing, options: CurveOptions
    ) -> CheckedInput:
        """The checked input of a problem; InputError where it is of no use."""
        r = problem.K.shape[0]
        H = check_harmonics(options.harmonics)
        periods = check_whole("periods", options.periods, 1)
        forces = {periods * k: F for k, F in check_forcing(forcing, r, MOST_HARMONICS).items()}
        if problem.varying is not None:
            none = {k: np.zeros(r, dtype=complex) for k in problem.varying.orders(periods)}
            forces = dict(sorted({**none, **forces}.items()))
        if max(forces, default=0) > H:
            raise InputError(_too_few_harmonics(H, periods, max(forces) // periods))
        if options.journal is not None:
            check_kind("journal", options.journal, Journal, "Journal(keep, blocks)")
        names, rows = check_outputs(options.outputs, r)
        groups = check_groups(options.peaks, names)
        return cls(
            H, forces, names, rows, groups, check_settings(options.settings, options.progress)
        )

    def balance(self, problem: ContactProblem, options: CurveOptions, w: float) -> HarmonicBalance:
        """The harmonic balance: the first thing that takes time. The derivatives of a law of one's
        own are checked, on the stuck response at w rad/s."""
        start = "zero_slider" if options.start is None else options.start
        arguments = problem, self.forces, self.H, start, options.samples
        check_harmonics_fit(len(problem.contacts), len(problem.law.components), self.H)
        made = (
            RecordedBalance(options.journal, *arguments)
            if options.journal
            else HarmonicBalance(*arguments)
        )
        if not problem.law.tested:
            there = Equation(made, Frequency().over(options.periods)).balance_at(w)[0]
            x = there.linear(w).reshape(len(problem.contacts), made.nd, made.nh)
            check_derivatives(problem.law, problem.contacts, x, w)
        return made


def _too_few_harmonics(H: int, periods: int, order: int) -> str:
    if periods == 1:
        return f"forcing of harmonic {order}: harmonics = {H} keeps orders 0..{H} only"
    return (
        f"harmonics = {H}: are counted in the frequency of a motion of {periods} periods, in which "
        f"the excitation of order {order} stands at {periods * order}: at least that many"
    )


def at_hz(
    problem: ContactProblem, case: CheckedInput, hz: float, periods: int
) -> tuple[ContactProblem, CheckedInput]:
    """(problem, checked input) with what varies with the frequency at that one."""
    if problem.varying is None:
        return problem, case
    problem.varying.check_frequency(hz)
    there, forces = Frequency().over(periods).rebuild(problem, case.forces, hz)
    return there, replace(case, forces=forces)
