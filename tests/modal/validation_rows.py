"""Rows of docs/validation on reduction and modes: G1, NAFEMS FV32 and FV52, random bodies, rotating beam."""

import numpy as np

from tests.benchmarks.nafems import FV32_HZ, FV52_HZ, exact_hard_plate, fv32, fv52
from tests.benchmarks.record import recorded
from tests.modal.test_g1_bar_beam import table
from tests.modal.test_stiffening import FLAP, beam_body, flap_and_lag
from tests.validation import Section, relative

FV32_RUNGS, FV52_RUNGS = (4, 8, 16, 32), ((4, 1), (8, 1), (16, 2), (24, 2))


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
    """FV52 on hard supports: the ladder against the exact three-dimensional solution; the published values.

    Those have no shear in the plane (modes 4 and 5 of the hard plate); their 193.59 Hz, which moves in the plane, the
    hard support does not let.
    """
    exact = exact_hard_plate(8)
    for n, layers in FV52_RUNGS:
        for k, (ours, told) in enumerate(zip(fv52(n, layers, "hard"), exact, strict=True), start=1):
            against = "exact" if (n, layers) == FV52_RUNGS[-1] else "exact, coarser mesh"
            yield f"FV52, {n} x {n} x {layers} cells, mode {k}", "", ours, told, relative(ours, told), against
    bending, others = [0, 1, 2, 5, 6, 7], [hz for hz in FV52_HZ if hz != 193.59]
    published = {"hard": (fv52(n, layers, "hard")[bending], others), "faces": (fv52(n, layers, "faces"), FV52_HZ)}
    for support, (found, reference) in published.items():
        for ours, told in zip(found, reference, strict=True):
            yield (f"FV52, {n} x {n} x {layers} cells, support: {support}, published {told:g} Hz", "", ours, told,
                   relative(ours, told), f"published, {support}")


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
            "support is from them. [The other supports](modes.md)", plate_rows, {"exact": 1e-3, "exact, coarser": 0.1}),
    Section("missed", "Modes of random bodies", "Repeated and close modes, known from small problems. Made by "
            "tests/benchmarks/random_bodies.py.", random_rows, {"none missed": 0.0},
            "random_bodies"),
    Section("rotating", "Rotating cantilever", "omega sqrt(m L^4 / EI). Source: Wright et al. 1982.", rotating_rows,
            {"published": 1e-3}))
