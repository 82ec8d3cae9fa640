"""How much memory a body will need, foretold from its number of nodes, and how much there is."""

from pathlib import Path

from hbm.errors import InputError

# Measured by tests/benchmarks/growth.py, assembly and reduction of a block of 8-node hexahedra with 186 master dofs:
# 0.60, 1.23, 2.51, 5.32 and 8.33 GB for 28, 57, 108, 207 and 298 thousand dofs. Matrices and boundary motions grow with
# the dofs, the two factors (for the modes and for their count) with dofs^(4/3): nested dissection in three dimensions.
_BYTES_PER_DOF, _FACTOR_BYTES, _GROWTH = 12e3, 240.0, 4 / 3


def predicted_bytes(nodes: int) -> float:
    """Peak memory of assembly and reduction of a solid mesh of that size, bytes, to a factor of 2."""
    return _BYTES_PER_DOF * 3 * nodes + _FACTOR_BYTES * (3 * nodes) ** _GROWTH


def available_bytes() -> float:
    """What the machine, or the container's limit, still gives; infinite where it cannot be told."""
    found = []
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
        found.append(next(int(line.split()[1]) * 1024 for line in lines if line.startswith("MemAvailable")))
    except (OSError, StopIteration, ValueError):
        pass
    try:
        limit = Path("/sys/fs/cgroup/memory.max").read_text().strip()
        used = int(Path("/sys/fs/cgroup/memory.current").read_text())
        found += [int(limit) - used] if limit.isdigit() else []
    except (OSError, ValueError):
        pass
    return float(min(found, default=float("inf")))


def check_memory(nodes: int, source: str) -> None:
    """Raises InputError before any heavy work when the prediction exceeds what is available."""
    need, there = predicted_bytes(nodes), available_bytes()
    if need > there:
        raise InputError(f"{source}: {nodes} nodes ({3 * nodes} dofs) are predicted to need {need / 1e9:.0f} GB of "
                         f"memory to assemble and factorise, {there / 1e9:.1f} GB are available; coarsen the mesh, or "
                         "reduce it elsewhere and give matrices")
