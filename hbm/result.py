"""ForcedResponse: a curve of periodic solutions as plain arrays; `record` makes it from a branch."""

import warnings
from dataclasses import MISSING, dataclass, field, fields
from pathlib import Path

import numpy as np

from hbm import fourier
from hbm.errors import InputError, nearest

KINDS = ("half_peak_to_peak", "harmonic", "rms")
RIPPLE = 1e-3          # a local maximum that stands out less, relative to its height, is none


@dataclass(frozen=True)
class ForcedResponse:
    """A branch of periodic solutions over frequency: n points, m outputs, P pairs, harmonics 0..H.

    frequency : (n,) Hz, in the order of the branch (not monotone where it folds)
    output_names : (m,) str
    harmonics : (n, m, H+1) complex, m - x(t) = X0 + Re sum X_k exp(i k w t); NaN where a point failed
    parameter_name, parameter : what the branch was followed in, and its (n,) values: 'frequency' in Hz, or 'level',
        'preload', 'mu', 'kn' or 'kt' as factors on the force or on that setting of every pair, at one frequency
    share_stick, share_slip, share_open : (n, P) share of the cycle; of a law that names no sliders (`tangents` of
        SampledLaw) a pair that loses energy slips wherever it is closed
    dissipated : (n, P) J per cycle that the law takes out, over all its components
    converged : (n,) bool; iterations : (n,) evaluations of the residual
    ended : why the curve ends, with the remedy; complete : it covers the band without a failed point
    leaps : (k, 2) parameters at which a branch that folds on and on was left, and at which a solution further ahead was
        taken up; between them there may be points solved one from the other, or none; empty where it is one branch
    contact_force, contact_motion : (n, P, nd, H+1) complex, N and m - of each pair in the order of the law,
        the force of the damper on the blade and the relative motion that makes it; empty unless asked for
    tops : (n, m) bool, the points solved at the largest half peak to peak of an output; empty in a curve made otherwise
    passages : what solves beside the points: passages of a value, local maxima; None from a file
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
    tops: np.ndarray = field(default_factory=lambda: np.empty((0, 0), dtype=bool))
    passages: object = field(default=None, repr=False, compare=False)

    def __repr__(self) -> str:
        f, failed = self.parameter, int((~self.converged).sum())
        over = f"{f.min():g} to {f.max():g} Hz" if self.parameter_name == "frequency" else \
            f"{self.parameter_name} {f.min():g} to {f.max():g} at {self.frequency[0]:g} Hz"
        return (f"<ForcedResponse: {over}, {len(f)} points ({failed} failed), outputs "
                f"{', '.join(self.output_names)}; {self.share_slip.shape[1]} pairs, {len(self.slipping_pairs)} slip, "
                f"H = {self.H}; {self.ended}>")

    def amplitude(self, kind: str = "half_peak_to_peak") -> np.ndarray:
        """(n, m) amplitude, m: 'half_peak_to_peak' of the whole cycle, 'harmonic' |X_1|, or 'rms' of the vibration."""
        return amplitude(self.harmonics, kind)

    def column(self, name: str) -> int:
        """Column of an output."""
        names = self.output_names.tolist()
        if name not in names:
            raise InputError(f"output '{name}' is not in this response; {nearest(name, names)}")
        return names.index(name)

    def peak(self, name: str, kind: str = "half_peak_to_peak") -> tuple[float, float]:
        """(Hz, m) largest amplitude of an output; over another parameter, (value of that, m).

        At the border of a frequency band it is no resonance: it is given with a warning (see `at_border`). Solved to
        1e-8 of the amplitude; in a curve from a file half peak to peak alone is, the others lie on a parabola.
        """
        a = self.amplitude(kind)[:, self.column(name)]
        if not np.isfinite(a).any():
            return float("nan"), float("nan")
        if self.parameter_name == "frequency" and self.at_border(name, kind):
            warnings.warn(f"peak of '{name}': its largest amplitude lies at the border of the band, "
                          f"{self.parameter[np.nanargmax(a)]:g} Hz; the resonance may be outside, widen the band",
                          stacklevel=2)
        top = self._top(a, int(np.nanargmax(a)), self.column(name), kind)
        if kind != KINDS[0] and self.passages is not None and not self.at_border(name, kind):
            return max([top, *map(tuple, self.peaks(name, kind)[:1])], key=lambda pair: pair[1])
        return top

    def at_border(self, name: str, kind: str = "half_peak_to_peak") -> bool:
        """Whether the largest amplitude of an output is that of an end of the curve: then `peak` is no resonance."""
        a = self.amplitude(kind)[:, self.column(name)]
        good = np.flatnonzero(np.isfinite(a))
        return bool(len(good) and a[good].max() > 0 and a[good].argmax() in (0, len(good) - 1))

    def peaks(self, name: str, kind: str = "half_peak_to_peak") -> np.ndarray:
        """(k, 2) Hz and m of every local maximum of an output inside the band, the largest first, solved to 1e-8.

        Ripples are left out: what is less than a thousandth of its height above the saddles beside it. A curve from a
        file knows its points alone: the largest half peak to peak is solved there, the others lie on a parabola, good
        to about 1e-4.
        """
        j = self.column(name)
        a = self.amplitude(kind)[:, j]
        if self.passages is not None:
            solved = self.tops[:, j] if kind == KINDS[0] else np.zeros(len(a), dtype=bool)
            found = self.passages.maxima(j, a, solved, kind)
        else:
            found = [self._top(a, i, j, kind) for i in crests(a, self.parameter)]
        found = np.reshape(found, (-1, 2))
        return found[np.argsort(-found[:, 1], kind="stable")]

    def _top(self, a, i, j, kind):
        """(parameter, amplitude) of point i where it was solved as a top, else of the parabola around it."""
        solved = self.tops.size and self.tops[i, j] and kind == KINDS[0]
        f = self.parameter[max(i - 1, 0):i + 2]
        apart = np.abs(np.diff(f))
        if solved or not 0 < i < len(a) - 1 or not np.isfinite(a[i - 1:i + 2]).all() or 20 * min(apart) <= max(apart):
            return float(self.parameter[i]), float(a[i])
        top, value = parabola(f - f[1], a[i - 1:i + 2])
        inside = min(f) <= f[1] + top <= max(f)
        return (float(f[1] + top), float(value)) if inside else (float(f[1]), float(a[i]))

    def solutions_at(self, value: float) -> np.ndarray:
        """(s, m, H+1) complex harmonics of every solution at a frequency in Hz, one for each passage of the curve.

        Every one is solved to the tolerance: those that the curve holds there (`at` of forced_response), and by Newton
        from the points around each other passage. A curve from a file knows its points alone: there `value` must have
        been in `at`. In a curve over another parameter, `value` is a value of that.
        Raises InputError outside the curve, and where a curve from a file has no point at `value`.
        """
        f, X = self.parameter, self.harmonics
        low, high, unit = f.min(), f.max(), " Hz" if self.parameter_name == "frequency" else ""
        if not low * (1 - 1e-12) <= value <= high * (1 + 1e-12):
            raise InputError(f"solutions at {value:g}{unit}: the band of the curve is {low:g} to {high:g}{unit}")
        there = np.abs(f - value) <= 1e-12 * value
        found = [(i, X[i]) for i in np.flatnonzero(there & self.converged)]
        if self.passages is not None:
            found += [(i, x) for i, x in self.passages(value) if not there[i - 1:i + 1].any()]
        elif (((f[:-1] - value) * (f[1:] - value) < 0) & ~there[:-1] & ~there[1:]
                & self.converged[:-1] & self.converged[1:]).any():
            raise InputError(f"solutions at {value:g}{unit}: this curve comes from a file and was not solved there; "
                             f"compute it with at = [{value:g}]")
        found.sort(key=lambda place: place[0])
        return np.array([x for _, x in found]).reshape(-1, *X.shape[1:])

    def time_history(self, name: str, value: float, which: int = 0, n: int = 256) -> tuple[np.ndarray, np.ndarray]:
        """(t (n,) s, x (n,) m) of an output over one period; value, which : as in `solutions_at`, `compare`."""
        found = self.solutions_at(value)
        if not 0 <= which < len(found):
            raise InputError(f"time_history: which = {which}: the curve has {len(found)} solutions at {value:g}")
        hz = value if self.parameter_name == "frequency" else self.frequency[0]
        tau = 2 * np.pi * np.arange(n) / n
        return tau / (2 * np.pi * hz), fourier.basis(tau, self.H) @ fourier.to_real(found[which, self.column(name)])

    def compare(self, value: float, which: int | None = None, **settings):
        """Comparison of a solution with time integration that starts on its orbit (see `hbm.time.comparison.compare`).

            print(curve.compare(106.0).said)

        value : as in `solutions_at`; which : the place there, needed where the curve has several solutions
        settings : of `compare`. Raises InputError where there is no such solution, and in a curve from a file (there:
        `hbm.time.comparison.compare_at`).
        """
        from hbm.time.comparison import compare
        if self.passages is None:
            raise InputError("compare: this curve comes from a file and knows no model; use "
                             "hbm.time.comparison.compare_at")
        there = self.solutions_at(value)
        balance, points = self.passages.solved(value)
        if which is None and len(points) > 1:
            sizes = ", ".join(f"{a:.3g}" for a in amplitude(there, "harmonic").max(axis=1))
            raise InputError(f"compare: the curve has {len(points)} solutions at {value:g}, of amplitude {sizes} m; "
                             f"say which = 0 to {len(points) - 1}")
        if not 0 <= (which or 0) < len(points) or not points[which or 0].converged:
            raise InputError(f"compare: which = {which}: {len(points)} solutions of the curve are known at {value:g}")
        return compare(balance, points[which or 0], self.passages.rows, **settings)

    @property
    def widest_gap(self) -> float:
        """Of the parameter, between the neighbouring solved points furthest apart where the branch was left; 0 where it
        is one branch."""
        return widest_gap(self.parameter, self.converged, self.leaps)

    @property
    def slipping_pairs(self) -> np.ndarray:
        """Indices of the pairs that slip or open anywhere in the band."""
        return np.flatnonzero(np.nanmax(self.share_slip + self.share_open, axis=0, initial=0.0) > 1e-6)

    def save(self, path) -> Path:
        """One .npz of plain arrays."""
        path = Path(path)
        np.savez(path, **{f.name: np.asarray(getattr(self, f.name)) for f in fields(self) if f.name != "passages"})
        return path

    @classmethod
    def load(cls, path) -> "ForcedResponse":
        path = Path(path)
        if not path.is_file():
            raise InputError(f"forced response not found: {path}")
        with np.load(path, allow_pickle=False) as z:
            missing = [f.name for f in fields(cls) if f.name not in z and f.default is f.default_factory is MISSING]
            if missing:
                raise InputError(f"{path}: is not a forced response, '{missing[0]}' is missing")
            plain = {str: str, bool: bool, int: int, float: float}
            return cls(**{f.name: plain[f.type](z[f.name]) if f.type in plain else z[f.name] for f in fields(cls)
                          if f.name in z})


def amplitude(X, kind) -> np.ndarray:
    """(...) amplitude of a kind from harmonics (..., H+1); NaN where they are."""
    if kind == "half_peak_to_peak":
        return fourier.half_peak_to_peak(X)
    if kind == "harmonic":
        return np.abs(X[..., 1]) if X.shape[-1] > 1 else np.zeros(X.shape[:-1])
    if kind == "rms":
        return fourier.rms(X)
    raise InputError(f"amplitude kind '{kind}' is unknown; {nearest(kind, KINDS)}")


def crests(a, parameter) -> list[int]:
    """Places of the local maxima of an amplitude along a curve, neighbours solved and ripples left out."""
    a, parameter = np.asarray(a, dtype=float), np.asarray(parameter)
    higher = (a[1:-1] > a[:-2]) & (a[1:-1] >= a[2:])
    jump = parameter[1:] == parameter[:-1]                # out of the band and in again: another solution
    return [i for i in np.flatnonzero(higher & ~jump[:-1] & ~jump[1:]) + 1
            if a[i] - max(_saddle(a[i::-1]), _saddle(a[i:])) > RIPPLE * a[i]]


def _saddle(a):
    """The least value before the first that is higher than the first one."""
    above = np.flatnonzero(a > a[0])
    return np.nanmin(a[:above[0]] if len(above) else a)


def widest_gap(parameter, converged, leaps) -> float:
    """Between the neighbouring solved points furthest apart in any of the leaps (k, 2); 0 without any."""
    solved = np.asarray(parameter)[np.asarray(converged)]
    return max((float(np.diff(np.unique([low, *solved[(low < solved) & (solved < high)], high])).max(initial=0.0))
                for low, high in np.sort(np.reshape(leaps, (-1, 2)), axis=1)), default=0.0)


def parabola(s, y):
    """(place, value) of the extremum of the parabola through three points."""
    c = np.polyfit(s / np.abs(s).max(), y, 2)
    if c[0] >= 0:
        return float("inf"), float(y[1])
    top = -0.5 * c[1] / c[0]
    return float(top * np.abs(s).max()), float(np.polyval(c, top))
