"""PeriodicSolution: a single periodic solution as read-only arrays."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from tipdamp.hbm import tables
from tipdamp.hbm.amplitude import amplitude, orders_of
from tipdamp.hbm.drawing import pictures
from tipdamp.hbm.errors import InputError, nearest
from tipdamp.hbm.io.array_record import ArrayRecord

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes


@dataclass(frozen=True, eq=False)
class PeriodicSolution(ArrayRecord):
    """One periodic solution at `frequency` Hz: m outputs, P contacts, harmonics 0..H; NaN where
    none was found.

    The arrays are copies that cannot be written to; two solutions are equal where all fields are.

    harmonics : (m, H+1) complex, m; contact_force, contact_motion : (P, nd, H+1) complex, N and m,
    as in ForcedResponse
    held : names of the motions that are held; reaction : (h, H+1) complex, N or N m, as in
    ForcedResponse
    share_stick, share_slip, share_open : (P,) share of the cycle; dissipated : (P,) J per cycle
    converged : whether it was found; iterations : evaluations of the residual
    unknowns : (N,) m, a `guess` for another call; force_orders : of the forcing
    force_residual, periods : as in ForcedResponse
    truncation : (m,) m; multipliers : (4,) complex; stable, unstable : of a point of a curve, as
    there; empty and False where these do not know them, as without `stability`

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> damped = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0)
    >>> found: PeriodicSolution = damped.solve_at(760, outputs={"tip": 0})
    >>> print(f"{1e6 * found.amplitude().item():.1f} um")
    13.9 um
    """

    frequency: float
    output_names: tuple
    held: tuple
    harmonics: np.ndarray
    reaction: np.ndarray
    contact_force: np.ndarray
    contact_motion: np.ndarray
    share_stick: np.ndarray
    share_slip: np.ndarray
    share_open: np.ndarray
    dissipated: np.ndarray
    converged: bool
    iterations: int
    unknowns: np.ndarray
    force_orders: tuple
    force_residual: float
    periods: int = 1
    truncation: np.ndarray = field(default_factory=lambda: np.empty(0))
    multipliers: np.ndarray = field(default_factory=lambda: np.empty(0, complex))
    stable: bool = False
    unstable: bool = False

    def __repr__(self) -> str:
        sizes = ", ".join(
            f"{name} {a:.4g} m" for name, a in zip(self.output_names, self.amplitude(), strict=True)
        )
        state = "" if self.converged else ", not solved"
        return f"<PeriodicSolution: {self.frequency:.6g} Hz, {sizes}{state}>"

    def plot(self, *names: str, unit: str = "m", ax: "Axes | None" = None) -> "Axes":
        """Draw the motion of outputs, all without any names, over one period of the motion.

        unit : 'm', 'mm' or 'um'; ax : axes of matplotlib to draw on; new ones without
        Returns the axes. Raises InputError where matplotlib is not installed, and for an unknown
        output.
        """
        drawn = names or self.output_names
        for name in drawn:
            if name not in self.output_names:
                raise InputError(f"output '{name}': {nearest(name, self.output_names)}")
        motions = {name: self.harmonics[self.output_names.index(name)] for name in drawn}
        seconds = self.periods / self.frequency
        return pictures.period(seconds, motions, unit, ["solid"] * len(motions), ax)

    def to_pandas(self) -> "pandas.DataFrame":
        """A row for each output: half peak to peak, root mean square and mean in m. Raises
        InputError where pandas is not installed."""
        columns: dict[str, Any] = {"output": list(self.output_names)}
        columns |= {kind: self.amplitude(kind) for kind in ("half_peak_to_peak", "rms")}
        return tables.frame(columns | {"mean": self.harmonics[:, 0].real}, "row")

    def to_xarray(self) -> "xarray.Dataset":
        """The arrays of the solution by output, contact, component and harmonic, with their units.
        Raises InputError where xarray is not installed."""
        contact = ("contact", "component", "harmonic")
        data = {
            "harmonics": (("output", "harmonic"), self.harmonics, "m"),
            "amplitude": (("output",), self.amplitude(), "m"),
            "contact_force": (contact, self.contact_force, "N"),
            "contact_motion": (contact, self.contact_motion, "m"),
            "share_stick": (("contact",), self.share_stick, "1"),
            "share_slip": (("contact",), self.share_slip, "1"),
            "share_open": (("contact",), self.share_open, "1"),
            "dissipated": (("contact",), self.dissipated, "J"),
        }
        orders = np.arange(self.harmonics.shape[-1])
        places = {"output": list(self.output_names), "harmonic": orders}
        about = {"frequency_Hz": self.frequency, "converged": int(self.converged)}
        return tables.dataset(data, places, periods=self.periods, **about)

    def _repr_html_(self) -> str:
        rows = {
            name: f"{a:.4g} m, mean {X[0].real:.4g} m"
            for name, a, X in zip(self.output_names, self.amplitude(), self.harmonics, strict=True)
        }
        rows |= {"dissipated": f"{self.dissipated.sum():.4g} J", "solved": str(self.converged)}
        if self.stable or self.unstable:
            rows["stable"] = str(self.stable)
        return tables.notebook_table(f"Periodic solution at {self.frequency:.6g} Hz", rows)

    def amplitude(self, kind: str = "half_peak_to_peak", order: int | None = None) -> np.ndarray:
        """(m,) amplitude, m: as ForcedResponse.amplitude."""
        return amplitude(
            self.harmonics,
            kind,
            orders_of(kind, order, self.harmonics.shape[-1] - 1, self.force_orders),
        )
