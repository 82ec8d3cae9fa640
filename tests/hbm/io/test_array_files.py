"""Arrays into .npz: the bytes of numpy, and one error on a full disk."""

import gc
import sys
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from tipdamp.hbm.errors import InputError
from tipdamp.hbm.io.array_files import open_matlab, save_npz

FULL = Path("/dev/full")  # takes nothing
ARRAYS = {
    "x": np.linspace(0.0, 1.0, 40_000),
    "name": np.array(["a", "b"]),
    "z": np.ones((2, 3), dtype=complex),
    "number": 3.0,
    "none": np.empty((0, 4)),
}


@pytest.mark.parametrize("packed", [False, True])
def test_bytes_are_those_of_numpy(tmp_path, packed):
    save_npz(tmp_path / "ours", packed=packed, **ARRAYS)
    (np.savez_compressed if packed else np.savez)(tmp_path / "theirs", **ARRAYS)
    assert (tmp_path / "ours.npz").read_bytes() == (tmp_path / "theirs.npz").read_bytes()


def test_objects_are_refused(tmp_path):
    with pytest.raises(ValueError, match="Object arrays cannot be saved"):
        save_npz(tmp_path / "x.npz", x=np.array([None]))


@pytest.mark.skipif(not FULL.exists(), reason="no such device")
@pytest.mark.parametrize("arrays", [ARRAYS, {"few": np.ones(3)}])
def test_a_full_disk_is_one_error(tmp_path, monkeypatch, arrays):
    """Nothing more is said when what was being written is forgotten, also of a file so small that
    it fails where it is closed."""
    said = []
    monkeypatch.setattr(sys, "unraisablehook", said.append)
    (tmp_path / "x.npz").symlink_to(FULL)
    with pytest.raises(OSError, match="No space left on device") as raised:
        save_npz(tmp_path / "x.npz", **arrays)
    del raised
    gc.collect()
    assert said == []


def test_matlab_files_of_hdf5_are_refused_with_a_remedy(tmp_path, monkeypatch):
    """scipy reads none and advises a reader of HDF5."""

    def of_hdf5(path):
        raise NotImplementedError("Please use HDF reader for matlab v7.3 files, e.g. h5py")

    monkeypatch.setattr(scipy.io, "whosmat", of_hdf5)
    with pytest.raises(InputError, match="model.mat: MATLAB 7.3 files are not read; save it with"):
        open_matlab(tmp_path / "model.mat")
