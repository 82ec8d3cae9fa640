"""A scheduler and workers of dask as processes of their own, as they are on other machines."""

import re
import subprocess
import sys
from contextlib import contextmanager


@contextmanager
def scheduler():
    """(process, address)."""
    with _started("scheduler", "--host", "127.0.0.1", "--port", "0") as process:
        yield process, _told(process, r"Scheduler at:\s+(tcp://\S+)")


@contextmanager
def worker(address, folder=None):
    """(process, address) of one that is ready; folder - where it starts, and looks for packages
    first."""
    options = ("--nthreads", "1", "--no-nanny")
    with _started("worker", address, *options, folder=folder) as process:
        own = _told(process, r"Start worker at:\s+(tcp://\S+)")
        _told(process, r"Registered to:\s+(\S+)")
        yield process, own


@contextmanager
def _started(*command, folder=None):
    """A process of dask, ended by its number."""
    process = subprocess.Popen(
        [sys.executable, "-m", "dask", *command, "--no-dashboard"],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        cwd=folder,
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def _told(process, pattern):
    """What a process says of itself, once it does."""
    for line in process.stdout:
        if found := re.search(pattern, line):
            return found[1]
    raise AssertionError(f"it ended without saying {pattern}")
