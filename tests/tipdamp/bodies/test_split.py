"""One file with all bodies gives what two files give: meshes, pairs and stiffness, by groups of
cells or by pieces."""

from dataclasses import replace

import numpy as np
import pytest

from tests.tipdamp import corner_study, mesh_texts
from tipdamp.bodies.assemble import assemble_bodies
from tipdamp.bodies.pair import matched
from tipdamp.bodies.read import read_meshes
from tipdamp.hbm.errors import InputError
from tipdamp.modal.faces import face_keys, group_faces
from tipdamp.modal.mesh import Mesh
from tipdamp.study.study import load_study

ONE_FILE = ('mesh = "damper.inp"', 'mesh = "all.inp"'), ('mesh = "blades.inp"', 'mesh = "all.inp"')


def joined(damper_name="pin"):
    """Both bodies of the corner study as one mesh, the damper's cells in a group of their own."""
    blades, damper = corner_study.blades(), corner_study.damper()
    n, last = len(blades.node), int(blades.node.max())
    return Mesh(
        np.concatenate([blades.node, damper.node + last]),
        np.vstack([blades.position, damper.position]),
        {k: np.concatenate([blades.cells[k], damper.cells[k] + n]) for k in blades.cells},
        {**blades.groups, **{k: v + last for k, v in damper.groups.items()}},
        number={
            k: np.concatenate([blades.number[k], damper.number[k] + 500]) for k in blades.number
        },
        cell_groups={
            **blades.cell_groups,
            "blades": np.concatenate(list(blades.number.values())),
            damper_name: np.concatenate(list(damper.number.values())) + 500,
        },
    ), last


def written(folder, mesh, *changes):
    corner_study.write(folder, change=(*ONE_FILE, *changes))
    (folder / "all.inp").write_text(mesh_texts.plain(mesh))
    return load_study(folder / "corner.toml")


@pytest.mark.parametrize(
    "cells",
    [
        ("", ""),
        ("", 'cells = "pin"'),
        ('cells = ["blades"]', ""),
        ('cells = ["blades", "blade two"]', 'cells = "pin"'),
    ],
)
def test_one_file_is_two_files(tmp_path, cells):
    mesh, last = joined()
    two = load_study(corner_study.write(tmp_path))
    apart = read_meshes(two)
    of_blades, of_damper = (f"\n{text}" * bool(text) for text in cells)
    one = written(
        tmp_path,
        mesh,
        ("modes = 5", "modes = 5" + of_blades),
        ("modes = 3", "modes = 3" + of_damper),
    )
    found = read_meshes(one)
    assert np.array_equal(found["blades"].node, apart["blades"].node)
    assert np.array_equal(found["damper"].node, apart["damper"].node + last)
    pairs, their = matched(one, found).pairs, matched(two, apart).pairs
    assert np.array_equal(pairs.blade_node, their.blade_node) and np.array_equal(
        pairs.damper_node - last, their.damper_node
    )
    assert pairs.frame == pytest.approx(their.frame)
    for mine, other in zip(
        assemble_bodies(one, found, lambda *_: None),
        assemble_bodies(two, apart, lambda *_: None),
        strict=True,
    ):
        assert (mine.K != other.K).nnz == 0 and (mine.M != other.M).nnz == 0
    assert "face_x" not in found["blades"].groups and "clamp_one" not in found["damper"].groups


def test_bodies_that_share_nodes(tmp_path):
    """A merged mesh: by groups of cells both bodies have the shared nodes, and so pairs; alone it
    is one piece."""
    mesh, _ = joined()
    place = {tuple(np.round(p, 9)): i for i, p in reversed(list(enumerate(mesh.position)))}
    first = np.array([place[tuple(np.round(p, 9))] for p in mesh.position])
    merged = replace(
        mesh,
        cells={k: first[c] for k, c in mesh.cells.items()},
        groups={k: np.unique(mesh.node[first[mesh.index(v)]]) for k, v in mesh.groups.items()},
    )
    study = written(tmp_path, merged, ("modes = 3", 'modes = 3\ncells = "pin"'))
    pairs = matched(study, read_meshes(study)).pairs
    assert len(pairs) == 18 and np.array_equal(pairs.blade_node, pairs.damper_node)
    with pytest.raises(
        InputError,
        match=r"\[damper\]: mesh is the file of the \[blades\] too, and "
        "all its cells are connected; name another file, or the groups of cells",
    ):
        read_meshes(written(tmp_path, merged))


@pytest.mark.parametrize(
    "change, message",
    [
        (
            'cells = "pim"',
            r"\[damper\] cells: all.inp: no group of cells 'pim'; did you mean 'pin'",
        ),
        ('cells = ["pin", "blade two"]\n[x]', None),
    ],
)
def test_cells_that_do_not_fit(tmp_path, change, message):
    mesh, _ = joined()
    if message is None:
        study = written(
            tmp_path,
            mesh,
            ("modes = 5", 'modes = 5\ncells = "blades"'),
            ("modes = 3", 'modes = 3\ncells = ["pin", "blade two"]'),
        )
        message = (
            r"\[damper\] cells and \[blades\] cells: 8 hexahedron cells belong to both "
            r"\(first: element 101\)"
        )
    else:
        study = written(tmp_path, mesh, ("modes = 3", "modes = 3\n" + change))
    with pytest.raises(InputError, match=message):
        read_meshes(study)


def test_cells_of_a_file_of_its_own(tmp_path):
    """A file with more than the body: the cells that are named, with the faces that they have."""
    mesh, _ = joined()
    text = mesh_texts.plain(mesh) + "*SURFACE, NAME=all_S1\npin, S1\nblades, S1\n"
    corner_study.write(tmp_path, change=(ONE_FILE[0], ("modes = 3", 'modes = 3\ncells = "pin"')))
    (tmp_path / "all.inp").write_text(text)
    damper = read_meshes(load_study(tmp_path / "corner.toml"))["damper"]
    (faces,) = group_faces(damper, "all_S1")
    # of eight S1 four lie on the outside
    assert len(damper.cells["hexahedron"]) == 8 and len(faces) == 4
    assert len(np.unique(face_keys(damper.node[faces]), axis=0)) == 4
