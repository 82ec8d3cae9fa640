"""Every public name has an example in its docstring, and the example holds.

An example may use `np` and every name of `tipdamp` without an import. It runs in a folder of its
own.
"""

import doctest
import warnings

import numpy as np
import pytest

import tipdamp
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.example import two_blades

KNOWN = {"np": np} | {name: getattr(tipdamp, name) for name in tipdamp.__all__}
MOST = 10  # statements: an example is no program


def example_of(name, doc):
    return doctest.DocTestParser().get_doctest(doc, dict(KNOWN), name, name, 0)


def failures(example):
    """What its runner says of the statements that do not give what stands there; empty where all
    do."""
    said: list[str] = []
    doctest.DocTestRunner(verbose=False).run(example, out=said.append)
    return "".join(said)


@pytest.mark.parametrize("name", tipdamp.__all__)
def test_example_of(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    example = example_of(name, KNOWN[name].__doc__)
    assert 0 < len(example.examples) <= MOST
    assert any(name in one.source or name in one.want for one in example.examples)
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)  # an example shows what is meant
        assert failures(example) == ""


def test_example_of_the_small_model():
    example = example_of("two_blades", two_blades.__doc__)
    example.globs["two_blades"] = two_blades
    assert example.examples and failures(example) == ""


def test_an_example_that_does_not_hold_is_seen():
    assert "Expected:\n    3" in failures(example_of("none", ">>> 1 + 1\n3\n"))


def test_small_model_has_stations():
    with pytest.raises(InputError, match="stations = 0: must be 1 or more"):
        two_blades(0)
