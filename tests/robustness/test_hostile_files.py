"""Files of a stranger that claim more than there is, never end, name one another or lead elsewhere:
refused in a line, in little memory. The rows of the catalogue and `test_hostile_folders` hold more
of them."""

import os
import tracemalloc

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp

from tests.modal.blocks import block
from tests.robustness import fuzz
from tests.robustness.meshes import WRITTEN
from tests.robustness.rows import chain, corner, refused, stages, tipdamp
from tests.tipdamp import corner_study, mesh_texts
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.io import array_files
from tipdamp.hbm.io.array_files import open_npz
from tipdamp.hbm.io.matrices_in import read_matrix
from tipdamp.readers.dispatch import read_mesh

LITTLE = 100e6  # bytes, for files of some kB
ENDS = list(WRITTEN)
MTX = "%%MatrixMarket matrix coordinate real symmetric\n"


def in_little_memory(call, *arguments):
    """The InputError, or the result, of a call, which takes little memory."""
    tracemalloc.start()
    try:
        return call(*arguments)
    except InputError as error:
        assert str(error).isprintable() and len(str(error)) < 2000
        return error
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak < LITTLE, f"{peak / 1e6:.0f} MB"


def small(end):
    return WRITTEN[end](block("hexahedron", (2, 1, 1)))


@pytest.mark.parametrize(
    "end, old, new, group",
    [
        (".inp", None, "*NSET, NSET=big, GENERATE\n1, 1000000000, 1\n", "big"),
        (".inp", None, "*ELSET, ELSET=big, GENERATE\n1, 1000000000000000, 3\n", "big"),
        (".bdf", "ENDDATA", "SET1,7,1,THRU,99999999\nENDDATA", "set_7"),
        (".bdf", "ENDDATA", "SPC1,9,123456,1,THRU,99999999\nENDDATA", "spc_9"),
        (
            ".cdb",
            "FINISH",
            "CMBLOCK,BIG,NODE,       2\n(8i10)\n         1-999999999\nFINISH",
            "BIG",
        ),
        (
            ".cdb",
            "FINISH",
            "CMBLOCK,BIG,ELEM,       2\n(8i10)\n         1-999999999\nFINISH",
            "BIG",
        ),
    ],
)
def test_a_range_of_a_billion_numbers_names_those_that_exist(tmp_path, end, old, new, group):
    """A line of thirty letters made a list of that length, of 8 GB and more."""
    text = small(end)
    path = tmp_path / f"mesh{end}"
    path.write_text(text.replace(old, new) if old else text + new)
    mesh = in_little_memory(read_mesh, path)
    members = mesh.groups.get(group, mesh.cell_groups.get(group))
    assert 0 < len(members) <= len(mesh.node)


def test_a_long_range_before_what_it_is_of(tmp_path):
    path = tmp_path / "mesh.inp"
    path.write_text("*NSET, NSET=big, GENERATE\n1, 1000000000, 1\n" + small(".inp"))
    assert "a range of 1000000000 numbers stands before" in str(in_little_memory(read_mesh, path))


def claiming(end, count):
    """A mesh whose heads of nodes, or of elements, say so many."""
    text = small(end)
    if end == ".msh":
        for version, field in (("4.1", 1), ("2.2", 0)):
            for section in ("$Nodes\n", "$Elements\n"):
                head, tail = mesh_texts.gmsh_text(block("hexahedron"), version).split(section)
                first, rest = tail.split("\n", 1)
                words = first.split()
                words[field] = str(count)
                yield head + section + " ".join(words) + "\n" + rest
    elif end == ".cdb":
        for name in ("NBLOCK", "EBLOCK", "CMBLOCK"):
            head = next(line for line in text.splitlines() if line.startswith(name))
            yield text.replace(head, ",".join([*head.split(",")[:-1], str(count)]))
    else:
        yield (
            text + f"*NSET, NSET=big, GENERATE\n{count}, {10 * count}, 1\n"
            if end == ".inp"
            else text.replace("ENDDATA", f"SET1,7,1,THRU,{count}\nENDDATA")
        )


@pytest.mark.parametrize("end", ENDS)
def test_meshes_that_claim_1e15_nodes_or_elements(tmp_path, end):
    path = tmp_path / f"mesh{end}"
    for text in claiming(end, 10**15):
        path.write_text(text)
        found = in_little_memory(read_mesh, path)
        assert isinstance(found, InputError) or end in (".inp", ".bdf") and len(found.node) == 12, (
            text
        )


INCLUDES = {".bdf": ("INCLUDE '{}'\n", "$\n"), ".inp": ("*INCLUDE, INPUT={}\n", "**\n")}


@pytest.mark.parametrize("end", INCLUDES)
def test_a_file_that_includes_itself(tmp_path, end):
    path = tmp_path / f"mesh{end}"
    path.write_text(INCLUDES[end][0].format(path.name))
    assert "lie in one another too deeply; does one name itself?" in str(
        in_little_memory(read_mesh, path)
    )


@pytest.mark.parametrize("end", INCLUDES)
def test_files_that_include_one_another_twice(tmp_path, end):
    """Forty of them: a million million readings."""
    line, last = INCLUDES[end]
    for i in range(40):
        (tmp_path / f"{i}{end}").write_text(2 * line.format(f"{i + 1}{end}"))
    (tmp_path / f"40{end}").write_text(last)
    with fuzz.within(100):
        assert "more than 500 files are included" in str(
            in_little_memory(read_mesh, tmp_path / f"0{end}")
        )


@pytest.mark.parametrize("end", INCLUDES)
@pytest.mark.parametrize("name", ["/etc/passwd", "../secret{}", "pipe{}", "link{}"])
def test_included_files_lie_beside_the_mesh(tmp_path, end, name):
    folder, name = tmp_path / "study", name.format(end)
    folder.mkdir()
    (tmp_path / f"secret{end}").write_text("root:x:0:0")
    (folder / f"link{end}").symlink_to(tmp_path / f"secret{end}")
    os.mkfifo(folder / f"pipe{end}")
    (folder / f"mesh{end}").write_text(INCLUDES[end][0].format(name))
    with fuzz.within(100):
        said = str(in_little_memory(read_mesh, folder / f"mesh{end}"))
    assert ("lies outside the folder" in said or "not found beside" in said) and "root:" not in said


@pytest.mark.parametrize(
    "name, text",
    [
        ("K.mtx", MTX + "3 3 1000000000000000000\n1 1 1\n"),
        ("K.mtx", MTX + "1000000000000 1000000000000 1\n1 1 1\n"),
        ("K.mtx", MTX.replace("coordinate", "array") + "1000000000 1000000000\n1\n"),
        ("K.mtx", "1,1,1.0\n1000000000,1000000000,1.0\n"),
        ("K.matrix", "1, 1, 1.0\n1000000000, 1000000000, 1.0\n"),
    ],
)
def test_matrices_that_claim_more_than_they_hold(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    assert "of memory, " in str(in_little_memory(read_matrix, tmp_path / name, "K"))


def test_a_sparse_matrix_that_is_too_large_as_a_dense_one(tmp_path):
    sp.save_npz(tmp_path / "K.npz", sp.coo_matrix(([1.0], ([0], [0])), shape=(10**7, 10**7)))
    assert "of memory, " in str(in_little_memory(read_matrix, tmp_path / "K.npz", "K"))


def test_a_packed_matlab_file(tmp_path, monkeypatch):
    """8 MB that are packed into 8 kB, where 4 MB are left."""
    scipy.io.savemat(tmp_path / "K.mat", {"K": np.zeros((1000, 1000))}, do_compression=True)
    assert (tmp_path / "K.mat").stat().st_size < 20e3
    monkeypatch.setattr(array_files, "available_bytes", lambda: 4e6)
    assert "take 0.008 GB of memory" in str(in_little_memory(read_matrix, tmp_path / "K.mat", "K"))


@pytest.mark.parametrize("name", ["K.mtx.gz", "K.xdmf", "K.h5", "K.pkl"])
def test_packed_and_linking_formats_are_not_read(tmp_path, name):
    """No unpacking, no external links of HDF5, no pickles."""
    (tmp_path / name).write_bytes(b"\x1f\x8b")
    assert "format of" in str(in_little_memory(read_matrix, tmp_path / name, "K"))
    assert "mesh files of type" in str(in_little_memory(read_mesh, tmp_path / name))


@pytest.mark.parametrize(
    "make, name",
    [
        (corner, "blades.inp"),
        (corner, "damper.inp"),
        (chain, "model.npz"),
        (chain, "pairs.csv"),
        (chain, "study.toml"),
    ],
)
def test_inputs_of_a_terabyte(tmp_path, make, name):
    """Holes that take no room on the disk."""
    study = make(tmp_path)
    os.truncate(tmp_path / name, 10**12)
    said = in_little_memory(
        refused, study, rf"{name}.* has (1e\+03 GB; what is read|1000000000000 bytes)"
    )
    assert isinstance(said, str)


def test_an_included_file_of_a_terabyte(tmp_path):
    study = corner(tmp_path)
    (tmp_path / "blades.inp").write_text("*INCLUDE, INPUT=part.inc\n")
    (tmp_path / "part.inc").touch()
    os.truncate(tmp_path / "part.inc", 10**12)
    said = in_little_memory(refused, study, r"part\.inc.* has 1e\+03 GB; what is read")
    assert isinstance(said, str)


@pytest.mark.parametrize(
    "name",
    [
        "model.npz",
        "preload.csv",
        "preload.json",
        ".stages/preload.json",
        ".stages/tune.from",
        ".stages/.holder",
    ],
)
def test_results_of_a_terabyte(tmp_path, name):
    """Refused, or made anew where they only record."""
    study = chain(tmp_path)
    stages(study, "preload")
    path = tmp_path / "results" / "study" / name
    path.touch()
    os.truncate(path, 10**12)
    said = [tipdamp(verb, study, "--quiet") for verb in ("inspect", "preload", "tune")]
    assert all(one.code in (0, 2) and "Traceback" not in one.err for one in said), said
    assert name.startswith(".stages") or said[-1].code == 2 and "GB" in said[-1].err, said


@pytest.mark.parametrize(
    "name",
    [
        "preload.json",
        "preload.csv",
        "model.npz",
        ".stages/preload.from",
        ".stages/.lock",
        ".stages/.holder",
        "inspect.html",
    ],
)
def test_pipes_in_the_place_of_results(tmp_path, name):
    """Nothing waits for somebody who writes into them."""
    study = chain(tmp_path)
    stages(study, "preload")
    path = tmp_path / "results" / "study" / name
    path.unlink(missing_ok=True)
    os.mkfifo(path)
    with fuzz.within(100):
        for verb in ("inspect", "reduce", "preload", "tune"):
            assert tipdamp(verb, study, "--quiet").code in (0, 2)


def test_a_pipe_in_the_place_of_arrays(tmp_path):
    os.mkfifo(tmp_path / "curve.npz")
    with fuzz.within(100), pytest.raises(InputError, match="curve.npz: is not a file"):
        open_npz(tmp_path / "curve.npz")


def test_a_million_columns(tmp_path):
    head = ",".join(f"c{i}" for i in range(1_000_000))
    (tmp_path / "pairs.csv").write_text(f"{head}\n{head}\n")
    tracemalloc.start()
    with pytest.raises(InputError, match="unknown column 'c0'"):
        ContactTable.load(tmp_path / "pairs.csv")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 30 * (tmp_path / "pairs.csv").stat().st_size


@pytest.mark.parametrize(
    "add",
    [
        '[measured."../../x"]\nfile = "a.csv"\ncolumns = ["frequency_hz", "magnitude"]\n',
        '[loads."../x"]\npull = 1\n',
        '[loads."/tmp/x"]\npull = 1\n',
    ],
)
def test_names_that_lead_elsewhere(tmp_path, add):
    home = tmp_path / "home"
    home.mkdir()
    study = chain(home, add=add)
    (home / "a.csv").write_text("900, 1\n1000, 2\n1100, 1\n")
    refused(study, r"\[(measured|loads)\..*: is named by letters, digits, - and _")
    assert [p.name for p in tmp_path.iterdir()] == ["home"]


@pytest.mark.parametrize("side", ["../../x", "a/b", "..", "/tmp/x"])
def test_sides_that_lead_elsewhere(tmp_path, side):
    """A side names columns and labels, no file."""
    home = tmp_path / "home"
    home.mkdir()
    study = corner(home, ("[contact.one]", f'[contact."{side}"]'))
    assert tipdamp("inspect", study, "--quiet").code in (0, 2)
    assert [p.name for p in tmp_path.iterdir()] == ["home"]
    assert {p.name for p in home.iterdir()} <= {
        "blades.inp",
        "damper.inp",
        "corner.toml",
        "results",
    }


def test_escapes_in_names_of_a_mesh_do_not_reach_the_terminal(tmp_path):
    mesh = corner_study.damper()
    mesh.groups['a\x1b]0;"root"\x07\x7f\x1b[2J'] = mesh.groups["face_x"]
    study = corner(tmp_path, damper_mesh=mesh)
    for arguments in ((study, "--quiet"), (tmp_path / "blades.inp", tmp_path / "damper.inp")):
        said = tipdamp("inspect", *arguments)
        assert "\x1b" not in said.out + said.err and "\x07" not in said.out + said.err
        assert said.code == 0, said


def test_room_is_that_of_the_machine(tmp_path, monkeypatch):
    """A file of 3 kB is refused where 10 kB are left: four times its size."""
    study = chain(tmp_path)
    monkeypatch.setattr(
        array_files, "available_bytes", lambda: 4.0 * (tmp_path / "model.npz").stat().st_size - 1
    )
    refused(study, "model.npz: has .* GB; what is read of it takes four times as much memory")
