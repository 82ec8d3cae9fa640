"""What of a problem depends on the frequency of the excitation: forces and matrices.

At a steady speed the problem has constant matrices and harmonic forces as any other; along a
frequency band they change. `Varying.at` gives the problem at one frequency, `Varying.rate` what the
derivative along the band needs.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.hbm.errors import InputError
from tipdamp.hbm.validation import brief, check_call, check_whole, numbers

STEP = 1e-5  # relative, of the central differences of given functions
Amplitude = Callable[[float], complex]


@dataclass(frozen=True)
class Unbalance:
    """Amplitude m e w^2 of an unbalanced mass, N, at the frequency w rad/s of the excitation.

    moment : m e in kg m; complex: with the phase of its place; of a mass that turns k times as
    fast (`harmonic=k`) k^2 times as much

    >>> rotor = Problem(M=[[2.0]], C=[[8.0]], K=[[2e5]]).force(0, Unbalance(1e-4))
    >>> stop = rotor.add(UnilateralSpring(), 0, kn=1e6, preload=-1e3)  # 1 mm away
    >>> curve = stop.follow_band((20, 400), outputs={"x": 0}, harmonics=1)
    >>> print(f"{curve.amplitude()[-1, 0] / (1e-4 / 2.0):.2f}")  # turns about its centre of mass
    1.02
    """

    moment: complex

    def __post_init__(self) -> None:
        if numbers("moment", self.moment, UNBALANCE, complex).shape or not np.isfinite(self.moment):
            raise InputError(f"moment = {brief(self.moment)}: {UNBALANCE}")

    def __call__(self, w: float) -> complex:
        """N."""
        return self.moment * w**2


@dataclass(frozen=True, eq=False)
class ForceTable:
    """Amplitude of a measured force over the frequency, straight between the entries.

    hz : (n,) rising; values : (n,) N, real or complex
    Raises InputError where these are no table. A band must lie inside it.

    >>> measured = ForceTable([100, 200, 300], [5.0, 7.0, 6.5])
    >>> print(abs(measured(2 * np.pi * 150)))
    6.0
    >>> blade = Problem(M=[[0.05]], K=[[4e4]], damping_ratio=0.01).force(0, measured)
    >>> damped = blade.add(Jenkins1D(), 0, kt=2e4, mu=0.5, preload=40.0)
    >>> damped.follow_band((110, 290), outputs={"tip": 0}).complete
    True
    """

    hz: "ArrayLike"
    values: "ArrayLike"

    def __post_init__(self) -> None:
        hz = numbers("hz", self.hz, "must be frequencies in Hz, rising")
        values = numbers("values", self.values, "must be numbers in N, real or complex", complex)
        if hz.ndim != 1 or len(hz) < 2 or values.shape != hz.shape:
            raise InputError(
                f"force table: hz has the shape {hz.shape} and values {values.shape}: must be two "
                "columns of the same length, 2 or more"
            )
        bad = ~(np.isfinite(hz) & np.isfinite(values))
        if bad.any():
            raise InputError(f"force table: entry {int(bad.argmax()) + 1} is not finite")
        if (np.diff(hz) <= 0).any() or hz[0] < 0:
            i = int((np.diff(hz) <= 0).argmax()) + 1
            raise InputError(f"force table: entry {i + 1}, {hz[i]:g} Hz: hz must rise, from 0 up")
        object.__setattr__(self, "hz", hz)
        object.__setattr__(self, "values", values)

    def __call__(self, w: float) -> complex:
        """N; beyond the table the value at its end, where further solutions are looked for."""
        return complex(np.interp(w / (2 * np.pi), np.asarray(self.hz), np.asarray(self.values)))

    def check(self, hz: float) -> None:
        """InputError outside the table."""
        table = np.asarray(self.hz)
        if not table[0] <= hz <= table[-1]:
            raise InputError(
                f"force table: {hz:g} Hz lies outside, it has {table[0]:g} to {table[-1]:g} Hz"
            )


UNBALANCE = "must be one number in kg m, real or complex"


@dataclass(frozen=True, eq=False)
class Varying:
    """Forces and matrices that depend on the frequency w rad/s of the excitation.

    forces : of (harmonic, pattern (r,), amplitude): amplitude(w) N times the pattern
    C, K : functions of the speed w / engine_order, rad/s, that give the matrix there, or None
    """

    forces: tuple = ()
    C: Callable | None = None
    K: Callable | None = None
    engine_order: int = 1

    @property
    def of_matrices(self) -> bool:
        """Whether a matrix varies."""
        return self.C is not None or self.K is not None

    def orders(self, periods: int = 1) -> list[int]:
        """Of the forces, in a motion of so many periods of the excitation."""
        return [periods * k for k, _, _ in self.forces]

    def matrices(self, w: float) -> dict[str, np.ndarray]:
        """Those that vary, at w."""
        speed = w / self.engine_order
        given = {"C": self.C, "K": self.K}
        return {name: np.asarray(of(speed)) for name, of in given.items() if of is not None}

    def forces_at(self, forces: dict, w: float, periods: int = 1) -> dict:
        """{harmonic: (r,)} with the constant ones `forces`, which have all orders."""
        found = dict(forces)
        for k, pattern, amplitude in self.forces:
            found[periods * k] = found[periods * k] + amplitude_at(amplitude, w) * pattern
        return found

    def rate(self, forces: dict, w: float, periods: int) -> tuple[dict, dict]:
        """Derivatives by w of the matrices that vary and of the forces."""
        h = STEP * w
        zero = {k: np.zeros_like(F) for k, F in forces.items()}
        after, before = (
            (self.matrices(w + s), self.forces_at(zero, w + s, periods)) for s in (h, -h)
        )
        matrices, rates = (
            {name: (one[name] - other[name]) / (2 * h) for name in one}
            for one, other in zip(after, before, strict=True)
        )
        return matrices, rates

    def check_frequency(self, hz: float) -> None:
        """InputError where a table of forces does not reach there."""
        for _, _, amplitude in self.forces:
            if isinstance(amplitude, ForceTable):
                amplitude.check(hz)

    def checked(self, r: int) -> "Varying":
        """The same; InputError where it does not fit a problem of r dofs."""
        check_whole("engine_order", self.engine_order, 1)
        for name, of in (("C", self.C), ("K", self.K)):
            if of is None:
                continue
            if not callable(of):
                raise InputError(
                    f"of_speed: {name} = {brief(of)}: must be a function of the speed in rad/s "
                    f"that gives ({r}, {r})"
                )
            check_call(f"of_speed: {name}", of, "speed")
        return self


def amplitude_at(amplitude: Amplitude, w: float) -> complex:
    """That of a given function at w; InputError where it is no finite number."""
    found: Any = amplitude(w)
    if not _is_one(found):
        raise InputError(
            f"force: its amplitude at {w / (2 * np.pi):g} Hz is {brief(found)}: must be one finite "
            "number"
        )
    return complex(found)


def constant(unit: str, amplitude: Any) -> Amplitude:
    """The function that always gives a number; InputError where it is none."""
    if not _is_one(amplitude):
        raise InputError(
            f"amplitude = {brief(amplitude)}: must be one finite number in {unit}, real or "
            "complex, or a function of w rad/s"
        )
    return lambda w: complex(amplitude)


def _is_one(value: complex) -> bool:
    number = np.asarray(value)
    return number.ndim == 0 and number.dtype.kind in "iufc" and bool(np.isfinite(number))


def at_frequency(problem: Any, w: float) -> Any:
    """A ContactProblem with its matrices at w rad/s, which vary no more; the same where none
    does."""
    varying = problem.varying
    if varying is None:
        return problem
    if not varying.of_matrices:
        return problem.as_constant
    try:
        there = replace(problem, varying=None, **varying.matrices(w))
        if not there.reducible:
            there.receptance()  # it is kept; a K that buckles is refused here, with its speed
        return there
    except InputError as error:
        speed = w / varying.engine_order
        raise InputError(f"of_speed, at {speed:g} rad/s: {error}") from None
