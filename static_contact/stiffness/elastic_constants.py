"""Two elastic bodies in contact: their combined constants, and what a stiffness of the pair
consists of.

Symbols: E, nu, G = E / (2 (1 + nu)) of each body; E* the combined (plane-strain) modulus.
Source: Johnson, Contact Mechanics (1985), ch. 4 and 5; Dundurs' constants with Johnson's sign.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from tipdamp.hbm.errors import InputError

Values = float | np.ndarray


def require(
    name: str,
    value: Any,
    low: float,
    high: float = np.inf,
    *,
    open_low: bool = False,
    unit: str = "",
) -> Any:
    """Return `value` if all of it is a finite number within low..high (above low with open_low),
    else InputError."""
    number = np.asarray(value)
    if number.dtype.kind not in "iuf":  # text, None, True: never taken as numbers
        raise InputError(
            f"{name} = {value!r} is not a number: allowed are real "
            f"numbers{' in ' + unit if unit else ''}"
        )
    above = number > low if open_low else number >= low
    if not np.all(np.isfinite(number) & above & (number <= high)):
        lower = "finite numbers"
        if np.isfinite(low):
            lower = f"{'>' if open_low else '>='} {low:g}"
        upper = f" and <= {high:g}" if np.isfinite(high) else ""
        raise InputError(
            f"{name} = {value!r} is out of range: allowed "
            f"{lower}{upper}{' ' + unit if unit else ''}"
        )
    return value


def positive(name: str, value: Any, unit: str = "") -> Any:
    """As `require`, above 0."""
    return require(name, value, 0, open_low=True, unit=unit)


@dataclass(frozen=True)
class MaterialPair:
    """Young's moduli (Pa) and Poisson's ratios of the two bodies in contact."""

    E1: float
    nu1: float
    E2: float
    nu2: float

    def __post_init__(self) -> None:
        for name in ("E1", "E2"):
            positive(name, vars(self)[name], "Pa")
        for name in ("nu1", "nu2"):
            require(name, vars(self)[name], 0, 0.5)

    @property
    def G1(self) -> float:
        """Shear modulus of body 1, Pa."""
        return self.E1 / (2 * (1 + self.nu1))

    @property
    def G2(self) -> float:
        """Shear modulus of body 2, Pa."""
        return self.E2 / (2 * (1 + self.nu2))

    @property
    def E_star(self) -> float:
        """Combined modulus, Pa: 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2."""
        return 1 / ((1 - self.nu1**2) / self.E1 + (1 - self.nu2**2) / self.E2)

    @property
    def shear_compliance(self) -> float:
        """1/G1 + 1/G2, 1/Pa."""
        return 1 / self.G1 + 1 / self.G2

    @property
    def nu_tangential(self) -> float:
        """Poisson's ratio of the one body whose tangential compliance is that of both: the mean
        weighted by 1/G."""
        return (self.nu1 / self.G1 + self.nu2 / self.G2) / self.shear_compliance

    @property
    def dundurs_alpha(self) -> float:
        """Difference of stiffness, -1..1, positive when body 2 is the stiffer one."""
        a1, a2 = (1 - self.nu1) / self.G1, (1 - self.nu2) / self.G2
        return (a1 - a2) / (a1 + a2)

    @property
    def dundurs_beta(self) -> float:
        """Coupling of normal and tangential traction, -0.5..0.5; all stiffnesses here take it as
        zero."""
        a1, a2 = (1 - self.nu1) / self.G1, (1 - self.nu2) / self.G2
        return ((1 - 2 * self.nu1) / self.G1 - (1 - 2 * self.nu2) / self.G2) / (2 * (a1 + a2))


class Stiffness(NamedTuple):
    """Stiffness of the pair (compliances of both bodies added): N/m, or N/m2 where per unit length
    of a line."""

    normal: Values
    along: Values  # tangential, along the length (axis of the damper, t1)
    across: Values  # tangential, across it (t2)

    def scaled(self, factor: float) -> "Stiffness":
        """All three components times `factor`."""
        return Stiffness(*(component * factor for component in self))

    def in_series_with(self, other: "Stiffness") -> "Stiffness":
        """1/K = 1/K1 + 1/K2, component by component."""
        return Stiffness(*(1 / (1 / a + 1 / b) for a, b in zip(self, other, strict=True)))
