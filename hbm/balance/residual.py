"""Harmonic balance condensed to the relative motion at the contacts.

    u_k + G(k w) [f_k(u) - K_c u_k] = G-response to the external force,        k = 0..H

G is the receptance of the stuck system at the contacts; in brackets is the deviation of the contact
forces from the stuck springs (`tipdamp.hbm.laws.records.ContactForces`). Newton's linear system:
`tipdamp.hbm.balance.newton`.
"""

from collections.abc import Callable
from copy import copy
from dataclasses import replace
from functools import cached_property, partial
from typing import Any, NamedTuple, Self

import numpy as np
import scipy.sparse as sp

from tipdamp.hbm import fourier
from tipdamp.hbm.balance import aft
from tipdamp.hbm.balance.kernels import away_from, by_order, modal_push, regularise
from tipdamp.hbm.balance.newton import Linearisation
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.balance.receptance import Receptance
from tipdamp.hbm.balance.reduced import reduced_receptance
from tipdamp.hbm.balance.series import ContactReceptance, contact_receptance, real_times
from tipdamp.hbm.balance.settings import DEFAULT
from tipdamp.hbm.laws.records import ContactForces, Contacts
from tipdamp.hbm.validation import check_samples


class Terms(NamedTuple):
    """What one evaluation consists of: modal q = factors * push, orders 0..H, m modes.

    u : (P, nd, nh) m; w : rad/s; forces : of the contacts; push : (m, H+1) N, modal
    factors, rates : (m, H+1) of the receptance, and their derivatives by the angular frequency of
    the order
    """

    u: np.ndarray
    w: float
    forces: ContactForces
    push: np.ndarray
    factors: np.ndarray
    rates: np.ndarray


Derivative = Callable[["HarmonicBalance", Terms], np.ndarray]  # (m, H+1), of the modal q at given u


def by_frequency(balance: "HarmonicBalance", t: Terms) -> np.ndarray:
    """(m, H+1) derivative of the modal q by w."""
    rate = by_order(t.rates, t.push)
    return (
        rate if t.forces.by_omega is None else rate - balance.modal_response(t, t.forces.by_omega)
    )


def by_level(balance: "HarmonicBalance", t: Terms) -> np.ndarray:
    """(m, H+1) derivative of the modal q by the force level."""
    return t.factors * balance.force


class HarmonicBalance:
    """Residual of a ContactProblem under forces {harmonic: (r,) complex N} for harmonics 0..H.

    x (P nd nh,) are the real coefficients of the relative motion, contact by contact, component by
    component.
    start, samples : as in `tipdamp.hbm.curve.options.CurveOptions`. Raises InputError where these
        do not fit.
    """

    def __init__(
        self,
        problem: ContactProblem,
        forces: dict,
        H: int,
        start: str | np.ndarray = "zero_slider",
        samples: int | None = None,
    ) -> None:
        law = problem.law
        P = len(problem.contacts)
        self.forces = forces
        self.given_start = start
        self.problem = problem
        self.H = H
        self.nh = fourier.n_real(H)
        self.nd = len(law.components)
        self.n_components = P * self.nd
        self.start = aft.slider_start(start, P, law.sliders)._replace(nearest=True)
        self.grid = aft.sample_grid(H, check_samples(samples, H) or law.default_samples(H))
        self.springs = law.stuck_stiffness(problem.contacts)
        self.own = self.cycle(problem.contacts)
        self.weights = np.tile(
            np.r_[DEFAULT.order_zero_weight, np.ones(self.nh - 1)], self.n_components
        )
        self.on_call: Callable[[], None] | None = None  # called at each evaluation
        self.cover = np.full(1 + P, np.inf)  # what its modes hold for: see `covering`
        self._covering: Any = self  # with the modes of the contacts that have acted so far
        if problem.varying is None and not problem.reducible:  # the first thing that takes time
            problem.receptance()
        if problem.varying is None:
            problem.check_mean(forces.get(0))

    @cached_property
    def receptance(self) -> Receptance:
        """Of the stuck system: all modes, or in a balance of `covering` those that matter there."""
        return self.problem.receptance()

    @cached_property
    def shapes(self) -> np.ndarray:
        """(nc, m) modes at the components of the contacts."""
        return self.contact_receptance.shapes

    @property
    def into(self) -> np.ndarray:
        """(nc, m) left modes at the components, by which the contact forces act."""
        return self.contact_receptance.into

    @cached_property
    def contact_receptance(self) -> ContactReceptance:
        """Between the components: that of the problem, for all its curves, where it has all modes
        and all components are taken at once; else what is taken depends on the contacts that have
        acted so far."""
        if np.isinf(self.cover[0]) and self.n_components <= DEFAULT.few_components:
            return self.problem.contact_receptance
        return contact_receptance(self.receptance, self.problem.B)

    @cached_property
    def reaction_rows(self) -> np.ndarray:
        """(h, m) of `ContactProblem.reaction_rows`."""
        return self.problem.reaction_rows(self.receptance)

    @cached_property
    def force(self) -> np.ndarray:
        """(m, H+1) N, modal, of level 1, without the constant parts."""
        force = np.zeros((self.receptance.shapes.shape[1], self.H + 1), dtype=complex)
        for k, F in self.forces.items():
            force[:, k] = self.receptance.into.T @ F
        return force

    @cached_property
    def damping(self) -> np.ndarray:
        """(m, m) or its diagonal (m,), N s/m, of the modal coordinates."""
        of = self.receptance
        if of.poles.size:
            return of.shapes.conj().T @ (self.problem.C @ of.shapes)
        constraints = np.zeros(len(of.constraint_forces))
        return np.r_[of.damping, of.free_damping, constraints]

    @cached_property
    def circulation(self) -> np.ndarray | None:
        """(m, m) N/m, modal, of the forces of the displacement that do work in a cycle: those of a
        stiffness that is not symmetric, and of structural damping; None where there are none."""
        skew = self.problem.circulatory
        shapes = self.receptance.shapes
        return None if skew is None else shapes.conj().T @ (skew @ shapes)

    @cached_property
    def static(self) -> np.ndarray:
        """(m,) N, modal, constant."""
        into = self.receptance.into
        static = self.problem.static
        return np.zeros(into.shape[1]) if static is None else into.T @ static

    def covering(self, cover: np.ndarray) -> Self:
        """This balance with modes that suffice for forces on some contacts up to some frequency.

        cover (1 + P,) : the frequency of the highest harmonic, rad/s, and 1 for each of these
            contacts, else 0; infinite for all modes. It tells the modes: made again, they are the
            same to the last digit.
        """
        if np.array_equal(cover, self._covering.cover):
            return self._covering
        other = copy(self)
        system = self.problem.reducible
        for name in (
            "receptance",
            "contact_receptance",
            "reaction_rows",
            "force",
            "static",
            "damping",
            "circulation",
        ):
            vars(other).pop(name, None)
        if system and np.isfinite(cover[0]):
            rows = np.flatnonzero(np.repeat(cover[1:] > 0, self.nd))
            loads = [part for F in self.forces.values() for part in (np.real(F), np.imag(F))]
            loads += [] if self.problem.static is None else [self.problem.static]
            columns = np.column_stack([_dense(self.problem.B[rows]).T, *loads])
            found = reduced_receptance(system, columns, cover[0])
            cover = cover if found else np.full_like(cover, np.inf)
            other.receptance = found or self.problem.receptance()
        other.cover = cover
        self._covering = other
        return other

    def _covering_for(self, w: float, acting: np.ndarray, u: np.ndarray | None = None) -> Self:
        """The balance with modes for the contacts `acting` (P,) at w and u, and for those that have
        acted before."""
        now = self._covering
        top = w * max(self.H, 1)
        before = now.cover if now is not self else np.zeros_like(now.cover)
        if (
            now is self
            and not self.problem.reducible
            or top <= before[0]
            and not (acting & (before[1:] == 0)).any()
        ):
            return now
        top = before[0] if top <= before[0] else DEFAULT.reduced_headroom * top
        return self.covering(
            np.r_[
                top, np.maximum(before[1:], acting if u is None else self._soon(u, acting, before))
            ]
        )

    def _soon(self, u: np.ndarray, acting: np.ndarray, before: np.ndarray) -> np.ndarray:
        """(P,) bool, `acting` and contacts that are next to slip or lift: some more than before, or
        modes would be sought for one after the other."""
        law = self.problem.law
        contacts = self.problem.contacts
        amplitude = np.abs(fourier.to_complex(u)).sum(axis=2)
        known = law.sticks_surely(contacts, 0 * amplitude)
        for factor in DEFAULT.reduced_growth:
            more = acting | known & ~law.sticks_surely(contacts, factor * amplitude)
            if more.sum() >= DEFAULT.reduced_growth[0] * before[1:].sum():
                return more
        return acting

    def rebuilt(self, problem: ContactProblem, forces: dict) -> Any:
        """The same balance of another problem or other forces."""
        other = HarmonicBalance(problem, forces, self.H, self.given_start, self.grid.samples)
        other.on_call = self.on_call
        return other

    def with_damping(self, factor: float) -> Self:
        """The same balance with the damping times a factor; where it does not couple the modes
        these are kept."""
        known = self.receptance
        floats = known.free_damping.size > 0  # and the shapes behind its modes follow the damping
        if self.problem.reducible or floats or self.problem.C is not None:
            return self.rebuilt(self.problem.with_damping(factor), self.forces)
        other = copy(self)
        at = self.contact_receptance
        damped = known.with_damping(factor)
        vars(other).pop("damping", None)
        other.receptance = damped
        other.contact_receptance = ContactReceptance(damped, at.shapes, at.into)
        other._covering = other
        return other

    def damping_push(self, modal: np.ndarray, w: float) -> np.ndarray:
        """(m, H+1) N, modal, of the damping in a motion with coordinates (m, H+1)."""
        orders = w * np.arange(self.H + 1)
        if self.receptance.ratio.size:
            return 1j * orders * (self.damping[:, None] * modal)
        problem = self.problem
        q = self.receptance.shapes @ modal
        C: Any = problem.C
        force = 1j * orders * (0.5 * (C + C.T) @ q)
        if problem.structural is not None:
            force += 1j * (orders != 0) * (problem.structural @ q)
        return self.receptance.into.T @ force

    def padded(self, x: np.ndarray) -> np.ndarray:
        """x of a balance with fewer orders, with zeros at the others."""
        full = np.zeros((self.n_components, self.nh))
        given = x.reshape(self.n_components, -1)
        full[:, : given.shape[1]] = given
        return full.ravel()

    def linear(self, w: float, level: float = 1.0) -> np.ndarray:
        """x of the stuck system at a force level: the solution while every contact sticks."""
        modes = self._covering_for(w, np.zeros(len(self.problem.contacts), dtype=bool))
        factors = modes.receptance.factors(w * np.arange(self.H + 1))[0]
        return fourier.to_real(modes.shapes @ (factors * modes.force_at(level))).ravel()

    def force_at(self, level: float) -> np.ndarray:
        """(m, H+1) modal force at a force level, constant parts included."""
        force = level * self.force
        force[:, 0] += self.static
        return force

    def evaluate(
        self,
        x: np.ndarray,
        w: float,
        level: float = 1.0,
        contacts: Contacts | None = None,
        derivative: Derivative = by_frequency,
    ) -> Linearisation:
        """Linearisation at x, the angular frequency w and a force level.

        contacts : other settings than those of the problem; derivative : by the parameter of a
        branch
        """
        if self.on_call:
            self.on_call()
        u = x.reshape(len(self.problem.contacts), self.nd, self.nh)
        regularised = partial(self.regularised_forces, u, w, contacts)
        forces = regularised()
        if self._covering is self and not self.problem.reducible:  # all modes are there
            return self._linearised(x, w, level, forces, regularised, derivative)
        every = contacts is not None or derivative not in (by_frequency, by_level)
        acting = forces.active.any(axis=1) | forces.g.any(axis=(1, 2)) | every
        modes = self._covering_for(w, acting, u)
        return modes._linearised(x, w, level, forces, regularised, derivative)

    def _linearised(
        self,
        x: np.ndarray,
        w: float,
        level: float,
        forces: ContactForces,
        again: Callable[[], ContactForces],
        derivative: Callable,
    ) -> Linearisation:
        """As `evaluate`, with the contact forces at x, computed again by `again`, and the modes of
        this balance."""
        factors, rates = self.receptance.factors(w * np.arange(self.H + 1))
        g = forces.g.reshape(-1, self.nh)
        rows = np.flatnonzero(g.any(axis=1))  # those that move
        contact = real_times(self.contact_receptance.into_of(rows).T, fourier.to_complex(g[rows]))
        push = modal_push(level, self.force, self.static, contact)
        modal = factors * push
        u = x.reshape(len(self.problem.contacts), self.nd, self.nh)
        modal_rate = derivative(self, Terms(u, w, forces, push, factors, rates))
        both = real_times(self.shapes, np.concatenate([modal, modal_rate], axis=1))
        residual, by_parameter = away_from(x, both)
        return Linearisation(
            x,
            residual,
            by_parameter,
            replace(forces, D=np.empty((0, *forces.D.shape[1:]))),
            modal,
            self,
            factors,
            w,
            modal_rate,
            lambda: again().D,
            [forces.D],
        )

    def modal_response(self, t: Terms, g: np.ndarray) -> np.ndarray:
        """(m, H+1) modal q under contact forces g (P, nd, nh) N on the bodies."""
        return t.factors * real_times(self.into.T, fourier.to_complex(g.reshape(-1, self.nh)))

    def cycle(self, contacts: Contacts) -> aft.Cycle:
        """The contacts of the problem, with these settings; their springs stay those of the
        problem."""
        return aft.Cycle(
            self.problem.law,
            contacts,
            self.springs,
            self.problem.rest_force(contacts),
            self.start,
            self.grid,
        )

    def contact_forces(
        self,
        u: np.ndarray,
        w: float,
        contacts: Contacts | None = None,
        known: ContactForces | None = None,
    ) -> ContactForces:
        """At the relative motion u (P, nd, nh), their g as the deviation from the force at rest and
        the stuck springs.

        contacts : other settings; the springs stay those of the problem, and their difference goes
        into the forces. known : as in `aft.Cycle.forces`."""
        return (self.own if contacts is None else self.cycle(contacts)).forces(u, w, known)

    def sampled(self, x: np.ndarray, w: float) -> bool:
        """Whether the contact forces at x (n,) and w rad/s depend on the samples of the cycle."""
        u = x.reshape(len(self.problem.contacts), self.nd, self.nh)
        finer = aft.sample_grid(self.H, 2 * self.grid.samples)
        g, exact = (
            aft.evaluate(self.problem.law, self.problem.contacts, u, self.start, grid, w).g
            for grid in (self.grid, finer)
        )
        return bool(np.abs(g - exact).max() > DEFAULT.sampling * np.abs(exact).max())

    def regularised_forces(
        self, u: np.ndarray, w: float, contacts: Contacts | None = None
    ) -> ContactForces:
        """`contact_forces` with a weak regularisation of the mean position in their derivative.

        Where every contact moves its slider in each cycle, no force depends on the mean position of
        a free body along the sliding direction: it may stand anywhere, and Newton's matrix is
        singular in that motion though the rest is well determined. Regularised, the body stays
        where it was; the residual, and so the solution, is not changed."""
        forces = self.contact_forces(u, w, contacts)
        regularise(forces.D, forces.contacts, self.springs, forces.active, DEFAULT.regularisation)
        return forces

    def regularisation(self, forces: ContactForces) -> np.ndarray:
        """(P nd,) N/m that Newton's matrix adds to the mean positions: a small share of the active
        stuck springs."""
        return DEFAULT.regularisation * (self.springs * forces.active).ravel()


def _dense(B: sp.spmatrix) -> np.ndarray:
    return B.toarray() if sp.issparse(B) else np.asarray(B)
