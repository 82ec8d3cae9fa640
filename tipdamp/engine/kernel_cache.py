"""Where numba keeps compiled kernels. A cache is read as pickles, so it must be a folder nobody
else can write to."""

import atexit
import os
import shutil
import stat
import tempfile
from pathlib import Path

import tipdamp


def choose_kernel_cache() -> None:
    """Set NUMBA_CACHE_DIR, to be called before numba is imported; a value that the user has set is
    kept.

    Kernels are stored beside the program. Where that folder is read-only they go to the user's
    cache folder, and without a cache folder of the user's own to a private temporary one that is
    removed at exit.
    """
    beside = Path(tipdamp.__file__).with_name("hbm")
    if "NUMBA_CACHE_DIR" in os.environ or os.access(beside, os.W_OK):
        return
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()).resolve()
    place = home / "tipdamp"
    try:
        home.mkdir(parents=True, exist_ok=True)
        place.mkdir(mode=0o700, exist_ok=True)
        private = (
            is_private(home, stat.S_IWOTH)
            and is_private(place, 0o077)
            and os.access(place, os.W_OK)
        )
    except OSError:
        private = False
    if not private:
        place = Path(tempfile.mkdtemp(prefix="tipdamp-"))
        atexit.register(shutil.rmtree, place, ignore_errors=True)
    os.environ["NUMBA_CACHE_DIR"] = str(place)


def is_private(folder: Path, forbidden: int) -> bool:
    """A folder, not a link, that belongs to this user and has none of the `forbidden` mode bits."""
    found = folder.lstat()
    return (
        stat.S_ISDIR(found.st_mode)
        and found.st_uid == os.getuid()
        and not found.st_mode & forbidden
    )
