"""Reference cases of tests/reference/hbm as ContactProblems, and one-line solvers for them."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from scipy.optimize import brentq

from tipdamp.hbm import fourier
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.curve.starts import first_point
from tipdamp.hbm.hold.named_motion import describe_motion
from tipdamp.hbm.laws import Contacts, CubicSpring, DryFriction2T, Jenkins1D, UnilateralSpring

REFERENCE = Path(__file__).parents[1] / "reference" / "hbm"


def load(case):
    return json.loads(next(REFERENCE.glob(f"{case}-*.json")).read_text())


def jenkins(p):
    """(problem, force) of the A files: one dof with a Jenkins element."""
    pairs = Contacts([0.0], [p["kt"]], [1.0], [p["slip_limit_muN"]])
    one = np.ones((1, 1))
    return ContactProblem(
        p["m"] * one, p["c"] * one, p["k"] * one, one, Jenkins1D(), pairs
    ), np.array([p["F"]])


MAX_HARMONICS = 199  # of B1: 200 are allowed


def den_hartog(known, H):
    """B1 at one frequency: [(kt/k, largest displacement, exact)], and the exponent of each decade
    of kt/k."""
    p = load("B1")["parameters"]
    rows = []
    for kt, expected in known["Jenkins_by_kt_over_k"].items():
        settings = dict(
            m=p["m"], c=p["c"], k=p["k"], kt=float(kt), slip_limit_muN=p["Ff"], F=p["P"]
        )
        problem, force = jenkins(settings)
        guess = None
        for orders in (*(n for n in (20, 60) if n < H), H):
            if guess is not None:  # the solution with fewer orders, the others zero
                guess = np.r_[guess, np.zeros(1 + 2 * orders - len(guess))]
            q, point, _ = solve(problem, force, known["Omega"], orders, guess=guess)
            guess = point.x
        largest = float(fourier.half_peak_to_peak(q[0]))
        rows.append((float(kt), largest, expected["xmax"]))
    kt, largest, _ = np.array(rows).T
    return rows, np.diff(np.log10(np.abs(largest / known["X_DenHartog"] - 1))) / np.diff(
        np.log10(kt)
    )


def unilateral(p):
    """(problem, force) of the C files: one dof on a preloaded or gapped unilateral spring."""
    pairs = Contacts([p["kn"]], [0.0], [0.0], [p["N0"]])
    one = np.ones((1, 1))
    return ContactProblem(
        p["m"] * one, p["c"] * one, p["k"] * one, one, UnilateralSpring(), pairs
    ), np.array([p["F"]])


def duffing(c, cubic=1.0):
    """m = k = 1 with a cubic spring."""
    return ContactProblem(
        np.eye(1),
        np.array([[c]]),
        np.eye(1),
        np.eye(1),
        CubicSpring(cubic=cubic),
        Contacts([0.0], [0.0], [0.0], [0.0]),
    )


def duffing_peak(c, F, cubic=1.0):
    """(rad/s, amplitude) of its peak at H = 1: (1 - w^2 + 3/4 cubic A^2)^2 + c^2 w^2 = (F/A)^2 is
    least there."""

    def w2(A):
        return 1 + 0.75 * cubic * A**2 - c**2 / 2

    A = brentq(lambda A: A**2 * (c**4 / 4 + c**2 * w2(A)) - F**2, 1e-6, 1e3, xtol=1e-14, rtol=1e-15)
    return np.sqrt(w2(A)), A


def coupled(p):
    """(problem, force) of the D files: tangential and normal contact; the second tangent is a zero
    row."""
    M, C, K = (np.array(p[k]) for k in "MCK")
    contacts = p["contacts"]
    B = np.vstack([np.vstack([c["bt"], np.zeros(len(M)), c["bn"]]) for c in contacts])
    pairs = Contacts(*[[c[k] for c in contacts] for k in ("kn", "kt", "mu", "N0")])
    return ContactProblem(M, C, K, B, DryFriction2T(), pairs), np.array(p["f_cos"]) - 1j * np.array(
        p["f_sin"]
    )


def beam(case):
    """(problem, force per newton, outputs) of the cantilever on eight contacts: 'B8' or 'C8'."""
    d = np.load(REFERENCE / f"model_{case}.npz")
    n = np.ones(len(d["N0"]))
    law = Jenkins1D() if case == "B8" else DryFriction2T()
    pairs = Contacts(0 * n if case == "B8" else d["kn"] * n, d["kt"] * n, d["mu"] * n, d["N0"])
    return ContactProblem(d["M"], d["C"], d["K"], d["Q"], law, pairs), d["fdir"], {"tip": d["out"]}


def rig(roll=True):
    """(problem, force per newton, outputs) of the two-blade rig with its tuned set of 18 pairs, in
    stuck modes.

    Made by docs/studies/two_blade_rig, asymmetric damper, and reduced once more, exactly, to the
    651 modes of the stuck system: K is what is left of the unit matrix without the stuck springs
    (tests/reference/hbm/README.md).
    roll : whether the flat resists to roll.
    """
    d = np.load(REFERENCE / "model_rig.npz")
    pairs = Contacts(d["kn"], d["kt"], d["mu"], d["preload"])
    B, law = d["shapes"], DryFriction2T()
    K = np.eye(B.shape[1]) - (B.T * law.stuck_stiffness(pairs).ravel()) @ B
    if not roll:
        K -= d["roll"].T @ d["roll"]
    nodes = SimpleNamespace(
        **{name: d[name] for name in ("body", "node", "direction", "position")},
        moves=np.isin(d["direction"], list("xyz")),
    )
    rows = d["motion"].astype(float)

    def describe(motion):
        return describe_motion(nodes, rows @ motion)

    problem = ContactProblem(
        np.diag(d["mass"]), None, K, B, law, pairs, damping_ratio=0.022, describe=describe
    )
    return problem, d["force"], dict(zip(d["names"].tolist(), d["outputs"], strict=True))


def with_damping_matrix(problem, dashpot=0.1):
    """A problem with damping ratios, its damping as a matrix: the same, and a dashpot at a pair.

    dashpot : at the first tangent of the first pair, its largest entry in units of that of the
        matrix; with 0 the matrix is diagonal in the modes and no pencil is needed
    """
    R = problem.receptance()
    inverse = np.linalg.inv(R.shapes)
    C = inverse.T @ np.diag(2 * R.ratio * np.sqrt(R.mass * R.stiffness)) @ inverse
    row = np.asarray(problem.B[[0]].todense() if hasattr(problem.B, "todense") else problem.B[[0]])
    size = np.abs(C).max() / np.abs(row.T @ row).max()
    return replace(problem, C=C + dashpot * size * row.T @ row, damping_ratio=None)


def solve(problem, force, w, H, start="zero_slider", samples=None, guess=None):
    """(q (r, H+1) complex, point, balance) of the periodic solution at w, from the stuck response
    or from a guess x."""
    balance = HarmonicBalance(problem, {1: force}, H, start, samples)
    settings = Settings()
    if guess is None:
        point = first_point(balance, w, settings)
    else:
        point = solve_fixed(balance.evaluate, guess, w, balance.weights, settings)
    assert point.converged
    return (balance.receptance.shapes @ point.detail.modal), point, balance


def harmonics(point, balance):
    """(P, nd, H+1) complex harmonics of the relative motion."""
    return fourier.to_complex(point.x.reshape(-1, balance.nd, balance.nh))
