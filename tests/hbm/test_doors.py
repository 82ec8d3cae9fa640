"""Arguments that cannot be used, at every public function beside forced_response: one line, and
what is allowed."""

from dataclasses import dataclass, fields
from inspect import Parameter, signature
from typing import ClassVar, get_args, get_type_hints

import numpy as np
import pytest

from tests.hbm.cases import jenkins, load
from tests.hbm.small_rig import small_rig
from tests.hbm.test_extremes import F, X, problem
from tipdamp import (
    ContactProblem,
    Contacts,
    ContactSetting,
    CubicSpring,
    ForcedResponse,
    InputError,
    follow_band,
    follow_parameter,
)
from tipdamp.hbm.curve.options import CurveKeywords, CurveOptions
from tipdamp.hbm.curve.solutions import time_history
from tipdamp.hbm.laws import ContactLaw, Jenkins1D, MixedLaw
from tipdamp.hbm.problem import Problem
from tipdamp.hbm.response import forced_response, solve_at
from tipdamp.hbm.testing import check_law

ONE = {"x": [1.0]}


def of_law(law):
    """Curve of one dof with a contact that has a law."""
    one, nd = np.ones((1, 1)), len(law.components)
    contact = ContactProblem(
        one, 0.05 * one, one, np.ones((nd, 1)), law, Contacts([1.0], [1.0], [0.5], [1.0])
    )
    return follow_band(contact, [1.0], (0.1, 0.3), harmonics=3, outputs=ONE)


@pytest.mark.parametrize("content", ["text", "array", "objects", "nothing", "others"])
def test_load_of_another_file(content, tmp_path):
    path = tmp_path / "curve.npz"
    if content == "text":
        path.write_text("frequency 1 2 3")
    elif content == "array":
        with open(path, "wb") as f:
            np.save(f, np.zeros(3))
    elif content == "objects":
        np.savez(path, frequency=np.array([None, {}], dtype=object))
    elif content == "others":
        np.savez(path, frequency=np.zeros(3))
    else:
        path.touch()
    with pytest.raises(
        InputError, match=r"curve\.npz: is not a forced response as ForcedResponse\.save writes it"
    ):
        ForcedResponse.load(path)


@dataclass(frozen=True)
class NoStep(ContactLaw):
    components: ClassVar[tuple] = ("t1",)


@dataclass(frozen=True)
class Spring(ContactLaw):
    """A spring that stiffens; wrong : how its step is."""

    components: ClassVar[tuple] = ("t1",)
    wrong: str = ""

    def step(self, motion, state, contacts):
        u = motion.u
        amount = {"": np.sqrt(u * u), "abs": np.abs(u), "real": np.abs(u.real), "nan": np.nan * u}[
            self.wrong
        ]
        return contacts.kt[:, None] * (1 + amount) * u, state


def ordered(*names):
    """A law with these components."""
    return type("Ordered", (Spring,), {"components": names})()


def test_a_law_without_step():
    with pytest.raises(
        InputError, match=r"law NoStep has no step: define step\(self, motion, state, contacts\)"
    ):
        of_law(NoStep())


@pytest.mark.parametrize("names", [("n", "t1"), ("t1", "x"), ("t2", "t1", "n"), ("x", "x"), ()])
def test_components_of_a_law(names):
    with pytest.raises(
        InputError,
        match=r"law Ordered: components = \(.*\), must be of \('t1', 't2', 'n'\), in this",
    ):
        of_law(ordered(*names))


@pytest.mark.parametrize("wrong", ["abs", "real", "nan"])
@pytest.mark.parametrize("mixed", [False, True])
def test_wrong_derivatives_are_found_before_the_curve(wrong, mixed):
    """Newton's method would creep for minutes; one that is right is taken."""

    def law(wrong):
        return MixedLaw((Spring(wrong),), [0]) if mixed else Spring(wrong)

    said = r"tangents .*: entry \[\d+, \d\] is .*check_law tests the whole"
    if wrong == "nan":
        said = "force of step at rest is not finite"
    with pytest.raises(InputError, match=rf"law \w+: {said}"):
        of_law(law(wrong))
    assert of_law(law("")).complete


def test_numbers_of_check_law():
    """Which entry, what was found and expected, and what is allowed."""
    with pytest.raises(
        AssertionError, match=r"entry \[\d+, \d\] is \S+, expected \S+, allowed difference \S+"
    ):
        check_law(Spring("abs"))
    check_law(Jenkins1D())


@pytest.mark.parametrize("contacts", ["a", 0.5, [], [[0]], [0, None]])
def test_contacts_of_a_setting(contacts):
    with pytest.raises(InputError, match=r"contacts = .*: must be indices of contacts"):
        ContactSetting("kt", contacts)


def test_one_contact_of_a_setting():
    curves = [
        follow_parameter(
            problem(Jenkins1D()), F, 80.0, ContactSetting("kt", one), (1.0, 1.5), outputs=X
        )
        for one in (0, [0], np.array([0]))
    ]
    assert curves[0].complete and all(
        np.array_equal(c.harmonics, curves[0].harmonics) for c in curves
    )
    assert curves[0].parameter_name == "kt of contacts 0"
    for beyond in (1, -1):
        with pytest.raises(InputError, match="must be indices from 0 to 0"):
            follow_parameter(
                problem(Jenkins1D()), F, 80.0, ContactSetting("kt", beyond), (1.0, 1.5), outputs=X
            )


@pytest.mark.parametrize(
    "direction", ["y", [0, 1], 1.0, [0, np.nan, 0], None, [0, 1j, 0], [0, 0, 0], [[0, 1, 0]]]
)
def test_direction_of_a_row(direction):
    model = small_rig(stations=2)[0]
    with pytest.raises(
        InputError, match=r"direction = .*: must be three numbers, for example \[0, 1, 0\]"
    ):
        model.displacement_row("damper", int(model.node[model.body == "damper"][0]), direction)


@pytest.mark.parametrize(
    "named",
    [
        {"n": 0},
        {"n": -1},
        {"n": 2.5},
        {"n": "a"},
        {"which": "a"},
        {"which": 1.5},
        {"which": -1},
        {"which": None},
        {"n": True},
    ],
    ids=str,
)
def test_whole_numbers_of_a_time_history(named):
    contact, force = jenkins(load("A1")["parameters"])
    curve = follow_band(contact, force, (0.1, 0.2), harmonics=1, outputs=ONE)
    name, value = next(iter(named.items()))
    with pytest.raises(
        InputError, match=rf"time_history: {name} = {value!r}: must be a whole number, \d or more"
    ):
        time_history(curve, contact, "x", 0.15, **named)


def test_keywords_of_a_curve_are_typed():
    """Editors, type checkers and `help` know them by name at every function: they are the fields of
    the record."""
    names = {field.name for field in fields(CurveOptions)}
    assert CurveKeywords.__annotations__.keys() == names and CurveKeywords.__required_keys__ == {
        "outputs"
    }
    curves = (forced_response, follow_band, follow_parameter, solve_at)
    for function in (*curves, Problem.follow_band, Problem.solve_at):
        assert get_args(get_type_hints(function)["options"]) == (CurveKeywords,)
        shown = signature(function).parameters
        assert names < shown.keys() and shown["harmonics"].default == CurveOptions.harmonics
        assert shown["outputs"].default is Parameter.empty and "options" not in shown


@pytest.mark.parametrize(
    "given", [(np.eye(2), np.eye(2)), [np.eye(2), np.eye(2)], None, {"M": np.eye(2)}]
)
def test_matrices_without_contact_are_no_problem(given):
    """A pair of matrices, as other packages take, is refused with what makes a problem of it."""
    with pytest.raises(
        InputError, match=r"problem = .*: must be a Problem\(M, C, K\) with its contacts"
    ):
        follow_band(given, np.ones(2), (0.1, 0.2), harmonics=1, outputs={"x": [1.0, 0.0]})


def test_a_problem_is_told_in_one_line():
    """Not as its matrices."""
    chain = Problem(np.eye(200), np.eye(200), np.eye(200)).force(3, 1.0)
    assert repr(chain) == "<Problem of 200 dofs: linear, forces of orders 1>"
    assert "CubicSpring" in repr(chain.add(CubicSpring(1.0), 0))


def test_damping_that_feeds_energy_in_has_its_remedy():
    with pytest.raises(InputError, match="give general = True where it is meant"):
        _ = Problem([[1.0]], [[-0.1]], [[1.0]]).add(CubicSpring(1.0), 0).contact_problem
