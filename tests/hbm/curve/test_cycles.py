"""Hysteresis loops and energies of solved points."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh

from tests.hbm.cases import beam, load, rig, unilateral
from tests.hbm.conformance import SteppedFriction, random_case
from tests.hbm.curve.test_sharp_peaks import duffing
from tests.hbm.oscillator import FORCE, oscillator
from tipdamp import (
    Contacts,
    DryFriction2T,
    IsotropicFriction,
    Jenkins1D,
    Problem,
    contact_cycles,
    energy_balance,
)
from tipdamp.hbm import fourier
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.response import follow_band
from tipdamp.hbm.testing import forces

LIMIT, KT = 2.0, 3.0


def jenkins():
    return ContactProblem(
        np.eye(1),
        np.array([[0.02]]),
        np.eye(1),
        np.eye(1),
        Jenkins1D(),
        Contacts([0], [KT], [1], [LIMIT]),
    )


def peak_of(problem, force, band, H):
    r = len(problem.K)
    curve = follow_band(
        problem, force, band, harmonics=H, outputs={f"q{i}": row for i, row in enumerate(np.eye(r))}
    )
    assert curve.complete
    return curve, int(np.argmax(np.nansum(curve.dissipated, axis=1)))


def test_loop_of_a_slipping_jenkins_element():
    """A parallelogram: work 4 mu N (U - mu N / kt) per period of a motion of amplitude U (Griffin
    1980)."""
    curve, i = peak_of(jenkins(), np.array([2.0]), (0.1, 0.5), 1)
    cycle, U = contact_cycles(curve, jenkins(), i), abs(curve.harmonics[i, 0, 1])
    assert U > LIMIT / KT and cycle.components == ("t1",)
    np.testing.assert_allclose(cycle.friction_work, [4 * LIMIT * (U - LIMIT / KT)], rtol=1e-6)
    np.testing.assert_allclose([cycle.force.max(), cycle.force.min()], [LIMIT, -LIMIT], rtol=1e-12)
    np.testing.assert_allclose(cycle.motion[-1], cycle.motion[0], atol=1e-12 * U)
    np.testing.assert_allclose(cycle.force[-1], cycle.force[0])
    slope = np.diff(cycle.force[:, 0, 0]) / np.diff(cycle.motion[:, 0, 0])
    stuck = np.abs(cycle.force[:-1, 0, 0]) < 0.9 * LIMIT
    np.testing.assert_allclose(slope[stuck][1:-1], KT, rtol=1e-6)


CASES = {
    "jenkins": (jenkins(), np.array([2.0]), (0.1, 0.5), 9),
    "C1": (*unilateral(load("C1")["parameters"]), (0.1, 0.3), 7),
    "C8": (beam("C8")[0], 40 * beam("C8")[1], (700, 1200), 5),
    "oscillator": (oscillator(0.4, 2e6, 5e7), FORCE, (150, 300), 5),
    "Duffing": (duffing(0.03), np.array([0.2]), (0.08, 0.5), 3),
}


@pytest.mark.parametrize("name", CASES)
def test_energy_of_a_period_is_balanced(name):
    """What the excitation puts in is lost in the damping and in the slip of the contacts,
    integrated apart."""
    problem, force, band, H = CASES[name]
    curve, peak = peak_of(problem, force, band, H)
    assert curve.energy_error.max() < 1e-6
    for i in {0, len(curve.frequency) // 2, peak}:
        found = energy_balance(curve, problem, i)
        stepped = contact_cycles(curve, problem, i).friction_work
        assert (
            found.input > 0 and found.damping >= 0 and (found.friction >= -1e-6 * found.input).all()
        )
        assert found.error == pytest.approx(curve.energy_error[i], abs=1e-8)
        assert replace(found, friction=stepped).error < 1e-6, (i, found, stepped)
        for friction in (found.friction, stepped):
            np.testing.assert_allclose(friction, curve.dissipated[i], atol=2e-6 * found.input)


def test_energy_by_samples():
    """Of sampled laws the work along the slip shows their error, which falls with the square of the
    samples."""
    law = SteppedFriction()
    x, pairs, _ = random_case(law, P=4, H=2, seed=3)
    found = [forces(law, pairs, x, samples=n) for n in (64, 256)]
    errors = [np.abs(f.work - fourier.work(f.g, x)).max() / f.work.max() for f in found]
    assert 8 * errors[1] < errors[0] < 1e-2 and errors[1] > 1e-8


def test_energy_of_coupled_friction():
    problem, force, _ = rig()
    curve = follow_band(
        replace(problem, law=IsotropicFriction()),
        12 * force,
        (2780, 2783),
        harmonics=3,
        outputs={"x": force},
    )
    assert (
        curve.complete
        and np.nanmax(curve.energy_error) < 1e-6
        and np.nanmax(curve.share_slip) > 0.1
    )


class Cheating(DryFriction2T):
    """Its harmonics are those of another friction coefficient than its slip."""

    def harmonics(self, contacts, x, start, grid, omega):
        other = super().harmonics(replace(contacts, mu=1.01 * contacts.mu), x, start, grid, omega)
        return replace(other, work=super().harmonics(contacts, x, start, grid, omega).work)


def test_energy_tells_slip_from_harmonics():
    problem, force, band, H = CASES["C8"]
    curve, _ = peak_of(replace(problem, law=Cheating()), force, band, H)
    assert np.nanmax(curve.energy_error) > 1e-3 and curve.force_residual.max() < 1e-8


class Watching(DryFriction2T):
    """Kernels are compiled anew for arrays that cannot be written to, as those of a curve."""

    def harmonics(self, contacts, x, start, grid, omega):
        assert x.flags.writeable and x.flags.c_contiguous
        return super().harmonics(contacts, x, start, grid, omega)


def test_kernels_are_compiled_once():
    problem, force, _, _ = CASES["C8"]
    watched = replace(problem, law=Watching())
    curve, i = peak_of(watched, force, (900, 910), 1)
    assert len(contact_cycles(curve, watched, i, n=16).time) == 17


def test_a_system_that_takes_nothing_is_balanced():
    """Neither damping nor friction: the input is rounding, and so is the error."""
    problem = replace(jenkins(), C=np.zeros((1, 1)))
    curve = follow_band(
        problem, np.array([0.1]), (0.1, 0.2), harmonics=3, outputs={"x": np.ones(1)}
    )
    assert curve.share_slip.max() == 0 and curve.energy_error.max() < 1e-6


def test_points_that_are_not_there():
    curve, _ = peak_of(jenkins(), np.array([2.0]), (0.1, 0.5), 1)
    for point in (-1, len(curve.frequency), 1.5):
        with pytest.raises(InputError, match="point"):
            contact_cycles(curve, jenkins(), point)
    with pytest.raises(InputError, match="n = 2"):
        contact_cycles(curve, jenkins(), 0, n=2)


def test_the_ratio_of_the_structure_in_a_motion():
    """Two masses: with the contact stuck the ratio of the modes, at the frequency of one; where it
    slips that of the matrices at the motion, ten times as much."""
    M, K = np.eye(2), np.diag([1.0, 20.0])
    contact = {"kt": 200.0, "mu": 1.0, "preload": 1e-3}
    ratios = []
    for level, band in ((1e-9, (0.45, 0.55)), (0.2, (0.1, 0.2))):
        problem = Problem(M=M, K=K, damping_ratio=0.01).add(Jenkins1D(), (0, 1), **contact)
        problem = problem.force(0, level)
        curve = problem.follow_band(band, outputs={"x": 0, "y": 1}, harmonics=1)
        point = int(curve.amplitude()[:, 0].argmax())
        energy = energy_balance(curve, problem, point)
        w, X = 2 * np.pi * curve.frequency[point], curve.harmonics[point, :, 1]
        stuck = K + 200.0 * np.array([[1, -1], [-1, 1]])
        squares, modes = eigh(stuck, M)
        C = M @ modes @ np.diag(2 * 0.01 * np.sqrt(squares)) @ modes.T @ M
        by_matrices = (X.conj() @ C @ X).real / (2 * w * (X.conj() @ M @ X).real)
        assert energy.damping_ratio == pytest.approx(by_matrices, rel=1e-7)
        ratios.append(energy.damping_ratio)
    assert ratios[0] == pytest.approx(0.01, rel=1e-3)
    assert ratios[1] > 0.1  # of 3.2 and 20 rad/s, vibrating at 1
