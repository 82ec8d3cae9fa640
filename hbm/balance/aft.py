"""Alternating frequency-time: harmonics of the relative motion in, harmonics of the contact forces out.

The forces come as the bracket g = f - K_c u (see `located`), whose derivative vanishes on every pair that sticks
through the cycle with its slider at a fixed place.
"""

from dataclasses import dataclass, replace

import numpy as np

from hbm import fourier
from hbm.errors import InputError
from hbm.laws import Contacts, compilation
from hbm.laws.uncoupled import events as transitions
from hbm.laws.uncoupled import integrals as located
from hbm.validation import brief

STARTS = ("zero_force", "zero_slider")


@dataclass(frozen=True)
class Bracket:
    """Harmonics (real coefficients, nh = 2H+1) of f - K_c u and their derivatives.

    g : (P, nd, nh) N
    pair : (a,) int - pairs with a derivative; D : (a, nd, nh, nd, nh) dg/du of these, N/m
    row : (P, nd) bool - components with a nonzero derivative
    by_preload : (P, nd, nh) dg/dpreload, or None: sampled laws do not know it
    shares : (P, 3) share of the cycle in stick, slip, open
    """

    g: np.ndarray
    pair: np.ndarray
    D: np.ndarray
    row: np.ndarray
    by_preload: np.ndarray | None
    shares: np.ndarray

    def with_springs(self, stiffness, x) -> "Bracket":
        """The bracket with springs (P, nd) N/m more at the relative motion x (P, nd, nh); every row then moves."""
        P, nd, nh = x.shape
        D = np.zeros((P, nd, nh, nd, nh))
        D[self.pair] = self.D
        for d in range(nd):
            D[:, d, np.arange(nh), d, np.arange(nh)] += stiffness[:, d, None]
        return replace(self, g=self.g + stiffness[:, :, None] * x, pair=np.arange(P), D=D, row=np.ones((P, nd), bool))


def default_samples(H: int, located: bool = True) -> int:
    """Samples that separate the transitions where these are located; where they are not, the result is as good as the
    samples (256: below 1e-3 of the limit force)."""
    return max(64 if located else 256, 1 << int(np.ceil(np.log2(12 * max(H, 1)))))


def sample_grid(H: int, samples: int):
    """Instants (samples + 1,), and the basis and its rate at all but the last."""
    tau = np.linspace(0.0, 2 * np.pi, samples + 1)
    return tau, fourier.basis(tau[:-1], H), fourier.basis_rate(tau[:-1], H)


def slider_start(start, P: int, tangents: int):
    """(positions (P, nt), from_position): 'zero_force', 'zero_slider' or positions (P, nt) in m."""
    if isinstance(start, str):
        if start not in STARTS:
            raise InputError(f"start = '{start}': must be 'zero_force', 'zero_slider' or slider positions "
                             f"({P}, {tangents}) in m")
        return np.zeros((P, max(tangents, 1))), start == "zero_force"
    try:
        w = np.asarray(start, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"start = {brief(start)}: must be 'zero_force', 'zero_slider' or slider positions "
                         f"({P}, {tangents}) in m") from None
    if w.shape != (P, tangents) or not np.isfinite(w).all():
        raise InputError(f"start: slider positions must be finite with shape ({P}, {tangents}), got {w.shape}")
    return w, False


def evaluate(law, pairs: Contacts, x: np.ndarray, start, grid) -> Bracket:
    """Bracket of a law at the relative motion x (P, nd, nh); start from `slider_start`, grid from `sample_grid`."""
    P, nd, nh = x.shape
    tau, E, E_rate = grid
    x = np.ascontiguousarray(x)
    kernel = located.brackets if law.corridor else getattr(type(law), "kernel", None)
    compilation.announce(kernel)
    if not law.corridor:
        g, D, moves, shares = law.harmonics(pairs, x, start, grid)
        active = np.flatnonzero(moves.any(axis=1))
        return Bracket(g, active, D[active], moves, None, shares)
    most = 8 * nh + 64
    pieces, counts = np.empty((P, law.tangents + 1, most, 7)), np.empty((P, law.tangents + 1), dtype=np.int64)
    moves, shares = np.empty((P, nd), dtype=bool), np.empty((P, 3))
    settings = law.tangents, law.has_normal, pairs.kt, pairs.kn, pairs.mu, pairs.preload
    transitions.find_pieces(x, x @ E.T, x @ E_rate.T, tau, *settings, *start, pieces, counts, moves, shares)
    active = np.flatnonzero(moves.any(axis=1))
    place = np.full(P, -1)
    place[active] = np.arange(len(active))
    g, gp, D = np.empty((P, nd, nh)), np.empty((P, nd, nh)), np.empty((len(active), nd, nh, nd, nh))
    located.brackets(x, pieces, counts, place, *settings, g, D, gp)
    return Bracket(g, active, D, moves, gp, shares)
