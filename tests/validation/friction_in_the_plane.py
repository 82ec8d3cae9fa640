"""Coupled friction in the plane: prescribed ellipses, and an oscillator under a rotating force."""

import numpy as np

from tests.hbm.cases import load
from tests.hbm.laws.test_coupled import prescribed, rotating
from tests.validation import Subject, row
from tipdamp.hbm.laws import DryFriction2T


def rows():
    for known in load("E1")["ellipses"]:
        X, Y = complex(known["X"]), known["Y"] * np.exp(1j * known["phi"])
        name = f"{known['X']:g} x {known['Y']:g}, phase {known['phi']:.2f}"
        expected = [complex(*known["coupled"][key]) for key in ("Tx1", "Ty1")]
        F = prescribed(X, Y, known["kt"], known["L"], 64, H=1)
        for d, label in enumerate("xy"):
            yield row(
                f"{name}, force in {label}, H = 1",
                F[d, 1],
                expected[d],
                "differential equation, per limit",
                known["L"],
            )
        yield row(name, _work(F, X, Y), known["coupled"]["dissipation"], "work per cycle")
        F = prescribed(X, Y, known["kt"], known["L"], 64, law=DryFriction2T())
        yield row(
            name, _work(F, X, Y), known["uncoupled"]["dissipation"], "work of two crossed elements"
        )
    for known in load("E1")["rotating_force_oscillator"]:
        found = rotating(known)
        exact = min(known["R_exact"], key=lambda R: abs(R - found))
        yield row(f"rotating force, Om = {known['Omega']:g}, H = 1", found, exact, "exact radius")


def _work(F, X, Y):
    return np.pi * (F[0, 1] * np.conj(X) + F[1, 1] * np.conj(Y)).imag


SUBJECT = Subject(
    "Coupled friction in the plane",
    "Prescribed ellipses: harmonic 1 of the force, and the work of a cycle. A force "
    "that rotates: radius of the orbit in closed form. Source: tests/reference/hbm/E1.",
    rows,
    {
        "differential equation": 2e-8,
        "work per cycle": 1e-7,
        "work of two": 1e-8,
        "exact radius": 1e-8,
    },
)
