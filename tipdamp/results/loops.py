"""Hysteresis loops as the stage `cycles` leaves them: one period of all contacts."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tipdamp.hbm.curve.cycles import ContactCycles
from tipdamp.hbm.io.npz import save_npz
from tipdamp.hbm.io.untrusted import open_npz


class Loops(NamedTuple):
    """What a file of the stage holds: time (n,) s, motion and force (n, P, nd) in m and N,
    components, pairs (P,)."""

    time: np.ndarray
    motion: np.ndarray
    force: np.ndarray
    components: tuple[str, ...]
    pairs: tuple[str, ...]


def load_loops(path: Path) -> Loops:
    """Read a file of the stage."""
    with open_npz(path, packed=True) as z:
        return Loops(
            z["time"],
            z["motion"],
            z["force"],
            tuple(z["components"].tolist()),
            tuple(z["pairs"].tolist()),
        )


def save_loops(path: Path, cycle: ContactCycles, names: Sequence[str]) -> None:
    """Store one period of all contacts."""
    save_npz(
        path,
        packed=True,
        time=cycle.time,
        motion=cycle.motion,
        force=cycle.force,
        sliders=cycle.sliders,
        components=np.array(cycle.components),
        pairs=np.array(names),
    )
