"""What every contact law shares: the settings of the contacts, and the tangents of a step."""

from dataclasses import dataclass

import numpy as np

from hbm.errors import InputError
from hbm.validation import brief


@dataclass(frozen=True)
class Contacts:
    """What the laws need of P pairs: kn, kt (N/m, weight included), mu (-), preload (N, negative = open). Each (P,)."""

    kn: np.ndarray
    kt: np.ndarray
    mu: np.ndarray
    preload: np.ndarray

    def __post_init__(self):
        for name in ("kn", "kt", "mu", "preload"):
            try:
                values = np.atleast_1d(np.asarray(getattr(self, name), dtype=float))
            except (TypeError, ValueError):
                raise InputError(f"{name} = {brief(getattr(self, name))}: must be one number per pair") from None
            object.__setattr__(self, name, values)
            bad = ~np.isfinite(values) | ((values < 0) & (name != "preload"))
            if bad.any():
                i = int(np.flatnonzero(bad)[0])
                allowed = "finite" if name == "preload" else "finite and not negative"
                raise InputError(f"pair {i + 1}: {name} = {values[i]:g}, must be {allowed}")
        if len({len(self.kn), len(self.kt), len(self.mu), len(self.preload)}) != 1:
            raise InputError("kn, kt, mu and preload must have one value per pair each")

    def __len__(self) -> int:
        return len(self.kn)


@dataclass(frozen=True)
class Tangents:
    """Derivatives of one step, per pair: of the force (P, nd) and of the slider (P, nt) by u and by the old slider."""

    force_u: np.ndarray        # (P, nd, nd)
    force_slider: np.ndarray   # (P, nd, nt)
    slider_u: np.ndarray       # (P, nt, nd)
    slider_slider: np.ndarray  # (P, nt, nt)
