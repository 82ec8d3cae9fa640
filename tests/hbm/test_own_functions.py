"""Functions of the user's own that cannot be called as they will be: one line that says how."""

import numpy as np
import pytest

from tipdamp import (
    ContactLaw,
    Contacts,
    ForceParameter,
    InputError,
    Jenkins1D,
    ModelParameter,
    OwnForce,
    Parameter,
    PlainForce,
    Problem,
    check_force,
    check_law,
    follow_parameter,
)
from tipdamp.hbm.testing import forces

ROW = {"tip": [1.0]}


class NoContacts(ContactLaw):
    components = ("t1",)

    def step(self, motion, state):
        return motion.u, state


class NoStart(ContactLaw):
    components = ("t1",)

    def step(self, motion, state, contacts):
        return motion.u, state

    def initial_state(self, u):
        return u[:, :0]


class NoVelocity(PlainForce):
    components = ("n",)

    def force(self, u):
        return u


class NoValue(Parameter):
    name = "mine"

    def rebuild(self, problem):
        return problem, {}


def blade():
    return Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)


def sliding():
    return blade().add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0)


def followed(parameter):
    return follow_parameter(sliding(), [5.0], 860, parameter, (0.1, 1), outputs=ROW)


@pytest.mark.parametrize(
    "call, names",
    [
        (lambda: blade().add(NoContacts(), 0), "law NoContacts: step"),
        (lambda: check_law(NoContacts()), "law NoContacts: step"),
        (lambda: blade().add(NoStart(), 0), "law NoStart: initial_state"),
        (lambda: blade().add(NoVelocity(), 0), "law NoVelocity: force"),
        (lambda: check_force(NoVelocity()), "law NoVelocity: force"),
        (lambda: OwnForce(lambda u: u), "OwnForce: function"),
        (lambda: OwnForce(lambda u, v: u, 1, lambda u: u), "OwnForce: derivative"),
        (lambda: blade().force(0, lambda: 1.0), "force: its amplitude"),
        (lambda: blade().base_motion([1.0], lambda a, b: 1.0), "base_motion: its amplitude"),
        (
            lambda: sliding().of_speed(K=lambda: np.eye(1)).solve_at(700, outputs=ROW),
            "of_speed: K",
        ),
        (lambda: followed(NoValue()), "parameter 'mine': rebuild"),
        (lambda: followed(ModelParameter("k", lambda k: k)), "parameter 'k': of_value"),
        (lambda: followed(ForceParameter("a", lambda: 1.0)), "parameter 'a': of_value"),
        (
            lambda: sliding().follow_band((600, 900), outputs=ROW, progress=lambda hz: None),
            "progress",
        ),
    ],
)
def test_another_number_of_arguments(call, names):
    with pytest.raises(InputError, match="cannot be called with") as error:
        call()
    assert str(error.value).startswith(names) and "\n" not in str(error.value)


def test_what_takes_more_by_default_is_called():
    assert OwnForce(lambda u, v, scale=2.0: scale * u).size == 1
    assert OwnForce(np.subtract).size == 1  # whose arguments nobody states


def test_a_part_of_a_curve_is_a_list_of_its_points():
    curve = sliding().follow_band((600, 900), outputs=ROW, harmonics=1)
    assert [one.frequency for one in curve[1:4]] == [curve[k].frequency for k in (1, 2, 3)]
    assert curve[5:5] == [] and len(curve[-2:]) == 2


@pytest.mark.parametrize("samples", [64, 256])
def test_a_given_derivative_is_the_one_that_counts(samples):
    """Of |u| u the complex step finds |u|, half of the slope."""
    law = OwnForce(
        lambda u, v: np.abs(u) * u,
        derivative=lambda u, v: (2 * np.abs(u)[:, :, None], np.zeros((*u.shape, 1))),
    )
    x = np.array([[[0.0, 1.0, 0.0]]])
    none = Contacts(kn=[0], kt=[0], mu=[0], preload=[0])
    found = forces(law, none, x, samples=samples)
    # of |cos| cos: 8 / (3 pi) at order 1; its derivative by the amplitude is twice that
    assert found.g[0, 0, 1] == pytest.approx(8 / (3 * np.pi), rel=1e-3)
    assert found.D[0, 0, 1, 0, 1] == pytest.approx(16 / (3 * np.pi), rel=1e-3)
