"""The benchmark's beam with 8 contacts is the reference's; with more it has the same totals, on
dofs of their own."""

import numpy as np
import pytest
import scipy.linalg as sl

from tests.benchmarks import contact_beam
from tests.hbm.cases import beam


@pytest.mark.parametrize(("name", "make"), [("B8", contact_beam.plane), ("C8", contact_beam.space)])
def test_eight_contacts_are_those_of_the_reference(name, make):
    ours, force, outputs = make(8)
    theirs, known_force, known_outputs = beam(name)
    masters = ours.B.shape[0]  # modes may come with either sign
    for matrix in ("M", "K", "C"):
        found, known = getattr(ours, matrix), getattr(theirs, matrix)
        scale = np.abs(known[:masters, :masters]).max()
        assert np.abs(found - known)[:masters, :masters].max() < 1e-8 * scale, matrix
    assert np.allclose(ours.B[:, :masters], theirs.B[:, :masters], atol=1e-12)
    assert np.array_equal(force, known_force) and np.array_equal(
        outputs["tip"], known_outputs["tip"]
    )
    assert np.allclose(ours.contacts.preload, theirs.contacts.preload, rtol=1e-12)
    assert np.allclose(ours.contacts.kt, theirs.contacts.kt) and np.allclose(
        ours.contacts.kn, theirs.contacts.kn
    )
    hz = [np.sqrt(sl.eigh(p.K, p.M, eigvals_only=True))[:8] / (2 * np.pi) for p in (ours, theirs)]
    assert np.allclose(*hz, rtol=1e-9)


@pytest.mark.parametrize("n", [32, 256])
def test_every_contact_has_a_dof_of_its_own(n):
    problem, force, outputs = contact_beam.plane(n)
    rows, columns = np.nonzero(problem.B)
    assert np.array_equal(rows, np.arange(n)) and len(set(columns)) == n
    assert problem.contacts.preload.sum() == pytest.approx(
        100
    ) and problem.contacts.kt.sum() == pytest.approx(1e6)
    first = np.sqrt(sl.eigh(problem.K, problem.M, eigvals_only=True)[0]) / (2 * np.pi)
    assert first == pytest.approx(835.517, rel=1e-5)  # free_hz of model_B8.npz
