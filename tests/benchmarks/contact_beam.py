"""The cantilever of tests/reference/hbm/frictional-beam.md with any number of contacts, each on a
node of its own.

Steel, 100 x 20 x 10 mm, Euler-Bernoulli elements, rods along the axis in 3-D; contacts to ground at
equal distances from 30 mm to the tip, the totals of stiffness and preload and the preload formula
of the reference. Craig-Bampton onto the contact nodes and the force's node (at 50 mm) with 6
fixed-interface modes, damping 0.5 % in every mode without contacts. With 8 contacts the matrices
are those of model_B8.npz and model_C8.npz.
"""

from dataclasses import replace

import numpy as np
import scipy.linalg as sl

from tests import beam_elements
from tests.hbm.cases import REFERENCE
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.laws import Contacts, DryFriction2T, Jenkins1D

E = 2.1e11
RHO = 7850.0
LENGTH = 0.10
FIRST = 0.03
PUSHED = 0.05
WIDTH, HEIGHT = 0.02, 0.01
KT = 1.0e6
KN = 1.2e6
MU = 0.5
PRELOAD = 100.0
MODES = 6
DAMPING = 0.005
AREA = WIDTH * HEIGHT
STIFF, SOFT = E * HEIGHT * WIDTH**3 / 12, E * WIDTH * HEIGHT**3 / 12  # EI along y and z in N m^2
STICKS = 100.0  # times its share of the preload: a pair that is not to slip


def places(n):
    """Places of the contacts in m."""
    return np.linspace(FIRST, LENGTH, n)


def preloads(n, sliding=None, share=1.0):
    """(n,) N by the reference's formula; those `sliding` (n,) get `share` of theirs, the others so
    much as to stick."""
    weight = 0.2 + 1.8 * (2 * np.linspace(0, 1, n) - 1) ** 2
    preload = PRELOAD * weight / weight.sum()
    return preload if sliding is None else preload * np.where(sliding, share, STICKS)


def mesh(n):
    """Nodes in m from the clamp on: 2.5 mm at most, with every contact and the force on a node."""
    marks = np.unique(np.round(np.r_[0.0, PUSHED, places(n)], 12))
    cells = np.maximum(np.round(np.diff(marks) / (LENGTH / 40)).astype(int), 1)
    return np.unique(
        np.concatenate(
            [np.linspace(a, b, m + 1) for a, b, m in zip(marks, marks[1:], cells, strict=False)]
        ).round(12)
    )


def bending(x, EI):
    """(K, M) of the clamped beam, dofs (w, slope) of every node but the first."""
    return tuple(A[2:, 2:] for A in beam_elements.bending(x, EI, RHO * AREA))


def rod(x):
    """(K, M) of the clamped rod, one dof of every node but the first."""
    K, M = np.zeros((2, len(x), len(x)))
    for e, h in enumerate(np.diff(x)):
        at = slice(e, e + 2)
        K[at, at] += E * AREA / h * np.array([[1, -1], [-1, 1]])
        M[at, at] += RHO * AREA * h / 6 * np.array([[2, 1], [1, 2]])
    return K[1:, 1:], M[1:, 1:]


def reduced(K, M, masters):
    """(K, C, M) on the masters, in their order, and 6 fixed-interface modes."""
    inner = np.setdiff1d(np.arange(len(K)), masters)
    hz2, modes = sl.eigh(
        K[np.ix_(inner, inner)], M[np.ix_(inner, inner)], subset_by_index=(0, MODES - 1)
    )
    T = np.zeros((len(K), len(masters) + MODES))
    T[masters, np.arange(len(masters))] = 1.0
    T[inner, : len(masters)] = -sl.solve(
        K[np.ix_(inner, inner)], K[np.ix_(inner, masters)], assume_a="pos"
    )
    T[inner, len(masters) :] = modes
    K, M = T.T @ K @ T, T.T @ M @ T
    omega2, shapes = sl.eigh(K, M)
    C = M @ shapes @ np.diag(2 * DAMPING * np.sqrt(omega2)) @ shapes.T @ M
    return K, C, M


def master_nodes(n):
    """(places of the nodes kept, rows of the contacts in them, row of the force)."""
    kept = np.unique(np.round(np.r_[PUSHED, places(n)], 12))
    return kept, np.searchsorted(kept, np.round(places(n), 12)), int(np.searchsorted(kept, PUSHED))


def in_modes(case):
    """The same case in the modes of the beam without contacts: node after node a fraction of a
    millimetre apart, K is so unevenly scaled that its lowest motion drowns in rounding.
    """
    problem, force, outputs = case
    _, shapes = sl.eigh(problem.K, problem.M)
    M, C, K = (shapes.T @ A @ shapes for A in (problem.M, problem.C, problem.K))
    return (
        replace(problem, M=M, C=C, K=K, B=problem.B @ shapes),
        force @ shapes,
        {k: row @ shapes for k, row in outputs.items()},
    )


def plane(n, preload=None):
    """(problem, force per newton, outputs): one direction, Jenkins elements; B8 with n contacts."""
    x, (kept, contact, pushed) = mesh(n), master_nodes(n)
    K, C, M = reduced(*bending(x, SOFT), 2 * (np.searchsorted(x, kept) - 1))
    rows = np.eye(len(K))
    pairs = Contacts(
        np.zeros(n), np.full(n, KT / n), np.full(n, MU), preloads(n) if preload is None else preload
    )
    return (
        ContactProblem(M, C, K, rows[contact], Jenkins1D(), pairs),
        rows[pushed],
        {"tip": rows[contact[-1]]},
    )


def space(n, preload=None):
    """(problem, force per newton, outputs): three directions, normal contact and two tangents; C8
    with n contacts."""
    x, (kept, contact, pushed) = mesh(n), master_nodes(n)
    at = np.searchsorted(x, kept) - 1
    parts = [rod(x), bending(x, STIFF), bending(x, SOFT)]
    masters = np.stack([at, len(x) - 1 + 2 * at, 3 * (len(x) - 1) + 2 * at], axis=1).ravel()
    K, C, M = reduced(*(sl.block_diag(*(p[i] for p in parts)) for i in (0, 1)), masters)
    rows = np.eye(len(K))
    frame = np.load(REFERENCE / "model_C8.npz")["R"].T  # rows t1, t2, n in x, y, z
    B = np.einsum(
        "ij,pjr->pir", frame, rows[: 3 * len(kept)].reshape(len(kept), 3, -1)[contact]
    ).reshape(3 * n, -1)
    pairs = Contacts(
        np.full(n, KN / n),
        np.full(n, KT / n),
        np.full(n, MU),
        preloads(n) if preload is None else preload,
    )
    force = 0.6 * rows[3 * pushed + 1] + 0.8 * rows[3 * pushed + 2]
    return (
        ContactProblem(M, C, K, B, DryFriction2T(), pairs),
        force,
        {"tip": rows[3 * contact[-1] + 2]},
    )
