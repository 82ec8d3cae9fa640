"""Preload of a pin between two inclined faces beside CalculiX on the same mesh (C3D8, GAPUNI
springs, NLGEOM).

    python -m tests.benchmarks.calculix [--cells 4] [--cases 3]

Needs the program ccx (Debian: calculix-ccx); nothing else of the project does. A trapezoid of 10
and 4 mm, 3 mm high and 30 mm long, its sides at 45 degrees, is pulled by 10 N at its two ends
between two clamped blocks; the faces are crowned by 0.5 um, so that pairs in the middle stay open.
Two lines of 31 pairs on each face. Both programs run on one thread; times are CPU times of this
run, and go to build/benchmarks/calculix.json.
"""

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

from tests.benchmarks.record import ccx_version, one_thread, record, run_ccx
from tests.boxes import block
from tipdamp.hbm.contact import ContactTable
from tipdamp.modal.craig_bampton import assemble, craig_bampton
from tipdamp.modal.elasticity import Material, elastic_body
from tipdamp.static_contact.contact.preload import StaticContact

STEEL = Material(207e9, 0.3, 7850.0)
LENGTH = 0.03
PULL = 10.0
KN = 2e6
CROWN = 5e-7


def meshes(n):
    """{body: Mesh}: pin, left and right block; n cells to a millimetre of height, 30 along."""
    z, y = np.linspace(0, 3e-3, 3 * n + 1), np.linspace(0, LENGTH, 31)
    made = {"pin": block(np.linspace(-1, 1, 8 * n + 1), y, z)}
    made |= {side: block(np.linspace(0, 1, 7 * n + 1), y, z) for side in ("left", "right")}
    for name, mesh in made.items():
        p = mesh.position
        half = 5e-3 - p[:, 2]
        p[:, 0] = p[:, 0] * half if name == "pin" else half + p[:, 0] * (12e-3 - half)
        if name == "left":  # turned about z, so that the cells keep their sense
            p[:, 0], p[:, 1] = -p[:, 0], LENGTH - p[:, 1]
    return made


def pair_table(made):
    """The two faces: node pairs in the same order; n from the pin outwards and up."""
    tables = []
    for side, sign, face in (("left", -1, "x0"), ("right", 1, "x1")):
        blade, pin = made[side].groups["x0"], made["pin"].groups[face]
        order = [
            np.lexsort(np.round(made[b].position[made[b].index(n)][:, [2, 1]], 9).T)
            for b, n in ((side, blade), ("pin", pin))
        ]
        blade, pin = blade[order[0]], pin[order[1]]
        position = made[side].position[made[side].index(blade)]
        lines = np.isclose(position[:, 2], 1e-3) | np.isclose(position[:, 2], 2e-3)
        blade, pin, position = blade[lines], pin[lines], position[lines]
        assert np.allclose(position, made["pin"].position[made["pin"].index(pin)])
        n, t1 = np.array([sign, 0, 1]) / np.sqrt(2), np.array([0.0, 1, 0])
        tables.append((side, blade, pin, position, np.array([t1, np.cross(n, t1), n])))
    join = np.concatenate
    count = [len(t[1]) for t in tables]
    position = join([t[3] for t in tables])
    P, one = len(position), np.ones(len(position))
    return ContactTable(
        side=np.repeat([t[0] for t in tables], count),
        station=np.arange(P),
        row=0 * one,
        blade_body=np.repeat([t[0] for t in tables], count),
        blade_node=join([t[1] for t in tables]),
        damper_body=np.full(P, "pin"),
        damper_node=join([t[2] for t in tables]),
        position=position,
        frame=np.repeat([t[4] for t in tables], count, axis=0),
        kn=KN * one,
        kt=one,
        mu=0 * one,
        gap=CROWN * (1 - (2 * position[:, 1] / LENGTH - 1) ** 2),
        preload=0 * one,
        weight=one,
    )


def ends(mesh):
    """Nodes under the pull: the middle of the pin's lower side, at both ends."""
    p = mesh.position
    return mesh.node[(np.abs(p[:, 0]) < 1e-9) & (p[:, 2] == 0) & np.isin(p[:, 1], [0.0, LENGTH])]


def ours(made, pairs, cases):
    """(forces of each case (c, P), CPU seconds of assembly + reduction, CPU seconds of each case,
    dofs)."""
    began = time.process_time()
    bodies = {
        b: elastic_body(m, STEEL, b, free=b == "pin", clamp=None if b == "pin" else "x1")
        for b, m in made.items()
    }
    masters = {
        "pin": pairs.damper_node,
        **{s: pairs.blade_node[pairs.side == s] for s in ("left", "right")},
    }
    reduced = {b: craig_bampton(bodies[b], masters[b], 0, bound=False) for b in bodies}
    loaded = ends(made["pin"])
    reduced["pin"].model.loads["pull"] = reduced["pin"].condense(
        loaded, np.tile([0, 0, 0.5], (2, 1))
    )
    model = assemble(*(r.model for r in reduced.values()))
    statics = StaticContact(model, pairs)
    prepared = time.process_time()
    force = [
        statics.solve(pull * model.loads["pull"], gap=crown * pairs.gap).force
        for pull, crown in cases
    ]
    each = (time.process_time() - prepared) / len(cases)
    return np.array(force), prepared - began, each, sum(b.dofs for b in bodies.values())


def deck(made, pairs, pull, crown):
    """CalculiX input. The pin's slide along y, which nothing loads, is held at one node."""
    first = dict(zip(made, np.cumsum([0, *(len(m.node) for m in made.values())])[:-1], strict=True))
    lines = ["*NODE, NSET=NALL"]
    for b, m in made.items():
        lines += [
            f"{first[b] + n}, {x:.12e}, {y:.12e}, {z:.12e}"
            for n, (x, y, z) in zip(m.node, m.position, strict=True)
        ]
    lines.append("*ELEMENT, TYPE=C3D8, ELSET=SOLID")
    count = 0
    for b, m in made.items():
        for cell in m.cells["hexahedron"]:
            count += 1
            lines.append(f"{count}, " + ", ".join(str(first[b] + m.node[i]) for i in cell))
    for i in range(len(pairs)):
        n1 = first["pin"] + pairs.damper_node[i]
        n2 = first[str(pairs.side[i])] + pairs.blade_node[i]
        direction = ", ".join(f"{v:.15f}" for v in pairs.normal[i])
        lines += [
            f"*ELEMENT, TYPE=GAPUNI, ELSET=G{i}",
            f"{count + i + 1}, {n1}, {n2}",
            f"*GAP, ELSET=G{i}",
            f"{crown * pairs.gap[i]:.12e}, {direction}, , {KN:.6e}, 1e-9",
        ]
    contact = sorted(
        {first["pin"] + n for n in pairs.damper_node}
        | {first[str(s)] + n for s, n in zip(pairs.side, pairs.blade_node, strict=True)}
    )
    clamp = [first[s] + n for s in ("left", "right") for n in made[s].groups["x1"]]
    lines += [
        "*NSET, NSET=CONTACT",
        *(f"{n}," for n in contact),
        "*NSET, NSET=CLAMP",
        *(f"{n}," for n in clamp),
        "*MATERIAL, NAME=STEEL",
        "*ELASTIC",
        f"{STEEL.E:.6e}, {STEEL.nu}",
        "*SOLID SECTION, ELSET=SOLID, MATERIAL=STEEL",
        "*BOUNDARY",
        "CLAMP, 1, 3",
        f"{first['pin'] + ends(made['pin'])[0]}, 2, 2",
        "*STEP, NLGEOM, INC=100",
        "*STATIC",
        "1., 1.",
        "*CLOAD",
        *(f"{first['pin'] + n}, 3, {pull / 2:.12e}" for n in ends(made["pin"])),
        "*NODE PRINT, NSET=CONTACT",
        "U",
        "*END STEP",
        "",
    ]
    return "\n".join(lines), first


def calculix(made, pairs, pull, crown):
    """(forces (P,), CPU seconds) of ccx on the same nodes, springs and load."""
    text, first = deck(made, pairs, pull, crown)
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "pin.inp").write_text(text)
        seconds, found = run_ccx(folder, "pin"), Path(folder, "pin.dat")
        rows = [line.split() for line in found.read_text().splitlines()] if found.is_file() else []
    u = {int(r[0]): np.array(r[1:], float) for r in rows if len(r) == 4 and r[0].isdigit()}
    motion = np.array(
        [
            pairs.normal[i]
            @ (
                u[first["pin"] + pairs.damper_node[i]]
                - u[first[str(pairs.side[i])] + pairs.blade_node[i]]
            )
            for i in range(len(pairs))
        ]
    )
    return np.maximum(KN * (motion - crown * pairs.gap), 0.0), seconds


def main():
    one_thread()
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--cells", type=int, default=4, help="cells to a millimetre of height")
    parser.add_argument(
        "--cases", type=int, default=2, help="load cases, of which ccx solves the first"
    )
    arguments = parser.parse_args()
    made = meshes(arguments.cells)
    pairs = pair_table(made)
    cases = [(PULL, 1.0), *((PULL * f, 0.5 * f) for f in np.linspace(0.5, 2, arguments.cases - 1))]
    small = meshes(1)
    # forms are compiled and libraries loaded before the clock runs
    ours(small, pair_table(small), cases[:1])
    force, prepared, each, dofs = ours(made, pairs, cases)
    theirs, seconds = calculix(made, pairs, *cases[0])
    closed = force[0] > 0
    record(
        "calculix",
        {
            "ccx": ccx_version(),
            "dofs": dofs,
            "pairs": len(pairs),
            "closed": int(closed.sum()),
            "cases": len(cases),
            "difference_of_the_pull": float(np.abs(force[0] - theirs).max() / PULL),
            "same_set": bool(((theirs > 0) == closed).all()),
            "sum_N": float(force[0].sum()),
            "sum_ccx_N": float(theirs.sum()),
            "prepared_s": prepared,
            "each_s": each,
            "ccx_s": seconds,
        },
    )
    print(
        f"{dofs} dofs, {len(pairs)} pairs, {int(closed.sum())} closed; sum of forces "
        f"{force[0].sum():.6f} N"
    )
    print(
        f"largest difference of a pair {np.abs(force[0] - theirs).max() / PULL:.1e} of the pull; "
        f"same detached set: {bool(((theirs > 0) == closed).all())}"
    )
    print(
        f"CalculiX {seconds:.2f} s; here {prepared + each:.2f} s "
        f"({seconds / (prepared + each):.1f} times less), each further case {1e3 * each:.1f} ms "
        f"({seconds / each:.0f} times less)"
    )


if __name__ == "__main__":
    main()
