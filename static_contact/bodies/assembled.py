"""The unreduced bodies side by side, as what `hbm.contact.relative_motion` asks of a model."""

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from tipdamp.hbm.errors import InputError, nearest, shown
from tipdamp.modal.body import Body


class AssembledBodies:
    """size - dofs of all bodies, one behind the other."""

    def __init__(self, bodies: list[Body]):
        ends = np.cumsum([body.dofs for body in bodies])
        self.size = int(ends[-1])
        self._bodies = {
            body.name: (body, int(end) - body.dofs) for body, end in zip(bodies, ends, strict=True)
        }

    def motion_of(self, body: str, numbers: ArrayLike) -> sp.csr_matrix:
        """(3n, size): x, y, z of nodes and contact points in turn, as `Body.motion_of`."""
        if body not in self._bodies:
            raise InputError(
                f"there is no body '{shown(str(body))}'; {nearest(str(body), list(self._bodies))}"
            )
        one, start = self._bodies[str(body)]
        own = one.motion_of(str(body), numbers)
        return sp.csr_matrix(
            (own.data, own.indices + start, own.indptr), shape=(own.shape[0], self.size)
        )
