"""Nonlinear forces that are no contact: their conformance, and their response beside time
integration."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.laws import Contacts, CubicSpring, DryFriction1T, PlainForce, UnilateralSpring
from tipdamp.hbm.response import solve_at
from tipdamp.hbm.testing import check_force, check_law


@dataclass(frozen=True)
class Square(PlainForce):
    """f = a u^2 on one coordinate."""

    components: ClassVar[tuple] = ("t1",)

    a: float | np.ndarray = 1.0

    def force(self, u, v):
        return np.reshape(self.a, (-1, 1)) * u**2


class Coupled(PlainForce):
    """The gradient of u1^2 u2 + u2^3."""

    components: ClassVar[tuple] = ("t1", "t2")

    def force(self, u, v):
        return np.stack([2 * u[:, 0] * u[:, 1], u[:, 0] ** 2 + 3 * u[:, 1] ** 2], axis=1)


class VanDerPol(PlainForce):
    components: ClassVar[tuple] = ("t1",)

    def force(self, u, v):
        return (u**2 - 1) * v


class OneSided(PlainForce):
    components: ClassVar[tuple] = ("t2",)

    def force(self, u, v):
        return np.where(u.real > 0.3, u - 0.3, 0 * u)


class _NotAnalytic(PlainForce):
    components: ClassVar[tuple] = ("n",)

    def force(self, u, v):
        return np.abs(u)


class _OfTheStep(PlainForce):
    components: ClassVar[tuple] = ("n",)

    def step(self, motion, state, contacts):
        return motion.u * motion.dt, state


class _OtherHarmonics(Square):
    def harmonics(self, contacts, x, *rest):
        return super().harmonics(contacts, 1.01 * x, *rest)


@pytest.mark.parametrize(
    "law",
    [
        Square(),
        Square(np.linspace(-2, 2, 12)),
        Coupled(),
        VanDerPol(),
        OneSided(),
        CubicSpring(np.linspace(-2, 2, 12)),
    ],
    ids=lambda law: law.name,
)
def test_forces_that_are_no_contact(law):
    check_force(law)


@pytest.mark.parametrize(
    "law, message",
    [
        (UnilateralSpring(), "depends on kn, kt, mu or preload.*check_law"),
        (DryFriction1T(), "has no state, states = 3"),
        (_OfTheStep(), "length of the step"),
        (_NotAnalytic(), "analytic"),
        (_OtherHarmonics(), "differ from those of step"),
    ],
    ids=lambda v: getattr(v, "name", ""),
)
def test_what_is_no_plain_force_is_found(law, message):
    with pytest.raises(AssertionError, match=message):
        check_force(law)


def test_a_contact_prefers_no_direction():
    """The conformance of contacts names the other one."""
    with pytest.raises(
        AssertionError,
        match="mirrored tangential forces .*that is no contact is a PlainForce",
    ):
        check_law(Square())


@pytest.mark.slow
@pytest.mark.parametrize(
    "law, F", [(Square(0.3), [0.1]), (Coupled(), [0.02, 0.01])], ids=["square", "coupled"]
)
def test_response_beside_time_integration(law, F):
    """x'' + c x' + x + f(x) = F cos w t: the mean and the harmonics are those of scipy's orbit."""
    w, nd, F, one = 0.7, len(F), np.array(F), np.eye(len(F))
    problem = ContactProblem(one, 0.1 * one, one, one, law, Contacts([0.0], [0.0], [0.0], [0.0]))
    found = solve_at(
        problem,
        F,
        w / (2 * np.pi),
        harmonics=9,
        outputs={f"x{i}": row for i, row in enumerate(one)},
    )
    period, n = 2 * np.pi / w, 256

    def rate(t, y):
        x, v = y[:nd], y[nd:]
        return np.r_[v, F * np.cos(w * t) - 0.1 * v - x - law.force(x[None], v[None])[0]]

    t = period * (30 + np.arange(n) / n)
    x = solve_ivp(rate, (0, 31 * period), np.zeros(2 * nd), t_eval=t, rtol=1e-9, atol=1e-11).y[:nd]
    harmonics = np.fft.rfft(x)[:, :3] * np.r_[1, 2, 2] / n
    assert found.converged and np.abs(harmonics[:, 0]).max() > 1e-4
    assert found.harmonics[:, :3] == pytest.approx(harmonics, rel=1e-4, abs=1e-6)


class Pull(PlainForce):
    """A constant pull."""

    components: ClassVar[tuple] = ("t1",)

    def force(self, u, v):
        return 0.5 + 0 * u


@pytest.mark.parametrize("preloaded, mean", [(True, 0.0), (False, -0.25)])
def test_a_force_at_rest_acts_where_no_static_load_is_implied(preloaded, mean):
    """On a spring of 2 N/m."""
    problem = ContactProblem(
        [[1.0]], [[0.1]], [[2.0]], [[1.0]], Pull(), Contacts([0], [0], [0], [0]), None, preloaded
    )
    found = solve_at(problem, np.array([0.3]), 0.1, outputs={"x": [1.0]}, harmonics=1)
    assert found.harmonics[0, 0].real == pytest.approx(mean, abs=1e-12)
