"""Available memory, and what Newton's method needs for the contacts that slip or lift."""

import warnings
from pathlib import Path

from hbm.errors import InputError

# Measured by tests/hbm/balance/test_memory.py: at its largest a curve keeps the condensed matrix and its factors of the
# last points, each of the square of the unknowns of the active contacts, beside the derivatives of their forces.
_SQUARES, _BLOCKS = 5, 10
_NEXT = 2                # squares that the next matrix and its factors need, beside what the curve keeps already
_SLIPPING = 4            # before the start one contact in so many is assumed to slip or lift, and at least one
_SMALL = 2.0**28         # bytes below which nothing is checked


def available_bytes() -> float:
    """Bytes left on the machine, or within the limit of the container; infinite where neither is known."""
    found = []
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
        found.append(next(int(line.split()[1]) * 1024 for line in lines if line.startswith("MemAvailable")))
    except (OSError, StopIteration, ValueError):
        pass
    try:
        limit = Path("/sys/fs/cgroup/memory.max").read_text().strip()
        used = int(Path("/sys/fs/cgroup/memory.current").read_text())
        found += [int(limit) - used] if limit.isdigit() else []
    except (OSError, ValueError):
        pass
    return float(min(found, default=float("inf")))


def newton_bytes(moving: int, components: int, H: int, squares: int = _SQUARES) -> float:
    """Bytes for so many slipping or lifting pairs of a law with so many components, in a whole curve."""
    block = components * (2 * H + 1)
    return 8.0 * (squares * (moving * block) ** 2 + _BLOCKS * moving * block**2)


def check_harmonics_fit(pairs: int, components: int, H: int):
    """Before anything heavy: InputError where not even one pair can slip or lift, a warning where not a quarter of them
    can at once; how many will is not known yet."""
    if said := _lack(1, components, H, _SQUARES, "one pair that slips or lifts"):
        raise InputError(said)
    moving = max(pairs // _SLIPPING, 1)
    what = f"{moving} of the {pairs} pairs, should they slip or lift at once,"
    if said := _lack(moving, components, H, _SQUARES, what):
        warnings.warn(said, stacklevel=4)


def check_moving_fit(moving: int, pairs: int, components: int, H: int):
    """InputError where so many pairs slip or lift that the next matrix cannot be held."""
    if said := _lack(moving, components, H, _NEXT, f"{moving} of the {pairs} pairs, which slip or lift at once here,"):
        raise InputError(said)


def _lack(moving, components, H, squares, what):
    """What to say where the memory does not suffice; None where it does."""
    need = newton_bytes(moving, components, H, squares)
    if need < _SMALL or need <= (there := available_bytes()):
        return None
    fits = next((h for h in range(H - 1, 0, -1) if newton_bytes(moving, components, h, squares) <= there), 0)
    return (f"harmonics = {H}: {what} need {need / 1e9:.3g} GB of memory for Newton's method, "
            f"{there / 1e9:.3g} GB are available: at most harmonics = {fits} here, or fewer pairs")
