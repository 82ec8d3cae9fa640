"""Where compiled code is kept: kernels of numba, forms of the finite elements. A cache is read as
pickles, or run, so it must be a folder nobody else can write to."""

import atexit
import os
import shutil
import stat
import tempfile
from pathlib import Path

import tipdamp


def choose_caches() -> None:
    """Set NUMBA_CACHE_DIR, to be called before numba is imported; a value that the user has set is
    kept.

    Kernels are stored beside the program. Where that folder is read-only they go to the user's
    cache folder, and without a cache folder of the user's own to a private temporary one that is
    removed at exit. Other libraries keep what they compile in the cache folder too: a user who has
    none, or no home, gets a temporary one for the run (XDG_CACHE_HOME, HOME).
    """
    if not os.path.isdir(os.path.expanduser("~")):
        os.environ["HOME"] = _temporary()
    home = Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache").expanduser().resolve()
    if not _can_be_used(home):
        home = Path(_temporary())
        os.environ["XDG_CACHE_HOME"] = str(home)
    beside = Path(tipdamp.__file__).with_name("hbm")
    if "NUMBA_CACHE_DIR" in os.environ or os.access(beside, os.W_OK):
        return
    place = home / "tipdamp"
    try:
        place.mkdir(mode=0o700, exist_ok=True)
        private = (
            is_private(home, stat.S_IWOTH)
            and is_private(place, 0o077)
            and os.access(place, os.W_OK)
        )
    except OSError:
        private = False
    if not private:
        place = Path(_temporary())
    os.environ["NUMBA_CACHE_DIR"] = str(place)


def _temporary() -> str:
    """A private folder that is removed at exit."""
    place = tempfile.mkdtemp(prefix="tipdamp-")
    atexit.register(shutil.rmtree, place, ignore_errors=True)
    return place


def _can_be_used(folder: Path) -> bool:
    """Whether it is there, or can be made, and takes files."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK | os.X_OK)


def is_private(folder: Path, forbidden: int) -> bool:
    """A folder, not a link, that belongs to this user and has none of the `forbidden` mode bits."""
    found = folder.lstat()
    return (
        stat.S_ISDIR(found.st_mode)
        and found.st_uid == os.getuid()
        and not found.st_mode & forbidden
    )
