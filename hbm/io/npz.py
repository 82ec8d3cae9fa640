"""Arrays into .npz."""

import zipfile
from pathlib import Path

import numpy as np
from numpy.lib import format as npy
from numpy.typing import ArrayLike


def save_npz(path: str | Path, /, *, packed: bool = False, **arrays: ArrayLike) -> None:
    """As np.savez without pickles; packed : compressed.

    np.savez leaves a file whose disk is full to the garbage collector, which fails once more and
    prints a traceback beside the OSError that the caller sees."""
    path = Path(path)
    whole = path if path.name.endswith(".npz") else path.with_name(f"{path.name}.npz")
    kind = zipfile.ZIP_DEFLATED if packed else zipfile.ZIP_STORED
    with zipfile.ZipFile(whole, "w", kind) as file:
        for name, values in arrays.items():
            with file.open(f"{name}.npy", "w", force_zip64=True) as member:
                npy.write_array(member, np.asanyarray(values), allow_pickle=False)
