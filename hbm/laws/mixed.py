"""Several laws in one model: every pair has its own.

    law = MixedLaw((DryFriction2T(), UnilateralSpring()), of_pair=[0, 0, 1, 0])
"""

from dataclasses import dataclass, replace

import numpy as np

from hbm.balance import aft
from hbm.errors import InputError
from hbm.laws import Contacts, Tangents

COMPONENTS = ("t1", "t2", "n")


@dataclass(frozen=True)
class MixedLaw:
    """Pair p follows laws[of_pair[p]]; components that its law does not know are free of force but for the preload.

    laws : tuple of laws, of any kind; of_pair : (P,) whole numbers, one for each pair of the contact table
    """

    laws: tuple
    of_pair: tuple
    name: str = "MixedLaw"
    components: tuple = COMPONENTS
    tangents: int = 2
    has_normal: bool = True
    corridor: bool = False

    def __post_init__(self):
        of_pair = np.asarray(self.of_pair)
        if of_pair.ndim != 1 or of_pair.dtype.kind not in "iu" or not np.isin(of_pair, range(len(self.laws))).all():
            raise InputError(f"of_pair: must hold a whole number from 0 to {len(self.laws) - 1} for each pair")
        object.__setattr__(self, "of_pair", tuple(of_pair.tolist()))

    def of_pairs(self, kept) -> "MixedLaw":
        """The law of some pairs of the table, by a mask."""
        if len(kept) != len(self.of_pair):
            raise InputError(f"of_pair has {len(self.of_pair)} entries, the contact table {len(kept)} pairs")
        return replace(self, of_pair=tuple(np.asarray(self.of_pair, dtype=int)[kept].tolist()))

    def stuck_stiffness(self, pairs: Contacts) -> np.ndarray:
        """(P, 3) stuck stiffness of each component, N/m."""
        k = np.zeros((len(pairs), 3))
        for law, at, columns in self._parts(pairs):
            k[np.ix_(at, columns)] = law.stuck_stiffness(_some(pairs, at))
        return k

    def harmonics(self, pairs: Contacts, x, start, grid):
        """g, D, moves, shares of all pairs: those of each law, in the places of its pairs and components."""
        P, nd, nh = x.shape
        g, D = np.zeros(x.shape), np.zeros((P, nd, nh, nd, nh))
        moves, shares = np.zeros((P, nd), dtype=bool), np.zeros((P, 3))
        sliders, from_position = start
        for law, at, columns in self._parts(pairs):
            given = np.ascontiguousarray(sliders[at, :max(law.tangents, 1)]), from_position
            b = aft.evaluate(law, _some(pairs, at), x[np.ix_(at, columns)], given, grid)
            g[np.ix_(at, columns)], moves[np.ix_(at, columns)], shares[at] = b.g, b.row, b.shares
            D[np.ix_(at[b.pair], columns, range(nh), columns, range(nh))] = b.D
        return g, D, moves, shares

    @property
    def states(self) -> int:
        """Length of the state of a pair in the time integration: of the law that needs most."""
        return max(_states(law) for law in self.laws)

    @property
    def kept(self) -> int:
        """Leading entries of the state that shooting must keep: all, as they mean something else for each law."""
        return self.states

    def begin(self, u, sliders, from_position, pairs):
        """State (P, states) at t = 0, where the motion is u (P, 3)."""
        state = np.zeros((len(pairs), self.states))
        for law, at, columns in self._parts(pairs):
            own, given = u[np.ix_(at, columns)], sliders[at, :law.tangents]
            if law.corridor:
                begun = np.concatenate([own[:, :law.tangents] if from_position else given, own], axis=1)
                state[at, :_states(law)] = begun[:, :_states(law)]
            else:
                state[at, :law.states] = law.begin(own, given, from_position, _some(pairs, at))
        return state

    def step(self, u, state, pairs):
        """Force (P, 3), state and tangents after the motion went on to u; laws without a normal carry the preload."""
        P, ns = len(pairs), self.states
        force, new = np.zeros((P, 3)), np.array(state, dtype=float)
        t = Tangents(np.zeros((P, 3, 3)), np.zeros((P, 3, ns)), np.zeros((P, ns, 3)), np.zeros((P, ns, ns)))
        force[:, 2] = pairs.preload
        for law, at, columns in self._parts(pairs):
            own, n = _some(pairs, at), np.arange(_states(law))
            motion, before = u[np.ix_(at, columns)], state[np.ix_(at, n)]
            f, after, by = _corridor_step(law, motion, before, own) if law.corridor else law.step(motion, before, own)
            if law.has_normal:
                force[at, 2] = 0.0
            force[np.ix_(at, columns)] += f
            new[np.ix_(at, n)] = after
            for name, rows, along in (("force_u", columns, columns), ("force_slider", columns, n),
                                      ("slider_u", n, columns), ("slider_slider", n, n)):
                getattr(t, name)[np.ix_(at, rows, along)] = getattr(by, name)
        return force, new, t

    def _parts(self, pairs):
        """(law, its pairs, its columns) of every law that has pairs."""
        if len(pairs) != len(self.of_pair):
            raise InputError(f"of_pair has {len(self.of_pair)} entries for {len(pairs)} pairs")
        of_pair = np.asarray(self.of_pair, dtype=int)
        for i, law in enumerate(self.laws):
            at = np.flatnonzero(of_pair == i)
            if len(at):
                yield law, at, [COMPONENTS.index(c) for c in law.components]


def _some(pairs, at):
    return Contacts(pairs.kn[at], pairs.kt[at], pairs.mu[at], pairs.preload[at])


def _states(law) -> int:
    """Of a corridor law with sliders: these, and the motion before, for the instant of re-contact."""
    if not law.corridor:
        return law.states
    return law.tangents + len(law.components) if law.tangents else 0


def _corridor_step(law, u, state, pairs):
    """One step of a corridor law; a pair that closes takes up its sliders where the motion was at contact.

    The derivatives are those of the force and of the sliders by the motion, as Newton within a step needs them.
    """
    nt, ns = law.tangents, _states(law)
    sliders, before = state[:, :nt].copy(), state[:, nt:]
    if nt and law.has_normal:
        N0, N1 = (pairs.preload + pairs.kn * motion[:, -1] for motion in (before, u))
        closes = (N0 <= 0) & (N1 > 0)
        share = np.divide(N0, N0 - N1, out=np.zeros(len(u)), where=closes)
        touch = before[:, :nt] + share[:, None] * (u - before)[:, :nt]
        sliders[closes] = touch[closes]
    force, new, t = law.step(u, sliders, pairs)
    by_u = t.force_u.copy()
    if nt and law.has_normal:
        moved = np.zeros((len(u), nt, u.shape[1]))
        moved[:, np.arange(nt), np.arange(nt)] = share[:, None]
        moved[:, :, -1] = (np.divide(N0 * pairs.kn, (N0 - N1) ** 2, out=np.zeros(len(u)), where=closes)[:, None]
                           * (u - before)[:, :nt])
        by_u += np.einsum("pds,psu->pdu", t.force_slider, moved * closes[:, None, None])
    none = np.zeros((len(u), ns, ns))
    return force, np.concatenate([new, u], axis=1)[:, :ns], Tangents(
        by_u, np.zeros((len(u), u.shape[1], ns)), np.zeros((len(u), ns, u.shape[1])), none)
