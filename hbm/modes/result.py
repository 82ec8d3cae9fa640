"""Backbone: a nonlinear mode over its amplitude as read-only arrays."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tipdamp.hbm import tables
from tipdamp.hbm.amplitude import amplitude
from tipdamp.hbm.drawing import pictures
from tipdamp.hbm.io.array_files import save_npz
from tipdamp.hbm.io.array_record import ArrayRecord, column_of, read_record

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes


@dataclass(frozen=True, eq=False)
class Backbone(ArrayRecord):
    """A nonlinear mode: n free motions in the order of the branch, m outputs, P contacts, harmonics
    0..H, a model with r dofs.

    mode : number of the stuck mode that it starts from, 1 is the lowest
    amplitude : (n,) m, harmonic 1 of the first output, real and positive there
    frequency : (n,) Hz; damping_ratio : (n,) of the mode, of structure and contacts together
    output_names : (m,) str; harmonics : (n, m, H+1) complex, m - x(t) = X0 + Re sum X_k exp(i k w
        t)
    shape : (n, r) complex, m - harmonic 1 of the whole model
    modal_amplitude : (n,) kg^1/2 m, sqrt(shape^H M shape)
    share_stick, share_slip, share_open : (n, P) share of the cycle
    stuck_frequency : Hz, stuck_damping_ratio : of the mode where every contact sticks
    ended : why it ends; complete : it reaches the last amplitude without a failed point
    unknowns : (n, N) of the equation (`tipdamp.hbm.modes.free_motion`); H : harmonics
    output_rows : (m, r) that take the outputs out of q
    seconds : cost

    The arrays are copies that cannot be written to; a point that failed is left out.

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01)
    >>> problem = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    >>> mode: Backbone = backbone(problem, 1, (1e-6, 1e-3), outputs={"tip": [1.0]})
    >>> print(f"{mode.frequency[0]:.1f} to {mode.frequency[-1]:.1f} Hz")  # stuck to free
    871.7 to 714.1 Hz
    >>> Backbone.load(mode.save("mode.npz")) == mode
    True
    """

    mode: int
    amplitude: np.ndarray
    frequency: np.ndarray
    damping_ratio: np.ndarray
    output_names: np.ndarray
    harmonics: np.ndarray
    shape: np.ndarray
    modal_amplitude: np.ndarray
    share_stick: np.ndarray
    share_slip: np.ndarray
    share_open: np.ndarray
    stuck_frequency: float
    stuck_damping_ratio: float
    ended: str
    complete: bool
    H: int
    unknowns: np.ndarray
    output_rows: np.ndarray
    seconds: float = field(compare=False)

    def __repr__(self) -> str:
        a, f = self.amplitude, self.frequency
        return (
            f"<Backbone of mode {self.mode}: {a.min():.3g} to {a.max():.3g} m, {f.max():.6g} to "
            f"{f.min():.6g} Hz, damping up to {100 * self.damping_ratio.max():.3g} %, {len(a)} "
            f"points, H = {self.H}; {self.ended}>"
        )

    def amplitudes(self, name: str, kind: str = "half_peak_to_peak") -> np.ndarray:
        """(n,) m of an output, of a kind as in `ForcedResponse.amplitude`."""
        j = column_of(name, self.output_names, "backbone")
        return amplitude(self.harmonics[:, j], kind, [1])

    def largest(self) -> np.ndarray:
        """(n,) m, half of peak to peak, of the output that moves most at each place."""
        return np.max([self.amplitudes(name) for name in self.output_names.tolist()], axis=0)

    def plot(self, name: str | None = None, unit: str = "m", ax: "Axes | None" = None) -> "Axes":
        """Draw half of peak to peak of an output over the frequency of the mode, as it stands among
        the curves of a forced response.

        name : of the output, the first without; unit : 'm', 'mm' or 'um'; ax : axes of matplotlib
            to draw on; new ones without
        Returns the axes. Raises InputError where matplotlib is not installed, and for an unknown
        output.
        """
        a = self.amplitudes(name or str(self.output_names[0]))
        return pictures.over_frequency(self.frequency, a, f"backbone, mode {self.mode}", unit, ax)

    def to_pandas(self, kind: str = "half_peak_to_peak") -> "pandas.DataFrame":
        """A row for each place: `mode_amplitude` in m (harmonic 1 of the first output), frequency
        in Hz, damping ratio, and the amplitude of each output in m, of a kind as in `amplitudes`.
        Raises InputError where pandas is not installed."""
        columns: dict[str, Any] = {
            "mode_amplitude": self.amplitude,
            "frequency": self.frequency,
            "damping_ratio": self.damping_ratio,
        }
        columns |= {name: self.amplitudes(name, kind) for name in self.output_names.tolist()}
        return tables.frame(columns, "place")

    def to_xarray(self) -> "xarray.Dataset":
        """The arrays of the branch by place, output, harmonic and contact, with their units. Raises
        InputError where xarray is not installed."""
        return tables.places_as_dataset(self)

    def _repr_html_(self) -> str:
        a, f, zeta = self.amplitude, self.frequency, self.damping_ratio
        rows = {
            "amplitude": f"{a.min():.4g} to {a.max():.4g} m",
            "frequency": f"{f.max():.6g} to {f.min():.6g} Hz",
            "damping ratio": f"up to {zeta.max():.3%}, at {a[zeta.argmax()]:.4g} m",
            "places": f"{len(a)}",
            "harmonics": f"{self.H}",
            "ended": self.ended,
        }
        return tables.notebook_table(f"Backbone of mode {self.mode}", rows)

    def save(self, path: str | Path) -> Path:
        """One .npz of plain arrays."""
        return save_npz(path, **vars(self))

    @classmethod
    def load(cls, path: str | Path) -> "Backbone":
        """Read what `save` wrote; InputError where the file is not there or holds something
        else."""
        return read_record(cls, path, "backbone", "a backbone as Backbone.save writes it")
