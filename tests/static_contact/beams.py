"""Free beams on unilateral supports: as a model, and by Macaulay brackets without any stiffness
matrix."""

import json
from itertools import product
from pathlib import Path

import numpy as np

from tests.beam_elements import bending
from tests.contact_tables import contact_table
from tipdamp.hbm.model import ReducedModel
from tipdamp.static_contact.contact.preload import preload

REFERENCE = Path(__file__).parents[1] / "reference" / "statics"


def beam(x, EI):
    """Free-free beam as a model of its deflections only: Hermite elements, rotations condensed
    exactly."""
    n = len(x)
    K, _ = bending(x, EI)
    w, r = np.arange(0, 2 * n, 2), np.arange(1, 2 * n, 2)
    S = K[np.ix_(w, w)] - K[np.ix_(w, r)] @ np.linalg.solve(K[np.ix_(r, r)], K[np.ix_(r, w)])
    position = np.column_stack([x, np.zeros(n), np.zeros(n)])
    return ReducedModel.from_matrices(
        np.eye(n),
        (S + S.T) / 2,
        body="damper",
        node=np.arange(1, n + 1),
        direction=np.full(n, "z"),
        position=position,
    )


def supports(x, kn, gap):
    return contact_table(
        np.tile(np.eye(3), (len(x), 1, 1)),
        kn=kn,
        gap=gap,
        kt=1.0,
        position=np.column_stack([x, 0 * x, 0 * x]),
    )


def random_case(random, largest=31):
    """x, EI, kn (a third of the cases with some hard supports), gap, load: one that an equilibrium
    exists for.

    EI between those of reference cases F1 and F2; the resultant presses inside the supports, single
    loads may pull."""
    n = int(random.integers(3, largest + 1))
    x = 0.07 * np.cumsum(random.uniform(0.4, 1.0, n))
    x = 0.07 * (x - x[0]) / (x[-1] - x[0])
    EI = 10 ** random.uniform(-0.85, 1.02)
    kn = 10 ** random.uniform(5, 7, n)
    if random.random() < 1 / 3:
        kn[random.random(n) < random.random()] = np.inf
    gap = random.uniform(0, 10 ** random.uniform(-6, -4), n)
    while True:
        load = random.normal(0, 40, n) * (random.random(n) < 0.5)
        total = load.sum()
        # one load on one support leaves the beam balanced there at any tilt: no set is the answer
        if (
            np.count_nonzero(load) > 1
            and total > 1
            and 0.02 * 0.07 < load @ x / total < 0.98 * 0.07
        ):
            return x, EI, kn, gap, load


def macaulay(x, EI, kn, gap, load, closed):
    """(sets, n) forces and opening for each row of `closed` (sets, n) bool; NaN where the set does
    not hold the beam.

    w(x) = a + b x + sum (P - r) <x - p>^3 / 6EI, balance of force and moment, w = gap + r/kn where
    closed.
    """
    closed = np.atleast_2d(closed)
    n, L = len(x), x[-1]
    s = x / L
    cube = np.maximum(s[:, None] - s[None, :], 0.0) ** 3 / 6  # times L^3/EI
    flex = L**3 / EI
    line = np.column_stack([np.ones(n), s])
    A = np.zeros((len(closed), n + 2, n + 2))
    A[:, :n, :n] = np.where(closed[:, :, None], cube + np.diag(1 / (kn * flex)), np.eye(n))
    A[:, :n, n:] = np.where(closed[:, :, None], -line, 0.0)  # unknowns a, b in flex * N
    A[:, n:, :n] = line.T
    right = np.concatenate(
        [np.where(closed, cube @ load - gap / flex, 0.0), np.tile(line.T @ load, (len(closed), 1))],
        axis=1,
    )
    held = closed.sum(axis=1) >= 2
    A[~held] = np.eye(n + 2)
    found = np.linalg.solve(A, right[:, :, None])[:, :, 0]
    r = found[:, :n]
    opening = gap - flex * (found[:, n:] @ line.T + (load - r) @ cube.T)
    return np.where(held[:, None], r, np.nan), np.where(held[:, None], opening, np.nan)


def is_solution(r, opening, closed):
    """(sets,) bool: no closed support pulls, no open one is overlapped."""
    return (np.where(closed, r >= 0, True) & np.where(closed, True, opening >= 0)).all(axis=1) & (
        closed.sum(1) >= 2
    )


def by_trying_all_sets(x, EI, kn, gap, load):
    """Forces and closed set of the only one of 2^n sets that satisfies all conditions."""
    closed = np.array(list(product([False, True], repeat=len(x))))
    r, opening = macaulay(x, EI, kn, gap, load, closed)
    good = np.flatnonzero(is_solution(r, opening, closed))
    assert len(good) == 1, f"{len(good)} sets satisfy the conditions"
    return r[good[0]], closed[good[0]]


def reference_beam(name):
    """(forces, preload) of a reference case as we find them, and its data."""
    case = json.loads((REFERENCE / f"{name}.json").read_text())
    p = case["parameters"]
    x = np.array(p["support_x"])
    places = np.unique(np.round(np.concatenate([x, [a for a, _ in p["loads_x_P"]]]), 12))
    load = np.zeros(len(places))
    for place, P in p["loads_x_P"]:
        load[np.abs(places - place).argmin()] += P
    table = supports(x, np.array(p["kn"]), np.array(p["gap"]))
    table = table.replace(damper_node=np.array([np.abs(places - a).argmin() + 1 for a in x]))
    return preload(beam(places, p["EI"]), table, load), case["results"]
