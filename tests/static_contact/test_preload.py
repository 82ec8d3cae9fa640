"""Unilateral preload: closed-form beams, random cases against a second method, free motions, bad input."""

import json
from pathlib import Path

import numpy as np
import pytest

from hbm.contact import ContactTable
from hbm.errors import InputError
from hbm.model import ReducedModel
from static_contact.preload import StaticContact, preload

REFERENCE = Path(__file__).parents[1] / "reference" / "statics"
UP = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1]])


def beam(x, EI):
    """Free-free beam as a model of its deflections only: Hermite elements, rotations condensed exactly."""
    n = len(x)
    K = np.zeros((2 * n, 2 * n))
    for i, h in enumerate(np.diff(x)):
        k = EI / h**3 * np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
                                  [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]])
        K[2 * i:2 * i + 4, 2 * i:2 * i + 4] += k
    w, r = np.arange(0, 2 * n, 2), np.arange(1, 2 * n, 2)
    S = K[np.ix_(w, w)] - K[np.ix_(w, r)] @ np.linalg.solve(K[np.ix_(r, r)], K[np.ix_(r, w)])
    position = np.column_stack([x, np.zeros(n), np.zeros(n)])
    return ReducedModel.from_matrices(np.eye(n), (S + S.T) / 2, body="damper", node=np.arange(1, n + 1),
                                      direction=np.full(n, "z"), position=position)


def supports(x, kn, gap):
    n = len(x)
    return ContactTable(side=np.full(n, "up"), station=np.arange(n), row=np.zeros(n), blade_body=np.full(n, "ground"),
                        blade_node=np.arange(n), damper_body=np.full(n, "damper"), damper_node=np.arange(1, n + 1),
                        position=np.column_stack([x, np.zeros(n), np.zeros(n)]), frame=np.tile(UP, (n, 1, 1)),
                        gap=gap, kn=kn, kt=kn, mu=np.zeros(n), preload=np.zeros(n), weight=np.ones(n))


@pytest.mark.parametrize("name", ["F1-beam-two-end-loads", "F2-beam-31-crowned"])
def test_beam_on_unilateral_supports(name):
    """Support forces and detached set of the reference (closed form; see tests/reference/statics)."""
    case = json.loads((REFERENCE / f"{name}.json").read_text())
    p = case["parameters"]
    x = np.array(p["support_x"])
    places = np.unique(np.round(np.concatenate([x, [a for a, _ in p["loads_x_P"]]]), 12))
    model = beam(places, p["EI"])
    load = np.zeros(len(places))
    for place, P in p["loads_x_P"]:
        load[np.abs(places - place).argmin()] += P
    table = supports(x, np.array(p["kn"]), np.array(p["gap"]))
    table = table.replace(damper_node=np.array([np.abs(places - a).argmin() + 1 for a in x]))
    result = preload(model, table, load)
    r = np.array(case["results"]["r"])
    assert np.maximum(result.pairs.preload, 0) == pytest.approx(r, abs=1e-8 * r.max())
    assert np.flatnonzero(result.pairs.preload < 0).tolist() == case["results"]["detached_indices"]
    assert result.residual < 1e-9 and result.balance < 1e-9


def test_random_beams_against_quadratic_programming():
    """Same forces as the minimum of the potential energy found by non-negative least squares, 60 random cases.

    With spring compressions s >= u - g, s >= 0, min 1/2 q'Kq - f'q + 1/2 kn s^2 is solved in its dual:
    min 1/2 N'(C + 1/kn) N - (u0 - g)' N, N >= 0, on a beam held by a soft spring at each end.
    """
    from scipy.optimize import nnls

    random = np.random.default_rng(20161)
    for _ in range(60):
        n = int(random.integers(3, 25))
        x = np.cumsum(random.uniform(2e-3, 6e-3, n))
        model = beam(x, 10 ** random.uniform(-1, 1.5))
        soft = np.zeros(n)
        soft[[0, -1]] = 1e3
        model = model.with_stiffness(model.K + np.diag(soft))
        kn, gap = 10 ** random.uniform(4, 7, n), random.uniform(0, 2e-5, n)
        load = random.normal(0, 40, n)
        result = preload(model, supports(x, kn, gap), load)
        C = np.linalg.inv(model.K)
        A = np.linalg.cholesky(C + np.diag(1 / kn)).T
        N, _ = nnls(A, np.linalg.solve(A.T, C @ load - gap), maxiter=100 * n)
        assert np.maximum(result.pairs.preload, 0) == pytest.approx(N, abs=1e-6 * max(N.max(), 1e-6))


def test_loads_and_gaps_reuse_one_factorisation():
    """Twice the load with twice the gap is twice the preload (the problem is homogeneous)."""
    x = np.linspace(0, 0.07, 11)
    gap = 1e-5 * (1 - (2 * x / 0.07 - 1) ** 2)
    load = np.zeros(11)
    load[[0, 5, 10]] = 50, 3, 40
    once = StaticContact(beam(x, 10.0), supports(x, np.full(11, 1e6), gap)).solve(load)
    twice = StaticContact(beam(x, 10.0), supports(x, np.full(11, 1e6), 2 * gap)).solve(2 * load)
    assert twice.pairs.preload == pytest.approx(2 * once.pairs.preload, rel=1e-9)


def test_weight_zero_is_as_if_the_pair_were_not_there():
    x = np.linspace(0, 0.07, 9)
    load = np.zeros(9)
    load[[2, 6]] = 40.0, 30.0
    table = supports(x, np.full(9, 1e6), np.zeros(9))
    kept = np.array([0, 1, 3, 8])
    weight = np.isin(np.arange(9), kept).astype(float)
    one = preload(beam(x, 5.0), table.replace(weight=weight), load).pairs.preload[kept]
    two = preload(beam(x, 5.0), table.select(kept), load).pairs.preload
    assert one == pytest.approx(two, rel=1e-9)


def test_load_that_lifts_the_body_off():
    x = np.linspace(0, 0.07, 5)
    with pytest.raises(InputError, match="do not hold the damper"):
        preload(beam(x, 5.0), supports(x, np.full(5, 1e6), np.zeros(5)), np.full(5, -3.0))


def test_no_pairs():
    x = np.linspace(0, 0.07, 5)
    table = supports(x, np.full(5, 1e6), np.zeros(5))
    for empty in (table.select([]), table.replace(weight=np.zeros(5))):
        with pytest.raises(InputError, match="no contact pairs"):
            StaticContact(beam(x, 5.0), empty)
