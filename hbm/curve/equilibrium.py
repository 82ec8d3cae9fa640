"""Equilibrium of solved points: the equation of motion once more, with the contact law on the motion that is kept.

Newton's method solves the condensed equations, in m, and takes its last step without evaluating again. What is kept of
a point is judged in N, by the plain equation

    r_k = [K - (k w)^2 M + i k w C] q_k + B' f_k(B q) - F_k,        k = 0..H

over its force scale: the larger of the applied forces and of what the contacts add to the state of rest. Each dof has
its own unit, by its stiffness at the frequency of the force. A stiff contact magnifies errors of the motion, and so its
rounding: that bounds the stiffness which double precision can carry.

Newton's method found q as the response to contact forces of its own. So r is by what the forces of the law on q differ
from these, known at every point, and the error of that response, in proportion to q: this is measured, with the full
matrices, at the ends of a curve and at its largest motion.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from hbm import fourier
from hbm.balance.newton import real_times
from hbm.balance.settings import DEFAULT
from hbm.continuation.corrector import damped
from hbm.continuation.point import Plane, Point, size
from hbm.continuation.settings import DEFAULT as SETTINGS
from hbm.curve.energy import EnergyBalance, energies
from hbm.errors import InputError
from hbm.laws.records import ContactForces
from hbm.parameter import Equation
from hbm.problem import ContactProblem
from hbm.result import ForcedResponse

TINY = float(np.finfo(float).tiny)


def settle(equation: Equation, points: list[Point],
           pinned: Iterable[float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(n,) residuals over the force scale of the points and (n,) errors of their energy balance, NaN where one was not
    found, and (n,) bool: out of balance.

    Points above the limit are replaced, in the list, by what further Newton steps make of them, unless rounding of the
    given matrices explains what is left.
    pinned : parameters at which points must stay, exactly
    """
    pinned = set(pinned)
    residuals, errors = force_residuals(equation, points)
    for i in np.flatnonzero(residuals > DEFAULT.equilibrium):
        (residuals[i],), _ = force_residuals(equation, [points[i]])
        if residuals[i] <= _limit(equation, points[i]):
            continue
        steps = _more_steps(equation, points[i], points[i].parameter in pinned)
        for new in steps if residuals[i] > DEFAULT.equilibrium else ():
            (residual,), energy = force_residuals(equation, [new])
            if residual < residuals[i]:
                residuals[i], errors[i], points[i] = residual, energy[0], new
            if residual <= DEFAULT.equilibrium:
                break
    bad = residuals > DEFAULT.equilibrium
    bad[bad] = [residuals[i] > _limit(equation, points[i]) for i in np.flatnonzero(bad)]
    return residuals, errors, bad


def _limit(equation, point):
    """Residual over the force scale that a point may have: where the terms of the equation of motion themselves are not
    known better, as of elements of very uneven stiffness, their rounding comes on top."""
    kept = Kept(equation, point)
    return DEFAULT.equilibrium + min(kept.rounding() / max(kept.scale(), TINY), DEFAULT.most_rounding)


def force_residuals(equation: Equation, points: list[Point]) -> tuple[np.ndarray, np.ndarray]:
    """(n,) residual of the equation of motion over the force scale and (n,) error of the energy balance of each
    point; NaN where one was not found."""
    found, energy = np.full((2, len(points)), np.nan)
    kept = {i: Kept(equation, point) for i, point in enumerate(points) if point.converged}
    motion = {i: float(np.linalg.norm(one.modal)) for i, one in kept.items()}
    measured = {min(kept), max(kept), max(motion, key=motion.__getitem__)} if kept else set()
    share = np.max([kept[i].response_error() / max(motion[i], TINY) for i in measured], initial=0.0)
    for i, one in kept.items():
        error, scale = one.contact_error() + share * motion[i], one.scale()
        found[i], energy[i] = error / scale if scale > 0 else float(error > 0), one.energy().error
    return found, energy


class Kept:
    """What is kept of a point: modal (m, H+1) and its u (P, nd, nh) m, and the contact forces of Newton's method.

    h (P, nd, nh) N : these forces, less those at rest
    """

    def __init__(self, equation: Equation, point: Point):
        detail, parameter, whole = point.detail, equation.parameter, equation.balance
        there, self.forces = parameter.rebuild(whole.problem, whole.forces, point.parameter / parameter.scale)
        self.balance, self.modal, self.g = detail.balance, detail.modal, detail.forces.g
        self.problem, self.w = self.balance.problem, parameter.angular_frequency(2 * np.pi * equation.hz,
                                                                                 point.parameter)
        self.contacts = None if there is self.problem else there.contacts
        own, u = self.problem.contacts, fourier.to_real(real_times(self.balance.shapes, self.modal))
        self.u = np.ascontiguousarray(u.reshape(self.g.shape))
        self.h = self.g + self.problem.law.stuck_stiffness(own)[:, :, None] * self.u
        self.unit = _units(self.problem, self.w)

    def contact_error(self) -> float:
        """Norm of the difference between the forces of the law on the motion and those of Newton's method."""
        return _norm(self.unit, self._at_dofs(self.of_law.g - self.g))

    @cached_property
    def of_law(self) -> ContactForces:
        """Forces of the law on the motion."""
        return self.balance.contact_forces(self.u, self.w, self.contacts)

    def energy(self) -> EnergyBalance:
        """Of a period."""
        return energies(self.balance, self.forces, self.w, self.modal, (self.u, self.of_law))

    def response_error(self) -> float:
        """Norm of the residual of the equation of motion under the forces of Newton's method."""
        problem, kw = self.problem, self.w * np.arange(self.balance.H + 1)
        q = self.motion()
        inner = real_times(problem.stiffness, q) - real_times(problem.M, q * kw**2) + 1j * kw * self.damping_force(q)
        for one, reaction in zip(problem.held, self.balance.reaction_rows @ self.modal[:, 0].real, strict=True):
            if one.mean:
                inner[:, 0] += one.row * reaction
        return _norm(self.unit, inner + self._at_dofs(self.h) - self.applied())

    def rounding(self) -> float:
        """Norm of what K q and M q may be off by rounding alone."""
        kw, q = self.w * np.arange(self.balance.H + 1), np.abs(self.motion())
        terms = real_times(abs(self.problem.stiffness), q) + real_times(abs(self.problem.M), q * kw**2)
        return DEFAULT.terms * np.finfo(float).eps * _norm(self.unit, terms)

    def scale(self) -> float:
        """Norm of the applied forces, or of the contact forces if that is larger."""
        return max(_norm(self.unit, self.applied()), _norm(self.unit, self._at_dofs(self.h)))

    def motion(self) -> np.ndarray:
        """(r, H+1) q, m."""
        return real_times(self.balance.receptance.shapes, self.modal)

    def _at_dofs(self, force):
        """(r, H+1) B' of forces (P, nd, nh)."""
        return real_times(self.problem.B.T, fourier.to_complex(force.reshape(-1, self.balance.nh)))

    def applied(self):
        """(r, H+1) N, the forces on the dofs, constant ones included."""
        force = np.zeros((len(self.unit), self.balance.H + 1), dtype=complex)
        for k, F in self.forces.items():
            force[:, k] = F
        if self.problem.static is not None:
            force[:, 0] += self.problem.static
        return force

    def damping_force(self, q):
        """(r, H+1) C q; with damping ratios that of the modes."""
        problem, of = self.problem, self.balance.receptance
        if problem.damping_ratio is None:
            return real_times(problem.C, q)
        y = (2 * of.ratio * np.sqrt(of.mass * of.stiffness))[:, None] * self.modal[:len(of.mass)]
        # K phi = (k/m) M phi has no rounding of stiff springs; it does not hold for massless motions, nor mode by mode
        # where these stand for many more
        heavy = (of.mass > DEFAULT.light * of.mass.max()) & (of.shapes.shape[1] >= len(q))
        force = real_times(problem.M, real_times(of.modes[:, heavy], y[heavy] / of.mass[heavy, None]))
        if heavy.all():
            return force
        light = real_times(of.modes[:, ~heavy], y[~heavy] / of.stiffness[~heavy, None])
        return force + real_times(problem.stuck_stiffness, light)


def _units(problem, w):
    """(r,) unit of force at each dof, by its stiffness at w rad/s without contact."""
    stiffness = np.abs(problem.K.diagonal()) + w**2 * problem.M.diagonal()
    return np.sqrt(np.maximum(stiffness, 1e-30 * stiffness.max()))


def _norm(unit, force):
    """Of forces (r, n) in their units; the largest entry is taken out, so that nothing under- or overflows."""
    scaled = force / unit[:, None]
    largest = float(np.abs(scaled).max())
    return float(largest * np.linalg.norm(scaled / largest)) if largest > 0 else 0.0


def _more_steps(equation, point, pinned) -> Iterator[Point]:
    """The point after further Newton steps: at its parameter, then across the branch where it is not pinned there."""
    begin = Plane(point.x, point.parameter, np.zeros(len(point.x)), 1.0)
    planes = [begin]
    if point.tangent is not None and not pinned:
        planes.append(begin._replace(row=point.tangent[0] / max(size(point.tangent[0]), TINY), corner=0.0))
    for x, p, row, corner in planes:
        e = equation.evaluate(x, p)
        for _ in range(DEFAULT.more_steps):
            dx, dp = e.solve(row, corner, 0.0)
            x, p = x + dx, p + dp
            if not (np.isfinite(x).all() and np.isfinite(p)):
                break
            e = equation.evaluate(x, p)
            yield replace(point, x=x, parameter=p, detail=e)
    # at a kink the full steps lead to and fro
    strict = replace(SETTINGS, tolerance=SETTINGS.patient_residual)
    new = damped(equation.evaluate, planes[-1], equation.weights, strict, SETTINGS.patient_calls)
    if new.converged:
        yield replace(point, x=new.x, parameter=new.parameter, detail=new.detail)


def with_residuals(curve: ForcedResponse, residuals: np.ndarray, bad: np.ndarray, equation: Equation,
                   points: list[Point]) -> ForcedResponse:
    """The curve with its residuals (n,); points that are out of balance, bad (n,), have failed: it says where and why,
    and where rounding of the matrices stays above the limit."""
    rounded = residuals[~bad] > DEFAULT.equilibrium
    if rounded.any():
        curve = replace(curve, ended=f"{curve.ended}; at {rounded.sum()} points the forces balance to "
                        f"{residuals[~bad][rounded].max():.0e} of their scale, the rounding of the given matrices")
    if not bad.any():
        return replace(curve, force_residual=residuals)
    worst = int(np.nanargmax(np.where(bad, residuals, 0.0)))
    at = Kept(equation, points[worst])
    problem = at.problem if at.contacts is None else at.problem.with_contacts(at.contacts)
    reason = _too_stiff(problem, at.forces, at.w, at.motion(), DEFAULT.equilibrium)
    ended = (f"{curve.ended}; {bad.sum()} point{'s' * int(bad.sum() > 1)} left out, as the forces do not balance to "
             f"{DEFAULT.equilibrium:g} of their scale: worst {residuals[worst]:.1e}, at "
             f"{equation.parameter.named(curve.parameter[worst])}; {reason or 'try other harmonics there'}")
    return replace(
        curve, force_residual=_blank(residuals, bad), energy_error=_blank(curve.energy_error, bad), complete=False,
        ended=ended, converged=curve.converged & ~bad, harmonics=_blank(curve.harmonics, bad),
        share_stick=_blank(curve.share_stick, bad),
        share_slip=_blank(curve.share_slip, bad), share_open=_blank(curve.share_open, bad),
        dissipated=_blank(curve.dissipated, bad), contact_force=_blank(curve.contact_force, bad),
        unknowns=_blank(curve.unknowns, bad), reaction=_blank(curve.reaction, bad),
        peak_points=curve.peak_points & ~bad[:len(curve.peak_points), None])


def _blank(column, bad):
    """A column of a curve with NaN at points; as it is where it is empty."""
    return np.where(bad.reshape(-1, *[1] * (column.ndim - 1)), np.nan, column) if column.size else column


def check_carried(problem: ContactProblem, forces: dict, w: float) -> None:
    """InputError where a contact is so stiff that rounding alone puts the response at w rad/s out of equilibrium."""
    springs, B = problem.law.stuck_stiffness(problem.contacts).ravel(), sp.csr_matrix(problem.B)
    most = DEFAULT.stiff * np.abs(problem.K.diagonal()).max()
    if (B.multiply(B).T @ springs).max(initial=0.0) <= most:
        return
    # rigid beside the bodies, but not so stiff that these are lost beside it
    soft = np.minimum(springs, most / max(abs(B).max(), 1e-300)**2)
    stiffness = problem.K + w**2 * problem.M + (B.T @ B.multiply(soft[:, None])).toarray()
    try:
        q = np.linalg.solve(stiffness, np.array(list(forces.values())).T)
    except np.linalg.LinAlgError:               # a motion without mass is free: named with the stuck system
        return
    if message := _too_stiff(problem, forces, w, q, DEFAULT.equilibrium / DEFAULT.resonance):
        raise InputError(message)


def _too_stiff(problem, forces, w, q, allowed):
    """A sentence on the stiffest contact where rounding of the motion q (r, n) is more than allowed; else empty."""
    springs, B = problem.law.stuck_stiffness(problem.contacts).ravel(), abs(sp.csr_matrix(problem.B))
    unit, rounding = _units(problem, w), np.finfo(float).eps * springs[:, None] * (B @ np.abs(q))
    scale = _norm(unit, np.array(list(forces.values())).T)
    if not (share := _norm(unit, B.T @ rounding)) > allowed * scale:
        return ""
    worst, names = int(np.linalg.norm(rounding, axis=1).argmax()), problem.law.components
    return (f"contact {worst // len(names) + 1}: a stiffness of {springs[worst]:.3g} N/m along "
            f"{names[worst % len(names)]} is more than double precision can carry, rounding of the motion is "
            f"{share / scale:.1e} of the force: at most {springs[worst] * allowed * scale / share:.1g} N/m, which is "
            "all but rigid beside the bodies")
