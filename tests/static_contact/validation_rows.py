"""Rows of the validation pages for statics and contact stiffness: reference beams, closed forms, Hertz, CalculiX.

Each function yields (case, H or '', ours, reference, relative error, against). What takes long was measured by
tests/benchmarks and is read from its results, with the day and the versions of that run.
"""

import numpy as np

from static_contact.stiffness import rectangular_punch_bem
from static_contact.stiffness.elastic_constants import MaterialPair, Stiffness
from static_contact.stiffness.rectangular_punch import rectangle_compliance
from tests.benchmarks.record import recorded
from tests.static_contact.beams import reference_beam
from tests.static_contact.stiffness.test_rectangular_punch import FRESH
from tests.static_contact.stiffness.test_reference import CASES, ROUTES
from tests.static_contact.stiffness.test_rounded_punch import FLATS, punch_limits, slope_and_stiffness
from tests.validation import Section, relative


def beam_rows():
    """Errors are of the largest force of the case."""
    for name in ("F1-beam-two-end-loads", "F2-beam-31-crowned"):
        found, known = reference_beam(name)
        expected = np.array(known["r"])
        label = name[:2]
        for i, (ours, r) in enumerate(zip(found.force, expected, strict=True)):
            error = abs(ours - r) / expected.max()
            yield f"{label}, support {i + 1}, N", "", float(ours), float(r), error, "closed form"
        ours = np.flatnonzero(found.pairs.preload < 0).tolist()
        same = set(ours) == set(known["detached_indices"])
        yield (f"{label}, detached supports", "", len(ours), len(known["detached_indices"]), 0.0 if same else 1.0,
               "detached set")


def stiffness_rows():
    """Errors are of the tolerance that the case states."""
    for name, case in CASES.items():
        i = case["inputs"]
        found = ROUTES[case["kind"]](MaterialPair(i["E1_Pa"], i["nu1"], i["E2_Pa"], i["nu2"]), i)
        for output, expected in case["outputs"].items():
            error = relative(found[output], expected)
            yield f"{name}, {output}", "", found[output], expected, error / case["rel_tol"], "case, in its tolerances"


def law_rows():
    """Limits of the rounded punch, the slope of its approach, and the rectangle's table against fresh solves."""
    for name, ours, expected in punch_limits():
        for x, (mine, told) in enumerate(zip(np.atleast_1d(ours), np.atleast_1d(expected), strict=True), start=1):
            yield f"{name}, place {x}" if np.size(ours) > 1 else name, "", mine, told, relative(mine, told), "limit"
    for b in FLATS:
        for component in Stiffness._fields:
            slope, stiffness = slope_and_stiffness(b, component)
            yield (f"flat half width {b:g} m, {component}: dP/d(delta), N/m per m", "", slope, stiffness,
                   relative(slope, stiffness), "slope of the approach")
    for aspect, nu in ((1.0, 0.3), *FRESH, (5000.0, 0.3)):
        fresh = rectangular_punch_bem.compliance(aspect, nu, meshes=(8, 12, 16, 24))[0]
        table = rectangle_compliance(aspect, nu)
        for name, ours, told in zip(("normal and along", "across"), table, fresh, strict=True):
            yield (f"rectangle {aspect:g} : 1, nu {nu:g}, {name}", "", ours, told, relative(ours, told),
                   "boundary elements, solved anew")


def hertz_rows():
    run = recorded("hertz")
    for rung in run["rungs"] if run else ():
        n = rung["per_width"]
        against = "Hertz, 16 elements and more" if n >= 16 else "Hertz, coarser"
        for what, key, unit in (("peak pressure", "peak", "Pa"), ("half width", "half_width", "m")):
            exact = run[f"{key}_{unit}"]
            yield (f"{n} elements over the half width, {what}, {unit}", "", rung[key], exact,
                   relative(rung[key], exact), against)


def calculix_rows():
    run = recorded("calculix")
    if run:
        name = f"pin between inclined faces, {run['dofs']} dofs, {run['pairs']} pairs, {run['closed']} closed"
        yield (f"{name}: sum of forces, N", "", run["sum_N"], run["sum_ccx_N"], run["difference_of_the_pull"],
               f"CalculiX {run['ccx']}, largest pair, of the pull")
        yield f"{name}: same detached set", "", int(run["same_set"]), 1, float(not run["same_set"]), "detached set"


def calculix_modes_rows():
    run = recorded("calculix_modes")
    if run:
        yield (f"{run['modes']} modes of a block of {run['dofs']} dofs, {run['hz'][0]:.1f} to {run['hz'][-1]:.1f} Hz, "
               "largest deviation", "", run["deviation"], 0, run["deviation"], "CalculiX")


def calculix_notes():
    run = recorded("calculix")
    if not run:
        return "Not measured: run `python -m tests.benchmarks.calculix --cells 4`."
    ours = run["prepared_s"] + run["each_s"]
    return (f"CPU time on one thread: CalculiX {run['ccx_s']:.1f} s, assembly, reduction and preload here {ours:.1f} "
            f"s, {run['ccx_s'] / ours:.1f} times less (asked: at least 4); each further load case "
            f"{1e3 * run['each_s']:.1f} ms (asked: under 20).")


def calculix_modes_notes():
    run = recorded("calculix_modes")
    if not run:
        return "Not measured: run `python -m tests.benchmarks.calculix_modes`."
    ours = sum(run[f"{part}_s"] for part in ("assembly", "factor", "modes", "count"))
    return (f"CPU time on one thread: CalculiX {run['calculix_s']:.1f} s, assembly, factor, modes and count by inertia "
            f"here {ours:.1f} s, {run['ratio']:.1f} times less (asked: at least 5); without the count, which CalculiX "
            f"does not make, {run['ratio_without_count']:.1f} times less. CalculiX prints seven digits.")


def rank_rows():
    """Errors are of the largest preload, force or frequency."""
    run = recorded("mpi_ranks")
    for row in run["rows"] if run else ():
        for key, label in (("preload", "preloads on springs"), ("hard", "every other hard"), ("hz", "frequencies")):
            if row["ranks"] > 1:
                yield f"{row['ranks']} ranks, {label}", "", row[key], 0, row[key], "one rank"


def bound_rows():
    """Ours: how far the reduced frequency lies above that of the full model; reference: the bound of it."""
    run = recorded("stuck_bound")
    for r in run["rows"] if run else ():
        error = r["reduced_hz"] / r["full_hz"] - 1
        yield (f"{r['set']}, mode {r['mode']}, {r['full_hz']:.2f} Hz", "", error, r["bound"],
               max(error - r["bound"], 0.0), "bound")


def random_rows():
    run = recorded("preload_random_beams")
    if run:
        low, high = run["supports"]
        name = f"{run['count']} beams of {low} to {high} supports (seed {run['seed']})"
        missed = float(run["count"] - run["same_set"])
        yield f"{name}: same set", "", run["same_set"], run["count"], missed, "detached set"
        yield f"{name}: largest error of a force, of the largest", "", run["largest_error"], 0, run["largest_error"], \
            "Macaulay brackets"


SECTIONS = (
    Section("f", "F: beams on unilateral supports", "Support forces of two beams; errors are of the largest force of "
            "the case. Source: tests/reference/statics.", beam_rows, {"closed form": 1e-8, "detached set": 0.0}),
    Section("random_beams", "5 000 random beams on springs and hard supports", "Every one of the 2^n sets is tried up "
            "to 8 supports, above that the conditions are checked on forces by Macaulay brackets.", random_rows,
            {"detached set": 0.0, "Macaulay brackets": 1e-8}, "preload_random_beams"),
    Section("stiffness", "Contact stiffness: ten reference cases", "The error is given in units of the tolerance that "
            "the case states: 1 is allowed. Source: tests/reference/stiffness.", stiffness_rows,
            {"case, in its tolerances": 1.0}),
    Section("contact_laws", "Contact stiffness: limits, slopes, rectangles", "The rounded punch as its flat or its "
            "radius goes to zero; its stiffness against the numerical derivative of its approach; the table of "
            "rectangles against boundary elements on coarser meshes than the table's.", law_rows,
            {"limit": 1e-6, "slope": 1e-10, "boundary elements": 1e-5}),
    Section("hertz", "Hertz: a cylinder on a block", "Hard contact of two elastic bodies in plane strain, 8-node "
            "hexahedra. Peak pressure p0 and half width a are not read off single nodes: they are those of the "
            "straight line p^2 = p0^2 (1 - x^2 / a^2), fitted over x^2 to the nodal forces over their share of the "
            "surface, where these press and x < 0.95 a.", hertz_rows, {"Hertz, 16": 5e-3}, "hertz"),
    Section("calculix_preload", "CalculiX: preload of a pin between inclined faces", "C3D8 and GAPUNI springs with "
            "NLGEOM on the same nodes. Made by tests/benchmarks/calculix.py.", calculix_rows,
            {"CalculiX": 1e-4, "detached set": 0.0}, "calculix", calculix_notes),
    Section("calculix_modes", "CalculiX: modes of a block", "C3D8 on the same mesh. Made by "
            "tests/benchmarks/calculix_modes.py.", calculix_modes_rows, {"CalculiX": 1e-6}, "calculix_modes",
            calculix_modes_notes),
    Section("mpi_ranks", "Full model on 1, 2 and 4 ranks", "Small two-blade rig, Newton on the full model under "
            "mpirun: largest difference from one rank. Made by tests/benchmarks/mpi_ranks.py.", rank_rows,
            {"one rank": 1e-9}, "mpi_ranks"),
    Section("stuck_bound", "The rig's stuck frequencies: bound of the reduction error", "Every stuck mode below 5 kHz, "
            "reduced against the unreduced finite-element model. Ours: relative error of the reduced frequency; "
            "reference: its bound; error: how far the bound falls short. Made by tests/benchmarks/stuck_bound.py.",
            bound_rows, {"bound": 0.0}, "stuck_bound"),
)
