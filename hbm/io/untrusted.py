"""Files that may come from anybody: no code, and no more memory than there is."""

import math
from pathlib import Path

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


def open_matlab(path: str | Path) -> dict:
    """As scipy.io.loadmat; the sizes that the file declares are held against the memory before
    anything is unpacked.

    Raises InputError where they do not fit into it; errors of loadmat stay what they are.
    """
    import scipy.io

    need = sum(8 * math.prod(shape) for _, shape, _ in scipy.io.whosmat(path))
    there = available_bytes()
    if 2 * need > there:  # what is made of them needs some too
        raise InputError(
            f"{path}: its variables take {need / 1e9:.3g} GB of memory, {there / 1e9:.3g} GB are "
            "available"
        )
    return scipy.io.loadmat(path, chars_as_strings=True)
