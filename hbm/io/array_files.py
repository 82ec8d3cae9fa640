"""Files of arrays, which may come from anybody: no code, and no more memory than there is."""

import math
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import ArrayLike

from tipdamp.hbm.errors import InputError
from tipdamp.hbm.memory import available_bytes


def check_size(path: Path, others: float = 0.0) -> None:
    """InputError where a file, read and parsed, does not fit into the memory; others : bytes beside
    it."""
    need, there = path.stat().st_size + others, available_bytes()
    if 4 * need > there:  # bytes, text, words and numbers
        raise InputError(
            f"{path}: has {need / 1e9:.3g} GB; what is read of it takes four times as much memory, "
            f"{there / 1e9:.3g} GB are available"
        )


def save_npz(path: str | Path, /, *, packed: bool = False, **arrays: ArrayLike) -> Path:
    """As np.savez without pickles; packed : compressed. Returns the path.

    np.savez leaves a file whose disk is full to the garbage collector, which fails once more and
    prints a traceback beside the OSError that the caller sees."""
    path = Path(path)
    whole = path if path.name.endswith(".npz") else path.with_name(f"{path.name}.npz")
    kind = zipfile.ZIP_DEFLATED if packed else zipfile.ZIP_STORED
    with zipfile.ZipFile(whole, "w", kind) as file:
        for name, values in arrays.items():
            with file.open(f"{name}.npy", "w", force_zip64=True) as member:
                npy.write_array(member, np.asanyarray(values), allow_pickle=False)
    return path


def open_npz(path: str | Path, packed: bool = False) -> Any:
    """As np.load without pickles; the sizes that the file declares are checked before anything is
    unpacked.

    packed : whether its arrays may be compressed, as in files of other programs. Raises InputError
    where they declare more than the file holds, or than there is memory; errors of np.load stay
    what they are.
    """
    path = Path(path)
    if path.exists() and not path.is_file():  # a pipe or a device, which may never end
        raise InputError(f"{path}: is not a file")
    if zipfile.is_zipfile(path):
        try:
            with zipfile.ZipFile(path) as z:
                total = sum(_declared(path, z, member) for member in z.infolist())
        # encrypted, or packed in an unknown way
        except (RuntimeError, NotImplementedError) as error:
            raise ValueError(error) from None
        if not packed and total > path.stat().st_size:
            raise InputError(
                f"{path}: its arrays declare {total} bytes, the file has {path.stat().st_size}; "
                "it was not written by this program"
            )
        _check_memory(path, "arrays", total)
    return np.load(path, allow_pickle=False)


def _check_memory(path: str | Path, what: str, need: int) -> None:
    """InputError where what a file holds, so many bytes, does not fit into the memory."""
    there = available_bytes()
    if 2 * need > there:  # what is made of them needs some too
        raise InputError(
            f"{path}: its {what} take {need / 1e9:.3g} GB of memory, {there / 1e9:.3g} GB are "
            "available"
        )


def _declared(path: Path, z: zipfile.ZipFile, member: zipfile.ZipInfo) -> int:
    """Bytes of a member when it is unpacked; InputError where its own header says something
    else."""
    if not member.filename.endswith(".npy"):
        return member.file_size
    with z.open(member) as file:
        version = npy.read_magic(file)
        shape, _, kind = (
            npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
        )(file)
        size = file.tell() + math.prod(shape) * kind.itemsize
    if not kind.hasobject and size != member.file_size:
        raise InputError(
            f"{path}: '{member.filename[:-4]}' is of shape {shape}, which takes {size} bytes, and "
            f"has {member.file_size}: damaged"
        )
    return size


def open_matlab(path: str | Path) -> dict:
    """As scipy.io.loadmat; the sizes that the file declares are held against the memory before
    anything is unpacked.

    Raises InputError where they do not fit into it, and for files of MATLAB 7.3; other errors of
    loadmat stay what they are.
    """
    import scipy.io

    try:
        known = scipy.io.whosmat(path)
    except NotImplementedError:
        raise InputError(f"{path}: MATLAB 7.3 files are not read; save it with -v7") from None
    _check_memory(path, "variables", sum(8 * math.prod(shape) for _, shape, _ in known))
    return scipy.io.loadmat(path, chars_as_strings=True)
