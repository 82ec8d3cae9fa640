"""Contact between unlike meshes beside CalculiX's surface-to-surface contact on the same meshes.

    python -m tests.benchmarks.calculix_surfaces [--refine damper | both]

Needs the program ccx (Debian: calculix-ccx). The wedge under platforms
(tests/reference/platform-wedge, C3D10) is pulled by 60 N without friction; both programs have a
linear pressure-overclosure of the same stiffness per area. Compared are force and moment of the
sides and the map of the preload in two ways: the force of each contact point with that of the
overclosure in ccx, averaged over the same area with the same weights; and the pressure at the
corners
of the damper's faces, to which ccx extrapolates from its integration points. --refine cuts every
cell of the damper, or of both bodies, into eight.
To build/benchmarks/calculix_surfaces.json.
"""

import argparse
import shutil
import tempfile
from itertools import takewhile
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from tests.benchmarks.record import ccx_version, one_thread, record, run_ccx
from tests.refined_meshes import refine
from tests.tipdamp.mesh_texts import theirs
from tipdamp.bodies.read import read_meshes
from tipdamp.bodies.surfaces import surface_points
from tipdamp.hbm.contact import ContactTable
from tipdamp.modal.faces import face_corners, group_faces
from tipdamp.readers.abaqus_sets import SOLID
from tipdamp.stages.run import results_folder, run_stage
from tipdamp.study.study import load_study

WEDGE = Path(__file__).parents[1] / "reference" / "platform-wedge"
SIDES = {"left": ("pf_L", "wd_L"), "right": ("pf_R", "wd_R")}
SOFT = 1e-6  # N/m that hold the damper before it touches: 1e-9 of the pull
# of the pull that ccx applies: without gaps the solution grows with the load, and ccx turns its
# normals with the motion
SCALE = 0.01


def ours(folder, refined):
    """Study, meshes and preload table; refined - "damper", "both" or "", whose cells are cut into
    eight."""
    for name in ("unlike_blades.msh", "unlike_damper.msh"):
        (refine if refined == "both" or refined and refined in name else shutil.copy)(
            WEDGE / name, folder / name
        )
    shutil.copy(WEDGE / "unlike.toml", folder)
    study = load_study(folder / "unlike.toml")
    store = results_folder(study, None)
    for stage in ("reduce", "preload"):
        run_stage(stage, study, store, quiet=True)
    return study, read_meshes(study), ContactTable.load(store.path("preload.csv"))


def deck(study, meshes):
    """CalculiX' input: both bodies, four surfaces, two contact pairs."""
    add = {"blades": 0, "damper": int(meshes["blades"].node.max())}
    lines, count, labels = ["*HEADING", "wedge", "*NODE, NSET=ALL"], 0, {}
    for body, mesh in meshes.items():
        lines += [
            f"{n + add[body]}, {x:.12e}, {y:.12e}, {z:.12e}"
            for n, (x, y, z) in zip(mesh.node, mesh.position, strict=True)
        ]
    lines.append("*ELEMENT, TYPE=C3D10, ELSET=SOLID")
    for body, mesh in meshes.items():
        for cell in theirs(mesh, "tetra10"):
            count += 1
            lines.append(f"{count}, " + ", ".join(str(n + add[body]) for n in cell))
            for k, corners in enumerate(SOLID[10][2], start=1):
                labels[body, tuple(sorted(cell[list(corners)].tolist()))] = f"{count}, S{k}"
    for side, groups in SIDES.items():
        for body, group in zip(meshes, groups, strict=True):
            mesh = meshes[body]
            lines.append(f"*SURFACE, NAME={body}_{side}, TYPE=ELEMENT")
            lines += [
                labels[body, tuple(sorted(mesh.node[face[: face_corners(len(face))]].tolist()))]
                for block in group_faces(mesh, group)
                for face in block
            ]
    return lines, add


def whole_deck(study, meshes, pairs):
    """With material, support, contact, load and output."""
    lines, add = deck(study, meshes)
    m, damper = study.material, meshes["damper"]
    clamp = np.concatenate([meshes["blades"].group(g) for g in study.blades.clamp])
    pulled = damper.group(study.damper.load_points) + add["damper"]
    lines += [
        "*NSET, NSET=CLAMP",
        *(f"{n}," for n in clamp),
        "*MATERIAL, NAME=STEEL",
        "*ELASTIC",
        f"{m.E:.8e}, {m.nu}",
        "*SOLID SECTION, ELSET=SOLID, MATERIAL=STEEL",
        "*BOUNDARY",
        "CLAMP, 1, 3",
        f"{pulled[0]}, 2, 2",
    ]
    last = 10**6
    for i, n in enumerate(pulled):
        for d in (1, 3):
            lines += [
                f"*ELEMENT, TYPE=SPRING1, ELSET=S{d}_{i}",
                f"{last + 10 * i + d}, {n}",
                f"*SPRING, ELSET=S{d}_{i}",
                f"{d}",
                f"{SOFT:.3e}",
            ]
    for side in SIDES:
        mine = pairs.select(pairs.side == side)
        k = mine.kn.sum() / mine.area.sum()
        lines += [
            f"*SURFACE INTERACTION, NAME=I_{side}",
            "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR",
            f"{k:.8e}, 1e-3, 1e-6",
            f"*CONTACT PAIR, INTERACTION=I_{side}, TYPE=SURFACE TO SURFACE",
            f"damper_{side}, blades_{side}",
        ]
    each = SCALE * study.damper.pull / len(pulled)
    return "\n".join(
        [
            *lines,
            "*STEP, INC=1000",
            "*STATIC",
            "1., 1.",
            "*CLOAD",
            *(f"{n}, 3, {each:.12e}" for n in pulled),
            *(
                text
                for side in SIDES
                for text in (f"*CONTACT PRINT, SLAVE=damper_{side}, MASTER=blades_{side}", "CF")
            ),
            "*NODE PRINT, NSET=ALL",
            "U",
            "*CONTACT FILE",
            "CDIS, CSTR",
            "*END STEP",
            "",
        ]
    ), add


def results(folder):
    """{side: force (3,) N and moment (3,) N m on the damper} and {node: displacement (3,) m} from
    wedge.dat, {node: Pa} from the block CONTACT of wedge.frd, all of the last increment."""
    lines, sums, moved = (folder / "wedge.dat").read_text().splitlines(), {}, {}
    for i, line in enumerate(lines):
        if "displacements (vx,vy,vz)" in line:
            for row in takewhile(str.strip, lines[i + 2 :]):
                node, *u = row.split()
                moved[int(node)] = np.array(u, dtype=float)
        if "statistics for slave set" in line:
            side = line.split("DAMPER_")[1].split(",")[0].lower()
            sums[side] = np.array(lines[i + 4].split(), dtype=float)
    pressure, inside = {}, False
    for line in (folder / "wedge.frd").read_text().splitlines():
        if line.startswith(" -4"):
            inside = line.split()[1] == "CONTACT"
        elif line.startswith(" -1") and inside:
            pressure[int(line[3:13])] = float(line[49:61])  # CPRESS, the fourth of six
        elif line.startswith(" -3"):
            inside = False
    return sums, moved, pressure


def read_by_ours(study, meshes, pairs, moved, add):
    """(n,) N: forces of the contact points, from ccx's displacements."""
    points = surface_points(study, meshes).points
    u = {
        body: one.weight @ np.array([moved[n + add[body]] for n in one.node]) / SCALE
        for body, one in points.items()
    }
    at = np.searchsorted(points["damper"].number, pairs.damper_node)
    closed = np.einsum("nx,nx->n", (u["damper"] - u["blades"])[at], pairs.normal)
    return np.maximum(pairs.kn * (closed - pairs.gap), 0)


def main():
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.calculix_surfaces")
    parser.add_argument("--refine", choices=("damper", "both"), default="")
    refined = parser.parse_args().refine
    one_thread()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        study, meshes, pairs = ours(folder, refined)
        text, add = whole_deck(study, meshes, pairs)
        (folder / "wedge.inp").write_text(text)
        seconds = run_ccx(folder, "wedge")
        sums, moved, pressure = results(folder)
    damper = meshes["damper"]
    facts = {}
    read = read_by_ours(study, meshes, pairs, moved, add)
    tree = cKDTree(damper.position)
    for side in SIDES:
        mine, its = pairs.select(pairs.side == side), read[pairs.side == side]
        node = damper.node[tree.query(mine.position)[1]] + add["damper"]
        N = np.maximum(mine.preload, 0)
        p, corner = N / mine.area, np.array([pressure[n] for n in node]) / SCALE
        each = -N[:, None] * mine.normal
        force, moment = np.split(sums[side] / SCALE, 2)
        own = np.cross(mine.position, each).sum(axis=0)
        facts[side] = {
            "ours_N": float(np.linalg.norm(each.sum(axis=0))),
            "ccx_N": float(np.linalg.norm(force)),
            "force_off": float(np.linalg.norm(each.sum(axis=0) - force) / np.linalg.norm(force)),
            "moment_off": float(np.linalg.norm(own - moment) / np.linalg.norm(moment)),
            "points": len(mine),
            "open": int((mine.preload <= 0).sum()),
            "map": off(p, its / mine.area, mine.area),
            "corners": off(p, corner, mine.area),
        }
        print(side, facts[side])
    record(
        "calculix_surfaces" + (refined and f"_{refined}"),
        {"ccx": ccx_version(), "ccx_s": seconds, **facts},
    )


def off(one, other, area):
    """Root mean square over the area and largest difference of two pressures, of the largest."""
    return {
        "rms": float(np.sqrt(np.average((one - other) ** 2, weights=area)) / one.max()),
        "largest": float(np.abs(one - other).max() / one.max()),
    }


if __name__ == "__main__":
    main()
