"""Piecewise-linear contact laws as tables: what event-driven time integration needs of a law.

A contact is in one of finitely many states. In each state its force is linear in the relative
motion and in a memory (slider positions), and each entry of the memory either rests or is carried
along by the motion. A state ends when one of its guards, negative while the state lasts, rises
through zero.

    f = stiffness u + by_memory m + offset        m = follow_u u + follow_0  where the motion
    carries it along

`slider_table` is the table of Coulomb friction behind tangential springs under a unilateral normal
spring, `merged_table` joins tables of several laws.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws.records import Contacts, ContactState

STICK, FORWARD, BACKWARD, OPEN = ContactState  # of one tangent
SHAPES = {
    "initial": "P",
    "stiffness": "PSnn",
    "by_memory": "PSnm",
    "offset": "PSn",
    "follows": "Sm",
    "follow_u": "PSmn",
    "follow_0": "PSm",
    "state": "G",
    "next_state": "G",
    "of_rate": "G",
    "entry": "G",
    "guard_u": "PGn",
    "guard_memory": "PGm",
    "guard_0": "PG",
    "watched": "PG",
}


@dataclass(frozen=True)
class PiecewiseLinear:
    """Table of P contacts with S states, G guards, n components and m entries of memory.

    initial : (P,) int, state from which that at a given motion is sought (see `settled`)
    stiffness (P, S, n, n) N/m, by_memory (P, S, n, m), offset (P, S, n) N : force in each state
    follows : (S, m) bool, entries of the memory that the motion carries along in a state; the
    others rest follow_u (P, S, m, n), follow_0 (P, S, m) : where the motion carries them
    state, next_state : (G,) int, state that a guard ends and the one that comes next; of guards
        that reach zero together the one listed first acts
    of_rate : (G,) bool, the guard is guard_u u', not guard_u u + guard_memory m + guard_0 (in m)
    entry : (G,) bool, guards of the next state that stand at zero and rise end it at once
    guard_u (P, G, n), guard_memory (P, G, m), guard_0 (P, G)
    watched : (P, G) bool, guards that can act on a contact
    The memory is the leading m entries of the state of the law. Raises InputError where shapes do
    not fit.
    """

    initial: np.ndarray
    stiffness: np.ndarray
    by_memory: np.ndarray
    offset: np.ndarray
    follows: np.ndarray
    follow_u: np.ndarray
    follow_0: np.ndarray
    state: np.ndarray
    next_state: np.ndarray
    of_rate: np.ndarray
    entry: np.ndarray
    guard_u: np.ndarray
    guard_memory: np.ndarray
    guard_0: np.ndarray
    watched: np.ndarray

    def __post_init__(self) -> None:
        size = dict(zip("PSnm", np.shape(self.by_memory), strict=False)) | {"G": len(self.state)}
        for name, given in list(vars(self).items()):
            value = np.asarray(given)
            wanted = tuple(size.get(letter, -1) for letter in SHAPES[name])
            if value.shape != wanted:
                raise InputError(
                    f"PiecewiseLinear: {name} has the shape {value.shape}, must be {wanted}"
                )
            object.__setattr__(self, name, value)

    def resolved(self) -> "PiecewiseLinear":
        """The same table with forces and guards by the motion alone where the motion carries the
        memory along."""
        carried = self.follows[None, :, :, None]
        along = np.where(carried, self.follow_u, 0.0)
        to = np.where(carried[..., 0], self.follow_0, 0.0)
        of_guard = along[:, self.state], to[:, self.state]
        return replace(
            self,
            stiffness=self.stiffness + self.by_memory @ along,
            offset=self.offset + np.einsum("psim,psm->psi", self.by_memory, to),
            by_memory=np.where(self.follows[None, :, None], 0.0, self.by_memory),
            guard_u=self.guard_u + np.einsum("pgm,pgmi->pgi", self.guard_memory, of_guard[0]),
            guard_0=self.guard_0 + np.einsum("pgm,pgm->pg", self.guard_memory, of_guard[1]),
            guard_memory=np.where(self.follows[self.state][None], 0.0, self.guard_memory),
        )

    def settled(
        self, u: np.ndarray, v: np.ndarray, state: np.ndarray, memory: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """(state (P,), memory (P, m)) after the motion has come to u (P, n) m with the rate v (P,
        n) m/s.

        Guards act in the order of the table until none is positive: guards of the rate first, then
        the others."""
        state, memory = np.array(state), np.array(memory, dtype=float)
        at, rate = np.arange(len(state)), np.einsum("pgn,pn->pg", self.guard_u, v)
        self._switch(state, at, (rate > 0) & self.of_rate)
        for _ in range(4 * self.follows.shape[0]):
            carried = (
                np.einsum("pmn,pn->pm", self.follow_u[at, state], u) + self.follow_0[at, state]
            )
            memory = np.where(self.follows[state], carried, memory)
            value = (
                np.einsum("pgn,pn->pg", self.guard_u, u)
                + np.einsum("pgm,pm->pg", self.guard_memory, memory)
                + self.guard_0
            )
            if not self._switch(state, at, (value > 0) & ~self.of_rate):
                break
        return state, memory

    def _switch(self, state: np.ndarray, at: np.ndarray, positive: np.ndarray) -> bool:
        """Put the contacts of which a guard acts into their next state; whether there are any."""
        if not positive.size:
            return False
        acts = positive & self.watched & (self.state == state[:, None])
        first, some = acts.argmax(axis=1), acts.any(axis=1)
        state[some] = self.next_state[first[some]]
        return bool(some.any())


def slider_table(contacts: Contacts, tangents: int, normal: bool) -> PiecewiseLinear:
    """Table of `tangents` sliders behind springs kt, each held by |T| <= mu N [Yang, Menq 1998].

    N = max(0, preload + kn u_n), u_n the last component, or N = preload where there is no normal
    component. The force is T = kt (u - w): the slider w rests (stick) until low = u - mu N/kt or
    high = u + mu N/kt pushes it (slip forward, backward), and follows u while the contact is open.
    States: those of each tangent while closed, then open."""
    P, nd = len(contacts), tangents + normal
    slides = (contacts.kt > 0) & (contacts.mu > 0)
    kt, kn = np.where(slides, contacts.kt, 0.0), contacts.kn if normal else np.zeros(P)
    reach = np.divide(contacts.mu, contacts.kt, out=np.zeros(P), where=slides)
    way_u, way_0 = _ways_of_sliders(reach, kn, contacts.preload, tangents, normal)
    closed = list(product((STICK, FORWARD, BACKWARD), repeat=tangents))
    opened = len(closed)
    states = np.array([*closed, (OPEN,) * tangents], dtype=int)
    stiffness = np.zeros((P, opened + 1, nd, nd))
    by_memory = np.zeros((P, opened + 1, nd, tangents))
    offset, each = np.zeros((P, opened + 1, nd)), np.arange(tangents)
    stiffness[:, :, each, each], by_memory[:, :, each, each] = kt[:, None, None], -kt[:, None, None]
    if normal:
        stiffness[:, :opened, -1, -1], offset[:, :opened, -1] = (
            kn[:, None],
            contacts.preload[:, None],
        )
    rests_open = (contacts.preload <= 0) & (kn == 0)
    guards = _opening(contacts.preload, kn, closed, tangents) if normal else []
    guards += _slip_and_stop(way_u, way_0, slides & ~rests_open, closed)
    return PiecewiseLinear(
        np.where(rests_open, opened, 0),
        stiffness,
        by_memory,
        offset,
        states != STICK,
        way_u[states, :, each].transpose(2, 0, 1, 3),
        way_0[states, :, each].transpose(2, 0, 1),
        *(np.array([guard[i] for guard in guards]) for i in range(4)),
        *(np.stack([guard[i] for guard in guards], axis=1) for i in range(4, 8)),
    )


def _ways_of_sliders(
    reach: np.ndarray, kn: np.ndarray, preload: np.ndarray, tangents: int, normal: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Where the sliders are in each state that moves them: (4, P, tangents, n) of the motion, and
    (4, P, tangents) m."""
    P, each = len(reach), np.arange(tangents)
    way_u, way_0 = np.zeros((4, P, tangents, tangents + normal)), np.zeros((4, P, tangents))
    for state, sign in ((FORWARD, -1.0), (BACKWARD, 1.0), (OPEN, 0.0)):
        way_u[state][:, each, each] = 1.0
        if normal:
            way_u[state][:, :, -1] = (sign * reach * kn)[:, None]
        way_0[state] = (sign * reach * preload)[:, None]
    return way_u, way_0


def _opening(
    preload: np.ndarray,
    kn: np.ndarray,
    closed: Sequence[tuple[ContactState, ...]],
    tangents: int,
) -> list[tuple]:
    """Guards by which a contact opens from each closed state, and closes into stick."""
    P, unilateral = len(kn), kn > 0
    gap_u, none = np.zeros((P, tangents + 1)), np.zeros((P, tangents))
    gap_u[:, -1] = -1.0
    gap_0 = -np.divide(preload, kn, out=np.zeros(P), where=unilateral)
    opens = [
        (s, len(closed), False, False, gap_u, none, gap_0, unilateral) for s in range(len(closed))
    ]
    return [*opens, (len(closed), 0, False, True, -gap_u, none, -gap_0, unilateral)]


def _slip_and_stop(
    way_u: np.ndarray,
    way_0: np.ndarray,
    slides: np.ndarray,
    closed: list[tuple[ContactState, ...]],
) -> list[tuple]:
    """Guards by which each tangent slips from stick, and sticks where the rate of its slider
    changes sign."""
    guards = []
    for s, modes in enumerate(closed):
        for d, mode in enumerate(modes):
            slider = np.zeros(way_0.shape[1:])
            slider[:, d] = 1.0
            for moving, sign in ((FORWARD, 1.0), (BACKWARD, -1.0)):
                u, u0 = sign * way_u[moving][:, d], sign * way_0[moving][:, d]
                after = closed.index(
                    (*modes[:d], moving if mode == STICK else STICK, *modes[d + 1 :])
                )
                if mode == STICK:
                    guards.append((s, after, False, False, u, -sign * slider, u0, slides))
                elif mode == moving:
                    guards.append((s, after, True, False, -u, 0 * slider, -u0, slides))
    return guards


def merged_table(
    parts: Sequence[tuple[PiecewiseLinear, np.ndarray, Any]], force: np.ndarray
) -> PiecewiseLinear:
    """One table of the tables of several laws, each with contacts of its own.

    parts : (table, its contacts (p,) int, its components (k,) int) of each law
    force : (P, n) N, constant force of the components that the law of a contact does not know
    """
    tables = [table for table, *_ in parts]
    total = {
        "P": len(force),
        "n": force.shape[1],
        "S": sum(len(t.follows) for t in tables),
        "G": sum(len(t.state) for t in tables),
        "m": max(t.follows.shape[1] for t in tables),
    }
    whole = {
        name: np.zeros([total[letter] for letter in SHAPES[name]], values.dtype)
        for name, values in vars(tables[0]).items()
    }
    whole["offset"][:] = force[:, None]
    first = {"S": 0, "G": 0}
    for table, contacts, components in parts:
        S, m = table.follows.shape
        at: dict[str, Any] = {
            "P": contacts,
            "n": components,
            "m": np.arange(m),
            "S": first["S"] + np.arange(S),
            "G": first["G"] + np.arange(len(table.state)),
        }
        for name, letters in SHAPES.items():
            shift = first["S"] if name in ("initial", "state", "next_state") else 0
            whole[name][np.ix_(*(at[letter] for letter in letters))] = vars(table)[name] + shift
        first = {"S": first["S"] + S, "G": first["G"] + len(table.state)}
    return PiecewiseLinear(**whole)
