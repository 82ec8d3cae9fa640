"""What the frictionless static contact gives: forces of the pairs, and with them the displacement
of the bodies."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tipdamp.hbm import tables
from tipdamp.hbm.contact import ContactTable

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class LoadedMotion:
    """A rigid motion of the bodies that no contact normal resists, and how the load acts along it.

    name - for example 'roll about the damper axis'; unit - 'N' or 'N m'; load - of the applied
    loads along it."""

    name: str
    unit: str
    load: float


@dataclass(frozen=True)
class StaticForces:
    """pairs - the table with its preload: the contact force of closed pairs, -kn times the opening
    of open ones (0 where kn = inf); force : (P,) N, the contact forces; opening : (P,) m - how far
    a pair stands open, 0 where closed motions - free ones and the load along each; held : {name: N
    or N m} - force on what holds a motion
    reactions : {name: N or N m} - of loads and contact forces along free motions, taken up in the
    reference state; empty where that is no more than 1e-10 of it
    balance - |sum of contact forces, loads and constraint reactions| / |sum of loads| on the
    floating dampers, None where none floats
    iterations - sets tried; method - 'newton', 'pivoting' after cycling, 'proximal' after a
    singular set
    or sets that cycled, 'unloaded' where no load acts and the bodies fit without any force
    """

    pairs: ContactTable
    force: np.ndarray
    opening: np.ndarray
    motions: tuple[LoadedMotion, ...]
    reactions: dict[str, float]
    held: dict[str, float]
    balance: float | None
    iterations: int
    method: str

    def plot(self, side: str | None = None, ax: "Axes | None" = None) -> "Axes":
        """Draw the preload map of a side, as `ContactTable.plot`."""
        return self.pairs.plot(side, ax)

    def to_pandas(self) -> "pandas.DataFrame":
        """The rows of its `pairs`, as `ContactTable.to_pandas`."""
        return self.pairs.to_pandas()

    def _repr_html_(self) -> str:
        rows = {}
        for side in self.pairs.sides:
            force = self.force[self.pairs.side == side]
            closed = f"{int((force > 0).sum())} of {len(force)} pairs closed"
            rows[f"side '{side}'"] = f"{closed}, {force.sum():.4g} N"
        rows |= {one.name: f"{one.load:.4g} {one.unit}, no contact resists" for one in self.motions}
        return tables.notebook_table("Preload", rows)


@dataclass(frozen=True)
class Preload(StaticForces):
    """StaticForces with the displacement (r,) m of the bodies
    residual - |K q + B' N - f| / |f|, f without the constraint reactions; without load / ||B|' N|

    >>> model, pairs = two_blades()
    >>> found = preload(model, pairs, 60.0 * model.loads["pull"])
    >>> isinstance(found, Preload), bool(found.residual < 1e-12)
    (True, True)
    """

    displacement: np.ndarray
    residual: float
