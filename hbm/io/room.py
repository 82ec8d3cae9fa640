"""Files that may come from anybody, held against the memory before they are read."""

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
