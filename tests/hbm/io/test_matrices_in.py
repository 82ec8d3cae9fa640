"""Matrices written as other codes write them come back as the same model, and give the same
response."""

import subprocess
import sys
import textwrap
import warnings
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp

from tests.hbm.small_rig import small_rig
from tipdamp.hbm.contact import COLUMNS, GROUND, ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.io.dof_table import DIRECTIONS, ROTATIONS, read_dofs
from tipdamp.hbm.io.matrices_in import FORMATS, abaqus_text, read_matrix
from tipdamp.hbm.model import ReducedModel

from_files = ReducedModel.from_files


@pytest.fixture(scope="module")
def rig():
    return small_rig(stations=3)


def dof_table(path, model):
    lines = ["body,node,direction,x,y,z"]
    lines += [
        f"{b},{n},{d},{x:.17g},{y:.17g},{z:.17g}"
        for b, n, d, (x, y, z) in zip(
            model.body, model.node, model.direction, model.position, strict=True
        )
    ]
    path.write_text("\n".join(lines))
    return path


def test_empty_cells_of_a_load_are_no_force(tmp_path):
    """And those of a position are unknown, those of a body the name that was given."""
    (tmp_path / "dofs.csv").write_text(
        "body,node,direction,x,y,z,load pull,load push\n"
        "blade,1,x,0.1,,0,,-3\n"
        ",1,y,0.1,0.2,0,2.5,\n"
        "blade,2,x,,,,,\n"
    )
    table = read_dofs(tmp_path / "dofs.csv", "other")
    assert table["loads"]["pull"] == [0, 2.5, 0]
    assert table["loads"]["push"] == [-3, 0, 0]
    assert np.isnan(table["position"]).tolist() == [[False, True, False], [False] * 3, [True] * 3]
    assert table["body"].tolist() == ["blade", "other", "blade"]


def harwell_boeing_as_ansys(path, matrix):
    """RSA with the lower triangle, one number per line, D exponents."""
    low = sp.csc_matrix(sp.tril(matrix))
    low.sort_indices()
    n, nnz = matrix.shape[0], low.nnz
    head = [
        "title".ljust(72) + "key",
        "".join(f"{k:14d}" for k in (n + 1 + 2 * nnz, n + 1, nnz, nnz, 0)),
        "RSA".ljust(14) + "".join(f"{k:14d}" for k in (n, n, nnz, 0)),
        "(1I14)".ljust(16) + "(1I14)".ljust(16) + "(1D25.16)".ljust(20) + "".ljust(20),
    ]
    body = [f"{k + 1:14d}" for k in low.indptr] + [f"{k + 1:14d}" for k in low.indices]
    body += [f"{v:25.16E}".replace("E", "D") for v in low.data]
    path.write_text("\n".join(head + body) + "\n")


def abaqus(path, matrix, node, direction):
    i, j = np.nonzero(np.triu(matrix))
    dof = ["xyz".index(d) + 1 for d in direction]
    path.write_text(
        "** comment\n*MATRIX INPUT\n"
        + "\n".join(
            f"{node[a]},{dof[a]}, {node[b]},{dof[b]}, {matrix[a, b]:.16e}"
            for a, b in zip(i, j, strict=True)
        )
    )


@pytest.mark.parametrize("kind", [".npz", ".npy", ".mtx", ".mat", ".hb", "sparse.npz"])
def test_every_format_comes_back(rig, tmp_path, kind):
    model = rig[0]
    write = {
        ".npz": lambda p, A: np.savez(p, A),
        ".npy": np.save,
        "sparse.npz": lambda p, A: sp.save_npz(p, sp.csr_matrix(A)),
        ".mtx": lambda p, A: scipy.io.mmwrite(
            p, sp.coo_matrix(A), symmetry="symmetric", precision=17
        ),
        ".mat": lambda p, A: scipy.io.savemat(p, {"A": sp.csc_matrix(A)}),
        ".hb": harwell_boeing_as_ansys,
    }[kind]
    paths = {name: tmp_path / f"{name}{kind}" for name in "MK"}
    for name, path in paths.items():
        write(path, getattr(model, name))
    again = from_files(
        **paths,
        dofs=dof_table(tmp_path / "dofs.csv", model),
        loads={"pull": model.K[0]},
        groups={"damper/line": [1, 2]},
    )
    assert np.array_equal(again.loads["pull"], model.K[0]) and again.groups[
        "damper/line"
    ].tolist() == [1, 2]
    for name in "MK":
        assert np.allclose(getattr(again, name), getattr(model, name), rtol=1e-14, atol=0)
    assert np.array_equal(again.dofs("damper", 2), model.dofs("damper", 2))
    assert np.allclose(again.position, model.position)


def test_abaqus_text_names_its_dofs(rig, tmp_path):
    model = rig[0]
    rows = np.flatnonzero(model.body == "damper")
    for name in "MK":
        A = getattr(model, name)[np.ix_(rows, rows)]
        abaqus(tmp_path / f"{name}.mtx", A + 0.0, model.node[rows], model.direction[rows])
    again = from_files(tmp_path / "M.mtx", tmp_path / "K.mtx", body="damper")
    assert np.allclose(again.K, model.K[np.ix_(rows, rows)], rtol=1e-14)
    assert again.dofs("damper", 2).tolist() == [3, 4, 5]
    (tmp_path / "heat.mtx").write_text("1,11,1,11,2.0")
    with pytest.raises(InputError, match="dof 11 is neither displacement .* direction 'mode'"):
        from_files(tmp_path / "heat.mtx", tmp_path / "heat.mtx")


def bernoulli():
    """(M, K, dof table rows) of a cantilever of two elements with x, y and rz at each free node; EI
    = L = rho A = 1."""
    K, M = np.zeros((9, 9)), np.zeros((9, 9))
    k = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4.0]])
    m = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]) / 420
    for e in (0, 3):
        axial, bending = [e, e + 3], [e + 1, e + 2, e + 4, e + 5]
        K[np.ix_(axial, axial)] += 1e3 * np.array([[1, -1], [-1, 1]])
        M[np.ix_(axial, axial)] += np.array([[2, 1], [1, 2]]) / 6
        K[np.ix_(bending, bending)] += k
        M[np.ix_(bending, bending)] += m
    return M[3:, 3:], K[3:, 3:], [(n, d) for n in (1, 2) for d in ("x", "y", "rz")]


def test_rotations_are_dofs_that_no_contact_touches(tmp_path):
    """From a dof table, from Abaqus' text (dof 6), from Ansys' mapping (ROTZ): the same model."""
    M, K, rows = bernoulli()
    for name, A in (("M", M), ("K", K)):
        np.save(tmp_path / f"{name}.npy", A)
        harwell_boeing_as_ansys(tmp_path / f"{name}.hb", A)
        for kind in (".mtx", ".matrix"):
            (tmp_path / f"{name}{kind}").write_text(
                "\n".join(
                    f"{i // 3 + 1},{(1, 2, 6)[i % 3]}, {j // 3 + 1},{(1, 2, 6)[j % 3]}, "
                    f"{A[i, j]:.16e}"
                    for i, j in zip(*np.nonzero(np.tril(A)), strict=True)
                )
            )
    (tmp_path / "dofs.csv").write_text("node,direction\n" + "\n".join(f"{n},{d}" for n, d in rows))
    (tmp_path / "K.mapping").write_text(
        "\n".join(
            f"{i + 1} {n} {'ROTZ' if d == 'rz' else 'U' + d.upper()}"
            for i, (n, d) in enumerate(rows)
        )
    )
    for kind, dofs in (
        (".npy", "dofs.csv"),
        (".mtx", None),
        (".mtx", "dofs.csv"),
        (".matrix", None),
        (".hb", "K.mapping"),
    ):
        model = from_files(
            tmp_path / f"M{kind}", tmp_path / f"K{kind}", dofs=dofs and tmp_path / dofs
        )
        assert (
            np.allclose(model.K, K, rtol=1e-15) and model.direction.tolist() == ["x", "y", "rz"] * 2
        )
        assert (
            model.dofs("body", 2).tolist() == [3, 4, -1]
            and model.moves.tolist() == [True, True, False] * 2
        )


def test_harwell_boeing_as_scipy_writes_it(tmp_path):
    """scipy breaks the width that its header states, and reads that back."""
    rng = np.random.default_rng(1)
    A = rng.normal(size=(30, 30)) * 10.0 ** rng.integers(-9, 9, (30, 30))
    A = A + A.T
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        scipy.io.hb_write(tmp_path / "K.hb", sp.csc_matrix(A))
    assert np.allclose(read_matrix(tmp_path / "K.hb")[0], A, rtol=1e-12)


def test_harwell_boeing_mapping(rig, tmp_path):
    model = rig[0]
    harwell_boeing_as_ansys(tmp_path / "K.hb", model.K)
    harwell_boeing_as_ansys(tmp_path / "M.hb", model.M)
    node = np.repeat(np.arange(1, model.size // 3 + 1), 3)
    (tmp_path / "K.mapping").write_text(
        "Matrix Eqn  Node  DOF\n"
        + "\n".join(f"{i + 1:8d} {node[i]:8d} U{'XYZ'[i % 3]}" for i in range(model.size))
    )
    again = from_files(
        tmp_path / "M.hb", tmp_path / "K.hb", dofs=tmp_path / "K.mapping", body="all"
    )
    assert again.dofs("all", 2).tolist() == [3, 4, 5]


def test_a_file_that_cannot_be_read_says_so(rig, tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_matrix(tmp_path / "M.mtx")
    (tmp_path / "M.xyz").write_text("1")
    with pytest.raises(InputError, match="unknown"):
        read_matrix(tmp_path / "M.xyz")
    (tmp_path / "K.mtx").write_text("*MATRIX\n1,1,1\n1,2\n")
    with pytest.raises(InputError, match="line 3"):
        read_matrix(tmp_path / "K.mtx")
    harwell_boeing_as_ansys(tmp_path / "K.hb", rig[0].K)
    text = (tmp_path / "K.hb").read_text().splitlines()
    (tmp_path / "K.hb").write_text("\n".join(text[:-20]))
    with pytest.raises(InputError, match="cut off"):
        read_matrix(tmp_path / "K.hb")


def refused(message, call, *arguments, **more):
    with pytest.raises(InputError, match=message) as caught:
        call(*arguments, **more)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("suffix", [".npz", ".npy", ".mat", ".mtx", ".hb"])
@pytest.mark.parametrize(
    "content", [b"", b"PK\x03\x04 cut off", b"\xff\xfe\x00binary"], ids=["empty", "cut", "binary"]
)
def test_a_damaged_file_says_so(tmp_path, suffix, content):
    path = tmp_path / f"K{suffix}"
    path.write_bytes(content)
    refused(f"K{suffix}", read_matrix, path, "K")
    if suffix == ".npz":
        refused("K.npz", ReducedModel.load, path)


def test_a_truncated_archive_says_so(rig, tmp_path):
    """Cut in the middle, and with a flipped byte in a matrix: found by the checksum of its
    member."""
    whole = rig[0].save(tmp_path / "model.npz").read_bytes()
    for name, content in (
        ("half", whole[: len(whole) // 2]),
        ("flipped", whole[:3000] + b"\x7f" + whole[3001:]),
    ):
        path = tmp_path / f"{name}.npz"
        path.write_bytes(content)
        refused(f"{name}.npz", ReducedModel.load, path)
        refused(f"{name}.npz", read_matrix, path, "M")


def test_what_is_no_square_matrix_is_refused(tmp_path):
    np.save(tmp_path / "K.npy", np.ones(4))
    refused(
        r"K\.npy holds an array of shape \(4,\), must be a square matrix",
        read_matrix,
        tmp_path / "K.npy",
        "K",
    )
    scipy.io.mmwrite(tmp_path / "K.mtx", np.eye(3) * (2 + 1j))
    refused(
        r"M\[0, 0\] is 2\+1j: matrices must be real",
        from_files,
        tmp_path / "K.mtx",
        tmp_path / "K.mtx",
    )


@pytest.mark.parametrize("kind", ["npz", "npy", "mat", "mtx"])
def test_files_that_changed_places_are_found_out(rig, tmp_path, kind):
    """By the name of what they hold, or by frequencies that no structure has."""
    model = rig[0]
    for name, matrix in (("M", model.M), ("K", model.K)):
        write = {
            "npz": lambda path, name, matrix: np.savez(path, **{name: matrix}),
            "npy": lambda path, name, matrix: np.save(path, matrix),
            "mat": lambda path, name, matrix: scipy.io.savemat(path, {name: matrix}),
            "mtx": lambda path, name, matrix: scipy.io.mmwrite(path, matrix),
        }[kind]
        write(tmp_path / f"{name}.{kind}", name, matrix)
    from_files(tmp_path / f"M.{kind}", tmp_path / f"K.{kind}")
    with pytest.raises(InputError, match="swapped"):
        from_files(M=tmp_path / f"K.{kind}", K=tmp_path / f"M.{kind}")


def test_dof_tables_that_cannot_be_meant(rig, tmp_path):
    """Not UTF-8, in another order than Abaqus' labels, with rotations of Ansys."""
    model = rig[0].part("damper")
    for name in "MK":
        abaqus(tmp_path / f"{name}.mtx", getattr(model, name), model.node, model.direction)
    dofs = dof_table(tmp_path / "dofs.csv", model)
    files = dict(M=tmp_path / "M.mtx", K=tmp_path / "K.mtx", dofs=dofs)
    assert np.array_equal(from_files(**files).node, model.node)
    lines = dofs.read_text().splitlines()
    dofs.write_text("\n".join([lines[0], lines[2], lines[1], *lines[3:]]))
    refused(
        r"dofs\.csv, row 1: is node 1, y; .*M\.mtx has node 1, dof 1 there: order",
        from_files,
        **files,
    )
    dofs.write_text("\n".join(lines[:-1]))
    refused(r"has 23 rows, .*M\.mtx names 24 dofs", from_files, **files)
    dofs.write_bytes("\n".join(lines).replace("damper", "d\xe4mpfer").encode("latin-1"))
    refused(r"dofs\.csv: is not a CSV text in UTF-8", from_files, **files)
    (tmp_path / "K.mapping").write_text("Eqn Node DOF\n 1 7 UX\n 2 7 TEMP\n")
    refused(
        r"equation 2 is TEMP of node 7, must be UX, UY, UZ, ROTX, ROTY, ROTZ",
        from_files,
        files["M"],
        files["K"],
        dofs=tmp_path / "K.mapping",
    )
    dofs.write_text("node,direction\n7,ROTX\n")
    for name in "MK":
        np.save(tmp_path / f"{name}.npy", np.eye(1))
    refused(
        r"direction 'rotx' is unknown; .*valid: x, y, z, rx, ry, rz, mode",
        from_files,
        tmp_path / "M.npy",
        tmp_path / "K.npy",
        dofs=dofs,
    )


def test_response_needs_no_finite_elements(rig, tmp_path):
    """A fresh process in which dolfinx, petsc4py, slepc4py and gmsh cannot be imported."""
    model, pairs, _ = rig
    for name in "MK":
        scipy.io.mmwrite(
            tmp_path / f"{name}.mtx", sp.coo_matrix(getattr(model, name)), precision=17
        )
    dof_table(tmp_path / "dofs.csv", model)
    pairs.save(tmp_path / "pairs.csv")
    script = textwrap.dedent("""
        import sys
        for name in ("dolfinx", "petsc4py", "slepc4py", "gmsh", "mpi4py"):
            sys.modules[name] = None
        from tipdamp.hbm.contact import ContactTable
        from tipdamp.hbm.model import ReducedModel
        from tipdamp.hbm.laws import DryFriction2T
        from tipdamp.hbm.response import forced_response
        model = ReducedModel.from_files("M.mtx", "K.mtx", dofs="dofs.csv")
        tip = model.displacement_row("blade1", 4, [0, 1, 0])
        pairs = ContactTable.load("pairs.csv")
        curve = forced_response(model, pairs, DryFriction2T(), 8 * tip, (200, 600), harmonics=1,
                                damping_ratio=0.02, outputs={"tip": tip})
        print(curve.complete, len(curve.slipping_pairs), *curve.peak("tip"))
    """)
    root = str(Path(__file__).parents[3])
    done = subprocess.run(
        [sys.executable, "-c", script],
        cwd=tmp_path,
        env={"PYTHONPATH": root, "PATH": "/usr/bin"},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    complete, _, hz, amplitude = done.stdout.split()
    assert complete == "True" and float(amplitude) > 0 and 200 < float(hz) < 600


def test_own_model_page_names_columns_and_endings(tmp_path):
    """And its example of a table of pairs is one."""
    page = (Path(__file__).parents[3] / "docs" / "own_model.md").read_text(encoding="utf-8")
    names = (*COLUMNS, *FORMATS, *DIRECTIONS, *ROTATIONS, "mode", GROUND)
    assert not [name for name in names if f"`{name}`" not in page]
    (tmp_path / "pairs.csv").write_text(page.split("```csv\n")[1].split("```")[0])
    pairs = ContactTable.load(tmp_path / "pairs.csv")
    assert (
        len(pairs) == 1 and pairs.damper_body[0] == GROUND and pairs.normal[0].tolist() == [0, 1, 0]
    )


@pytest.mark.parametrize("lines", ["1, 1", "1, 1, 2.0\n1, 1", "1, 1, 2.0\n1, 1, 1, 2, 3.0"])
def test_lines_of_abaqus_text_are_alike(tmp_path, lines):
    path = tmp_path / "K.mtx"
    path.write_text(lines + "\n")
    with pytest.raises(InputError, match=f"line {lines.count(chr(10)) + 1}: 'node, dof"):
        abaqus_text(path)
