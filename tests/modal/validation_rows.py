"""Rows of docs/validation on reduction and modes: G1, NAFEMS FV32 and FV52, random bodies, rotating beam."""

import numpy as np

from tests.benchmarks.nafems import FV32_HZ, FV52_HZ, exact_hard_plate, fv32, fv52
from tests.benchmarks.record import recorded
from tests.modal.test_g1_bar_beam import table
from tests.modal.test_stiffening import FLAP, beam_body, flap_and_lag
from tests.validation import Section, relative

FV32_RUNGS, FV52_RUNGS = (4, 8, 16, 32), ((4, 1), (8, 1), (16, 2), (24, 2))
IN_THE_PLANE = FV52_HZ[4]        # Hz: the published mode that does not bend, and that a line support does hold


def reduction_rows():
    """Every frequency of the table; how far the bound of the reduction error lies below the error, at most 0."""
    for name, order in (("bar", 1), ("beam", 2)):
        for row, omega, told, error, bound, _ in table(name, order):
            case = f"G1 {name}, tip spring {row['kappa']:g}, {row['N']} modes"
            for k, (ours, value) in enumerate(zip(omega, told, strict=False), start=1):
                yield f"{case}, frequency {k}", "", ours, value, relative(ours, value), "table"
            short = max(np.max(error - bound), 0.0)
            yield f"{case}, error beyond its bound", "", short, 0.0, short, "bound"


def membrane_rows():
    """FV32: the ladder against its published values, the finest rung last."""
    for n in FV32_RUNGS:
        for k, (ours, told) in enumerate(zip(fv32(n), FV32_HZ, strict=True), start=1):
            against = "published" if n == FV32_RUNGS[-1] else "published, coarser mesh"
            yield f"FV32, {2 * n} x {n} cells, mode {k}", "", ours, told, relative(ours, told), against


def plate_rows():
    """FV52: the ladder on hard supports against the exact three-dimensional solution; three supports and NAFEMS."""
    exact = exact_hard_plate(8)
    for n, layers in FV52_RUNGS:
        coarser = "" if (n, layers) == FV52_RUNGS[-1] else ", coarser mesh"
        name = f"FV52, {n} x {n} x {layers} cells"
        hard = fv52(n, layers, "hard")
        for k, (ours, told) in enumerate(zip(hard, exact, strict=True), start=1):
            yield f"{name}, mode {k}", "", ours, told, relative(ours, told), f"exact{coarser}"
        for support, found in (("hard", hard), ("faces", fv52(n, layers, "faces")),
                               ("lower edges", fv52(n, layers, "lower edges"))):
            for ours, told in beside_published(support, found):
                kind = "lower edges, in the plane" if (support, told) == ("lower edges", IN_THE_PLANE) else support
                yield (f"{name}, support: {support}, published {told:g} Hz", "", ours, told, relative(ours, told),
                       f"published, {kind}{coarser}")


def beside_published(support, found):
    """(ours, published) of the modes that can be told apart.

    The hard support has two shear modes in the plane more and does not let the published one; on its lower edges
    the bending modes fall past that one as the mesh is refined.
    """
    if support == "hard":
        return zip(np.delete(found, [3, 4])[:6], [hz for hz in FV52_HZ if hz != IN_THE_PLANE], strict=True)
    if support == "faces":
        return zip(found, FV52_HZ, strict=True)
    return [*zip(found[:4], FV52_HZ, strict=False), (found[np.abs(found - IN_THE_PLANE).argmin()], IN_THE_PLANE)]


def random_rows():
    run = recorded("random_bodies")
    if run:
        lost = run["missed"]
        yield f"modes missed in {run['bodies']} random bodies", "", lost, 0, float(lost), "none missed"


def rotating_rows():
    made = beam_body()
    for eta in (1, 4, 12):
        for k, (ours, told) in enumerate(zip(flap_and_lag(made, eta)[0], FLAP[eta], strict=True), start=1):
            yield f"flapping at speed {eta}, mode {k}", "", ours, told, relative(ours, told), "published"


SECTIONS = (
    Section("reduction", "G1: Craig-Bampton of a bar and a beam", "omega of each mode, and the bound of its error. "
            "Source: tests/reference/modal/G1.", reduction_rows, {"table": 1e-8, "bound": 0.0}),
    Section("fv32", "NAFEMS FV32: tapered membrane", "Hz; 27-node hexahedra, plane stress. Source: NAFEMS R0015.",
            membrane_rows, {"published": 1e-3, "published, coarser": 0.01}),
    Section("fv52", "NAFEMS FV52: solid square plate", "Hz; 27-node hexahedra. What is held to 0.1 % is the plate "
            "on hard supports, its edge faces held in z and along themselves, which has an exact solution in three "
            "dimensions (Graff, Wave Motion in Elastic Solids, 8.1). NAFEMS' own values (R0015; also in the "
            "verification manuals of Altair OptiStruct and Autodesk Fusion) are no limit of this problem: 45.897, "
            "109.44 and 167.89 Hz are thick-plate theory, the others a reference mesh, and the line support of the "
            "original, the lower edges in z, has no limit in three dimensions; rows 'published' say how far each "
            "support is from them. The mode at 193.59 Hz moves in the plane and has a limit there too.", plate_rows,
            {"exact": 1e-3, "exact, coarser": 0.1, "published, lower edges, in the plane": 1e-3,
             "published, lower edges, in the plane, coarser": 1e-2}),
    Section("missed", "Modes of random bodies", "Repeated and close modes, known from small problems. Made by "
            "tests/benchmarks/random_bodies.py.", random_rows, {"none missed": 0.0},
            "random_bodies"),
    Section("rotating", "Rotating cantilever", "omega sqrt(m L^4 / EI). Source: Wright et al. 1982.", rotating_rows,
            {"published": 1e-3}))
