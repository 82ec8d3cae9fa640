"""Available memory, and what a curve needs: of all contacts, and for those that slip or lift."""

import os
import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path

from tipdamp.hbm.errors import Doubt, InputError

# At its largest a curve keeps of the last points the condensed matrix and its factors, each of the
# square of the unknowns of the active contacts [tests/hbm/test_memory.py], or where these are many,
# matrices between their components for each order, of two numbers [a wedge under platforms, 87 of
# 100 pairs that move, H = 5 to 17]; beside some derivatives of their forces.
_SQUARES, _ORDERS, _BLOCKS = 5, 120, 12
# of all unknowns, sticking contacts included: some twenty at each of about a hundred points
_VECTORS = 20 * 100
_NEXT = 0.4  # share of it that the next matrices need, beside what the curve keeps already
# before the start one contact in so many is assumed to slip or lift, and at least one
_SLIPPING = 4
SMALL = 2.0**28  # bytes below which nothing is checked


def available_bytes() -> float:
    """Bytes left on the machine, or within the limit of the container; infinite where neither is
    known."""
    found = []
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
        found.append(
            next(int(line.split()[1]) * 1024 for line in lines if line.startswith("MemAvailable"))
        )
    except (OSError, StopIteration, ValueError):
        pass
    try:
        limit = Path("/sys/fs/cgroup/memory.max").read_text().strip()
        used = int(Path("/sys/fs/cgroup/memory.current").read_text())
        found += [int(limit) - used] if limit.isdigit() else []
    except (OSError, ValueError):
        pass
    return float(min(found, default=float("inf")))


def own_bytes() -> float:
    """Bytes that this process holds; 0 where that is not known."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except (OSError, ValueError, IndexError):
        return 0.0
    return float(pages * os.sysconf("SC_PAGE_SIZE"))


def newton_bytes(active: float, components: int, H: int, share: float = 1.0) -> float:
    """Bytes of Newton's method, for so many active contacts (slipping or lifting) of a law with so
    many components; a contact of which only some components are active counts for a part. share :
    of its matrices."""
    block = components * (2 * H + 1)
    matrices = min(_SQUARES * (active * block) ** 2, _ORDERS * (active * components) ** 2 * (H + 1))
    return 8.0 * (share * matrices + _BLOCKS * active * block**2)


def curve_bytes(active: float, contacts: int, components: int, H: int) -> float:
    """Bytes of a whole curve with so many contacts, so many of them active: Newton's method and the
    points."""
    return newton_bytes(active, components, H) + 8.0 * _VECTORS * contacts * components * (
        2 * H + 1
    )


def check_harmonics_fit(contacts: int, components: int, H: int) -> None:
    """Before anything heavy: InputError where not even one contact can be active, a warning where
    not a quarter of them can at once; how many will be is not known yet."""
    one = partial(curve_bytes, 1, contacts, components)
    if message := _lack(one, H, "one contact that slips or lifts needs"):
        raise InputError(message)
    active = max(contacts // _SLIPPING, 1)
    what = f"{active} of the {contacts} contacts, should they slip or lift at once, need"
    if message := _lack(partial(curve_bytes, active, contacts, components), H, what):
        warnings.warn(message, Doubt, stacklevel=6)


def check_active_fit(active: int, contacts: int, components: int, H: int) -> None:
    """InputError where so many contacts are active that there is no memory for the next matrix."""
    what = f"{active} of the {contacts} contacts, which slip or lift at once here, need"
    if message := _lack(partial(newton_bytes, active, components, share=_NEXT), H, what):
        raise InputError(message)


def check_matrix_fits(unknowns: int) -> None:
    """InputError where there is no memory for a matrix of so many unknowns, which iterations have
    not solved."""
    need, there = 8.0 * unknowns**2, available_bytes()
    if need > max(there, SMALL):
        raise InputError(
            f"Newton's matrix of {unknowns} unknowns needs {need / 1e9:.3g} GB of memory, "
            f"{there / 1e9:.3g} GB are available: fewer harmonics, or fewer contacts"
        )


def _lack(of_harmonics: Callable, H: int, what: str) -> str | None:
    """The message where the memory of so many harmonics does not suffice; None where it does."""
    need = of_harmonics(H)
    if need < SMALL or need <= (there := available_bytes()):
        return None
    fits = next((h for h in range(H - 1, 0, -1) if of_harmonics(h) <= there), 0)
    return (
        f"harmonics = {H}: {what} {need / 1e9:.3g} GB of memory for Newton's method, "
        f"{there / 1e9:.3g} GB are available: at most harmonics = {fits} here, or fewer contacts"
    )
