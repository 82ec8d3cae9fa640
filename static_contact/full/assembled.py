"""The unreduced bodies side by side, as what `hbm.contact.relative_motion` asks of a model."""

import numpy as np

from hbm.errors import InputError
from modal.body import Body


class AssembledBodies:
    """size - dofs of all bodies, one behind the other."""

    def __init__(self, bodies: list[Body]):
        self.size, self._table = 0, {}
        for body in bodies:
            dofs = np.full((len(body.node), 3), -1)
            dofs[body.dof_node, body.dof_direction] = np.arange(self.size, self.size + body.dofs)
            order = np.argsort(body.node)
            self._table[body.name] = body.node[order], dofs[order]
            self.size += body.dofs

    def dofs(self, body: str, node: int) -> np.ndarray:
        """(3,) int: dofs of a node along x, y, z; -1 where it is clamped. Raises InputError for a node that is not
        there."""
        numbers, dofs = self._table[str(body)]
        place = int(np.searchsorted(numbers, node))
        if place == len(numbers) or numbers[place] != node:
            raise InputError(f"body '{body}' has no node {node}")
        return dofs[place]
