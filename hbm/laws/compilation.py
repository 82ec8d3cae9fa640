"""One line that says why nothing seems to happen: numba compiles the kernels once per machine."""

import logging
from pathlib import Path

from numba.core.registry import CPUDispatcher


def announce(kernel):
    """Say that numba has to compile a kernel, where no compiled one newer than its source is stored; once a process.

    kernel : what numba.njit returned; a plain function (numba switched off) is passed over
    """
    if not isinstance(kernel, CPUDispatcher) or kernel.overloads:      # not its signatures: they are hashed
        return
    source = Path(kernel.py_func.__code__.co_filename)
    stored = Path(kernel.stats.cache_path).glob(f"{source.stem}.{kernel.py_func.__name__}*.nbi")
    if max((path.stat().st_mtime for path in stored), default=0.0) < source.stat().st_mtime:
        logging.getLogger("hbm").warning("compiling the contact kernels (once per machine, half a minute at most)")
