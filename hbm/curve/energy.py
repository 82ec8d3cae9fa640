"""Energies of a period of a solved point: what the excitation puts in, the damping and the contacts
take."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tipdamp.hbm import tables
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.balance.settings import DEFAULT
from tipdamp.hbm.drawing import pictures

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class EnergyBalance:
    """Energies of one period.

    J per period: input of the excitation, loss in the structure's damping, friction (P,) of each
    contact; apparent - input if each force were in phase with its velocity; kinetic - J, largest of
    a motion whose points move in phase, NaN under a general damping matrix.

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> damped = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0)
    >>> curve = damped.follow_band((600, 1000), outputs={"tip": 0})
    >>> energy = energy_balance(curve, damped, 3)
    >>> isinstance(energy, EnergyBalance), bool(energy.error < 1e-6)
    (True, True)
    """

    input: float
    damping: float
    friction: np.ndarray
    apparent: float
    kinetic: float

    @property
    def damping_ratio(self) -> float:
        """Of the structure alone in this motion, contacts left out. Where contacts slip or part the
        motion is one of several modes with closed contacts, and it is another ratio than theirs;
        NaN under a general damping matrix."""
        return self.damping / (4 * np.pi * self.kinetic) if self.kinetic else 0.0

    @property
    def error(self) -> float:
        """Of the balance input = damping + friction, relative to the input, or to a small share of
        the apparent one where that is larger: a system that takes nothing is balanced to
        rounding."""
        left = abs(self.input - self.damping - self.friction.sum())
        return left / max(abs(self.input), DEFAULT.no_input * self.apparent, np.finfo(float).tiny)

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Draw a bar for the input, for what the damping takes, and for each contact.

        ax : axes of matplotlib to draw on; new ones without
        Returns the axes. Raises InputError where matplotlib is not installed.
        """
        contacts = [(f"contact {c}", float(one)) for c, one in enumerate(self.friction)]
        rows = [("input", self.input), ("damping", self.damping), *contacts]
        return pictures.bars(rows[::-1], "energy of a period (J)", ax)

    def to_pandas(self) -> "pandas.DataFrame":
        """A row for the input, for what the damping takes, and for each contact, in J. Raises
        InputError where pandas is not installed."""
        names = ["input", "damping", *(f"contact {c}" for c in range(len(self.friction)))]
        taken = [self.input, self.damping, *self.friction]
        return tables.frame({"of": names, "energy": taken}, "row")

    def _repr_html_(self) -> str:
        friction = f"{self.friction.sum():.4g} J in {len(self.friction)} contacts"
        rows = {"input": f"{self.input:.4g} J", "damping": f"{self.damping:.4g} J"}
        rows |= {"friction": friction, "error": f"{self.error:.1e}"}
        return tables.notebook_table("Energy of a period", rows)


def excitation(balance: HarmonicBalance, forces: dict) -> dict[int, np.ndarray]:
    """{order: (m,) N} whose product with the conjugate modal motion is that of the forces
    {harmonic: (r,)} with that of the dofs; constant forces are left out."""
    found = {}
    for k, F in forces.items():
        at = np.flatnonzero(F)
        if k:
            found[k] = F[at] @ balance.receptance.shapes[at].conj()
    return found


def energies(
    balance: HarmonicBalance,
    excited: list[dict],
    w: np.ndarray,
    modal: np.ndarray,
    friction: np.ndarray,
) -> list[EnergyBalance]:
    """Of n modal motions (n, m, H+1) at w (n,) rad/s; excited : of `excitation`, of each; friction
    : (n, P) J of each contact."""
    k = np.arange(balance.H + 1)
    damping = balance.damping
    damped = damping[:, None] * modal if damping.ndim == 1 else damping @ modal
    lost = np.pi * w * (np.einsum("nmk,nmk->nk", modal.conj(), damped).real @ k**2)
    if balance.circulation is not None:
        turned = balance.circulation @ modal
        lost += np.pi * np.einsum("nmk,nmk->nk", modal.conj(), turned).imag @ k
    squares = np.einsum("nmk,m,nmk->nk", modal.conj(), balance.receptance.masses, modal).real @ k**2
    powers = [
        {order: complex(row @ q[:, order].conj()) for order, row in one.items()}
        for one, q in zip(excited, modal, strict=True)
    ]
    return [
        EnergyBalance(
            np.pi * sum(order * power.imag for order, power in one.items()),
            float(loss),
            taken,
            np.pi * sum(order * abs(power) for order, power in one.items()),
            float(kinetic),
        )
        for one, loss, taken, kinetic in zip(
            powers, lost, friction, 0.5 * w**2 * squares, strict=True
        )
    ]
