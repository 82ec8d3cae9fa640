"""NAFEMS FV32 (tapered membrane) and FV52 (simply supported solid plate): ladders of meshes towards
their limit.

Solid 27-node hexahedra throughout. FV32 is plane stress: half of the thickness, its middle plane
held in z, the root held in x and y. FV52 in three supports: "lower edges", the line support of the
original, has no limit in three dimensions (a line force moves its own line infinitely far), which
its ladder shows; "faces" holds the four edge faces in z; "hard" holds them along themselves too,
which thick-plate theory assumes and which has an exact solution."""

from dataclasses import replace

import numpy as np
from scipy.optimize import brentq

from tests.boxes import block
from tests.validation import Subject, row
from tipdamp.modal.eigen import Factor
from tipdamp.modal.elasticity import Material, elastic_body
from tipdamp.modal.mesh import Mesh

STEEL = Material(E=200e9, nu=0.3, density=8000.0)  # both tests
# NAFEMS, Selected Benchmarks for Natural Frequency Analysis (R0015), as printed in the verification
# manuals of commercial codes: FV32 from a fine reference mesh, FV52 thick-plate theory (modes 4 to
# 7) and a reference mesh
FV32_HZ = (44.623, 130.03, 162.70, 246.05, 379.90, 391.44)
FV52_HZ = (45.897, 109.44, 109.44, 167.89, 193.59, 206.19, 206.19)
# the published mode that does not bend, and that a line support does hold
IN_THE_PLANE = FV52_HZ[4]
FV32_RUNGS, FV52_RUNGS = (4, 8, 16, 32), ((4, 1), (8, 1), (16, 2), (24, 2))


def lattice(nx, ny, nz, place) -> Mesh:
    """27-node hexahedra on a grid of nx x ny x nz cells; place(s, t, r) -> position for coordinates
    in 0..1."""
    mesh = block(*(np.linspace(0, 1, 2 * n + 1) for n in (nx, ny, nz)), order=2)
    return replace(mesh, position=np.column_stack(place(*mesh.position.T)), groups={})


def frequencies(mesh, held, count, shift_hz=0.0):
    """Hz of the lowest modes; held (n, 3) bool: fixed directions of each node. A shift where the
    body can float."""
    body = elastic_body(mesh, STEEL, "plate", free=True)
    keep = np.flatnonzero(~held.ravel())
    K, M = body.K[keep][:, keep], body.M[keep][:, keep]
    shift = (2 * np.pi * shift_hz) ** 2
    omega, _ = Factor(K + shift * M).lowest_modes(M, count)
    return np.sqrt(np.maximum(omega**2 - shift, 0)) / (2 * np.pi)


def fv32(n):
    """10 m long, 5 m wide at the root, 1 m at the tip, 0.05 m thick."""
    mesh = lattice(2 * n, n, 1, lambda s, t, r: (10 * s, (t - 0.5) * (5 - 4 * s), 0.025 * r))
    x, _, z = mesh.position.T
    root = x < 1e-9
    return frequencies(mesh, np.column_stack([root, root, z < 1e-9]), 6)


def fv52(n, layers, support="faces"):
    """10 x 10 x 1 m, n x n cells in the plane. The rigid motions in the plane are left out."""
    spread = (lambda s: 5 * (1 - np.cos(np.pi * s))) if support == "faces" else (lambda s: 10 * s)
    mesh = lattice(n, n, layers, lambda s, t, r: (spread(s), spread(t), r - 0.5))
    x, y, z = mesh.position.T
    edge = (x < 1e-9) | (x > 10 - 1e-9) | (y < 1e-9) | (y > 10 - 1e-9)
    if support == "lower edges":
        edge &= z < -0.5 + 1e-9
    held = np.zeros((len(x), 3), dtype=bool)
    held[:, 2] = edge
    if support == "hard":
        held[(x < 1e-9) | (x > 10 - 1e-9), 1] = True
        held[(y < 1e-9) | (y > 10 - 1e-9), 0] = True
        return frequencies(mesh, held, 8)
    return frequencies(mesh, held, 10, shift_hz=30.0)[3:]


def exact_hard_plate(count):
    """Hz of the plate of FV52 whose edge faces are held in z and along themselves, exact in three
    dimensions.

    Its modes are those of the infinite plate with wave number k = pi sqrt(i^2 + j^2) / 10: bending
    by the antisymmetric Rayleigh-Lamb equation, shear in the plane omega = c_t k.   [Graff, Wave
    Motion in Elastic Solids, sec. 8.1]"""
    shear = STEEL.E / 2 / (1 + STEEL.nu)
    ct = np.sqrt(shear / STEEL.density)
    cl = ct * np.sqrt(2 * (1 - STEEL.nu) / (1 - 2 * STEEL.nu))

    def bending(w, k):
        p = np.sqrt(complex((w / cl) ** 2 - k**2))
        q = np.sqrt(complex((w / ct) ** 2 - k**2))
        h = 0.5
        value = (q**2 - k**2) ** 2 * np.sin(p * h) / p * np.cos(q * h) + 4 * k**2 * q * np.sin(
            q * h
        ) * np.cos(p * h)
        return value.real

    found = []
    for i in range(6):
        for j in range(6):
            k = np.pi / 10 * np.hypot(i, j)
            if i and j:  # the lowest root lies below Rayleigh's wave and below thin-plate theory
                thin = k**2 * np.sqrt(STEEL.E / 12 / (1 - STEEL.nu**2) / STEEL.density)
                found.append(
                    brentq(bending, 1e-3 * thin, min(1.001 * thin, 0.93 * ct * k), args=(k,))
                )
            if i or j:
                found.append(ct * k)
    return np.sort(found)[:count] / (2 * np.pi)


def rows():
    """The ladders, the finest rung last; FV52 on hard supports also against the exact
    three-dimensional solution."""
    for n in FV32_RUNGS:
        coarser = "" if n == FV32_RUNGS[-1] else ", coarser mesh"
        for k, (ours, told) in enumerate(zip(fv32(n), FV32_HZ, strict=True), start=1):
            yield row(
                f"FV32, {2 * n} x {n} cells, mode {k}", ours, told, f"FV32, published{coarser}"
            )
    exact = exact_hard_plate(8)
    for n, layers in FV52_RUNGS:
        coarser = "" if (n, layers) == FV52_RUNGS[-1] else ", coarser mesh"
        name = f"FV52, {n} x {n} x {layers} cells"
        found = {support: fv52(n, layers, support) for support in ("hard", "faces", "lower edges")}
        for k, (ours, told) in enumerate(zip(found["hard"], exact, strict=True), start=1):
            yield row(f"{name}, mode {k}", ours, told, f"FV52, exact{coarser}")
        for support, hz in found.items():
            for ours, told in _beside_published(support, hz):
                kind = (
                    "lower edges, in the plane"
                    if (support, told) == ("lower edges", IN_THE_PLANE)
                    else support
                )
                yield row(
                    f"{name}, {support}, published {told:g} Hz",
                    ours,
                    told,
                    f"FV52, published, {kind}{coarser}",
                )


def _beside_published(support, found):
    """(ours, published) of the modes that can be told apart.

    The hard support has two shear modes in the plane more and does not let the published one; on
    its lower edges the bending modes fall past that one as the mesh is refined.
    """
    if support == "hard":
        return zip(
            np.delete(found, [3, 4])[:6], [hz for hz in FV52_HZ if hz != IN_THE_PLANE], strict=True
        )
    if support == "faces":
        return zip(found, FV52_HZ, strict=True)
    return [
        *zip(found[:4], FV52_HZ, strict=False),
        (found[np.abs(found - IN_THE_PLANE).argmin()], IN_THE_PLANE),
    ]


SUBJECT = Subject(
    "NAFEMS: tapered membrane FV32, solid square plate FV52",
    "Hz; 27-node hexahedra. FV52 on hard supports has an exact solution (Graff, Wave Motion in "
    "Elastic Solids, 8.1). NAFEMS' own values (R0015; also in the verification manuals of Altair "
    "OptiStruct and Autodesk Fusion) are no limit of this problem: 45.897, 109.44 and 167.89 Hz "
    "are thick-plate theory, the others a reference mesh, and the line support of the original "
    "has no limit in three dimensions; rows 'published' say how far each support is from them. "
    "The mode at 193.59 Hz moves in the plane and has a limit there too.",
    rows,
    {
        "FV32, published": 1e-3,
        "FV32, published, coarser": 0.01,
        "FV52, exact": 1e-3,
        "FV52, exact, coarser": 0.1,
        "FV52, published, lower edges, in the plane": 1e-3,
        "FV52, published, lower edges, in the plane, coarser": 1e-2,
    },
)
