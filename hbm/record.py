"""From a branch to a ForcedResponse: its points as arrays, and its end in words."""

from dataclasses import dataclass

import numpy as np

from hbm import fourier
from hbm.balance.receptance import mostly
from hbm.result import ForcedResponse, widest_gap


def harmonics(branch, recover) -> np.ndarray:
    """(n, m, H+1) complex harmonics of the outputs along a branch; NaN where a point failed."""
    orders = next((p.detail.modal.shape[1] for p in branch.points if p.converged), 1)
    X = np.full((len(branch.points), len(recover), orders), np.nan, dtype=complex)
    for i, point in enumerate(branch.points):
        if point.converged:
            X[i] = recover @ point.detail.modal
    return X


@dataclass(frozen=True)
class Parameter:
    """What a branch is followed in: `name` as in ForcedResponse, and how many of the branch's units make one of it."""

    name: str = "frequency"
    scale: float = 2 * np.pi
    hz: float | None = None           # the frequency of a branch over another parameter

    def named(self, value) -> str:
        """A value in the units of the branch, for messages."""
        return f"{value / self.scale:.6g} Hz" if self.hz is None else f"{self.name} = {value:.6g}"


def record(branch, balance, recover, names, problem, start, parameter, seconds):
    """ForcedResponse of a branch."""
    n, P = len(branch.points), len(problem.pairs)
    X = np.full((n, len(names), balance.H + 1), np.nan, dtype=complex)
    X[:] = harmonics(branch, recover)
    shares, work = np.full((n, P, 3), np.nan), np.full((n, P), np.nan)
    for i, point in enumerate(branch.points):
        if point.converged:
            shares[i] = point.detail.bracket.shares
            # of all components: springs give nothing, and which of them rub is the law's affair
            work[i] = fourier.work(point.detail.bracket.g, point.x.reshape(-1, balance.nd, balance.nh))
    values = np.array([p.parameter for p in branch.points]) / parameter.scale
    return ForcedResponse(
        frequency=values if parameter.hz is None else np.full(n, float(parameter.hz)),
        parameter_name=parameter.name, parameter=values, output_names=np.array(names, dtype=str),
        harmonics=X, share_stick=shares[..., 0], share_slip=shares[..., 1], share_open=shares[..., 2],
        dissipated=work, converged=np.array([p.converged for p in branch.points]),
        iterations=np.array([p.iterations for p in branch.points]), ended=explain(branch, problem, parameter),
        complete=bool(branch.complete and all(p.converged for p in branch.points)), H=balance.H,
        origin="preloaded" if problem.preloaded else "unloaded", start=start if isinstance(start, str) else "given",
        seconds=seconds, residual_calls=branch.calls, leaps=np.reshape(branch.leaps, (-1, 2)) / parameter.scale)


def contact_harmonics(branch, balance):
    """{field: (n, P, nd, H+1) complex} of the contact forces and motions along a branch; NaN where a point failed."""
    shape = (len(branch.points), len(balance.problem.pairs), balance.nd, balance.H + 1)
    force, motion = np.full(shape, np.nan, dtype=complex), np.full(shape, np.nan, dtype=complex)
    for i, point in enumerate(branch.points):
        if point.converged:
            force[i], motion[i] = point.detail.contact()
    return {"contact_force": force, "contact_motion": motion}


def explain(branch, problem, parameter) -> str:
    """Why the curve ends, where points failed or the branch was left, and the motion that no force holds."""
    ended, named = branch.sentence(parameter.named), parameter.named
    good, failed = ([p for p in branch.points if p.converged == wanted] for wanted in (True, False))
    if not good:
        return ended
    if branch.outside is not None and branch.complete:
        ended += f"; it left the band where it begins and was followed outside, to {named(branch.outside)}, and back"
    if branch.leaps:
        places = ", ".join(f"{named(a)} to {named(b)}" for a, b in branch.leaps)
        values, solved = ([getattr(p, name) for p in branch.points] for name in ("parameter", "converged"))
        gap = widest_gap(values, solved, branch.leaps)
        ended += (f"; not one branch: it folds on and on, was left, and taken up further on: {places}; solved points "
                  f"there are up to {gap / parameter.scale:.3g}{' Hz' * (parameter.hz is None)} apart (more damping, "
                  "or more or fewer harmonics, may give one)")
    if failed and branch.complete:
        ended += (f"; {len(failed)} point{'s' * (len(failed) > 1)} failed near {named(failed[0].parameter)}: "
                  "run the other direction, or other harmonics, there")
    return ended if branch.complete else ended + _what_nothing_holds(good[-1], problem)


def _what_nothing_holds(last, problem) -> str:
    """The mean motion in which the Jacobian is singular at the last point, in words; empty where there is none."""
    value, q = last.detail.smallest_motion()
    if q is None or value >= 1e-4 or np.abs(q[:, 0]).max() <= 0.9 * np.abs(q).max():
        return ""
    motion = q[:, 0].real
    named = problem.describe(motion) if problem.describe else None
    verb = "the damper rolls" if named and named.turns else "a mean motion is held by nothing"
    return (f"; {verb} ({named or mostly(motion)}): no periodic state exists there, give that motion a stiffness that "
            "holds it")
