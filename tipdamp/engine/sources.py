"""The program's own sources, which say what version computed. Loads no library."""

import os
from collections.abc import Sequence
from pathlib import Path

import tipdamp

PACKAGES = ("", "hbm", "modal", "static_contact")  # folders below tipdamp, most of them links
KINDS = (".py", ".csv", ".css", ".js", ".html")
PAGES = {"report", "comparison"}  # folders of the sources that show results, and decide about none


def packages() -> list[Path]:
    """Folders of all packages of the program."""
    return [Path(str(tipdamp.__file__)).parent / name for name in PACKAGES]


def sources(parts: Sequence[Path], with_report: bool) -> list[Path]:
    """Files in folders of packages that decide about results; those in their own folders of
    `PAGES` only `with_report`."""
    left_out = {"__pycache__"} if with_report else {"__pycache__", *PAGES}
    found = []
    for part in parts:
        for where, folders, files in os.walk(part):
            folders[:] = [name for name in folders if name not in left_out]
            found += [Path(where, name) for name in files if name.endswith(KINDS)]
    return sorted(found)
