"""Time integration against exact orbits, through stick, slip, lift-off and contact, also with a
light contact node."""

import numpy as np

from tests.hbm.cases import coupled, jenkins, load, solve, unilateral
from tests.hbm.contact_nodes import with_node
from tests.validation import Subject, row
from tipdamp.hbm.time import shooting
from tipdamp.hbm.time.exact import ExactIntegrator
from tipdamp.hbm.time.settings import IntegrationSettings

LIGHT_NODE = {"C1": (1.2, 1.25, 1.3), "D1": (0.9, 1.0, 1.2, 1.5)}
BUILD = {"A": jenkins, "C": unilateral, "D": coupled}


def steady(problem, force, omega, H=9, settings=None):
    """Amplitudes of the first harmonic of every dof, by shooting from the harmonic balance."""
    q, point, balance = solve(problem, force, omega, H)
    integrator = ExactIntegrator(balance, omega, settings)
    found = shooting.shoot(integrator, integrator.on_orbit(point), np.eye(len(q)))
    assert found.periodic
    return np.abs(found.harmonics[:, 1])


def rows():
    """C1 at 1.15 has three orbits and is left to its own test."""
    for case in ("A1", "A2", "C1", "C2", "D1", "D2"):
        data = load(case)
        problem, force = BUILD[case[0]](data["parameters"])
        for known in data.get("results", data.get("steady_state")):
            omega, exact = known["Omega"], np.atleast_1d(known["X1"])
            if (case, omega) == ("C1", 1.15):
                continue
            name = f"{case}, Om = {omega:g}"
            yield row(name, steady(problem, force, omega), exact, "exact orbit, tolerance 1e-7")
            for steps in (32, 128):
                ours = steady(
                    problem, force, omega, settings=IntegrationSettings(tolerance=0, steps=steps)
                )
                yield row(name, ours, exact, f"exact orbit, {steps} equal steps")
            if omega in LIGHT_NODE.get(case, ()):
                node = with_node(problem, 1e-6)
                ours = steady(node, np.r_[force, np.zeros(len(node.K) - len(force))], omega, 20)[
                    : len(force)
                ]
                yield row(
                    f"{name}, light contact node", ours, exact, "exact orbit, node without mass"
                )


SUBJECT = Subject(
    "Time integration against exact orbits",
    "Amplitudes of the first harmonic, by shooting; fourth order in the step. Modes above 50 "
    "times the excitation follow statically: C1 and D1 also with a node of a millionth of the "
    "mass between body and contact, on springs three times as stiff, both in series those of the "
    "reference. Source: tests/reference/hbm/A1 to D2.",
    rows,
    {"exact orbit, tolerance": 5e-6, "exact orbit, 128": 5e-6, "exact orbit, node": 1e-5},
)
