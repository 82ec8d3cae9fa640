"""Twenty modes of a clamped block of 8-node hexahedra, beside CalculiX (apt: calculix-ccx) on the
same mesh.

    python -m tests.benchmarks.calculix_modes [--cells 16 32 64] [--modes 20]

The solver of ccx is SPOOLES, with which Debian builds it. Largest deviation of the frequencies, and
CPU seconds from the mesh in memory (here) or in its file (CalculiX) to the modes. CalculiX prints
seven digits. Ours include the count by inertia, which CalculiX has not; its time is also given by
itself.
"""

import argparse
import os
import tempfile
import time
from pathlib import Path

import numpy as np

from tests import boxes
from tests.benchmarks.record import ccx_version, one_thread, record, run_ccx
from tipdamp.modal.eigen import Factor
from tipdamp.modal.elasticity import Material, elastic_body
from tipdamp.modal.mesh import Mesh
from tipdamp.modal.solvers.inertia import modes_below

STEEL = Material(E=207e9, nu=0.3, density=7850.0)
BOX = np.array([0.020, 0.045, 0.100])  # m, three different edges: no repeated modes


def block(cells) -> Mesh:
    """Box of 8-node hexahedra; its foot is the group z0."""
    return boxes.block(*(np.linspace(0, edge, n + 1) for edge, n in zip(BOX, cells, strict=True)))


def ours(mesh, modes):
    began = time.process_time()
    body = elastic_body(mesh, STEEL, "block", clamp="z0")
    assembled = time.process_time()
    factor = Factor(body.K)
    factored = time.process_time()
    omega, _ = factor.lowest_modes(body.M, modes)
    ended = time.process_time()
    assert modes_below(body.K, body.M, 1.0001 * omega[-1]) >= modes
    count = time.process_time() - ended
    return (
        omega / (2 * np.pi),
        (assembled - began, factored - assembled, ended - factored - count, count),
        body.dofs,
    )


def calculix(mesh, modes):
    with tempfile.TemporaryDirectory() as folder:
        job = Path(folder, "block.inp")
        with open(job, "w") as f:
            f.write("*NODE, NSET=ALL\n")
            f.writelines(
                f"{n},{x:.17g},{y:.17g},{z:.17g}\n"
                for n, (x, y, z) in zip(mesh.node, mesh.position, strict=True)
            )
            f.write("*ELEMENT, TYPE=C3D8, ELSET=ALL\n")
            f.writelines(
                f"{i + 1}," + ",".join(map(str, mesh.node[c])) + "\n"
                for i, c in enumerate(mesh.cells["hexahedron"])
            )
            f.write("*NSET, NSET=CLAMP\n" + "".join(f"{n},\n" for n in mesh.group("z0")))
            f.write(
                "*MATERIAL, "
                f"NAME=STEEL\n*ELASTIC\n{STEEL.E:g},{STEEL.nu:g}\n*DENSITY\n{STEEL.density:g}\n"
                "*SOLID SECTION, ELSET=ALL, MATERIAL=STEEL\n*BOUNDARY\nCLAMP,1,3\n"
                f"*STEP\n*FREQUENCY\n{modes}\n*END STEP\n"
            )
        seconds = run_ccx(folder, "block")
        hz = []
        for line in Path(folder, "block.dat").read_text().splitlines():
            fields = line.split()
            if len(fields) == 5 and fields[0] == str(len(hz) + 1):
                hz.append(float(fields[3]))
        return np.array(hz[:modes]), seconds


def main():
    one_thread()
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--cells", type=int, nargs=3, default=(16, 32, 64))
    parser.add_argument("--modes", type=int, default=20)
    arguments = parser.parse_args()
    ours(block((2, 2, 2)), 2)  # forms are compiled and libraries loaded before the clock runs
    mesh = block(np.array(arguments.cells))
    mine, parts, dofs = ours(mesh, arguments.modes)
    theirs, seconds = calculix(mesh, arguments.modes)
    print(f"{dofs} dofs, {arguments.modes} modes, {mine[0]:.3f} to {mine[-1]:.3f} Hz")
    print(f"largest deviation {np.abs(mine / theirs - 1).max():.1e}")
    named = dict(zip(("assembly", "factor", "modes", "count"), parts, strict=True))
    print(
        "here      "
        + ", ".join(f"{name} {t:.1f}" for name, t in named.items())
        + f", in all {sum(parts):.1f} CPU s"
    )
    print(
        f"CalculiX  {seconds:.1f} CPU s, {seconds / sum(parts):.1f} times as long, "
        f"{seconds / sum(parts[:3]):.1f} times as long as without the count"
    )
    record(
        "calculix_modes",
        {
            "load": os.getloadavg()[0],
            "ccx": ccx_version(),
            "dofs": dofs,
            "modes": arguments.modes,
            "deviation": np.abs(mine / theirs - 1).max(),
            "hz": [mine[0], mine[-1]],
            "calculix_s": seconds,
            "ratio": seconds / sum(parts),
            "ratio_without_count": seconds / sum(parts[:3]),
            **{f"{name}_s": t for name, t in named.items()},
        },
    )


if __name__ == "__main__":
    main()
