"""Hysteresis loops as the stage `cycles` leaves them: one period of all contacts."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tipdamp.hbm.curve.cycles import ContactCycles
from tipdamp.hbm.io.array_files import open_npz, save_npz


class Loops(NamedTuple):
    """What a file of the stage holds: time (n,) s, motion and force (n, P, nd) in m and N,
    sliders (n, P, s) m, components, pairs (P,); damper (r, H+1) m - Fourier coefficients of its
    reduced dofs."""

    time: np.ndarray
    motion: np.ndarray
    force: np.ndarray
    sliders: np.ndarray
    components: tuple[str, ...]
    pairs: tuple[str, ...]
    damper: np.ndarray


def load_loops(path: Path) -> Loops:
    """Read a file of the stage."""
    with open_npz(path, packed=True) as z:
        return Loops(
            z["time"],
            z["motion"],
            z["force"],
            z["sliders"],
            tuple(z["components"].tolist()),
            tuple(z["pairs"].tolist()),
            z["damper"],
        )


def save_loops(path: Path, cycle: ContactCycles, names: Sequence[str], damper: np.ndarray) -> None:
    """Store one period of all contacts, and of the damper."""
    save_npz(
        path,
        packed=True,
        time=cycle.time,
        motion=cycle.motion,
        force=cycle.force,
        sliders=cycle.sliders,
        components=np.array(cycle.components),
        pairs=np.array(names),
        damper=damper,
    )
