"""How much memory bodies will need, predicted from their numbers of nodes and masters."""

from dataclasses import dataclass

from tipdamp.hbm.errors import InputError
from tipdamp.hbm.memory import available_bytes


@dataclass(frozen=True)
class MemoryModel:
    """Measured by tests/benchmarks/growth.py, assembly and reduction of a block of 8-node hexahedra
    with 186 master dofs: 0.60, 1.23, 2.51, 5.32 and 8.33 GB for 28, 57, 108, 207 and 298 thousand
    dofs."""

    bytes_per_dof: float = 12e3  # matrices and constraint modes
    factor_bytes: float = 240.0  # of the two factors, for the modes and for their count,
    # which grow with this power of the dofs: nested dissection in three dimensions
    growth: float = 4 / 3
    master_dofs: int = 186  # of the measurements
    # arrays of dofs x master dofs at once: Psi, M Psi, its remainder, the back-solve
    dense: int = 4


MODEL = MemoryModel()


def predicted_bytes(nodes: int, masters: int = 0) -> float:
    """Peak memory of assembly and reduction of a solid mesh onto so many master nodes, bytes, to a
    factor of 2."""
    dense = 8 * MODEL.dense * 3 * nodes * max(3 * masters - MODEL.master_dofs, 0)
    return (
        MODEL.bytes_per_dof * 3 * nodes + MODEL.factor_bytes * (3 * nodes) ** MODEL.growth + dense
    )


def check_memory(*bodies: tuple[int, int, str]) -> None:
    """Raises InputError before any heavy work when the bodies, held together, are predicted to need
    more than there is.

    bodies : (nodes, masters, source) of each; masters 0 where they are not known yet
    """
    need = sum(predicted_bytes(nodes, masters) for nodes, masters, _ in bodies)
    there = available_bytes()
    if need > there:
        sizes = "; ".join(
            f"{source}: {nodes} nodes ({3 * nodes} "
            f"dofs{f', {masters} master nodes' if masters else ''})"
            for nodes, masters, source in bodies
        )
        raise InputError(
            f"{sizes} are predicted to need {need / 1e9:.0f} GB of memory to assemble and reduce, "
            f"{there / 1e9:.1f} GB are available; coarsen the mesh, name fewer masters, or reduce "
            "it elsewhere and give matrices"
        )
