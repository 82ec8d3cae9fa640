"""Equilibrium of solved points: the equation of motion once more, with the contact law on the
motion that is kept.

Newton's method solves the condensed equations, in m, and takes its last step without evaluating
again. What is kept of a point is judged in N, by the plain equation

    r_k = [K - (k w)^2 M + i k w C] q_k + B' f_k(B q) - F_k,        k = 0..H

over its force scale: the larger of the applied forces and of what the contacts add to the state of
rest, of the orders k > 0 without the constant parts. Each dof has its own unit, by its stiffness at
the frequency of the force. A stiff contact magnifies errors of the motion, and so its rounding:
that bounds the stiffness which double precision can carry.

Newton's method found q as the response to contact forces of its own. So r is by what the forces of
the law on q differ from these, known at every point, and the error of that response, in proportion
to q: this is measured, with the full matrices, at the ends of a curve and at its largest motion.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp

from tipdamp.hbm import fourier
from tipdamp.hbm.balance.equation import Equation
from tipdamp.hbm.balance.kernels import norms
from tipdamp.hbm.balance.newton import real_times
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.balance.settings import DEFAULT
from tipdamp.hbm.continuation.corrector import damped
from tipdamp.hbm.continuation.point import Plane, Point, size
from tipdamp.hbm.continuation.settings import DEFAULT as SETTINGS
from tipdamp.hbm.curve.energy import EnergyBalance, energies, excitation
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws.records import ContactForces
from tipdamp.hbm.result import ForcedResponse

TINY = float(np.finfo(float).tiny)
OF_SOLVED_POINTS = (
    "harmonics",
    "share_stick",
    "share_slip",
    "share_open",
    "dissipated",
    "contact_force",
    "unknowns",
    "reaction",
)
BLOCK = 20_000  # rows of a sparse matrix that are multiplied at once in extended precision


def settle(
    equation: Equation, points: list[Point], pinned: Iterable[float]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(n,) residuals over the force scale of the points and (n,) errors of their energy balance,
    NaN where one was not found, and (n,) bool: out of balance.

    Points above the limit are replaced, in the list, by what further Newton steps make of them,
    unless rounding of the given matrices explains what is left.
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
    bad[bad] = [
        residuals[i] > _limit(equation, points[i], 1.0)
        or doubt(equation, points[i]) > DEFAULT.most_doubt
        for i in np.flatnonzero(bad)
    ]
    if 2 * bad.sum() > np.isfinite(residuals).sum():  # that few of many balance is luck
        bad |= residuals > DEFAULT.equilibrium
    return residuals, errors, bad


def _limit(equation: Equation, point: Point, springs: float = 0.0) -> float:
    """Residual over the force scale that a point may have: the terms of the equation of motion
    themselves are not known better than their rounding, which is large beside their sum where
    elements are small.

    springs : share of the rounding of the motion of stiff contacts that comes on top as well, once
        further steps are of no help; none of it where it exceeds the limit, as there the stiffness
        is said to be too large
    """
    kept = KeptPoints(equation, [point])
    terms, motion = (
        float(kept.over_scale(error)[0]) for error in (kept.rounding(), kept.rounding_of_springs())
    )
    motion = springs * motion if motion <= DEFAULT.equilibrium else 0.0
    return DEFAULT.equilibrium + terms + motion


def doubt(equation: Equation, point: Point) -> float:
    """Share of the vibration of a point by which it is off its branch: what is left of the equation
    of motion in extended precision, where the rounding of its large terms does not hide it, and
    what the mean contact forces may be off by, answered by the linearised equations."""
    kept = KeptPoints(equation, [point])
    detail = point.detail
    balance = point.detail.balance
    shapes = balance.receptance.shapes
    orders = np.arange(balance.H + 1)
    phase = np.exp(2j * np.pi * np.random.default_rng(0).random((len(shapes), len(orders))))
    forces = kept.defect() + phase * kept.rounding_of_mean()[0]
    moved = balance.receptance.factors(kept.w[0] * orders)[0] * (balance.receptance.into.T @ forces)
    row, corner = _across(point)
    step = detail.solve(row, corner, 0.0, -fourier.to_real(balance.shapes @ moved).ravel())
    moved = moved + detail.moved(*step).modal - detail.modal
    change, whole = (norms((shapes @ y)[None], 1 / kept.unit)[0, 1] for y in (moved, detail.modal))
    return float(change / max(whole, TINY))


def _across(point: Point) -> tuple[np.ndarray, float]:
    """Row and corner of a border that leads across the branch; at its parameter where that has no
    tangent."""
    if point.tangent is None or not np.any(point.tangent[0]):
        return np.zeros(len(point.x)), 1.0
    along, rate = point.tangent
    return along / size(along) ** 2, rate / point.parameter**2


def force_residuals(equation: Equation, points: list[Point]) -> tuple[np.ndarray, np.ndarray]:
    """(n,) residual of the equation of motion over the force scale and (n,) error of the energy
    balance of each point; NaN where one was not found."""
    found, energy = np.full((2, len(points)), np.nan)
    solved = [i for i, point in enumerate(points) if point.converged]
    if not solved:
        return found, energy
    motion = np.concatenate([_parts(points[i].detail.modal[None]) for i in solved])
    share = np.zeros(2)
    last = len(solved) - 1
    for k in {0, last, int(motion[:, 1].argmax())}:
        error = KeptPoints(equation, [points[solved[k]]]).response_error()[0]
        share = np.maximum(share, error / np.maximum(motion[k], TINY))
    # one after the other: all at once need memory
    for run in _alike(points, solved, equation.balance):
        kept = KeptPoints(equation, [points[i] for i in run])
        found[run] = kept.over_scale(kept.contact_error() + share * _parts(kept.modal))
        energy[run] = [one.error for one in kept.energies()]
    return found, energy


def _alike(
    points: Sequence[Point], chosen: Sequence[int], balance: HarmonicBalance
) -> list[list[int]]:
    """Indices of points, in runs of one balance and no more of them than fit into memory at
    once."""
    P = len(balance.problem.contacts)
    r = len(balance.problem.K)
    most = max(1, DEFAULT.kept_at_once // max(P * (balance.nd * balance.nh) ** 2, r * balance.nh))
    runs = [[chosen[0]]]
    for i in chosen[1:]:
        same = points[i].detail.balance is points[runs[-1][0]].detail.balance
        if same and len(runs[-1]) < most:
            runs[-1].append(i)
        else:
            runs.append([i])
    return runs


class KeptPoints:
    """What is kept of n points of one balance: modal (n, m, H+1) and its u (n, P, nd, nh) m, and
    the contact forces of Newton's method.

    w : (n,) rad/s; forces : {harmonic: (r,)} of each; contacts : settings of each, those of the
    problem or others
    h (n, P, nd, nh) N : the contact forces, less those at rest
    sticks (n, P) : whether a contact sticks throughout the cycle
    """

    def __init__(self, equation: Equation, points: list[Point]) -> None:
        parameter = equation.parameter
        whole = equation.balance
        there = [
            parameter.rebuild(whole.problem, whole.forces, point.parameter / parameter.scale)
            for point in points
        ]
        self.forces = [forces for _, forces in there]
        self.contacts = [problem.contacts for problem, _ in there]
        self.balance = points[0].detail.balance
        self.problem = self.balance.problem
        self.modal = np.array([point.detail.modal for point in points])
        self.g = np.array([point.detail.forces.g for point in points])
        self.sticks = np.array([point.detail.forces.shares[:, 0] == 1 for point in points])
        self.w = np.array(
            [parameter.angular_frequency(equation.w, point.parameter) for point in points]
        )
        u = fourier.to_real(_times(self.balance.shapes, self.modal))
        self.u = np.ascontiguousarray(u.reshape(self.g.shape))
        self.h = self.g + self.balance.springs[:, :, None] * self.u
        self.unit = _units(self.problem, self.w)

    def contact_error(self) -> np.ndarray:
        """(n, 2) size of the difference between the forces of the law on the motion and those of
        Newton's method."""
        return self._size(self._at_dofs(self.of_law[0] - self.g))

    def energies(self) -> list[EnergyBalance]:
        """Of a period of each point."""
        different = {id(forces): forces for forces in self.forces}
        made = {key: excitation(self.balance, forces) for key, forces in different.items()}
        excited = [made[id(forces)] for forces in self.forces]
        return energies(self.balance, excited, self.w, self.modal, self.of_law[1])

    @cached_property
    def of_law(self) -> tuple[np.ndarray, np.ndarray]:
        """Forces of the law on the motion, (n, P, nd, nh) N as `g`, and (n, P) J their work: of all
        points at once, where the law does not depend on the frequency."""
        forces_of = self.balance.contact_forces
        first = forces_of(self.u[0], self.w[0], self.contacts[0])
        if first.by_omega is not None:
            found = [first, *map(forces_of, self.u[1:], self.w[1:], self.contacts[1:])]
            return np.array([one.g for one in found]), np.array(list(map(_work, found, self.u)))
        g = first.g[None]
        work = _work(first, self.u[0])[None]
        if len(self.w) == 1:
            return g, work
        of = self.contacts[1:]
        own = self.balance.own
        u = self.u[1:].reshape(-1, *self.u.shape[2:])
        rest = [
            own.rest if contacts is self.problem.contacts else self.problem.rest_force(contacts)
            for contacts in of
        ]
        others = own.repeated(of, rest).forces(u, self.w[0])
        return (
            np.r_[g, others.g.reshape(len(of), *g.shape[1:])],
            np.r_[work, _work(others, u).reshape(len(of), -1)],
        )

    def response_error(self) -> np.ndarray:
        """(n, 2) size of the residual of the equation of motion under the forces of Newton's
        method."""
        problem = self.problem
        q = self.motion()
        stiff = _times(problem.stiffness, q)
        heavy = _times(problem.M, q * self._orders() ** 2)
        return self._size(stiff - heavy + self._other_forces(q))

    def defect(self) -> np.ndarray:
        """(r, H+1) N, the residual of the first point under the forces of the law, its largest
        terms summed in extended precision."""
        problem = self.problem
        q = self.motion()[:1]
        stiff = _extended(problem.stiffness, q[0])
        heavy = _extended(problem.M, q[0]) * (self._orders()[0].astype(np.longdouble) ** 2)
        changed = self._at_dofs(self.of_law[0][:1] - self.g[:1])[0]
        return (stiff - heavy + self._other_forces(q)[0] + changed).astype(complex)

    def _other_forces(self, q: np.ndarray) -> np.ndarray:
        """(n, r, H+1) of damping, holds and contacts, less what is applied."""
        problem = self.problem
        inner = 1j * self._orders() * self.damping_force(q)
        if problem.structural is not None:
            inner += _times(1j * problem.structural, q) * (self._orders() != 0)
        reactions = self.modal[:, :, 0].real @ self.balance.reaction_rows.T
        for one, reaction in zip(problem.held, reactions.T, strict=True):
            if one.mean:
                inner[:, :, 0] += reaction[:, None] * one.row
        return inner + self._at_dofs(self.h) - self.applied()

    def rounding(self) -> np.ndarray:
        """(n, 2) size of what K q and M q may be off by rounding alone, and orders k > 0 by that of
        the mean contact forces, with which a sampled cycle mixes them."""
        q = np.abs(self.motion())
        terms = _times(abs(self.problem.stiffness), q)
        terms = terms + _times(abs(self.problem.M), q * self._orders() ** 2)
        forces = np.hypot(DEFAULT.terms * np.finfo(float).eps * terms, self.rounding_of_mean())
        return self._size(forces)

    def rounding_of_mean(self) -> np.ndarray:
        """(n, r, H+1) N, what orders k > 0 may be off by that of the mean contact forces."""
        at = np.abs(self._at_dofs(self.h))
        share = np.full(at.shape[2], 1 / np.sqrt(max(at.shape[2] - 1, 1)))
        share[0] = 0.0
        return DEFAULT.terms * np.finfo(float).eps * at[:, :, :1] * share

    def rounding_of_springs(self) -> np.ndarray:
        """(n, 2) size of the contact forces that one rounding of the motion makes."""
        made = self.balance.springs[:, :, None] * np.abs(fourier.to_complex(self.u))
        made = made.reshape(len(made), -1, made.shape[-1])
        return np.finfo(float).eps * self._size(_times(abs(self.problem.B.T), made))

    def over_scale(self, error: np.ndarray) -> np.ndarray:
        """(n,) errors (n, 2) over the force scale: the applied forces, or the contact forces if
        these are larger. What vibrates is held against what vibrates alone: static forces, however
        large, say nothing of it."""
        applied = self._size(self.applied())
        scale = np.maximum(applied, self._size(self._at_dofs(self.h)))
        scale[:, 0] = np.hypot(*scale.T)
        scale[applied[:, 1] == 0, 1] = scale[applied[:, 1] == 0, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.linalg.norm(np.where(scale > 0, error / scale, error != 0), axis=1)  # NaN: 1

    def motion(self) -> np.ndarray:
        """(n, r, H+1) q, m."""
        return _times(self.balance.receptance.shapes, self.modal)

    def _orders(self) -> np.ndarray:
        """(n, 1, H+1) rad/s of every order."""
        return self.w[:, None, None] * np.arange(self.balance.H + 1)

    def _at_dofs(self, force: np.ndarray) -> np.ndarray:
        """(n, r, H+1) B' of forces (n, P, nd, nh)."""
        return _times(
            self.problem.B.T, fourier.to_complex(force.reshape(len(force), -1, self.balance.nh))
        )

    def _size(self, force: np.ndarray) -> np.ndarray:
        return norms(force, self.unit)

    def applied(self) -> np.ndarray:
        """(n, r, H+1) N, the forces on the dofs, constant ones included."""
        different = {id(forces): forces for forces in self.forces}
        made = {key: self._applied(forces) for key, forces in different.items()}
        if len(made) == 1:
            (alone,) = made.values()
            return np.broadcast_to(alone, (*self.unit.shape, self.balance.H + 1))
        return np.array([made[id(forces)] for forces in self.forces])

    def _applied(self, forces: dict[int, np.ndarray]) -> np.ndarray:
        found = np.zeros((self.unit.shape[1], self.balance.H + 1), dtype=complex)
        for k, F in forces.items():
            found[:, k] = F
        if self.problem.static is not None:
            found[:, 0] += self.problem.static
        return found

    def damping_force(self, q: np.ndarray) -> np.ndarray:
        """(n, r, H+1) C q; with damping ratios that of the modes."""
        problem = self.problem
        of = self.balance.receptance
        if problem.damping_ratio is None:
            return _times(problem.C, q)
        y = (2 * of.ratio * np.sqrt(of.mass * of.stiffness))[:, None] * self.modal[
            :, : len(of.mass)
        ]
        # K phi = (k/m) M phi has no rounding of stiff springs; it does not hold for massless
        # motions, nor mode by mode where these stand for many more
        heavy = (of.mass > DEFAULT.light * of.mass.max()) & (of.shapes.shape[1] >= q.shape[1])
        force = _times(problem.M, _times(of.modes[:, heavy], y[:, heavy] / of.mass[heavy, None]))
        if heavy.all():
            return force
        light = _times(of.modes[:, ~heavy], y[:, ~heavy] / of.stiffness[~heavy, None])
        return force + _times(problem.stuck_stiffness, light)


def _work(forces: ContactForces, u: np.ndarray) -> np.ndarray:
    """(P,) J of contact forces in a period, along the slip where the law tells it, else along the
    motion u."""
    return fourier.work(forces.g, u) if forces.work is None else forces.work


def _times(A: sp.spmatrix | np.ndarray, X: np.ndarray) -> np.ndarray:
    """(n, k, H+1) products of a real or complex, dense or sparse matrix (k, m) with X (n, m, H+1),
    in one go."""
    n, m, orders = X.shape
    product = real_times(A, X.transpose(1, 0, 2).reshape(m, n * orders))
    return product.reshape(A.shape[0], n, orders).transpose(1, 0, 2)


def _extended(A: Any, X: np.ndarray) -> np.ndarray:
    """(k, o) product of a dense or sparse matrix (k, m) with X (m, o) in the longest floats of the
    machine, in blocks of rows."""
    X = X.astype(np.clongdouble)
    if not sp.issparse(A):
        return np.asarray(A).astype(np.longdouble) @ X
    A = A.tocsr()
    found = np.zeros((A.shape[0], X.shape[1]), dtype=np.clongdouble)
    for first in range(0, A.shape[0], BLOCK):
        block = A[first : first + BLOCK].tocoo()
        terms = block.data.astype(np.longdouble)[:, None] * X[block.col]
        np.add.at(found, first + block.row, terms)
    return found


def _units(problem: ContactProblem, w: np.ndarray) -> np.ndarray:
    """(n, r) unit of force at each dof, by its stiffness at w (n,) rad/s without contact."""
    stiffness = np.abs(problem.K.diagonal()) + w[:, None] ** 2 * problem.M.diagonal()
    return np.sqrt(np.maximum(stiffness, 1e-30 * stiffness.max(axis=1, keepdims=True)))


def _parts(X: np.ndarray) -> np.ndarray:
    """(n, 2) norms of order 0 and of the others, of (n, r, H+1)."""
    return norms(X, np.ones(X.shape[:2]))


def _norm(unit: np.ndarray, force: np.ndarray) -> float:
    """Of forces (r, n) in their units."""
    return float(np.linalg.norm(norms(force[None], unit[None])))


def _more_steps(equation: Equation, point: Point, pinned: bool) -> Iterator[Point]:
    """The point after further Newton steps: at its parameter, then across the branch where it is
    not pinned there."""
    begin = Plane(point.x, point.parameter, np.zeros(len(point.x)), 1.0)
    planes = [begin]
    if point.tangent is not None and not pinned:
        planes.append(
            begin._replace(row=point.tangent[0] / max(size(point.tangent[0]), TINY), corner=0.0)
        )
    for x, p, row, corner in planes:
        e = equation.evaluate(x, p)
        for _ in range(DEFAULT.more_steps):
            dx, dp = e.solve(row, corner, 0.0)
            x, p = x + dx, p + dp
            if not (np.isfinite(x).all() and _nearby(p, point)):
                break
            e = equation.evaluate(x, p)
            yield replace(point, x=x, parameter=p, detail=e)
    # at a kink the full steps lead to and fro
    strict = replace(SETTINGS, tolerance=SETTINGS.patient_residual)
    new = damped(equation.evaluate, planes[-1], equation.weights, strict, SETTINGS.patient_calls)
    if new.converged and _nearby(new.parameter, point):
        yield replace(point, x=new.x, parameter=new.parameter, detail=new.detail)


def _nearby(p: float, point: Point) -> bool:
    return abs(p - point.parameter) <= DEFAULT.nearby * abs(point.parameter)


def with_residuals(
    curve: ForcedResponse,
    settled: tuple[np.ndarray, np.ndarray, np.ndarray],
    equation: Equation,
    points: list[Point],
) -> ForcedResponse:
    """The curve with what `settle` found; points that are out of balance have failed: it says where
    and why, and where rounding of the matrices stays above the limit."""
    residuals, energies, bad = settled
    ended = curve.ended
    rounded = residuals[~bad] > DEFAULT.equilibrium
    if rounded.any():
        worst = int(np.nanargmax(np.where(bad, -1.0, residuals)))
        ended += (
            f"; at {rounded.sum()} points the forces balance to {residuals[worst]:.0e} of their "
            "scale, rounding of the given matrices or of stiff contacts: the vibration is known "
            f"to {doubt(equation, points[worst]):.0e}"
        )
    if not bad.any():
        return replace(curve, ended=ended, force_residual=residuals, energy_error=energies)
    worst = int(np.nanargmax(np.where(bad, residuals, 0.0)))
    ended += (
        f"; {bad.sum()} point{'s' * int(bad.sum() > 1)} left out, as the forces do not balance to "
        f"{DEFAULT.equilibrium:g} of their scale: worst {residuals[worst]:.1e}, at "
        f"{equation.parameter.named(curve.parameter[worst])}; "
        f"{_why_unbalanced(equation, points[worst])}"
    )
    blank: dict[str, Any] = {name: _blank(vars(curve)[name], bad) for name in OF_SOLVED_POINTS}
    return replace(
        curve,
        force_residual=_blank(residuals, bad),
        energy_error=_blank(energies, bad),
        complete=False,
        ended=ended,
        converged=curve.converged & ~bad,
        peak_points=curve.peak_points & ~bad[: len(curve.peak_points), None],
        **blank,
    )


def _why_unbalanced(equation: Equation, point: Point) -> str:
    at = KeptPoints(equation, [point])
    problem = at.problem
    contacts = at.contacts[0]
    problem = problem if contacts is problem.contacts else problem.with_contacts(contacts)
    reason = _too_stiff(problem, at.forces[0], at.w[0], at.motion()[0], DEFAULT.equilibrium)
    return reason or "try other harmonics there"


def _blank(column: np.ndarray, bad: np.ndarray) -> np.ndarray:
    """A column of a curve with NaN at points; as it is where it is empty."""
    if not column.size:
        return column
    return np.where(bad.reshape(-1, *[1] * (column.ndim - 1)), np.nan, column)


def check_carried(problem: ContactProblem, forces: dict, w: float) -> None:
    """InputError where a contact is so stiff that rounding alone puts the response at w rad/s out
    of equilibrium."""
    springs = problem.law.stuck_stiffness(problem.contacts).ravel()
    B = sp.csr_matrix(problem.B)
    most = DEFAULT.stiff * np.abs(problem.K.diagonal()).max()
    if (B.multiply(B).T @ springs).max(initial=0.0) <= most:
        return
    # rigid beside the bodies, but not so stiff that these are lost beside it
    soft = np.minimum(springs, most / max(abs(B).max(), 1e-300) ** 2)
    stiffness = problem.K + w**2 * problem.M + (B.T @ B.multiply(soft[:, None])).toarray()
    try:
        q = np.linalg.solve(stiffness, np.array(list(forces.values())).T)
    except np.linalg.LinAlgError:  # a motion without mass is free: named with the stuck system
        return
    if message := _too_stiff(problem, forces, w, q, DEFAULT.equilibrium / DEFAULT.resonance):
        raise InputError(message)


def _too_stiff(
    problem: ContactProblem, forces: dict, w: float, q: np.ndarray, allowed: float
) -> str:
    """A sentence on the stiffest contact where rounding of the motion q (r, n) is more than
    allowed; else empty."""
    springs = problem.law.stuck_stiffness(problem.contacts).ravel()
    B = abs(sp.csr_matrix(problem.B))
    unit = _units(problem, np.array([w]))[0]
    rounding = np.finfo(float).eps * springs[:, None] * (B @ np.abs(q))
    scale = _norm(unit, np.array(list(forces.values())).T)
    if not (share := _norm(unit, B.T @ rounding)) > allowed * scale:
        return ""
    worst = int(np.linalg.norm(rounding, axis=1).argmax())
    names = problem.law.components
    return (
        f"contact {worst // len(names)}: a stiffness of {springs[worst]:.3g} N/m along "
        f"{names[worst % len(names)]} is more than double precision can carry, rounding of the "
        f"motion is {share / scale:.1e} of the force: at most "
        f"{springs[worst] * allowed * scale / share:.1g} N/m, which is all but rigid beside the "
        "bodies"
    )
