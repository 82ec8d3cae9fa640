"""Several laws in one model: every pair has its own.

    law = MixedLaw((DryFriction2T(), UnilateralSpring()), of_pair=[0, 0, 1, 0])
"""

from dataclasses import dataclass, replace

import numpy as np

from hbm import aft
from hbm.errors import InputError
from hbm.laws import PairSettings

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

    def stuck_stiffness(self, pairs: PairSettings) -> np.ndarray:
        """(P, 3) stuck stiffness of each component, N/m."""
        k = np.zeros((len(pairs), 3))
        for law, at, columns in self._parts(pairs):
            k[np.ix_(at, columns)] = law.stuck_stiffness(_some(pairs, at))
        return k

    def harmonics(self, pairs: PairSettings, x, start, grid):
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
    return PairSettings(pairs.kn[at], pairs.kt[at], pairs.mu[at], pairs.preload[at])
