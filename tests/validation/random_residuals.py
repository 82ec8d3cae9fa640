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
from tests.validation.random_systems import contact_systems

SAMPLES, DECADES, SEED, LIMIT = 16384, (-2, 3), 3, 1e-3


def contact_harmonics(problem, X, w):
    """(P nd, H+1) N of the law in the second period of the motion X (P nd, H+1), stepped in a plain loop."""
    law, contacts, H = problem.law, problem.contacts, X.shape[1] - 1
    tau = np.linspace(0, 2 * np.pi, SAMPLES + 1)
    real, shape = fourier.to_real(X), (len(contacts), len(law.components), -1)
    u, v = (real @ fourier.basis(tau, H).T).reshape(shape), w * (real @ fourier.basis_rate(tau, H).T).reshape(shape)
    state = law.initial_state(u[:, :, 0], SliderStart(np.zeros((len(contacts), law.sliders)), False), contacts)
    forces = np.empty((SAMPLES, *shape[:2]))
    for _ in range(2):
        for i in range(1, SAMPLES + 1):
            forces[i - 1], state = law.step(Motion(u[:, :, i], v[:, :, i], tau[1] / w), state, contacts)
    found = 2 / SAMPLES * np.einsum("tk,tpd->pdk", np.exp(-1j * np.outer(tau[1:], np.arange(H + 1))), forces)
    found[:, :, 0] = found[:, :, 0] / 2 - problem.rest_force(contacts)
    return found.reshape(X.shape)


def residual(problem, force, w, q):
    """Of the equation of motion at q (r, H+1), over the external force or that of the contacts."""
    k, contact, applied = w * np.arange(q.shape[1]), problem.B.T @ contact_harmonics(problem, problem.B @ q, w), 0 * q
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
    found = [residual(system.problem, system.force, 2 * np.pi * curve.frequency[i], curve.harmonics[i]) for i in drawn]
    return curve, max(found, default=np.nan)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=500)
    worst, complete, count = 0.0, 0, parser.parse_args().count
    for i, system in enumerate(contact_systems(count, SEED, DECADES)):
        curve, error = checked(system, np.random.default_rng([SEED, i, 1]))
        complete, worst = complete + curve.complete, max(worst, error)
        if not error <= LIMIT or not curve.complete:
            print(f"{i}: {system.name}, H = {system.H}, residual {error:.1e}: {curve.ended}", flush=True)
    print(f"{complete} of {count} complete, largest residual {worst:.1e}")


if __name__ == "__main__":
    main()
