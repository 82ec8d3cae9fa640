"""A cube of elastic elements pulled into a corner of two others: 18 pairs that face two ways, with
random gaps.

And a second solver for any unilateral contact: an interior point method on the motions and forces
themselves, which knows neither sets of closed pairs nor the condensed compliance.
"""

import numpy as np

from tests.tipdamp import corner_study
from tipdamp.modal.craig_bampton import assemble, craig_bampton
from tipdamp.modal.elasticity import Material, elastic_body
from tipdamp.modal.loads import nodal_load
from tipdamp.static_contact.surfaces.pairing import Side, join, pair

PULL = np.array([10.0, 0, 10.0]) / np.sqrt(2)  # N, into the corner
SHARES = {
    "centred": ([1 / 3] * 3, 0.0),
    "uneven": ([0.2, 0.35, 0.45], 0.0),
    "turned": ([1 / 3] * 3, 0.3),
    "both": ([0.2, 0.35, 0.45], 0.3),
}
_STEPS = 200


def corner():
    """(bodies, model, pairs): kn = kt = 1e6 N/m, no gaps; masters are the nodes of the pairs, no
    modes."""
    steel = Material(207e9, 0.3, 7850.0)
    blades, damper = corner_study.blades(), corner_study.damper()
    sides = (Side("one", "touch_one", "face_x"), Side("two", "touch_two", "face_z"))
    pairs = join(
        *(pair(blades, damper, side, axis=(0, 1, 0), pull=PULL, tolerance=1e-6) for side in sides)
    )
    pairs = pairs.replace(kn=np.full(len(pairs), 1e6), kt=np.full(len(pairs), 1e6))
    bodies = [
        elastic_body(blades, steel, "blades", clamp=["clamp_one", "clamp_two"]),
        elastic_body(damper, steel, "damper", free=True),
    ]
    reduced = [
        craig_bampton(body, nodes, 0)
        for body, nodes in zip(bodies, (pairs.blade_node, pairs.damper_node), strict=True)
    ]
    return bodies, reduced, assemble(*(r.model for r in reduced)), pairs


def pulls(bodies, reduced, name):
    """Forces on the damper's own dofs, and the load on the model: the pull in shares on three nodes
    of its far edge, turned by so many newtons about their middle."""
    shares, couple = SHARES[name]
    forces = np.outer(shares, PULL) + np.outer([1 / 3] * 3, [couple, 0, -couple])
    full = nodal_load(bodies[1], bodies[1].group("load"), forces)
    return full, np.concatenate([np.zeros(reduced[0].model.size), reduced[1].condense_dofs(full)])


def random_pairs(pairs, random, hard):
    """The pairs with gaps between 0 and some largest one, 0.1 to 100 um; hard contact or
    springs."""
    gap = random.uniform(0, 1, len(pairs)) * 10 ** random.uniform(-7, -4)
    return pairs.replace(gap=gap, kn=np.full(len(pairs), np.inf) if hard else pairs.kn)


def by_interior_point(K, B, f, gap, kn):
    """N (P,) of  K q + B' N = f,  0 <= N  complementary to  s = gap + N/kn - B q >= 0.

    Predictor and corrector steps [Mehrotra 1992]; asserts that all three conditions are met at the
    end.
    """
    c = np.where(np.isinf(kn), 0.0, 1 / kn)
    N = np.full(len(gap), np.abs(f).sum() / len(gap))
    s = np.full(len(gap), gap.max() + (c * N).max() + 1e-9)
    q, size = np.zeros(len(f)), N[0] * s[0]

    def step(want):
        D = 1 / (s / N + c)
        h = want / N - (gap + c * N - B @ q)
        dq = np.linalg.lstsq(K + B.T * D @ B, f - K @ q - B.T @ (N + D * h), rcond=1e-15)[0]
        dN = D * (h + B @ dq)
        return dq, dN, want / N - s - s / N * dN

    for _ in range(_STEPS):
        mu = N @ s / len(N)
        dq, dN, ds = step(0.0)
        reach = min(_longest(N, dN), _longest(s, ds))
        sigma = max(1e-3, ((N + reach * dN) @ (s + reach * ds) / len(N) / mu) ** 3)
        dq, dN, ds = step(sigma * mu - dN * ds)
        reach = min(1.0, 0.9 * min(_longest(N, dN), _longest(s, ds)))
        q, N, s = q + reach * dq, N + reach * dN, s + reach * ds
        if (N * s).max() < 1e-16 * size and np.linalg.norm(
            K @ q + B.T @ N - f
        ) < 1e-11 * np.linalg.norm(f):
            break
    assert (N * s).max() < 1e-16 * size and np.linalg.norm(
        K @ q + B.T @ N - f
    ) < 1e-11 * np.linalg.norm(f)
    assert np.abs(gap + c * N - B @ q - s).max() < 1e-9 * gap.max()
    return N


def _longest(x, dx):
    """Step that takes the first entry to zero, at most 1 / 0.9."""
    return min(1 / 0.9, np.where(dx < 0, -x / np.where(dx < 0, dx, -1.0), np.inf).min())
