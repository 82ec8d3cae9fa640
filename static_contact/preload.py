"""Unilateral static contact of the free damper: the signed preload of every pair.

    K q + B_n' N = f,    0 <= N  complementary to  g0 + N/kn - B_n q >= 0        (kn = inf: hard contact)

The elastic bodies are already condensed on the pairs (Schur stiffness), so that what remains is a small
complementarity problem. With a reference spring k0 at every pair A = K + B_n' k0 B_n is factored once; a set of closed
pairs is one small system on the compliance G = B_n A^-1 B_n', and a further load or gap costs milliseconds.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl
from numpy.typing import ArrayLike

from hbm.contact import ContactTable, relative_motion
from hbm.errors import InputError
from hbm.hold.spring import HeldMotion, spring_forces, with_springs
from hbm.model import ReducedModel
from static_contact.complementarity import NoEquilibrium, NormalContact, solve_complementarity
from static_contact.free_motions import free_motions, name_of_drift
from static_contact.refinement import RigidSplit, refined
from static_contact.rigid_motions import SETTINGS as RIGID
from static_contact.rigid_motions import RigidMotionSettings, floating, rigid_motions
from static_contact.unloaded import unstressed


@dataclass(frozen=True)
class StaticSettings:
    """Of the static solution."""

    residual: float = 1e-8      # of the load: what may stay unbalanced
    reported: float = 1e-10     # of the load's reach along a free motion: smaller constraint reactions are rounding
    rigid: RigidMotionSettings = RIGID


SETTINGS = StaticSettings()


@dataclass(frozen=True)
class Motion:
    """A rigid motion of the bodies that no contact normal resists, and how the load acts along it.

    name - for example 'roll about the damper axis'; unit - 'N' or 'N m'; load - of the applied loads along it.
    """

    name: str
    unit: str
    load: float


@dataclass(frozen=True)
class Preload:
    """pairs - the table with its preload: the contact force of closed pairs, -kn times the opening of open ones (0
    where kn = inf); force : (P,) N, the contact forces; opening : (P,) m - how far a pair stands open, 0 where closed
    displacement : (r,) m; motions - free ones and the load along each; held : {name: N or N m} - force on what holds a
    motion
    reactions : {name: N or N m} - of loads and contact forces along free motions, taken up in the reference
    state; empty where that is no more than 1e-8 of the load
    residual - |K q + B' N - f| / |f|, f without the constraint reactions; without load / ||B|' N|
    balance - |sum of contact forces, loads and constraint reactions| / |sum of loads| on the floating dampers, None
    where none floats
    iterations - sets tried; method - 'newton', 'pivoting' after cycling, 'proximal' after a singular set
    or sets that cycled, 'unloaded' where no load acts and the bodies fit without any force
    """

    pairs: ContactTable
    force: np.ndarray
    opening: np.ndarray
    displacement: np.ndarray
    motions: tuple[Motion, ...]
    reactions: dict[str, float]
    held: dict[str, float]
    residual: float
    balance: float | None
    iterations: int
    method: str


class StaticContact:
    """The frictionless problem of one model and one set of pairs, factored once, solved for many loads and gaps."""

    def __init__(self, model: ReducedModel, pairs: ContactTable, settings: StaticSettings = SETTINGS,
                 held: Sequence[HeldMotion] = ()):
        """settings.rigid.facing : may be lowered when coordinates are exact; held : rigid motions on springs. Raises
        InputError without pairs, and where a motion that is not known to be rigid meets no stiffness."""
        check_pairs(pairs)
        self.bodies, self.held = model, held
        model = model.with_stiffness(with_springs(model.K, held)) if held else model
        self.model, self.pairs, self.settings = model, pairs, settings
        self.B = relative_motion(model, pairs)[2::3].toarray()
        self.kn = np.where(pairs.carrying, pairs.kn, 0.0) * np.where(pairs.carrying, pairs.weight, 1.0)
        k0 = reference_stiffness(model.K, self.B, self.kn)
        K = model.K + self.B.T * k0 @ self.B
        self.rigid = rigid_motions(model)
        self.motions = free_motions(self.rigid, model, self.B[k0 > 0], settings.rigid)
        self.idle = np.linalg.qr(self.motions.shape)[0]
        try:
            # the gauge makes the free motions definite; its forces are part of the constraint reactions
            self.gauge = np.median(K.diagonal()[K.diagonal() > 0]) * (self.idle @ self.idle.T)
            self.factor = sl.cho_factor(K + self.gauge)
        except np.linalg.LinAlgError:
            raise InputError("a motion meets no stiffness, or too little beside that of the bodies for double "
                             "precision. K is singular: an unrestrained motion is not a rigid-body motion of a free "
                             "body with known node positions") from None
        self.split = RigidSplit.of(self.rigid, model.K)
        self.by_pair = sl.cho_solve(self.factor, self.B.T)
        c = np.divide(1.0, self.kn, out=np.zeros(len(pairs)), where=self.kn > 0)
        self.normal = NormalContact(self.B @ self.by_pair, k0, c, pairs.carrying & (self.kn > 0))

    def solve(self, load: np.ndarray, *, gap: np.ndarray | None = None, constrain: bool = False) -> Preload:
        """Preloads under load (r,) N on the dofs of the model, with the table's gaps or others, (P,) m.

        A load along a motion that no contact resists raises InputError with its amount; below 1e-3 of what the load
        could do along it, as inexact meshes leave it, or with constrain=True, a constraint takes it up in the reference
        state instead, and its reaction is reported. Raises InputError when the load lifts the damper off, and when the
        solution leaves more than 1e-8 of the load unbalanced.
        """
        load = finite_values("load", load, self.model.size, "dofs of the model")
        gap = finite_values("gap", self.pairs.gap if gap is None else gap, len(self.pairs), "pairs")
        along = self.motions.shape.T @ load
        if not constrain:
            self.motions.refuse(along, load)
        taken = self.motions.taken_up(along)
        q, elastic, u, force, closed, iterations, method = self._contact(load - taken, gap)
        scale = load if load.any() else np.abs(self.B).T @ np.abs(force)
        left, reaction = elastic + self.B.T @ force - load, {}
        if _ratio(left, scale) > self.settings.residual:
            # the gauge balances the part of the contact forces along nearly free motions: tilted normals slide a little
            taken -= self.idle @ (self.idle.T @ (left + taken))
            left += taken
            amounts = self.motions.shape.T @ taken
            if not constrain:
                self.motions.refuse(amounts, scale)
            reaction = self.motions.reactions(amounts, scale, self.settings.reported)
        if not _ratio(left, scale) <= self.settings.residual:
            raise InputError(f"the static solution leaves {_ratio(left, scale):.1e} of the load unbalanced (allowed: "
                             f"{self.settings.residual:g}): the model's K is too ill-conditioned")
        spring = np.where(np.isinf(self.kn), 0.0, self.kn)
        return Preload(pairs=self.pairs.replace(preload=np.where(closed, force, spring * (u - gap)), gap=gap),
                       force=force, opening=np.where(closed, 0.0, gap - u), displacement=q,
                       motions=tuple(Motion(*name, float(amount)) for name, amount
                                     in zip(self.motions.names, along, strict=True)),
                       reactions=reaction, held=spring_forces(self.held, q), residual=_ratio(left, scale),
                       balance=self._balance((load - taken if reaction else load) + (self.bodies.K - self.model.K) @ q,
                                             force), iterations=iterations,
                       method=method)

    def _contact(self, applied, gap):
        """Displacement and the bodies' forces K q, motion and force of the pairs, which are closed, sets tried, method.
        """
        if not applied.any():
            may_close = self.normal.free
            loose = self.rigid @ floating(self.rigid, self.model.K, settings=self.settings.rigid)
            q = unstressed(loose, self.B[may_close], gap[may_close])
            if q is not None:
                nothing = np.zeros(len(gap))
                return q, self.model.K @ q, self.B @ q, nothing, nothing > 0, 0, "unloaded"
        start = sl.cho_solve(self.factor, applied)
        try:
            found = solve_complementarity(self.normal, self.B @ start, gap)
        except NoEquilibrium as error:
            if error.drift is None:
                raise
            name = name_of_drift(self.rigid, self.model.K, self.B, error.drift, self.settings.rigid)
            raise NoEquilibrium(f"{error}, the load leaves it free to move: {name}", error.drift) from None
        q = start - self.by_pair @ (found.N - self.normal.k0 * found.u)
        return *refined(self, applied, q, found), found.closed, found.sets, found.method

    def _balance(self, load, force):
        """Sum of the contact forces and the load on the dampers that float, against the load; None where none does."""
        total, left = 0.0, 0.0
        for body in dict.fromkeys(self.pairs.damper_body.tolist()):
            motions = np.array([(self.model.body == body) & (self.model.direction == d) for d in "xyz"], dtype=float).T
            stiffness = np.abs(self.bodies.K @ motions).max(initial=0.0)
            if motions.any() and stiffness < self.settings.rigid.free_stiffness * np.abs(self.bodies.K).max():
                total += np.linalg.norm(motions.T @ load) ** 2
                left += np.linalg.norm(motions.T @ (load - self.B.T @ force)) ** 2
        return float(np.sqrt(left / total)) if total > 0 else None


def check_pairs(pairs: ContactTable) -> None:
    """InputError where no pair carries."""
    if not len(pairs) or not pairs.carrying.any():
        raise InputError("no contact pairs: a free damper needs at least one pair on two sides")


def reference_stiffness(K: np.ndarray, B: np.ndarray, spring: np.ndarray) -> np.ndarray:
    """(P,) N/m: the pair's own spring, but no stiffer than the bodies at the pair, so that the sum stays well scaled.

    K (r, r); B (P, r) one row for each pair; spring (P,) N/m, may be inf, 0 where nothing acts.
    """
    size = np.einsum("ij,ij->i", B, B)
    local = np.divide(np.einsum("ij,ij->i", B @ K, B), size**2, out=np.zeros(len(B)), where=size > 0)
    local = np.where(local > 0, local, local.max(initial=0.0))
    finite = spring[np.isfinite(spring)]
    return np.minimum(spring, np.where(local > 0, local, finite.max(initial=1.0)))


def preload(model: ReducedModel, pairs: ContactTable, load: np.ndarray, *, constrain: bool = False) -> Preload:
    """One load case of `StaticContact`."""
    return StaticContact(model, pairs).solve(load, constrain=constrain)


def finite_values(name: str, given: ArrayLike, size: int, of: str) -> np.ndarray:
    """The numbers (size,), all finite; InputError otherwise."""
    values = np.asarray(given, dtype=float)
    if values.shape != (size,) or not np.isfinite(values).all():
        odd = f"shape {values.shape}" if values.shape != (size,) else f"{values[~np.isfinite(values)][0]} among them"
        raise InputError(f"{name}: {odd}; allowed are {size} finite numbers, one for each of the {of}")
    return values


def _ratio(a, b):
    size = np.linalg.norm(b)
    return float(np.linalg.norm(a) / size) if size > 0 else float(np.linalg.norm(a))
