"""Stored points of random contact systems by the plain equation of motion, the law stepped through 16384 samples.

    OMP_NUM_THREADS=1 python -m tests.validation.random_residuals [--count 500]

kn and kt over five decades. A curve is complete or says why not; of each, five points at random. Prints what is worse
than 1e-3, and curves that ended without a word. About a second a point.
"""

import argparse

import numpy as np

from hbm import fourier
from hbm.laws.base import SliderStart
from hbm.laws.records import Motion
from hbm.response import follow_band
from tests.robustness import counts
from tests.validation.random_systems import contact_systems

SAMPLES, DECADES, SEED, LIMIT = 16384, (-2, 3), 3, 1e-3


def contact_harmonics(problem, X):
    """(m, P nd, H+1) N of the law in the second period of the motions X (m, P nd, H+1), all of them stepped at once in
    a plain loop; of laws that do not know the velocity."""
    m, P, nd, H = len(X), len(problem.contacts), len(problem.law.components), X.shape[2] - 1
    every = np.tile(np.arange(P), m)
    law, contacts = problem.law.select(every), problem.contacts.select(every)
    tau = np.linspace(0, 2 * np.pi, SAMPLES + 1)
    real = fourier.to_real(X.reshape(-1, H + 1))
    u, v = ((real @ basis(tau, H).T).reshape(m * P, nd, -1) for basis in (fourier.basis, fourier.basis_rate))
    state = law.initial_state(u[:, :, 0], SliderStart(np.zeros((m * P, law.sliders)), False), contacts)
    forces = np.empty((SAMPLES, m * P, nd))
    for _ in range(2):
        for i in range(1, SAMPLES + 1):
            forces[i - 1], state = law.step(Motion(u[:, :, i], v[:, :, i], tau[1]), state, contacts)
    found = 2 / SAMPLES * np.einsum("tk,tpd->pdk", np.exp(-1j * np.outer(tau[1:], np.arange(H + 1))), forces)
    found[:, :, 0] = found[:, :, 0] / 2 - np.tile(problem.rest_force(problem.contacts), (m, 1))
    return found.reshape(X.shape)


def residual(problem, force, w, q, contact):
    """Of the equation of motion at q (r, H+1) under the contact forces (P nd, H+1), over the external force or that of
    the contacts."""
    k, contact, applied = w * np.arange(q.shape[1]), problem.B.T @ contact, 0 * q
    applied[:, 1] = force
    modes = problem.receptance()
    C = problem.C if problem.damping_ratio is None else _modal_damping(problem, modes)
    r = problem.K @ q - k**2 * (problem.M @ q) + 1j * k * (C @ q) + contact - applied
    return np.linalg.norm(r) / max(np.linalg.norm(applied), np.linalg.norm(contact))


def _modal_damping(problem, modes):
    """C of the damping ratio of the stuck modes: M phi diag(2 zeta w) phi' M for phi' M phi = 1."""
    phi = problem.M @ (modes.shapes / np.sqrt(modes.mass))
    return phi * (2 * problem.damping_ratio * np.sqrt(modes.stiffness / modes.mass)) @ phi.T


def checked(system, rng, points=5):
    """(curve, largest residual of some points) of a system."""
    outputs = {f"q{i}": row for i, row in enumerate(np.eye(len(system.force)))}
    curve = follow_band(system.problem, system.force, tuple(system.band), harmonics=system.H, outputs=outputs)
    solved = np.flatnonzero(curve.converged)
    drawn = rng.choice(solved, min(points, len(solved)), replace=False)
    if not len(drawn):
        return curve, np.nan
    forces = contact_harmonics(system.problem, np.einsum("ij,njk->nik", np.asarray(system.problem.B),
                                                         curve.harmonics[drawn]))
    found = [residual(system.problem, system.force, 2 * np.pi * curve.frequency[i], curve.harmonics[i], contact)
             for i, contact in zip(drawn, forces, strict=True)]
    return curve, max(found)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=500)
    worst, complete, above, count = 0.0, 0, 0, parser.parse_args().count
    for i, system in enumerate(contact_systems(count, SEED, DECADES)):
        curve, error = checked(system, np.random.default_rng([SEED, i, 1]))
        complete, above = complete + bool(curve.complete), above + (not error <= LIMIT)
        worst = np.fmax(worst, error)
        if not error <= LIMIT or not curve.complete:
            print(f"{i}: {system.name}, H = {system.H}, residual {error:.1e}: {curve.ended}", flush=True)
    counts.keep("random contact systems", systems=count, complete=complete, others="each with its reason",
                points_each=5, curves_with_a_residual_above_1e_3=above, largest_residual=float(f"{worst:.2g}"))


if __name__ == "__main__":
    main()
