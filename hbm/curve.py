"""ForcedResponse: a curve of periodic solutions as plain arrays, and how it is made from a branch."""

from dataclasses import MISSING, dataclass, field, fields
from pathlib import Path

import numpy as np

from hbm import fourier
from hbm.errors import InputError, nearest
from hbm.linear import mostly

KINDS = ("half_peak_to_peak", "harmonic", "rms")


@dataclass(frozen=True)
class ForcedResponse:
    """A branch of periodic solutions over frequency: n points, m outputs, P pairs, harmonics 0..H.

    frequency : (n,) Hz, in the order of the branch (not monotone where it folds)
    output_names : (m,) str
    harmonics : (n, m, H+1) complex, m - x(t) = X0 + Re sum X_k exp(i k w t); NaN where a point failed
    parameter_name, parameter : what the branch was followed in, and its (n,) values: 'frequency' in Hz, or 'level',
        'preload', 'mu', 'kn' or 'kt' as factors on the force or on that setting of every pair, at one frequency
    share_stick, share_slip, share_open : (n, P) share of the cycle
    dissipated : (n, P) J per cycle by friction
    converged : (n,) bool; iterations : (n,) evaluations of the residual
    ended : why the curve ends, with the remedy; complete : it covers the band without a failed point
    leaps : (k, 2) parameters at which a branch that folds on and on was left, and at which a solution further ahead was
        taken up; between them there may be points solved one from the other, or none; empty where it is one branch
    contact_force, contact_motion : (n, P, nd, H+1) complex, N and m - of each pair in the order of the law,
        the force of the damper on the blade and the relative motion that makes it; empty unless asked for
    """

    frequency: np.ndarray
    output_names: np.ndarray
    harmonics: np.ndarray
    parameter_name: str
    parameter: np.ndarray
    share_stick: np.ndarray
    share_slip: np.ndarray
    share_open: np.ndarray
    dissipated: np.ndarray
    converged: np.ndarray
    iterations: np.ndarray
    ended: str
    complete: bool
    H: int
    origin: str
    start: str
    seconds: float
    residual_calls: int
    leaps: np.ndarray = field(default_factory=lambda: np.empty((0, 2)))
    contact_force: np.ndarray = field(default_factory=lambda: np.empty((0, 0, 0, 0)))
    contact_motion: np.ndarray = field(default_factory=lambda: np.empty((0, 0, 0, 0)))

    def amplitude(self, kind: str = "half_peak_to_peak") -> np.ndarray:
        """(n, m) amplitude, m: 'half_peak_to_peak' of the whole cycle, 'harmonic' |X_1|, or 'rms' of the vibration."""
        if kind == "half_peak_to_peak":
            return fourier.half_peak_to_peak(self.harmonics)
        if kind == "harmonic":
            return np.abs(self.harmonics[..., 1]) if self.H else np.zeros(self.harmonics.shape[:-1])
        if kind == "rms":
            return fourier.rms(self.harmonics)
        raise InputError(f"amplitude kind '{kind}' is unknown; {nearest(kind, KINDS)}")

    def column(self, name: str) -> int:
        """Column of an output."""
        names = self.output_names.tolist()
        if name not in names:
            raise InputError(f"output '{name}' is not in this response; {nearest(name, names)}")
        return names.index(name)

    def peak(self, name: str, kind: str = "half_peak_to_peak") -> tuple[float, float]:
        """(Hz, m) largest amplitude of an output; the curve was refined there when it was computed."""
        a = self.amplitude(kind)[:, self.column(name)]
        if not np.isfinite(a).any():
            return float("nan"), float("nan")
        i = int(np.nanargmax(a))
        if not 0 < i < len(a) - 1 or not np.isfinite(a[i - 1:i + 2]).all():
            return float(self.frequency[i]), float(a[i])
        f = self.frequency[i - 1:i + 2]
        top, value = parabola(f - f[1], a[i - 1:i + 2])
        inside = min(f) <= f[1] + top <= max(f)
        return (float(f[1] + top), float(value)) if inside else (float(f[1]), float(a[i]))

    def solutions_at(self, hz: float) -> np.ndarray:
        """(s, m, H+1) complex harmonics of every solution at a frequency, one for each passage of the curve.

        Solved ones where the frequency was asked for (`at` of forced_response), else interpolated linearly.
        """
        f, X = self.frequency, self.harmonics
        close = np.abs(f - hz) <= 1e-12 * hz
        if (close & self.converged).any():
            return X[close & self.converged]
        i = np.flatnonzero(((f[:-1] - hz) * (f[1:] - hz) < 0) & self.converged[:-1] & self.converged[1:])
        share = ((hz - f[i]) / (f[i + 1] - f[i]))[:, None, None]
        return (1 - share) * X[i] + share * X[i + 1]

    @property
    def slipping_pairs(self) -> np.ndarray:
        """Indices of the pairs that slip or open anywhere in the band."""
        return np.flatnonzero(np.nanmax(self.share_slip + self.share_open, axis=0, initial=0.0) > 1e-6)

    def save(self, path) -> Path:
        """One .npz of plain arrays."""
        path = Path(path)
        np.savez(path, **{f.name: np.asarray(getattr(self, f.name)) for f in fields(self)})
        return path

    @classmethod
    def load(cls, path) -> "ForcedResponse":
        path = Path(path)
        if not path.is_file():
            raise InputError(f"forced response not found: {path}")
        with np.load(path, allow_pickle=False) as z:
            missing = [f.name for f in fields(cls) if f.name not in z and f.default_factory is MISSING]
            if missing:
                raise InputError(f"{path}: is not a forced response, '{missing[0]}' is missing")
            plain = {str: str, bool: bool, int: int, float: float}
            return cls(**{f.name: plain[f.type](z[f.name]) if f.type in plain else z[f.name] for f in fields(cls)
                          if f.name in z})


def record(branch, balance, recover, names, ended, problem, start, seconds):
    n, m, P, H = len(branch.points), len(names), len(problem.pairs), balance.H
    harmonics = np.full((n, m, H + 1), np.nan, dtype=complex)
    shares, work = np.full((n, P, 3), np.nan), np.full((n, P), np.nan)
    for i, point in enumerate(branch.points):
        if point.converged:
            harmonics[i] = recover @ point.detail.modal
            shares[i] = point.detail.bracket.shares
            work[i] = _dissipated(point, balance, problem.law.tangents)
    hz = np.array([p.parameter for p in branch.points]) / (2 * np.pi)
    return ForcedResponse(
        frequency=hz, parameter_name="frequency", parameter=hz, output_names=np.array(names, dtype=str),
        harmonics=harmonics, share_stick=shares[..., 0], share_slip=shares[..., 1], share_open=shares[..., 2],
        dissipated=work, converged=np.array([p.converged for p in branch.points]),
        iterations=np.array([p.iterations for p in branch.points]), ended=ended,
        complete=bool(branch.complete and all(p.converged for p in branch.points)), H=H,
        origin="preloaded" if problem.preloaded else "unloaded", start=start if isinstance(start, str) else "given",
        seconds=seconds, residual_calls=branch.calls, leaps=np.reshape(branch.leaps, (-1, 2)) / (2 * np.pi))


def contact_harmonics(branch, balance):
    shape = (len(branch.points), len(balance.problem.pairs), balance.nd, balance.H + 1)
    force, motion = np.full(shape, np.nan, dtype=complex), np.full(shape, np.nan, dtype=complex)
    for i, point in enumerate(branch.points):
        if point.converged:
            force[i], motion[i] = point.detail.contact()
    return {"contact_force": force, "contact_motion": motion}


def _dissipated(point, balance, tangents):
    """(P,) J per cycle: sum of pi k Im(f_k conj(u_k)) over the tangents; the springs give nothing."""
    g = fourier.to_complex(point.detail.bracket.g)[:, :tangents, 1:]
    u = fourier.to_complex(point.x.reshape(-1, balance.nd, balance.nh))[:, :tangents, 1:]
    return np.pi * np.sum(np.arange(1, balance.H + 1) * (g * u.conj()).imag, axis=(1, 2))


def explain(branch, balance, problem):
    """The end in Hz, where points failed or the branch was left, and the motion that no force holds, if that is why."""
    ended = branch.ended
    good = [p for p in branch.points if p.converged]
    if not good:
        return ended
    last, failed = good[-1], [p for p in branch.points if not p.converged]
    for parameter in (last.parameter, branch.points[0].parameter):
        ended = ended.replace(f"{parameter:.6g}", f"{parameter / (2 * np.pi):.6g} Hz")
    if branch.leaps:
        places = ", ".join(f"{a / (2 * np.pi):.6g} to {b / (2 * np.pi):.6g}" for a, b in branch.leaps)
        ended += (f"; not one branch: it folds on and on, was left, and taken up further on: {places} Hz (more "
                  "damping, or more or fewer harmonics, may give one)")
    if failed and branch.complete:
        ended += (f"; {len(failed)} point{'s' * (len(failed) > 1)} failed near {failed[0].parameter / (2 * np.pi):.6g} "
                  "Hz: run the other direction, or other harmonics, there")
    if branch.complete:
        return ended
    value, q = last.detail.smallest_motion()
    if q is not None and value < 1e-4 and np.abs(q[:, 0]).max() > 0.9 * np.abs(q).max():
        motion = q[:, 0].real
        named = problem.describe(motion) if problem.describe else None
        verb = "the damper rolls" if named and named.turns else "a mean motion is held by nothing"
        named = named or mostly(motion)
        ended += f"; {verb} ({named}): no periodic state exists there unless a stiffness holds that motion"
    return ended


def parabola(s, y):
    """(place, value) of the extremum of the parabola through three points."""
    c = np.polyfit(s / np.abs(s).max(), y, 2)
    if c[0] >= 0:
        return float("inf"), float(y[1])
    top = -0.5 * c[1] / c[0]
    return float(top * np.abs(s).max()), float(np.polyval(c, top))
