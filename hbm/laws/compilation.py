"""One line that says why nothing seems to happen: numba compiles the kernels once per machine."""

import logging
from hashlib import sha256
from pathlib import Path

from numba.core.registry import CPUDispatcher


def announce(kernel):
    """Say that numba has to compile a kernel, where no compiled one is stored that is newer than
    its source, or of the same source; once a process.

    kernel : what numba.njit returned; a plain function (numba switched off) is passed over
    """
    # not its signatures: they are hashed
    if not isinstance(kernel, CPUDispatcher) or kernel.overloads:
        return
    source, folder = Path(kernel.py_func.__code__.co_filename), kernel.stats.cache_path
    stored = Path(folder).glob(f"{source.stem}.{kernel.py_func.__name__}*.nbi") if folder else ()
    # older, newer versions of numba
    newest, mark = source.stat().st_mtime, sha256(source.read_bytes()).digest()
    if not any(
        path.is_file() and (path.stat().st_mtime >= newest or _holds(path, mark)) for path in stored
    ):
        logging.getLogger("hbm").warning(
            "compiling the contact kernels (once per machine, about a minute)"
        )


def _holds(path, mark):
    try:
        return mark in path.read_bytes()
    except OSError:  # of somebody else
        return False
