"""Unilateral static contact of the free damper: the signed preload of every pair.

    K q + B_n' N = f,    0 <= N  complementary to  g0 + N/kn - B_n q >= 0        (kn = inf: hard
    contact)

The elastic bodies are already condensed on the pairs (Schur stiffness); `compliance` factors them
once, and what remains is a complementarity problem in the contact forces and the motions of bodies
that float (`normal_contact`). A further load or gap costs milliseconds.
"""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.hbm.contact import ContactTable, check_pairs_once
from tipdamp.hbm.errors import Doubt, InputError
from tipdamp.hbm.hold.spring import HeldMotion
from tipdamp.hbm.model import ReducedModel
from tipdamp.static_contact.bodies.compliance import Compliance
from tipdamp.static_contact.bodies.free_motions import name_of_drift
from tipdamp.static_contact.bodies.rigid_motions import SETTINGS as RIGID
from tipdamp.static_contact.bodies.rigid_motions import RigidMotionSettings
from tipdamp.static_contact.bodies.stuck_bodies import normal_springs, reference_stiffness
from tipdamp.static_contact.contact.contact_forces import LoadedMotion, Preload, StaticForces
from tipdamp.static_contact.normal.complementarity import (
    ContactSolution,
    NoEquilibrium,
    solve_complementarity,
    unstressed,
)
from tipdamp.static_contact.normal.normal_contact import SETTINGS as SETS
from tipdamp.static_contact.normal.normal_contact import Loading, NormalContact


@dataclass(frozen=True)
class StaticSettings:
    """Of the static solution."""

    # of the load: what may stay unbalanced, in all dofs and in the sum on a damper
    residual: float = SETS.residual
    # of the load's reach along a free motion: smaller constraint reactions are rounding
    reported: float = 1e-10
    rigid: RigidMotionSettings = RIGID


SETTINGS = StaticSettings()


class StaticContact:
    """The frictionless problem of one model and one set of pairs, factored once, solved for many
    loads and gaps."""

    def __init__(
        self,
        model: ReducedModel | Any,
        pairs: ContactTable,
        settings: StaticSettings = SETTINGS,
        held: Sequence[HeldMotion] = (),
        compliance: Callable[..., Compliance] = Compliance,
    ) -> None:
        """settings.rigid.facing : may be lowered when coordinates are exact; held : rigid motions
        on springs;
        compliance : how the bodies are factored, `sparse_bodies.SparseCompliance` for a
        `sparse_bodies.SparseBodies`. Raises InputError without pairs, and where a motion that is
        not known to be rigid meets no stiffness."""
        check_pairs(pairs)
        self.model, self.pairs, self.settings, self.held = model, pairs, settings, held
        self.kn = normal_springs(pairs)
        self.bodies = compliance(model, pairs, self.kn, held, settings.rigid)
        self.B, self.motions, self.loose = self.bodies.B, self.bodies.loose.free, self.bodies.loose
        c = np.divide(1.0, self.kn, out=np.zeros(len(pairs)), where=self.kn > 0)
        A = self.bodies.G
        A[np.diag_indices(len(c))] += c
        self.normal = NormalContact(
            A,
            c,
            self.bodies.Y,
            self.bodies.E,
            reference_stiffness(model.K, self.B, self.kn),
            self.kn > 0,
        )
        if not self.normal.held():
            raise InputError(
                "a motion meets no stiffness, or too little beside that of the bodies for double "
                "precision. K is singular: an unrestrained motion is not a rigid-body motion of "
                "a free body with known node positions; where a body floats, name its motions "
                "(rigid of ReducedModel.from_matrices)"
            )
        self._warn_of_rounding()

    def solve(
        self,
        load: np.ndarray,
        *,
        gap: np.ndarray | None = None,
        constrain: bool = False,
        near: StaticForces | None = None,
    ) -> Preload:
        """Preloads under load (r,) N on the dofs of the model, with the table's gaps or others,
        (P,) m.

        A load along a motion that no contact resists raises InputError with its amount; below 1e-3
        of what the load could do along it, as inexact meshes leave it, or with constrain=True, a
        constraint takes it up in the reference state instead, and its reaction is reported. Raises
        InputError when the load lifts the damper off, and when the solution leaves more than 1e-8
        of the load unbalanced. near - a solution with almost the same closed pairs."""
        load, gap, taken = self._given(load, gap, constrain)
        loading = self.bodies.loading(load - taken)
        found, q = self._contact(load - taken, loading, gap, near)
        if q is None:
            q, elastic = self.bodies.displacement(loading, load - taken, found.N, found.amount)
        else:
            elastic = np.zeros(len(q))
        forces, residual = self._checked(
            load, gap, taken, found, elastic + self.B.T @ found.N - load, constrain
        )
        return Preload(**vars(forces), displacement=q, residual=residual)

    def forces(
        self,
        load: np.ndarray,
        *,
        gap: np.ndarray | None = None,
        constrain: bool = False,
        near: StaticForces | None = None,
    ) -> StaticForces:
        """As `solve`, without the displacement of the bodies, whose balance alone is checked: for
        many further cases of bodies with many dofs."""
        load, gap, taken = self._given(load, gap, constrain)
        found, _ = self._contact(load - taken, self.bodies.loading(load - taken), gap, near)
        idle = self.loose.idle
        left = idle @ (idle.T @ (self.B.T @ found.N - load + taken)) - taken
        return self._checked(load, gap, taken, found, left, constrain)[0]

    def _warn_of_rounding(self) -> None:
        """Of motions that the bodies resist too little for a spring that is meant, and too much for
        the contact."""
        contact = self.kn @ (self.B @ self.loose.Z) ** 2 if np.isfinite(self.kn).all() else np.inf
        own = np.abs(np.einsum("ij,ij->j", self.loose.Z, self.loose.resisted))
        share = own / (own + contact)
        doubtful = (own < self.settings.rigid.doubtful * self.bodies.gauge) & (
            share > self.settings.residual
        )
        if doubtful.any():
            warnings.warn(
                f"K resists {int(doubtful.sum())} rigid motions of bodies by less than "
                f"{self.settings.rigid.doubtful:g} of the stiffness of their dofs, which carries "
                f"up to {share[doubtful].max():.1e} of a load on them: where a body floats this "
                "is rounding; name its motions (rigid of ReducedModel.from_matrices)",
                Doubt,
                stacklevel=3,
            )

    def _given(
        self, load: np.ndarray, gap: np.ndarray | None, constrain: bool
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Load and gaps, looked at, and what constraints take up of the load."""
        load = finite_values("load", load, self.model.size, "dofs of the model")
        gap = finite_values("gap", self.pairs.gap if gap is None else gap, len(self.pairs), "pairs")
        along = self.motions.shape.T @ load
        if not constrain:
            self.motions.refuse(along, load)
        return load, gap, self.motions.taken_up(along)

    def _checked(
        self,
        load: np.ndarray,
        gap: np.ndarray,
        taken: np.ndarray,
        found: ContactSolution,
        left: np.ndarray,
        constrain: bool,
    ) -> tuple[StaticForces, float]:
        """StaticForces of a solution that leaves `left` (r,) N of the load unbalanced, and how much
        that is."""
        applied = load - taken
        scale = load if load.any() else abs(self.B).T @ np.abs(found.N)
        reaction: dict[str, float] = {}
        if _ratio(left, scale) > self.settings.residual:
            taken, reaction = self._taken_by_constraints(left, taken, scale, constrain)
            left = left + taken
        residual = _ratio(left, scale)
        if not residual <= self.settings.residual:
            raise InputError(
                f"the static solution leaves {residual:.1e} of the load unbalanced "
                f"(allowed: {self.settings.residual:g}): the model's K is too ill-conditioned"
            )
        held = self.bodies.spring_forces(applied, found.N, found.amount)
        balance = self._balance(
            (load - taken if reaction else load) - self.bodies.held.T @ held, found.N
        )
        return StaticForces(
            pairs=self.pairs.replace(preload=self._preload(found, gap), gap=gap),
            force=found.N,
            opening=np.where(found.closed, 0.0, gap - found.u),
            motions=self._loaded(load),
            reactions=reaction,
            held={one.name: float(f) for one, f in zip(self.held, held, strict=True)},
            balance=balance,
            iterations=found.sets,
            method=found.method,
        ), residual

    def _preload(self, found: ContactSolution, gap: np.ndarray) -> np.ndarray:
        """(P,) N, negative where a pair stands open."""
        spring = np.where(np.isinf(self.kn), 0.0, self.kn)
        return np.where(found.closed, found.N, spring * (found.u - gap))

    def _loaded(self, load: np.ndarray) -> tuple[LoadedMotion, ...]:
        along = self.motions.shape.T @ load
        return tuple(
            LoadedMotion(*name, float(amount))
            for name, amount in zip(self.motions.names, along, strict=True)
        )

    def _taken_by_constraints(
        self, left: np.ndarray, taken: np.ndarray, scale: np.ndarray, constrain: bool
    ) -> tuple[np.ndarray, dict[str, float]]:
        """What constraints take up (r,) N where `left` stays unbalanced, and their reactions: the
        gauge balances the part of the contact forces along nearly free motions, on which tilted
        normals slide a little."""
        idle = self.loose.idle
        taken = taken - idle @ (idle.T @ (left + taken))
        amounts = self.motions.shape.T @ taken
        if not constrain:
            self.motions.refuse(amounts, scale)
        return taken, self.motions.reactions(amounts, scale, self.settings.reported)

    def _contact(
        self, applied: np.ndarray, loading: Loading, gap: np.ndarray, near: StaticForces | None
    ) -> tuple[ContactSolution, np.ndarray | None]:
        """The solution of the contact, and the displacement (r,) where no load acts and the bodies
        fit without force."""
        loose = self.loose
        if not applied.any():
            may_close = self.normal.free
            q = unstressed(loose.rigid @ loose.floats, self.B[may_close], gap[may_close])
            if q is not None:
                none = np.zeros(len(gap))
                return ContactSolution(
                    self.B @ q, none, np.zeros(loose.Z.shape[1]), none > 0, 0, "unloaded"
                ), q
        try:
            return solve_complementarity(
                self.normal, loading, gap, start=None if near is None else near.opening <= 0
            ), None
        except NoEquilibrium as error:
            if error.drift is None:
                raise
            name = name_of_drift(
                loose.rigid, loose.floats, self.B, error.drift, self.settings.rigid
            )
            raise NoEquilibrium(
                f"{error}, the load leaves it free to move: {name}", error.drift
            ) from None

    @cached_property
    def _dampers(self) -> np.ndarray:
        """(r, 3 b) slides of the dampers that float."""
        slides, most = [np.zeros((self.model.size, 0))], abs(self.model.K).max()
        for body in dict.fromkeys(self.pairs.damper_body.tolist()):
            mine = self.model.body == body
            motions = np.array([mine & (self.model.direction == d) for d in "xyz"], dtype=float).T
            if body in self.model.rigid:
                known = self.model.rigid[body]
                known = known[:, np.arange(known.shape[1]) % 6 < 3]
                motions = np.zeros((len(mine), known.shape[1]))
                motions[mine] = known
            if (
                np.abs(self.model.K @ motions).max(initial=0.0)
                < self.settings.rigid.free_stiffness * most
            ):
                slides.append(motions)
        return np.hstack(slides)

    def _balance(self, load: np.ndarray, force: np.ndarray) -> float | None:
        """Sum of the contact forces and the load on the dampers that float, against the load; None
        where none does. InputError where it is more than rounding."""
        total = np.linalg.norm(self._dampers.T @ load)
        if not total > 0:
            return None
        balance = float(np.linalg.norm(self._dampers.T @ (load - self.B.T @ force)) / total)
        if not balance <= self.settings.residual:
            raise InputError(
                f"the contact forces leave {balance:.1e} of the load on the damper unbalanced "
                f"(allowed: {self.settings.residual:g}): the model's K resists, or drives, the "
                "motion of a damper that floats"
            )
        return balance


def check_pairs(pairs: ContactTable) -> None:
    """InputError where no pair carries, or one is there twice."""
    if not len(pairs) or not pairs.carrying.any():
        raise InputError("no contact pairs: a free damper needs at least one pair on two sides")
    check_pairs_once("contact table", pairs)


def preload(
    model: ReducedModel, pairs: ContactTable, load: np.ndarray, *, constrain: bool = False
) -> Preload:
    """One load case of `StaticContact`.

    >>> model, pairs = two_blades()
    >>> found = preload(model, pairs, 60.0 * model.loads["pull"])  # N
    >>> print(found.force.round(1), found.pairs.preload.round(1))
    [52.3 52.3] [52.3 52.3]
    """
    return StaticContact(model, pairs).solve(load, constrain=constrain)


def finite_values(name: str, given: ArrayLike, size: int, of: str) -> np.ndarray:
    """The numbers (size,), all finite; InputError otherwise."""
    values = np.asarray(given, dtype=float)
    if values.shape != (size,) or not np.isfinite(values).all():
        odd = (
            f"shape {values.shape}"
            if values.shape != (size,)
            else f"{values[~np.isfinite(values)][0]} among them"
        )
        raise InputError(
            f"{name}: {odd}; allowed are {size} finite numbers, one for each of the {of}"
        )
    return values


def _ratio(a: np.ndarray, b: np.ndarray) -> float:
    size = np.linalg.norm(b)
    return float(np.linalg.norm(a) / size) if size > 0 else float(np.linalg.norm(a))
