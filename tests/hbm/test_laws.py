"""Conformance of the contact laws, and the located harmonics against the plain loop over small time steps."""

import os
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from hbm import aft, fourier, laws, located
from hbm.errors import InputError

ALL = [laws.Jenkins1D(), laws.DryFriction2T(), laws.UnilateralSpring()]
IDS = [law.name for law in ALL]
H = 5


def random_case(law, P=30, seed=0):
    rng = np.random.default_rng(seed)
    decay = (1 + np.r_[0, np.repeat(np.arange(1, H + 1), 2)]) ** 2
    x = rng.normal(size=(P, len(law.components), 2 * H + 1)) / decay
    pairs = laws.PairSettings(kn=rng.uniform(0.5, 2, P), kt=rng.uniform(0.5, 2, P), mu=rng.uniform(0.1, 0.8, P),
                              preload=rng.uniform(-0.3, 1, P))
    return x, pairs, rng


def harmonics_by_small_steps(law, pairs, x, start, n=4000):
    tau = np.arange(2 * n + 1) * (2 * np.pi / n)
    u = x @ fourier.basis(tau, H).T
    slider = np.zeros((len(pairs), law.tangents)) if start == "zero_slider" else u[:, :law.tangents, 0]
    force = np.empty((*x.shape[:2], n))
    for i in range(2 * n):
        f, slider, _ = law.step(u[:, :, i], slider, pairs)
        if i >= n:
            force[:, :, i - n] = f
    F = force @ fourier.basis(tau[:n], H) * (2 / n)
    F[..., 0] /= 2
    return F


@pytest.mark.parametrize("start", aft.STARTS)
@pytest.mark.parametrize("law", ALL, ids=IDS)
def test_located_harmonics_are_those_of_the_plain_loop(law, start):
    x, pairs, _ = random_case(law)
    b = aft.evaluate(law, pairs, x, aft.slider_start(start, len(pairs), law.tangents), aft.sample_grid(H, 64))
    force = b.g + law.stuck_stiffness(pairs)[:, :, None] * x
    if law.has_normal:
        force[:, -1, 0] += pairs.preload
    # steps of 2 pi/4000: an instant is missed by up to one step, the force by its square
    assert np.abs(force - harmonics_by_small_steps(law, pairs, x, start)).max() < 5e-4
    assert (b.shares.min(axis=0) >= -1e-12).all() and np.allclose(b.shares.sum(axis=1), 1)


@pytest.mark.parametrize("start", aft.STARTS)
@pytest.mark.parametrize("law", ALL, ids=IDS)
def test_result_does_not_depend_on_the_samples(law, start):
    x, pairs, _ = random_case(law)
    given = aft.slider_start(start, len(pairs), law.tangents)
    coarse, fine = (aft.evaluate(law, pairs, x, given, aft.sample_grid(H, n)).g for n in (64, 1024))
    assert np.abs(coarse - fine).max() < 1e-12 * np.abs(fine).max()


@pytest.mark.parametrize("start", aft.STARTS)
@pytest.mark.parametrize("law", ALL, ids=IDS)
def test_derivatives_by_differences(law, start):
    x, pairs, rng = random_case(law)
    given, grid = aft.slider_start(start, len(pairs), law.tangents), aft.sample_grid(H, 128)
    b = aft.evaluate(law, pairs, x, given, grid)
    D = np.zeros((*x.shape, *x.shape[1:]))
    D[b.pair] = b.D
    dx, dp, h = rng.normal(size=x.shape), rng.normal(size=len(pairs)), 1e-6
    numeric = (aft.evaluate(law, pairs, x + h * dx, given, grid).g
               - aft.evaluate(law, pairs, x - h * dx, given, grid).g) / (2 * h)
    assert np.abs(np.einsum("pijkl,pkl->pij", D, dx) - numeric).max() < 1e-6
    numeric = (aft.evaluate(law, replace(pairs, preload=pairs.preload + h * dp), x, given, grid).g
               - aft.evaluate(law, replace(pairs, preload=pairs.preload - h * dp), x, given, grid).g) / (2 * h)
    assert np.abs(b.by_preload * dp[:, None, None] - numeric).max() < 1e-6


@pytest.mark.parametrize("law", ALL, ids=IDS)
def test_step_tangents_by_differences(law):
    x, pairs, rng = random_case(law)
    u, slider = x[:, :, 0], 0.3 * rng.normal(size=(len(pairs), law.tangents))
    _, _, t = law.step(u, slider, pairs)
    h = 1e-7
    for k in range(u.shape[1]):
        e = np.eye(u.shape[1])[k] * h
        (fp, sp, _), (fm, sm, _) = law.step(u + e, slider, pairs), law.step(u - e, slider, pairs)
        assert np.abs((fp - fm) / (2 * h) - t.force_u[:, :, k]).max() < 1e-6
        assert np.abs((sp - sm) / (2 * h) - t.slider_u[:, :, k]).max(initial=0) < 1e-6
    for k in range(law.tangents):
        e = np.eye(law.tangents)[k] * h
        (fp, sp, _), (fm, sm, _) = law.step(u, slider + e, pairs), law.step(u, slider - e, pairs)
        assert np.abs((fp - fm) / (2 * h) - t.force_slider[:, :, k]).max() < 1e-6
        assert np.abs((sp - sm) / (2 * h) - t.slider_slider[:, :, k]).max() < 1e-6


def test_friction_stays_in_the_cone_and_open_is_zero():
    law = laws.DryFriction2T()
    x, pairs, _ = random_case(law, P=50)
    u = x @ fourier.basis(np.linspace(0, 4 * np.pi, 800), H).T
    slider = np.zeros((50, 2))
    for i in range(800):
        f, slider, _ = law.step(u[:, :, i], slider, pairs)
        assert (np.abs(f[:, :2]) <= pairs.mu[:, None] * f[:, 2:] * (1 + 1e-12)).all()
        is_open = pairs.preload + pairs.kn * u[:, 2, i] <= 0
        assert (f[is_open] == 0).all()
        assert np.array_equal(slider[is_open], u[is_open, :2, i])     # on re-contact it starts where it is


def test_stuck_is_a_spring():
    law = laws.DryFriction2T()
    pairs = laws.PairSettings([2.0], [3.0], [0.5], [10.0])
    f, slider, _ = law.step(np.array([[0.1, -0.2, 0.3]]), np.zeros((1, 2)), pairs)
    assert np.allclose(f, [[0.3, -0.6, 10.6]]) and (slider == 0).all()


def test_energy_of_a_jenkins_cycle_in_closed_form():
    """4 L (X - L/kt) per cycle, the area of the parallelogram."""
    kt, L, X = 2.0, 0.3, 1.0
    law, pairs = laws.Jenkins1D(), laws.PairSettings([0.0], [kt], [1.0], [L])
    x = np.zeros((1, 1, 3))
    x[0, 0, 1] = X
    b = aft.evaluate(law, pairs, x, aft.slider_start("zero_slider", 1, 1), aft.sample_grid(1, 64))
    g = fourier.to_complex(b.g)[0, 0, 1]
    assert np.pi * (g * X).imag == pytest.approx(4 * L * (X - L / kt), rel=1e-12)


def test_turned_tangents_give_turned_forces():
    """t1, t2 -> -t1, -t2 and t1 <-> t2 are symmetries of two uncoupled tangents."""
    law = laws.DryFriction2T()
    x, pairs, _ = random_case(law)
    given, grid = aft.slider_start("zero_slider", len(pairs), 2), aft.sample_grid(H, 64)
    g = aft.evaluate(law, pairs, x, given, grid).g
    assert np.allclose(aft.evaluate(law, pairs, x[:, [1, 0, 2]], given, grid).g, g[:, [1, 0, 2]], atol=1e-13)
    sign = np.array([-1.0, -1, 1])[:, None]
    assert np.allclose(aft.evaluate(law, pairs, sign * x, given, grid).g, sign * g, atol=1e-13)


def test_excursions_inside_one_sample_are_found():
    """Open for 2 % of the cycle, between two of eight samples."""
    law, pairs = laws.UnilateralSpring(), laws.PairSettings([1.0], [0.0], [0.0], [1.0])
    x = np.zeros((1, 1, 3))
    turn = 2 * np.pi * 4.5 / 8
    amplitude = 1 / np.cos(np.pi * 0.02)
    x[0, 0, 1:] = -amplitude * np.cos(turn), amplitude * np.sin(turn)
    b = aft.evaluate(law, pairs, x, aft.slider_start("zero_slider", 1, 0), aft.sample_grid(1, 8))
    assert b.shares[0, 2] == pytest.approx(0.02, rel=1e-10)


@pytest.mark.parametrize("column", ["kn", "kt", "mu"])
def test_negative_settings_are_refused(column):
    values = dict(kn=[1.0], kt=[1.0], mu=[0.5], preload=[1.0]) | {column: [-1.0]}
    with pytest.raises(InputError, match=column):
        laws.PairSettings(**values)


def test_compilation_is_announced_where_no_compiled_kernel_is_newer_than_its_source(tmp_path, caplog):
    source = Path(located.__file__)
    kernel = SimpleNamespace(py_func=located.brackets.py_func, stats=SimpleNamespace(cache_path=tmp_path))
    aft._announce_compilation(kernel)
    assert "compiling the contact kernels" in caplog.text
    caplog.clear()
    stored = tmp_path / "located.brackets-1.py311.nbi"
    stored.touch()
    os.utime(stored, (source.stat().st_mtime + 5,) * 2)
    aft._announce_compilation(kernel)
    assert not caplog.text
