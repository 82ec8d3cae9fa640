"""A. Mesh files, read through the whole command line; each reader by itself is held in
tests/tipdamp/test_bad_*.py."""

import contextlib
import os
from dataclasses import replace
from unittest import mock

import numpy as np

from tests.modal.blocks import block
from tests.robustness.rows import accepted, corner, refused, row, warned
from tests.tipdamp import corner_study, mesh_texts
from tests.tipdamp.bad_meshes import WRITERS
from tipdamp.modal import memory
from tipdamp.modal.mesh import Mesh

WRITTEN = {
    ".msh": mesh_texts.gmsh_text,
    ".inp": mesh_texts.abaqus_flat,
    ".cdb": mesh_texts.ansys,
    ".bdf": mesh_texts.nastran,
}


def other_mesh(folder, name, data):
    """The study with another file as mesh of the blades."""
    study = corner(folder, ('"blades.inp"', f'"{name}"'))
    if data is not None:
        (folder / name).write_bytes(data)
    return study


@row("1", "file missing, a directory, not readable", "E")
def absent(folder):
    yield refused(
        other_mesh(folder, "none.msh", None),
        r"\[blades\] mesh = 'none.msh'.*no such file.*looked for in /",
    )
    (folder / "dir.msh").mkdir()
    yield refused(other_mesh(folder, "dir.msh", None), "is a folder")
    (folder / "io.msh").symlink_to("/proc/self/mem")  # opens, and cannot be read
    yield refused(other_mesh(folder, "io.msh", None), "io.msh: Input/output error", code=4)
    os.mkfifo(folder / "pipe.msh")
    yield refused(other_mesh(folder, "pipe.msh", None), "pipe.msh.* is not a file")


@row("2", "empty mesh file", "E")
def empty(folder):
    for end in WRITTEN:
        yield refused(other_mesh(folder, f"empty{end}", b""), "is empty: it holds no nodes")


@row("3", "truncated mid-file", "E")
def truncated(folder):
    for end, write in WRITTEN.items():
        text = write(block("hexahedron", (2, 1, 1)))
        yield refused(
            other_mesh(folder, f"cut{end}", text[: int(0.7 * len(text)) + 3].encode()), f"cut{end}"
        )


@row("4", "NaN or inf coordinate", "E")
def not_finite(folder):
    for value in (np.nan, np.inf):
        mesh = corner_study.blades()
        mesh.position[7, 2] = value
        yield refused(
            corner(folder, blade_mesh=mesh),
            r"node \d+ has a coordinate that is not a finite number",
        )


@row("5", "element refers to a node that does not exist", "E")
def absent_node(folder):
    study = corner(folder)
    path = folder / "blades.inp"
    path.write_text(path.read_text().replace("C3D8R\n1, 10,", "C3D8R\n1, 999,"))
    yield refused(study, "element 1 refers to node 999, which does not exist")


@row("6", "inverted elements", "W")
def inverted(folder):
    mesh = corner_study.blades()
    mesh.cells["hexahedron"][3] = mesh.cells["hexahedron"][3][[4, 5, 6, 7, 0, 1, 2, 3]]
    yield warned(
        corner(folder, blade_mesh=mesh), "1 hexahedron cells were numbered inside out .* elements 4"
    )


@row("7", "zero volume, or a node twice in an element", "E")
def flat(folder):
    mesh = corner_study.blades()
    mesh.cells["hexahedron"][2, 0] = mesh.cells["hexahedron"][2, 1]
    yield refused(corner(folder, blade_mesh=mesh), "name a node twice .*: elements 3")
    mesh = corner_study.blades()
    mesh.position[:27, 0] = 0.01
    yield refused(
        corner(folder, blade_mesh=mesh), r"inverted or flat \(smallest Jacobian .*elements 1,"
    )


@row("9", "negative node count", "E")
def negative_count(folder):
    for version in ("4.1", "2.2"):
        text = mesh_texts.gmsh_text(block("hexahedron"), version)
        head, tail = text.split("$Nodes\n")
        first, rest = tail.split("\n", 1)
        fields = first.split()
        fields[1 if version == "4.1" else 0] = "-27"
        yield refused(
            other_mesh(
                folder, "b.msh", "\n".join([head + "$Nodes", " ".join(fields), rest]).encode()
            ),
            "b.msh: .Nodes.*(negative|says -27)",
        )


@row("10", "physical group missing or misspelt", "E")
def misspelt(folder):
    yield refused(
        corner(folder, ('"clamp_one"', '"clmp_one"')),
        "no group 'clmp_one'; did you mean 'clamp_one'.*valid: .*touch_two",
    )


@row("11", "group empty, or of the wrong dimension", "E")
def empty_group(folder):
    mesh = corner_study.blades()
    mesh.groups["clamp_one"] = mesh.groups["clamp_one"][:0]
    yield refused(corner(folder, blade_mesh=mesh), "clamp_one")
    study = corner(
        folder, ('damper = "face_x"', 'damper = "solid"'), ('"damper.inp"', '"damper.msh"')
    )
    mesh = corner_study.damper()
    (folder / "damper.msh").write_text(mesh_texts.gmsh_text(mesh))
    yield refused(study, "'solid'.*27 nodes.*volume|'solid'.*volume")


@row("13", "mesh in mm, study in SI", "W")
def millimetres(folder):
    mesh = {"blade_mesh": corner_study.blades(), "damper_mesh": corner_study.damper()}
    large = {name: replace(m, position=1e3 * m.position) for name, m in mesh.items()}
    yield warned(
        corner(folder, ("mu = 0.3", "mu = 0.3\ntolerance = 1e-3"), **large), "factor of 1000"
    )


@row("14", "two disconnected bodies in one", "S, W, E")
def two_bodies(folder):
    study = corner(folder)  # two blades, which are meant
    yield next(
        line for line in accepted(study).out.splitlines() if "54 nodes in 2 pieces" in line
    ).strip()
    (folder / "third").mkdir()
    yield warned(
        corner(folder / "third", blade_mesh=corner_study.with_a_third()),
        "blades: the mesh consists of 3 pieces .*; 1 of them is clamped and in no contact",
    )
    alone = corner(folder, ('["clamp_one", "clamp_two"]', '["clamp_one"]'))
    yield refused(alone, "blades.*6 rigid|blades.*free|support")


@row("15", "unreferenced nodes", "S")
def hanging(folder):
    study = corner(folder)
    path = folder / "damper.inp"
    path.write_text(
        path.read_text().replace("*ELEMENT", "900, 0.5, 0.5, 0.5\n901, 1, 1, 1\n*ELEMENT", 1)
    )
    found = accepted(study)
    assert "27 nodes" in found.out and "6 rigid modes" in found.out
    yield [line for line in found.out.splitlines() if "damper" in line or "no cell" in line][
        -1
    ].strip()[:200]


@row("16", "contact surfaces do not match", "E")
def unmatched(folder):
    damper = corner_study.damper(at=(0, 0, -2e-6))
    yield refused(corner(folder, damper_mesh=damper), "9 damper nodes .*tolerance|tolerance")


@row("18", "contact normals point the same way", "E")
def same_way(folder):
    damper = corner_study.damper()
    damper.groups["face_x"] = corner_study.on(damper, 0, 0.0)
    damper = replace(damper, position=damper.position + [0.01, 0, 0])
    yield refused(corner(folder, damper_mesh=damper), "normal|oppos|partner|tolerance")


@row("19", "initial penetration", "W")
def penetration(folder):
    damper = corner_study.damper(at=(1e-3, 0, 0))
    yield warned(
        corner(folder, ("mu = 0.3", "mu = 0.3\ntolerance = 2e-3"), damper_mesh=damper),
        r"pairs overlap, most at blade node \d+ .*0.001 m.*\[contact\] distance",
    )


@row("20", "pyramid cells, mixed order", "E")
def pyramids(folder):
    study = corner(folder)
    (folder / "blades.inp").write_text("*NODE\n1,0,0,0\n*ELEMENT, TYPE=C3D5\n1,1,1,1,1,1\n")
    yield refused(study, "type C3D5 cannot be assembled; allowed: C3D4")


@row("21", "gmsh 2.2, 4.1; other formats of one mesh", "S")
def formats(folder):
    said = set()
    for end, name in ((".msh", "a.msh"), (".2.msh", "b.msh")):
        study = corner(folder, ('"damper.inp"', f'"{name}"'))
        (folder / name).write_text(WRITERS[end](corner_study.damper()))
        said.add(next(line for line in accepted(study).out.splitlines() if "damper:" in line))
    assert len(said) == 1, said
    yield (
        "the same counts, masses and groups from 2.2 and 4.1 (binary: "
        "tests/tipdamp/readers/test_bad_formats.py)"
    )


@row("22", "group name that is not UTF-8", "W")
def latin(folder):
    study = corner(folder)
    path = folder / "damper.inp"
    path.write_bytes(
        path.read_bytes().replace(b'NSET="load"', b'NSET="load"\n13\n*NSET, NSET="l\xefad"')
    )
    yield warned(study, r"not UTF-8 \(byte")


@row("23", "hostile group name", "S")
def hostile_name(folder):
    name = "../<script>alert(1)</script>&x"
    mesh = corner_study.blades()
    mesh.groups[name] = mesh.groups["touch_one"]
    study = corner(folder, ('patches = ["touch_one"', f"patches = ['{name}'"), blade_mesh=mesh)
    accepted(study)
    page = (folder / "results" / "corner" / "inspect.html").read_text(encoding="utf-8")
    assert "<script>alert" not in page and sorted(p.name for p in folder.iterdir()) == [
        "blades.inp",
        "corner.toml",
        "damper.inp",
        "results",
    ]
    yield "the name is kept and escaped; no file is called after it"


@row("24", "mesh of 5e6 nodes", "E")
def too_large(folder):
    with (
        mock.patch.object(memory, "available_bytes", lambda: 64e9),
        contextlib.suppress(ValueError),
    ):
        memory.check_memory((5_000_000, 0, "big.msh"))
        raise AssertionError("5e6 nodes were taken")
    with mock.patch.object(memory, "available_bytes", lambda: 1e5):
        yield refused(corner(folder), r"blades.inp: 54 nodes \(162 dofs.* are predicted to need")


@row("x1", "twenty kinds of damage to one mesh in every format", "E, S")
def damage(folder):
    rng, counts = np.random.default_rng(5), {0: 0, 2: 0}
    for end in (".msh", ".inp", ".cdb", ".bdf"):
        whole = WRITTEN[end](_single(corner_study.damper())).encode()
        for _ in range(5):
            data = bytearray(whole)
            for place in rng.integers(len(data) - 50, size=3):
                data[place : place + 3] = bytes(
                    rng.choice(list(b"0123456789,-*$.\n eE"), size=2).tolist()
                )
            study = corner(folder, ('"damper.inp"', f'"damaged{end}"'))
            (folder / f"damaged{end}").write_bytes(bytes(data))
            from tests.robustness.rows import tipdamp

            said = tipdamp("inspect", study, "--quiet")
            assert said.code in (0, 2) and "Traceback" not in said.err, said.err
            assert said.code == 0 or said.err.count("\n") == 1, said.err
            counts[said.code] += 1
    yield f"{counts[2]} refused in one line, {counts[0]} read"


def _single(mesh: Mesh) -> Mesh:
    """Groups that every writer of the tests knows."""
    return replace(mesh, groups={"clamp": mesh.groups["face_x"], "tip": mesh.groups["face_z"]})
