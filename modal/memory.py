"""How much memory bodies will need, foretold from their numbers of nodes and masters."""

from hbm.balance.memory import available_bytes
from hbm.errors import InputError

# Measured by tests/benchmarks/growth.py, assembly and reduction of a block of 8-node hexahedra with 186 master dofs:
# 0.60, 1.23, 2.51, 5.32 and 8.33 GB for 28, 57, 108, 207 and 298 thousand dofs. Matrices and boundary motions grow with
# the dofs, the two factors (for the modes and for their count) with dofs^(4/3): nested dissection in three dimensions.
_BYTES_PER_DOF, _FACTOR_BYTES, _GROWTH = 12e3, 240.0, 4 / 3
_MASTER_DOFS = 186  # of those measurements
_DENSE = 4          # arrays of dofs x master dofs held at once: Psi, M Psi, what the modes leave of it, its back-solve


def predicted_bytes(nodes: int, masters: int = 0) -> float:
    """Peak memory of assembly and reduction of a solid mesh onto so many master nodes, bytes, to a factor of 2."""
    dense = 8 * _DENSE * 3 * nodes * max(3 * masters - _MASTER_DOFS, 0)
    return _BYTES_PER_DOF * 3 * nodes + _FACTOR_BYTES * (3 * nodes) ** _GROWTH + dense


def check_memory(*bodies) -> None:
    """Raises InputError before any heavy work when the bodies, held together, are predicted to need more than there is.

    bodies : (nodes, masters, source) of each; masters 0 where they are not known yet
    """
    need, there = sum(predicted_bytes(nodes, masters) for nodes, masters, _ in bodies), available_bytes()
    if need > there:
        sizes = "; ".join(f"{source}: {nodes} nodes ({3 * nodes} dofs{f', {masters} master nodes' if masters else ''})"
                          for nodes, masters, source in bodies)
        raise InputError(f"{sizes} are predicted to need {need / 1e9:.0f} GB of memory to assemble and reduce, "
                         f"{there / 1e9:.1f} GB are available; coarsen the mesh, name fewer masters, or reduce it "
                         "elsewhere and give matrices")
