"""Sizes that an .npz declares are held against the file and the memory before anything is
unpacked."""

import io
import zipfile

import numpy as np
import pytest

from tests.tipdamp.rig_study import CHAIN
from tipdamp.cli import main
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.io import array_files
from tipdamp.hbm.io.array_files import open_npz
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.result import ForcedResponse


def lying(path, shape):
    """K of a given shape by its header, of 3 numbers in truth."""
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        header, {"descr": "<f8", "fortran_order": False, "shape": shape}
    )
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as z:
        z.writestr("K.npy", header.getvalue() + np.zeros(3).tobytes())


def test_a_header_that_says_more_than_there_is(tmp_path):
    lying(tmp_path / "a.npz", (40_000_000, 40_000_000))
    with pytest.raises(InputError, match=r"'K' is of shape \(40000000, 40000000\).*damaged"):
        open_npz(tmp_path / "a.npz", packed=True)


def test_arrays_beyond_the_memory(tmp_path, monkeypatch, capsys):
    """9 MB in each of the readers of matrices, as from a supplier, where 12 MB are left."""
    big = np.zeros((1100, 1100))
    np.savez_compressed(tmp_path / "model.npz", M=big, K=big)
    monkeypatch.setattr(array_files, "available_bytes", lambda: 12e6)
    for read in (ReducedModel.load, lambda path: ReducedModel.from_files(path, path)):
        with pytest.raises(
            InputError, match="arrays take 0.0194 GB of memory, 0.012 GB are available"
        ):
            read(tmp_path / "model.npz")
    (tmp_path / "study.toml").write_text(CHAIN)
    (tmp_path / "pairs.csv").write_text("")
    assert main(["reduce", str(tmp_path / "study.toml"), "--quiet"]) == 2
    assert "GB are available" in capsys.readouterr().err


def test_packed_results_are_not_ours(tmp_path):
    np.savez_compressed(tmp_path / "curve.npz", frequency=np.zeros(100_000))
    with pytest.raises(InputError, match="not written by this program"):
        ForcedResponse.load(tmp_path / "curve.npz")


def test_memory_that_runs_out_is_one_line(matrices_study, monkeypatch, capsys):
    def greedy(_):
        raise MemoryError("Unable to allocate 9.2 GiB")

    monkeypatch.setattr("tipdamp.study.study.load_study", greedy)
    assert main(["inspect", str(matrices_study)]) == 4
    assert capsys.readouterr().err == "tipdamp: not enough memory: Unable to allocate 9.2 GiB\n"
