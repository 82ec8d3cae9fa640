"""numba's njit for the kernels of this project: what it compiles is kept in files that may be lost
at any time.

numba reads its cache as pickles without a check: a file that is cut ends in a traceback on every
later run, and one of which a byte is another may run and be wrong. Here each file begins with its
checksum, and code names the signature and the source that it is of, with those of the kernels that
it may call in other files; what does not fit is compiled anew and written again. Where nothing can
be written, kernels live as long as the process.
"""

import logging
import os
import pickle
from collections.abc import Callable
from hashlib import sha256
from typing import Any

import numba
from numba.core.caching import FunctionCache, IndexDataCacheFile, NullCache
from numba.core.registry import CPUDispatcher

CHECKSUM = sha256().digest_size
COMPILING = (
    "compiling the kernels of the laws (once per machine for each kind of law, up to a minute)"
)
_told: set[str] = set()


def njit(cache: bool = False, **options: Any) -> Callable:
    """As numba.njit(cache=..., ...), to be called; cache : whether the code is kept from run to
    run."""

    def compiled(function: Callable) -> Callable:
        kernel = numba.njit(**options)(function)
        # a plain function where numba is switched off
        if cache and isinstance(kernel, CPUDispatcher):
            kernel._cache = _cache_of(function)
        return kernel

    return compiled


class KernelCache(FunctionCache):
    """The kept code of one kernel; whatever goes wrong with its files, the kernel is compiled."""

    def __init__(self, function: Callable) -> None:
        super().__init__(function)
        self.stamp = (self._impl.locator.get_source_stamp(), *_stamps_of_others(function))
        self._cache_file = KernelFiles(self._cache_path, self._impl.filename_base, self.stamp)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The code for a signature; None, after saying so once a process, where numba has to
        compile it now."""
        code = None
        try:
            code = super().load_overload(sig, target_context)
        except Exception as error:  # whole, and yet not what these libraries can load
            _tell_once("stored kernels cannot be loaded and are compiled anew", error)
        if code is None and not _told:  # what was told before says that it is compiled
            _told.add(COMPILING)
            logging.getLogger("hbm").warning(COMPILING)
        return code

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep the code for a signature, where the disk allows it."""
        try:
            super().save_overload(sig, data)
        except Exception as error:  # the disk, or a numba whose cache works otherwise
            _tell_once("compiled kernels cannot be kept, and every run compiles them again", error)


class KernelFiles(IndexDataCacheFile):
    """Index and code of one kernel, as numba names them, each behind its checksum."""

    def load(self, key: tuple) -> Any:
        """The code of a key, or None; that of another key or source does not count, as two
        processes may have taken one name at the same time, or one ended between the index and the
        code."""
        name = self._load_index().get(key)
        of, data = (name and self._load_data(name)) or (None, None)
        return data if of == (self._source_stamp, key) else None

    def save(self, key: tuple, data: Any) -> None:
        """Write the code of a key."""
        super().save(key, ((self._source_stamp, key), data))

    def _load_index(self) -> dict[tuple, str]:
        stamp, names = _read(self._index_path) or (None, {})
        return names if stamp == self._source_stamp else {}

    def _save_index(self, overloads: dict[tuple, str]) -> None:
        self._write(self._index_path, (self._source_stamp, overloads))

    def _load_data(self, name: str) -> Any:
        return _read(self._data_path(name))

    def _save_data(self, name: str, data: Any) -> None:
        self._write(self._data_path(name), data)

    def _write(self, path: str, content: Any) -> None:
        packed = self._dump(content)
        with self._open_for_write(path) as file:
            file.write(_checksum(packed) + packed)


def _stamps_of_others(function: Callable) -> list:
    """Of the kernels of other files that are known by name in the file of a function."""
    kernels = (one for one in function.__globals__.values() if isinstance(one, CPUDispatcher))
    others = (one for one in kernels if _file(one.py_func) != _file(function))
    return sorted({one._cache.stamp for one in others if isinstance(one._cache, KernelCache)})


def _file(function: Callable) -> str:
    return function.__code__.co_filename


def _cache_of(function: Callable) -> KernelCache | NullCache:
    try:
        return KernelCache(function)
    except Exception as error:  # no folder that can be written to
        _tell_once("compiled kernels cannot be kept, and every run compiles them again", error)
        return NullCache()


def _checksum(packed: bytes) -> bytes:
    return sha256(numba.__version__.encode() + packed).digest()


def _read(path: str) -> Any:
    """What `_write` has written there, or None."""
    if not os.path.isfile(path):  # a folder or a pipe neither
        return None
    try:
        with open(path, "rb") as file:
            content = file.read()
    except OSError as error:
        _tell_once("stored kernels cannot be read and are compiled anew", error)
        return None
    if content[:CHECKSUM] != _checksum(content[CHECKSUM:]):
        _tell_once("stored kernels are damaged, or of another version, and are compiled anew", path)
        return None
    return pickle.loads(content[CHECKSUM:])


def _tell_once(problem: str, what: object) -> None:
    if problem not in _told:
        _told.add(problem)
        logging.getLogger("hbm").warning("%s (first: %s)", problem, what)
