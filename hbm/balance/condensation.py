"""Which contacts Newton's system consists of, and the receptance between them.

A contact that sticks through the cycle is not in it: its force is that of its spring. One that
stays open leaves it harmonic by harmonic, for there its deviation from the stuck spring is -k u in
every harmonic alike. With G the receptance, o the open ones and

    dg_o = E (r_o + G_or dg),     E = (I - k G_oo)^-1 k

the others see G + G_:o E G_o: and the residual r + G_:o E r_o (Woodbury): the structure without the
springs of the open contacts.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import lu_factor, lu_solve

from tipdamp.hbm.balance.kernels import alike_in_orders, sign_of
from tipdamp.hbm.balance.settings import DEFAULT
from tipdamp.hbm.laws.records import ContactForces

Between = Callable[[np.ndarray, np.ndarray], np.ndarray]  # receptance (to, at, K) of components


class ActiveContacts(NamedTuple):
    """Contacts whose force is not that of their springs all through the cycle.

    contacts (a,) : their numbers; D (a, nd, nh, nd, nh) : derivatives of their forces
    active (a, nd) : components on which these act; components (a nd,) : numbers of all of theirs
    places (n,) : of the active ones among these; rows (n,) : numbers of the active ones
    """

    contacts: np.ndarray
    D: np.ndarray
    active: np.ndarray
    components: np.ndarray
    places: np.ndarray
    rows: np.ndarray


def active_contacts(contacts: np.ndarray, D: np.ndarray, active: np.ndarray) -> ActiveContacts:
    """Contacts (a,) with the derivatives of their forces, and where these act (a, nd)."""
    nd = active.shape[1]
    components = (contacts[:, None] * nd + np.arange(nd)).ravel()
    places = np.flatnonzero(active)
    return ActiveContacts(contacts, D, active, components, places, components[places])


@dataclass(frozen=True)
class OpenContacts:
    """Contacts that have left the system.

    rows (p,) : their components; rates (p, K) N/m : derivative of the force by the displacement,
    order by order; factors : LU of I + rates G_oo, for each order
    response (K, p, n) : E G_or, their forces by those of the others
    """

    rows: np.ndarray
    rates: np.ndarray
    factors: list[Any]
    response: np.ndarray

    def forces(self, u: np.ndarray) -> np.ndarray:
        """(p, K) complex N, E u, at displacements u (p, K) complex of the stuck structure."""
        return _forces(self.factors, self.rates, u.T[:, :, None])[:, :, 0].T

    def forces_by(self, g: np.ndarray) -> np.ndarray:
        """(p, K) complex N under forces g (n, K) of the others."""
        return times_orders(self.response, g)

    def seen_by(self, row: np.ndarray) -> np.ndarray:
        """(n, K) what a row (p, K) of the open components adds to that of the others."""
        return np.matmul(row.T[:, None, :], self.response)[:, 0].T

    @property
    def sign(self) -> float:
        """Of the determinant of their part of the system: that of order 0, as the others are
        squares."""
        lu, pivots = self.factors[0]
        return sign_of(np.ascontiguousarray(lu.real), pivots)


class Condensed(NamedTuple):
    """Newton's system: the contacts in it, G (a nd, n, K) between their components and the active
    ones as the open contacts leave it; these, None where all are in it; and all active ones."""

    acting: ActiveContacts
    G: np.ndarray
    open: OpenContacts | None
    active: ActiveContacts


def condensed_contacts(forces: ContactForces, between: Between, lowest: int = 0) -> Condensed:
    """The system of contact forces at their orders from `lowest` on, from the receptance of the
    stuck structure at these: between(to, at) (len(to), len(at), K) of components."""
    acts = forces.active[forces.contacts]
    active = active_contacts(forces.contacts, forces.D, acts)
    alike, rates = alike_in_orders(active.D, acts, DEFAULT.open_rounding)
    if alike.sum() * acts.shape[1] < DEFAULT.few_open:
        G = np.ascontiguousarray(between(active.components, active.rows))
        return Condensed(active, G, None, active)
    acting, left = (
        active_contacts(active.contacts[at], active.D[at], acts[at]) for at in (~alike, alike)
    )
    rates = rates[alike, :, lowest:].reshape(len(left.rows), -1)
    own = by_orders(between(left.rows, left.rows))
    systems = np.eye(len(left.rows)) + rates.T[:, :, None] * own
    factors = [lu_factor(one, check_finite=False) for one in systems]
    response = _forces(factors, rates, by_orders(between(left.rows, acting.rows)))
    into = by_orders(between(acting.components, left.rows))
    G = between(acting.components, acting.rows) + np.moveaxis(into @ response, 0, 2)
    G = np.ascontiguousarray(G)
    return Condensed(acting, G, OpenContacts(left.rows, rates, factors, response), active)


def _forces(factors: list[Any], rates: np.ndarray, u: np.ndarray) -> np.ndarray:
    """(K, p, n) E u, at displacements u (K, p, n) of the stuck structure."""
    each = zip(factors, rates.T, u, strict=True)
    return np.array([lu_solve(lu, -k[:, None] * one, check_finite=False) for lu, k, one in each])


def by_orders(G: np.ndarray) -> np.ndarray:
    """(K, to, at) of a receptance (to, at, K)."""
    return np.ascontiguousarray(np.moveaxis(G, 2, 0))


def times_orders(matrices: np.ndarray, g: np.ndarray) -> np.ndarray:
    """(m, K) products of matrices (K, m, n) with g (n, K), order by order."""
    return np.matmul(matrices, np.ascontiguousarray(g.T)[:, :, None])[:, :, 0].T
