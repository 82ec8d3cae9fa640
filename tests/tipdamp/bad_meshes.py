"""What the tests of damaged meshes share: a mesh written in every format, the refusal, what inspect
says."""

import json

import pytest

from tests.tipdamp import mesh_texts
from tipdamp.cli import main
from tipdamp.hbm.errors import InputError
from tipdamp.readers.dispatch import read_mesh

WRITERS = {
    ".msh": mesh_texts.gmsh_text,
    ".2.msh": lambda m: mesh_texts.gmsh_text(m, "2.2"),
    ".inp": mesh_texts.abaqus_flat,
    ".cae.inp": mesh_texts.abaqus_cae,
    ".cdb": mesh_texts.ansys,
    ".bdf": mesh_texts.nastran,
    ".free.bdf": lambda m: mesh_texts.nastran(m, "free"),
}
every_format = pytest.mark.parametrize("end", WRITERS)


def write(tmp_path, end, mesh):
    path = tmp_path / f"b{end}"
    path.write_text(WRITERS[end](mesh))
    return path


def refused(path, pattern):
    with pytest.raises(InputError, match=pattern) as caught:
        read_mesh(path)
    assert "\n" not in str(caught.value) and path.name in str(caught.value)
    return str(caught.value)


def inspect(path, capsys):
    """Exit code, standard error, and the warnings that are printed, at least those of inspect.json
    (None when it failed)."""
    code = main(["inspect", str(path), "--quiet"])
    out, error = capsys.readouterr()
    result = path.parent / "results" / "corner" / "inspect.json"
    if code:
        assert not result.exists() and error.count("\n") == 1
        return code, error, None
    printed = [
        line.removeprefix("warning: ") for line in out.splitlines() if line.startswith("warning: ")
    ]
    kept = json.loads(result.read_text())["warnings"]
    assert [w[:60] for w in printed[: len(kept)]] == [w[:60] for w in kept]
    return code, error, printed


def rewritten(gmsh, source, path, version, binary, save_all=0):
    gmsh.initialize(readConfigFiles=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(source))
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.option.setNumber("Mesh.Binary", binary)
        gmsh.option.setNumber("Mesh.SaveAll", save_all)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()
    return path.read_bytes()
