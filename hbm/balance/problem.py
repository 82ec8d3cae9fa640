"""The contact problem: matrices, contacts and their law, as the harmonic balance takes them."""

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from types import MappingProxyType
from typing import Any, cast

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from numpy.typing import ArrayLike

from tipdamp.hbm.balance.receptance import (
    Receptance,
    general_receptance,
    ratios,
    stuck_receptance,
)
from tipdamp.hbm.balance.reduced import StuckMatrices
from tipdamp.hbm.balance.restraint import (
    SUPPORT,
    FloatingMotions,
    acts_along,
    check_rest,
    floating_motions,
    loose_motions,
    stiff_factor,
    with_gauge,
)
from tipdamp.hbm.balance.series import ContactReceptance, contact_receptance
from tipdamp.hbm.balance.settings import DEFAULT
from tipdamp.hbm.balance.varying import Varying
from tipdamp.hbm.contact import ContactTable, relative_motion, without_normal_motion
from tipdamp.hbm.contact_doubts import contact_doubts
from tipdamp.hbm.errors import Doubt, InputError
from tipdamp.hbm.hold.named_motion import describe_motion, mostly
from tipdamp.hbm.hold.spring import HeldMotion, Hold, held_motions, springs, with_springs
from tipdamp.hbm.laws.base import ContactLaw, check_law
from tipdamp.hbm.laws.records import Contacts
from tipdamp.hbm.model import ReducedModel, check_damping, square, symmetric
from tipdamp.hbm.validation import brief, check_kind, numbers

NOT_SYMMETRIC = {
    "M": "",
    "C": "; gyroscopic forces are meant with general = True",
    "K": "; circulatory forces are meant with general = True",
}
STRUCTURAL = "must be a loss factor, 0 or more, or a matrix (r, r) in N/m"


class AnyProblem:
    """A ContactProblem, or what one is made of.

    forces : {harmonic: (r,) N} that it has itself
    """

    forces: Mapping[int, np.ndarray] = MappingProxyType({})

    @property
    def contact_problem(self) -> "ContactProblem":
        """As matrices, contacts and one law."""
        raise NotImplementedError


def contact_problem_of(problem: AnyProblem) -> "ContactProblem":
    """The ContactProblem of a Problem, or itself; InputError for anything else."""
    if not isinstance(problem, AnyProblem):
        raise InputError(
            f"problem = {brief(problem)}: must be a Problem(M, C, K) with its contacts, or a "
            "ContactProblem"
        )
    return problem.contact_problem


@dataclass(frozen=True, eq=False)
class ContactProblem(AnyProblem):
    """M q'' + C q' + K q + B' f(B q) = F0 + Re sum F_k exp(i k w t), with a contact law f on P
    contacts.

    M, C, K : (r, r) kg, N s/m, N/m, symmetric; C is None where damping_ratio is given
    B : (P nd, r) dense or sparse - relative motion, the components of each contact in turn, in the
    order of the law
    contacts : P of them, with their settings
    static : (r,) N or None - constant force beside the one that balances the preload
    preloaded : True when q = 0 is the preloaded state (the static loads that hold the preloads are
        implied: open contacts, of negative preload, carry nothing), False when q = 0 is the
        unloaded one and `static` carries all static loads
    damping_ratio : of the modes of the stuck system, where C is None; contacts that are open at
        rest are closed in it, too
    describe : motion (r,) -> NamedMotion for messages (see
    `tipdamp.hbm.hold.named_motion.describe_motion`), or None
    held : rigid motions that springs hold, beside K, or whose mean is held rigidly (see
    `tipdamp.hbm.hold.spring.held_motions`)
    general : C and K need not be symmetric (gyroscopic and circulatory forces), and C may feed
        energy in; damping is then a C
    structural : loss factor eta of K, or (r, r) N/m D: the damping force i D q of every harmonic
        motion, beside C or alone; without motion in time, so without stability and time integration
    varying : forces and matrices that depend on the frequency of the excitation; M, C and K are
        then those at rest, and other forces add to those given
    Raises InputError where shapes disagree, a matrix is not symmetric, a mass is negative or
    damping feeds energy in.

    >>> contacts = Contacts(kn=0, kt=5e5, mu=0.5, preload=40)
    >>> M, K, B = np.array([[0.05]]), np.array([[1e6]]), np.array([[1.0]])
    >>> problem = ContactProblem(M, None, K, B, Jenkins1D(), contacts, damping_ratio=0.01)
    >>> print(problem.receptance().frequencies.round(1))  # Hz, stuck
    [871.7]
    """

    M: np.ndarray
    C: np.ndarray | None
    K: np.ndarray
    B: Any
    law: ContactLaw
    contacts: Contacts
    static: np.ndarray | None = None
    preloaded: bool = True
    damping_ratio: "ArrayLike | None" = None
    describe: Callable | None = None
    held: tuple[HeldMotion, ...] = ()
    general: bool = False
    structural: Any = None
    varying: Varying | None = None

    def __post_init__(self) -> None:
        if self.C is not None and self.damping_ratio is not None:
            raise InputError(
                "damping: both a damping matrix C and damping_ratio given, exactly one is "
                "needed; leave one of them out (C=None)"
            )
        matrices = {name: vars(self)[name] for name in "MCK" if vars(self)[name] is not None}
        for name, matrix in matrices.items():
            if self.general and name != "M":
                object.__setattr__(self, name, square(name, matrix))
            else:
                object.__setattr__(self, name, symmetric(name, matrix, NOT_SYMMETRIC[name]))
        check_law(self.law)
        check_kind("contacts", self.contacts, Contacts, "Contacts(kn, kt, mu, preload)")
        nd = len(self.law.components)
        r = self.K.shape[0]
        if any(matrix is not None and matrix.shape != (r, r) for matrix in (self.M, self.C)):
            shapes = ", ".join(f"{name} is {np.shape(vars(self)[name])}" for name in "MCK")
            raise InputError(f"{shapes}: all must have the same size")
        self._check_signs()
        self._check_general()
        if self.varying is not None:
            check_kind("varying", self.varying, Varying, "Varying(forces, C, K, engine_order)")
            self.varying.checked(r)
        if not len(self.contacts):
            raise InputError("no contacts: use linear_response for a model without contact")
        if np.shape(self.B) != (len(self.contacts) * nd, r):
            raise InputError(
                f"B is {np.shape(self.B)}: law {self.law.name} on {len(self.contacts)} contacts "
                f"of a model with {r} dofs needs ({len(self.contacts) * nd}, {r})"
            )
        B = numbers("B", self.B, "must be a real matrix")
        object.__setattr__(self, "B", self.B if sp.issparse(self.B) else B)
        self.law.check(self.contacts)
        if self.static is not None:
            static = numbers("static", self.static, f"must be {r} real numbers in N")
            if static.shape != (r,) or not np.isfinite(static).all():
                raise InputError(
                    f"static load: must be finite with shape ({r},), got {static.shape}"
                )

    @property
    def contact_problem(self) -> "ContactProblem":
        """Itself."""
        return self

    def _check_signs(self) -> None:
        """Some dofs may be massless, but not all; damping must not feed energy in."""
        if not self.M.any():
            raise InputError("M is zero: at least one dof must have mass")
        if (self.M.diagonal() < 0).any():
            i = int(self.M.diagonal().argmin())
            raise InputError(
                f"M has {self.M[i, i]:g} on its diagonal at dof {i}: masses must not be negative"
            )
        if self.C is not None and not self.general:
            check_damping(
                self.C,
                remedy="check the sign of C, or give general = True where it is meant, as for a "
                "self-excited motion",
            )

    def _check_general(self) -> None:
        """Matrices that are not symmetric, and structural damping, have no modes to give ratios
        to."""
        if self.structural is not None:
            eta = numbers("structural", self.structural, STRUCTURAL)
            D = eta * 0.5 * (self.K + self.K.T) if eta.ndim == 0 else eta
            if D.shape != self.K.shape:
                raise InputError(f"structural is {D.shape}: {STRUCTURAL}")
            object.__setattr__(self, "structural", symmetric("structural", D))
            if (np.diag(self.structural) < 0).any():
                raise InputError(f"structural = {brief(self.structural)}: must not be negative")
            if self.C is None and self.damping_ratio is None:
                object.__setattr__(self, "C", np.zeros_like(self.K))
        if not self.has_left_modes:
            return
        what = "general = True" if self.general else "structural"
        if self.damping_ratio is not None:
            raise InputError(
                f"damping_ratio beside {what}: ratios are of real modes, which there are none of; "
                "give the viscous damping as C"
            )
        if self.C is None:
            raise InputError(f"C is missing: with {what} give a damping matrix, zeros for none")
        if any(one.mean for one in self.held):
            raise InputError(f"hold with mean = true beside {what}: hold the motion by a spring")

    @property
    def has_left_modes(self) -> bool:
        """Whether forces act on the modes otherwise than these move."""
        return self.general or self.structural is not None

    def check_plain(self, what: str) -> None:
        """InputError where the problem is not that of real modes, which `what` is made of."""
        if self.has_left_modes or self.varying is not None:
            kind = "structural damping" if self.structural is not None else "general = True"
            raise InputError(
                f"{what}: needs symmetric matrices and viscous damping that do not depend on the "
                f"frequency, the problem has {kind if self.has_left_modes else 'others'}; use "
                "follow_band"
            )

    def _symmetric(self, matrix: np.ndarray) -> np.ndarray:
        return 0.5 * (matrix + matrix.T) if self.general else matrix

    @property
    def circulatory(self) -> np.ndarray | None:
        """(r, r) N/m, real or complex: the part of what resists displacements that does work in a
        cycle; None where there is none."""
        if not self.has_left_modes:
            return None
        skew = 0.5 * (self.K - self.K.T)
        return skew if self.structural is None else skew + 1j * self.structural

    @property
    def stiffness(self) -> np.ndarray:
        """(r, r) K with the springs of what is held."""
        return with_springs(self.K, [one for one in self.held if not one.mean])

    @cached_property
    def stuck_stiffness(self) -> np.ndarray:
        """(r, r) K + B' K_c B, with the springs of what is held."""
        return self.with_contact_springs(self.stiffness, self.law.stuck_stiffness(self.contacts))

    def with_contact_springs(self, K: np.ndarray, springs: np.ndarray) -> np.ndarray:
        """K (r, r) with springs (P, nd) N/m at the contacts."""
        k = springs.ravel()
        B = sp.csr_matrix(self.B)
        if 2 * B.nnz > B.shape[0] * B.shape[1]:
            B = B.toarray()
            return K + (B.T * k) @ B
        added = (B.T @ B.multiply(k[:, None])).tocoo()
        found = K.copy()
        found[added.row, added.col] += added.data
        return found

    def held_by_friction(self) -> np.ndarray:
        """(r, n) motions that nothing but friction restrains: normal springs do not, nor what is
        held. They are told apart by the tangential component in which the contacts slide."""
        tangents = np.array([name != "n" for name in self.law.components])
        normal = np.where(tangents, 0.0, self.law.stuck_stiffness(self.contacts))
        K = self._symmetric(self.with_contact_springs(with_springs(self.K, self.held), normal))
        free = self._checked_motions[0].shapes
        motions = loose_motions(with_gauge(self.M, K, free))
        slip = np.asarray(self.B @ motions).reshape(len(self.contacts), len(tangents), -1)
        first, whole = (np.einsum("pij,pik->jk", part, part) for part in (slip[:, :1], slip))
        size, axes = la.eigh(whole) if motions.shape[1] else (np.zeros(0), np.zeros((0, 0)))
        moves = size > DEFAULT.unseen * size.max(initial=0.0)  # what the contacts feel
        axes = axes[:, moves] / np.sqrt(size[moves])
        return (
            motions @ axes @ la.eigh(axes.T @ first @ axes)[1][:, ::-1] if moves.any() else motions
        )

    @property
    def damping_matrix(self) -> np.ndarray:
        """(r, r) N s/m: C, or that of the damping ratios of the stuck modes."""
        if self.damping_ratio is None:
            return cast(np.ndarray, self.C)
        known = self.receptance()
        shapes = self.M @ known.modes / np.maximum(known.mass, 1e-300)
        return (shapes * known.damping) @ shapes.T

    def rest_force(self, contacts: Contacts) -> np.ndarray:
        """(P, nd) N: force at q = 0 that the implied static loads balance, of these contacts or
        with other settings."""
        zero = np.zeros((len(contacts), len(self.law.components)))
        return self.law.force_at_rest(contacts) if self.preloaded else zero

    @cached_property
    def as_constant(self) -> "ContactProblem":
        """With the matrices as they are, and nothing that varies."""
        return replace(self, varying=None)

    def receptance(self) -> Receptance:
        """Of the stuck system, computed once; raises InputError when a motion is left free."""
        return self._receptance

    @cached_property
    def contact_receptance(self) -> ContactReceptance:
        """Of the stuck system between the components of the contacts."""
        return contact_receptance(self.receptance(), self.B)

    @cached_property
    def _receptance(self) -> Receptance:
        stuck = self.stuck_stiffness
        free, remedy = self._checked_motions
        C = self.C if self.damping_ratio is None else None
        means = [one.row for one in self.held if one.mean]
        if self.has_left_modes:
            return general_receptance(
                self.M, cast(np.ndarray, self.C), stuck, self.structural, self.describe, remedy
            )
        remedy += "; mean = true holds no vibration, leave it out" * bool(means)
        found = stuck_receptance(self.M, C, stuck, self.damping_ratio, self.describe, remedy, free)
        return found.constrained(np.array(means)) if means else found

    @cached_property
    def _checked_motions(self) -> tuple[FloatingMotions, str]:
        """(motions of a structure that floats, what to do where another one is free); InputError
        where one is that nothing holds at rest."""
        has_springs = self.law.stuck_stiffness(self.contacts).any()
        free = FloatingMotions(np.zeros((len(self.K), 0)))
        if self._stuck_factor is None and not self.has_left_modes:
            free = floating_motions(self.M, self.stiffness, self.stuck_stiffness, self.B)
        if has_springs and not self.law.stiffness_at_rest(self.contacts).any():
            held = with_gauge(self.M, self._symmetric(self.stiffness), free.shapes)
            check_rest(held, None if self.preloaded else self.static, self.describe)
        return (
            free,
            SUPPORT
            if has_springs
            else f"law {self.law.name} has no stuck stiffness: give it one (`stuck_stiffness`; "
            "solutions do not depend on it) or support the body",
        )

    @property
    def reducible(self) -> StuckMatrices | None:
        """The stuck system where all its modes are many, and not known yet; else None. Raises as
        `receptance`."""
        return None if "_receptance" in self.__dict__ else self._reducible

    @cached_property
    def _reducible(self) -> StuckMatrices | None:
        r = len(self.K)
        by_ratio = self.damping_ratio is not None
        few = r <= (DEFAULT.few_modes_of_ratio if by_ratio else DEFAULT.few_modes_of_matrix)
        if (
            self.has_left_modes
            or few
            or by_ratio is (self.C is not None)
            or any(one.mean for one in self.held)
        ):
            return None
        ratio = ratios(self.damping_ratio, r) if by_ratio else np.zeros(1)
        if np.ptp(ratio) or self._checked_motions[0].shapes.shape[1] or self._stuck_factor is None:
            return None
        return StuckMatrices(
            self.M, self.stuck_stiffness, self.C, float(ratio[0]), *self._stuck_factor
        )

    @cached_property
    def _stuck_factor(self) -> tuple[np.ndarray, np.ndarray] | None:
        return stiff_factor(self._symmetric(self.stuck_stiffness))

    def reaction_rows(self, receptance: Receptance) -> np.ndarray:
        """(h, m) that take the modal coordinates of a receptance to the forces on what holds, N or
        N m."""
        shapes = receptance.shapes
        means = [i for i, one in enumerate(self.held) if one.mean]
        rows = (
            np.array([one.stiffness * one.row for one in self.held]).reshape(-1, len(shapes))
            @ shapes
        )
        rows[means] = 0.0
        rows[np.ix_(means, range(shapes.shape[1] - len(means), shapes.shape[1]))] = (
            receptance.constraint_forces
        )
        return rows

    def check_mean(self, force: np.ndarray | None = None) -> None:
        """InputError where a constant force, `static` or `force` (r,) N of order 0, acts along a
        free motion."""
        free = self._checked_motions[0]
        for load in (self.static, force) if free.shapes.shape[1] else ():
            motion = None if load is None else acts_along(free, self.stuck_stiffness, load)
            if motion is not None:
                named = self.describe(motion) if self.describe else None
                raise InputError(
                    f"a constant force acts along a motion that nothing restrains: "
                    f"{named or mostly(motion)}; leave it out, or "
                    f"{named.remedy if named else 'support the body, however softly'}"
                )

    def with_stiffer_holds(self, factor: float) -> "ContactProblem":
        """With so many times the stiffness of every spring that holds a motion."""
        return replace(
            self, held=tuple(replace(one, stiffness=factor * one.stiffness) for one in self.held)
        )

    def with_springs_alone(self) -> "ContactProblem":
        """With a spring where only the mean of a motion is held, as time integration takes it."""
        return (
            replace(self, held=springs(self.held)) if any(one.mean for one in self.held) else self
        )

    def with_contacts(self, contacts: Contacts) -> "ContactProblem":
        """With other settings of the contacts; the receptance is kept where these do not change
        it."""
        other = replace(self, contacts=contacts)
        stiffness = self.law.stuck_stiffness
        if "_receptance" in self.__dict__ and np.array_equal(
            stiffness(contacts), stiffness(self.contacts)
        ):
            kept = {"_receptance", "contact_receptance"} & self.__dict__.keys()
            other.__dict__.update({name: self.__dict__[name] for name in kept})
        return other

    def with_damping(self, factor: float) -> "ContactProblem":
        """With the damping ratios, or C, times a factor; the modes are kept where the damping does
        not couple them."""
        if self.has_left_modes:  # gyroscopic forces are no damping
            given = cast(np.ndarray, self.C)
            turning = 0.5 * (given - given.T)
            more = None if self.structural is None else factor * self.structural
            return replace(self, C=turning + factor * self._symmetric(given), structural=more)
        if self.C is not None and self.damping_ratio is None:
            other = replace(self, C=factor * self.C)
        else:
            other = replace(self, damping_ratio=factor * np.asarray(self.damping_ratio))
        known = self.receptance()
        if known.ratio.size:
            other.__dict__["_receptance"] = known.with_damping(factor)
        return other


def contact_problem(
    model: ReducedModel,
    pairs: ContactTable,
    law: ContactLaw,
    origin: str = "preloaded",
    static: np.ndarray | None = None,
    damping_ratio: "ArrayLike | None" = None,
    hold: Hold | Sequence[Hold] = (),
) -> tuple[ContactProblem, np.ndarray]:
    """(ContactProblem of the carrying pairs, mask (P,) of these in the table).

    model, pairs, law, origin, damping_ratio : as in `tipdamp.hbm.response.forced_response`
    static : (r,) N - constant loads: all of them with the unloaded origin, those beside the
    preload's else
    hold : rigid motions of bodies that no contact resists, and that are held
    (`tipdamp.hbm.hold.spring.Hold`)
    Raises InputError on unusable input; warns where the model cannot move along the normal of a
    pair, and where the table is doubtful beside the model (see `tipdamp.hbm.contact_doubts`).

    >>> model, pairs = two_blades()
    >>> half = pairs.replace(weight=[1, 0])
    >>> problem, kept = contact_problem(model, half, DryFriction2T(), damping_ratio=0.01)
    >>> problem.B.shape, kept.tolist()  # three components of the one pair that carries
    ((3, 9), [True, False])
    """
    problem, kept, doubts = doubted_problem(
        model, pairs, law, (origin, static, damping_ratio, hold)
    )
    for doubt in (*doubts, *contact_doubts(model, pairs.select(kept))):
        warnings.warn(doubt, Doubt, stacklevel=2)
    return problem, kept


def doubted_problem(
    model: ReducedModel, pairs: ContactTable, law: ContactLaw, more: tuple
) -> tuple[ContactProblem, np.ndarray, list[str]]:
    """As `contact_problem`, whose further arguments are `more`, with its warnings as sentences."""
    origin, static, damping_ratio, hold = more
    if origin not in ("preloaded", "unloaded"):
        raise InputError(f"origin = '{origin}': must be 'preloaded' or 'unloaded'")
    check_kind("model", model, ReducedModel, "ReducedModel.from_matrices, .from_files or .load")
    check_kind("pairs", pairs, ContactTable, "ContactTable.load or a contact detection")
    check_law(law)
    if own := set(law.components) - set(ContactLaw.components):
        raise InputError(
            f"law {law.name}: acts on coordinates of its own, {', '.join(sorted(own))}, which "
            "pairs do not have; Problem(M, C, K).add(law, where) takes it"
        )
    kept = pairs.carrying
    if not kept.any():
        raise InputError(
            "no pair carries: every weight is 0; use linear_response for the model without damper"
        )
    used = pairs.select(kept)
    preload = used.preload if origin == "preloaded" else -used.kn * used.weight * used.gap
    settings = Contacts(used.kn * used.weight, used.kt * used.weight, used.mu, preload)
    law = law.select(kept)
    motion = relative_motion(model, used)
    held = held_motions(model, used, hold)
    B = motion
    if law.components != ContactLaw.components:
        columns = [ContactLaw.components.index(name) for name in law.components]
        B = motion[np.add.outer(3 * np.arange(len(used)), columns).ravel()]
    problem = ContactProblem(
        model.M,
        model.C if damping_ratio is None else None,
        model.K,
        B,
        law,
        settings,
        static,
        origin == "preloaded",
        damping_ratio,
        partial(describe_motion, model),
        held,
    )
    has_normal = law.components[-1:] == ("n",)
    normal = law.stuck_stiffness(settings)[:, -1] * has_normal
    doubts = [
        without_normal_motion(motion, used, normal),
        law.doubt(settings),
        *(one.doubt for one in held),
    ]
    return problem, kept, [doubt for doubt in doubts if doubt]
