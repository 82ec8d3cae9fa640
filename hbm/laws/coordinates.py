"""Forces on any number of coordinates that are no contact: polynomials, and functions of one's own.

A law of these acts on coordinates q1, q2, ... which `Problem.add` is told: dofs, differences of
dofs, or rows.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws.force import PlainForce
from tipdamp.hbm.laws.records import Contacts, Motion, Tangents
from tipdamp.hbm.validation import brief, check_call, check_whole, numbers


class CoordinateForce(PlainForce):
    """Base of forces on as many coordinates as `size` says."""

    size: int

    @property
    def components(self) -> tuple[str, ...]:  # type: ignore[override]
        """q1, q2, ..."""
        return tuple(f"q{i + 1}" for i in range(self.size))


@dataclass(frozen=True)
class Polynomial(CoordinateForce):
    """f_i = sum of coefficients_i q1^a q2^b ..., with the same terms for all coordinates.

    terms : {exponents (a, b, ...): coefficients (one for each coordinate)}, N/m^(a + b + ...)
    Exact with more samples than twice the harmonics times the degree and one.
    Raises InputError where the terms do not fit each other.

    >>> mixed = Polynomial({(2, 1): (0.0, 3.0), (1, 2): (3.0, 0.0)})  # of the energy 3/2 q1^2 q2^2
    >>> print(mixed.force(np.array([[2.0, 1.0]]), None))
    [[ 6. 12.]]
    >>> pair = Problem(np.eye(2), 0.02 * np.eye(2), np.diag([1.0, 4.0])).force(0, 0.1)
    >>> pair.add(mixed, [0, 1]).follow_band((0.1, 0.2), outputs={"q1": 0}).complete
    True
    """

    terms: Mapping[tuple[int, ...], Sequence[float]]

    def __post_init__(self) -> None:
        try:
            given = {tuple(a): tuple(map(float, c)) for a, c in dict(self.terms).items()}
        except (TypeError, ValueError):
            given = {}
        sizes = {len(one) for pair in given.items() for one in pair}
        if len(sizes) != 1 or 0 in sizes:
            raise InputError(
                f"Polynomial: terms = {brief(self.terms)}: must be {{exponents: coefficients}}, "
                "each with one number for each coordinate"
            )
        for exponents, coefficients in given.items():
            for one in exponents:
                check_whole(f"Polynomial: exponent of {exponents}", one, 0)
            if not np.isfinite(coefficients).all():
                raise InputError(f"Polynomial: coefficients of {exponents} must be finite")
        object.__setattr__(self, "terms", tuple(given.items()))

    @property
    def size(self) -> int:  # type: ignore[override]
        """Number of coordinates."""
        return len(dict(self.terms).popitem()[0])

    def force(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(P, size) N."""
        return sum(
            np.prod([u[:, [j]] ** e for j, e in enumerate(exponents) if e], axis=0)
            * np.array(coefficients)
            + 0 * u
            for exponents, coefficients in dict(self.terms).items()
        )


@dataclass(frozen=True)
class OwnForce(CoordinateForce):
    """A force of one's own on any number of coordinates.

    function : of (u, v), each (n, size) m and m/s, that gives (n, size) N: n motions at once
    size : number of coordinates
    derivative : of (u, v), that gives the derivatives by u and by v, each (n, size, size); None
        takes them by the complex step, for which the function must be analytic (no abs) and take
        complex numbers
    Raises InputError where these are none; derivatives that are not those of the function are
    refused at the begin of a curve.

    >>> van_der_pol = OwnForce(lambda u, v: 0.5 * (u**2 - 1) * v, 1)
    >>> driven = Problem([[1.0]], [[0.0]], [[1.0]]).add(van_der_pol, 0).force(0, 3.0)
    >>> driven.solve_at(0.25, outputs={"x": 0}).converged
    True
    """

    function: Callable
    size: int = 1
    derivative: Callable | None = None

    def __post_init__(self) -> None:
        check_whole("OwnForce: size", self.size, 1)
        for name in ("function", "derivative"):
            given = vars(self)[name]
            if not callable(given) and not (name == "derivative" and given is None):
                raise InputError(
                    f"OwnForce: {name} = {brief(given)}: must be a function of (u, v), each "
                    f"(n, {self.size})"
                )
            if given is not None:
                check_call(f"OwnForce: {name}", given, "u", "v")

    def force(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(P, size) N."""
        return self.function(u, v)

    def tangents(
        self, motion: Motion, state: np.ndarray, contacts: Contacts
    ) -> tuple[np.ndarray, np.ndarray, Tangents]:
        """As in `ContactLaw`, by the derivative where it is given."""
        if self.derivative is None:
            return super().tangents(motion, state, contacts)
        n, size = np.shape(motion.u)
        given = self.derivative(motion.u, motion.v)
        pair = isinstance(given, tuple | list) and len(given) == 2
        each = [np.shape(one) for one in given] if pair else [np.shape(given)]
        if not pair or set(each) != {(n, size, size)}:
            raise InputError(
                f"OwnForce: derivative gives {' and '.join(map(str, each))}, must be two of "
                f"(n, {size}, {size}): by u and by v"
            )
        by_u, by_v = (np.asarray(one, dtype=float) for one in given)
        others = (n, size, 0), (n, size), (n, 0, size), (n, 0, size), (n, 0, 0), (n, 0)
        tangents = Tangents(by_u, by_v, *map(np.zeros, others))  # without a state, nor by dt
        return self.force(motion.u, motion.v), state, tangents

    def check(self, contacts: Contacts) -> None:
        """InputError where the force at rest is none, or its derivative has another shape."""
        super().check(contacts)
        self.tangents(*self._rest(contacts))
        numbers("OwnForce: force at rest", self.force_at_rest(contacts), "must be real numbers")
        if not np.isfinite(self.force_at_rest(contacts)).all():
            raise InputError("OwnForce: the force at rest is not finite")
