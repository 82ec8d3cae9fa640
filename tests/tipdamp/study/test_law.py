"""[respond] law: any shipped law by name, with its parameters."""

import pytest

from tests.hbm.conformance import required
from tests.tipdamp import corner_study
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws import SHIPPED, CubicSpring
from tipdamp.study.study import load_study


def law_of(folder, text):
    return load_study(
        corner_study.write(folder, change=[("[respond]", f"[respond]\nlaw = {text}")])
    ).respond.law


@pytest.mark.parametrize("name", SHIPPED)
def test_laws_by_name(tmp_path, name):
    needed = required(SHIPPED[name])
    table = ", ".join((f'name = "{name}"', *(f"{key} = {value}" for key, value in needed.items())))
    chosen = law_of(tmp_path, f"{{ {table} }}" if needed else f'"{name}"')
    assert chosen.make() == SHIPPED[name](**needed) and chosen.meaning
    assert chosen.meaning.endswith(".") and chosen.meaning.count("[") == chosen.meaning.count("]")


def test_default_and_parameters(tmp_path):
    assert load_study(corner_study.write(tmp_path)).respond.law.make() == SHIPPED["DryFriction2T"]()
    assert law_of(tmp_path, '{ name = "CubicSpring", cubic = 1e12 }').make() == CubicSpring(1e12)


@pytest.mark.parametrize(
    "text, words",
    [
        (
            '"Coulomb"',
            r"\[respond\] law = 'Coulomb': no law 'Coulomb'; .*valid: Jenkins1D, .*DryFriction2T",
        ),
        ('"IsotropicFricton"', "did you mean 'IsotropicFriction'"),
        ("3", "must be the name of a law, or a table"),
        ("{ cubic = 1.0 }", "must be the name of a law, or a table"),
        ('"CubicSpring"', "the parameter 'cubic' of CubicSpring is missing"),
        (
            '{ name = "CubicSpring", cubc = 1 }',
            "CubicSpring has no parameter 'cubc'; did you mean 'cubic'",
        ),
        ('{ name = "CubicSpring", cubic = "much" }', "cubic must be a number"),
        ('{ name = "CubicSpring", cubic = inf }', "cubic must be finite"),
        (
            '{ name = "DryFriction2T", mu = 0.3 }',
            "DryFriction2T has no parameter 'mu'; there are none to choose from",
        ),
    ],
)
def test_wrong_laws_are_one_line(tmp_path, text, words):
    with pytest.raises(InputError, match=words) as caught:
        law_of(tmp_path, text)
    assert "corner.toml: [respond] law" in str(caught.value) and "\n" not in str(caught.value)
