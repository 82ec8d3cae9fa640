"""NLvib's matrix of solutions, built here from its definition, and back."""

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat
from scipy.optimize import fsolve

from tipdamp import CubicSpring, InputError, Problem
from tipdamp.hbm.io.nlvib import from_nlvib, read_nlvib, to_nlvib

M, D = np.diag([1.0, 0.05]), np.array([[0.015, -0.013], [-0.013, 0.013]])
K = np.array([[1.0453, -0.0453], [-0.0453, 0.0453]])
CUBIC, FORCE, H = 1.0, np.array([0.11, 0.0]), 3
PAGE = Path(__file__).parents[3] / "docs" / "coming_from.md"


def balanced(omega):
    """Unknowns of the chain with a cubic spring in NLvib's order: the mean of both dofs, then
    cosine and sine of each order; by sums over instants and scipy's solver."""
    t = np.arange(64) * 2 * np.pi / 64  # W t

    def parts(x):
        mean, rest = x[:2], x[2:].reshape(H, 2, 2)  # order, cosine and sine, dof
        angles = np.outer(np.arange(1, H + 1), t)
        return mean, rest[:, 0], rest[:, 1], np.cos(angles), np.sin(angles)

    def residual(x):
        mean, cosine, sine, c, s = parts(x)
        order = omega * np.arange(1, H + 1)[:, None]
        q = mean[:, None] + cosine.T @ c + sine.T @ s
        v = (order * sine).T @ c - (order * cosine).T @ s
        a = -(order**2 * cosine).T @ c - (order**2 * sine).T @ s
        left = M @ a + D @ v + K @ q - np.outer(FORCE, np.cos(t))
        left[0] += CUBIC * q[0] ** 3
        along = [left.mean(axis=1)]
        for k in range(H):
            along += [2 * (left * c[k]).mean(axis=1), 2 * (left * s[k]).mean(axis=1)]
        return np.concatenate(along)

    start = np.zeros(2 * (2 * H + 1))
    linear = np.linalg.solve(K - omega**2 * M + 1j * omega * D, FORCE)
    start[2:6] = np.r_[linear.real, -linear.imag]
    return fsolve(residual, start, xtol=1e-13)


def test_solutions_are_those_of_the_same_oscillator(tmp_path):
    """Read from a .mat file, against curves of our own."""
    omegas = [0.5, 0.7, 1.6]
    X = np.column_stack([np.r_[balanced(w), w] for w in omegas])
    savemat(tmp_path / "X.mat", {"X_HB": X, "H": H})
    found = read_nlvib(tmp_path / "X.mat", H)
    assert found.hz == pytest.approx(np.array(omegas) / (2 * np.pi), rel=1e-15)
    chain = Problem(M, D, K).add(CubicSpring(CUBIC), 0).force(0, FORCE[0])
    for hz, harmonics in zip(*found, strict=True):
        ours = chain.solve_at(hz, outputs={"a": 0, "b": 1}, harmonics=H)
        assert harmonics == pytest.approx(ours.harmonics, abs=1e-9)


def test_motions_are_the_same_at_every_instant():
    """With a mean, and any phase."""
    rng = np.random.default_rng(1)
    dofs, w, t = 3, 2.7, np.linspace(0, 3, 11)
    mean, cosine, sine = rng.normal(size=dofs), *rng.normal(size=(2, H, dofs))
    column = [mean]
    for k in range(H):
        column += [cosine[k], sine[k]]
    X = np.r_[np.concatenate(column), w]
    (hz,), (harmonics,) = from_nlvib(X, H)
    angles = np.outer(np.arange(1, H + 1), w * t)
    motion = mean[:, None] + cosine.T @ np.cos(angles) + sine.T @ np.sin(angles)
    ours = (harmonics @ np.exp(2j * np.pi * hz * np.outer(np.arange(H + 1), t))).real
    assert ours == pytest.approx(motion, abs=1e-13)
    assert to_nlvib([hz], harmonics[None])[:, 0] == pytest.approx(X, rel=1e-15)


@pytest.mark.parametrize(
    "X, words",
    [
        (np.zeros((16, 2)), r"X has 16 rows, with harmonics = 3 it must have dofs \* 7 \+ 1"),
        (np.full((15, 1), np.nan), "not finite"),
        ("X", "must be real numbers"),
        (-np.ones((15, 2)), r"X, solution 1: the angular frequency in its last row is -1: must be"),
        (np.zeros(15), r"X, solution 1: .* is 0: must be greater than 0"),
    ],
)
def test_what_is_no_such_matrix(X, words):
    with pytest.raises(InputError, match=words):
        from_nlvib(X, H)


def test_files_that_cannot_be_read(tmp_path):
    (tmp_path / "no.mat").write_text("no")
    savemat(tmp_path / "other.mat", {"X": np.zeros((15, 1))})
    for name, words in [
        ("gone.mat", "file not found"),
        ("no.mat", "is no .mat file"),
        ("other.mat", "has no variable 'X_HB'"),
    ]:
        with pytest.raises(InputError, match=words):
            read_nlvib(tmp_path / name, H)


def test_the_page_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    for block in re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL):
        exec(compile(block, str(PAGE), "exec"), names)
    assert names
