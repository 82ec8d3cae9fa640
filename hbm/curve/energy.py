"""Energies of a period of a solved point: what the excitation puts in, the damping and the contacts take."""

from dataclasses import dataclass

import numpy as np

from hbm.balance.residual import HarmonicBalance
from hbm.balance.settings import DEFAULT


@dataclass(frozen=True)
class EnergyBalance:
    """J per period: input of the excitation, loss in the structure's damping, friction (P,) of each contact; apparent -
    input if each force were in phase with its velocity."""

    input: float
    damping: float
    friction: np.ndarray
    apparent: float

    @property
    def error(self) -> float:
        """Of the balance input = damping + friction, relative to the input, or to a small share of the apparent one
        where that is larger: a system that takes nothing is balanced to rounding."""
        left = abs(self.input - self.damping - self.friction.sum())
        return left / max(abs(self.input), DEFAULT.no_input * self.apparent, np.finfo(float).tiny)


def excitation(balance: HarmonicBalance, forces: dict) -> dict[int, np.ndarray]:
    """{order: (m,) N} whose product with the conjugate modal motion is that of the forces {harmonic: (r,)} with that of
    the dofs; constant forces are left out."""
    found = {}
    for k, F in forces.items():
        at = np.flatnonzero(F)
        if k:
            found[k] = F[at] @ balance.receptance.shapes[at].conj()
    return found


def energies(balance: HarmonicBalance, excited: dict, w: float, modal: np.ndarray,
             friction: np.ndarray) -> EnergyBalance:
    """Of the modal motion (m, H+1) at w rad/s; excited : of `excitation`; friction : (P,) J of each contact."""
    orders, k = list(excited), np.arange(balance.H + 1)
    loss = modal.conj() * (balance.damping[:, None] * modal if balance.damping.ndim == 1 else balance.damping @ modal)
    power = np.array([row @ modal[:, order].conj() for order, row in excited.items()], dtype=complex)
    return EnergyBalance(float(np.pi * np.dot(orders, power.imag)), float(np.pi * w * k**2 @ loss.sum(axis=0).real),
                         friction, float(np.pi * np.dot(orders, np.abs(power))))
