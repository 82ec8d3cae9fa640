"""Rigid motions of the damper that no contact normal faces and no `hold` holds: nothing but
friction resists them."""

from collections.abc import Iterable, Sequence

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp

from tipdamp.hbm.contact import GROUND, ContactTable
from tipdamp.hbm.hold.rigid_motion import parse_motion
from tipdamp.static_contact.bodies.free_motions import FreeMotions, unresisted
from tipdamp.static_contact.bodies.rigid_motions import SETTINGS as RIGID
from tipdamp.study.hold import HoldChoice


def held_by_friction(pairs: ContactTable, holds: Sequence[HoldChoice] = ()) -> list[str]:
    """Names such as 'slide along y' of motions of a free, rigid damper between bodies at rest."""
    return directed(_unresisted(pairs, holds, np.zeros((0, 3))))


def loaded(
    pairs: ContactTable,
    holds: Sequence[HoldChoice],
    position: np.ndarray,
    forces: np.ndarray,
) -> list[str]:
    """Sentences on such motions along which forces (k, 3) N at the places (k, 3) m do work."""
    motions = _unresisted(pairs, holds, position)
    load = np.r_[np.zeros(len(motions.rigid) - forces.size), forces.ravel()]
    return motions.loaded(motions.shape.T @ load, load)


def _unresisted(
    pairs: ContactTable, holds: Sequence[HoldChoice], further: np.ndarray
) -> FreeMotions:
    """Of the places of the pairs and further ones (k, 3) m on the damper."""
    mine = pairs.select(pairs.damper_body != GROUND)
    arm = np.concatenate([mine.position, further]) - mine.position.mean(axis=0)
    turns = np.cross(np.eye(3), arm[:, None]).transpose(0, 2, 1)  # columns: about x, y, z
    rigid = np.concatenate([np.broadcast_to(np.eye(3), turns.shape), turns], axis=2).reshape(-1, 6)
    held = np.array([parse_motion(one.motion)[2] for one in holds]).reshape(-1, 6)
    left = sl.null_space(held) if len(held) else np.eye(6)
    motion = sp.hstack(
        [sp.block_diag(list(mine.frame)), sp.csr_matrix((3 * len(mine), further.size))],
        format="csr",
    )
    rows = np.arange(2, 3 * len(mine), 3)
    return unresisted(rigid, left, motion, rows, np.full(len(rigid), "damper"))


def directed(motions: FreeMotions) -> list[str]:
    """Names of the motions; of a slide along no coordinate its direction, 'slide along (0.6, 0.8,
    0)'."""
    names = []
    for (name, _), column in zip(motions.names, motions.coefficients.T, strict=True):
        parts = column.reshape(-1, 3)
        vector = parts[np.abs(parts).max(axis=1).argmax()]
        oblique = np.abs(vector).max() < RIGID.along * np.linalg.norm(vector)
        names.append(parse_motion(vector)[0] if name.startswith("slide") and oblique else name)
    return names


def said(motions: Iterable[str]) -> str:
    """'nothing but friction holds the damper (slide along y)', or '' without such a motion."""
    names = ", ".join(dict.fromkeys(motions))
    return f"nothing but friction holds the damper ({names})" if names else ""


def remedy(motions: Iterable[str], section: str = "damper") -> str:
    """The key that holds the mean position and leaves the vibration free: '[damper] hold = { motion
    = "y", ... }'."""
    tables = [f"{{ motion = {_value(name)}, mean = true }}" for name in dict.fromkeys(motions)]
    return f"[{section}] hold = " + (tables[0] if len(tables) == 1 else f"[{', '.join(tables)}]")


def _value(name: str) -> str:
    """A motion as the key has it: "y", "about x" or a direction [x, y, z]."""
    short = name.removeprefix("slide along ").removeprefix("roll ")
    return f"[{short.strip('()')}]" if short.startswith("(") else f'"{short}"'
