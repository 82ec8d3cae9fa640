"""Two dofs with coupled tangential and normal contact: tables at equal H, exact orbits, plain
sampling."""

import numpy as np

from tests.hbm.cases import coupled, load, solve
from tests.hbm.plain_balance import harmonic_one
from tests.validation import Miss, Subject, row

REFINED = 2**18  # samples of the plain computation


def rows():
    for case in ("D1", "D2"):
        data = load(case)
        problem, force = coupled(data["parameters"])
        for known in data["results"]:
            name = f"{case}, Om = {known['Omega']:g}"
            opens = (case, known["Omega"]) == ("D1", 1.5)
            yield from _at(name, problem, force, known, ", open" if opens else "")
            if opens:
                yield from _sampled(name, problem, force, data["parameters"], known)


def _at(name, problem, force, known, opens):
    """Harmonic 1 of each dof, and the mean: where nothing slips that is free in a range and left
    out."""
    exact = np.array(known["X1_cos"]) - 1j * np.array(known["X1_sin"])
    largest = np.abs(exact).max()
    slips = known["state_fraction_stick_slipP_slipM_sep"][0][0] <= 1 - 1e-12
    for H, table in known["HB_by_H"].items():
        q = solve(problem, force, known["Omega"], int(H))[0]
        for dof, (ours, told) in enumerate(zip(np.abs(q[:, 1]), table["X1"], strict=True)):
            which = (
                ""
                if not opens
                else ", larger dof"
                if dof == np.abs(exact).argmax()
                else ", smaller dof"
            )
            yield row(
                f"{name}, dof {dof + 1}, H = {H}", ours, told, f"table at equal H{opens}{which}"
            )
        if slips:
            yield row(
                f"{name}, H = {H}",
                q[:, 0].real,
                table["X0"],
                f"mean, table at equal H{opens}",
                largest,
            )
    for H in (5, 20, 40):
        q = solve(problem, force, known["Omega"], H)[0]
        yield row(name, q[:, 1], exact, f"exact orbit, H = {H}")
        for dof, (ours, told) in enumerate(
            zip(np.abs(q[:, 1]), np.abs(exact), strict=True), start=1
        ):
            yield row(f"{name}, dof {dof}", ours, told, f"exact orbit, H = {H}")
        if slips:
            yield row(
                name, q[:, 0].real, known["X0"], f"mean, exact orbit, H = {H}{opens}", largest
            )


def _sampled(name, problem, force, parameters, known):
    for H in (1, 3, 5, 9, 20):
        ours = np.abs(solve(problem, force, known["Omega"], H)[0][:, 1])
        coarse, fine = (harmonic_one(parameters, known["Omega"], H, n) for n in (4096, REFINED))
        for dof, (mine, told) in enumerate(zip(ours, fine, strict=True), start=1):
            yield row(
                f"{name}, dof {dof}, H = {H}", mine, told, f"plain sampling, {REFINED} samples"
            )
        yield row(
            f"{name}, H = {H}: plain sampling, not ours",
            coarse,
            known["HB_by_H"][str(H)]["X1"],
            "the table is plain sampling at 4096",
        )


TABLE_IS_OFF = (
    "the table is off by as much: plain sampling that shares no code with hbm gives the table at "
    f"its 4096 samples and goes to our numbers at {REFINED}, to 1.5e-6 of each dof; the mean of "
    "the exact orbit is met to 1.1e-8 at H = 40"
)
SUBJECT = Subject(
    "Coupled tangential and normal contact",
    "Harmonic 1 of each dof, and the mean. The table was sampled 4096 times; where the contact "
    "opens (D1, Om = 1.5) it is good to 4e-5 of the larger dof by its own account: a sampled "
    "slider begins at the first sample in contact, not at the instant of contact. A third, plain "
    "computation (tests/hbm/plain_balance.py) gives the table at 4096 samples and goes to our "
    "numbers when refined; at H = 40 ours meet the exact orbit. Source: tests/reference/hbm/D1, "
    "D2.",
    rows,
    {
        "table at equal H": 5e-6,
        "table at equal H, open, larger": 4e-5,
        "table at equal H, open, smaller": 4e-5,
        "mean, table at equal H": 5e-6,
        "mean, table at equal H, open": 4e-5,
        "exact orbit, H = 5": 5e-4,
        "exact orbit, H = 20": 5e-6,
        "exact orbit, H = 40": 5e-6,
        "mean, exact orbit, H = 20": 5e-6,
        "mean, exact orbit, H = 40": 5e-6,
        "plain sampling": 2e-6,
        "the table is": 1e-12,
    },
    {
        "table at equal H, open, smaller dof": Miss(1.07e-4, 1, TABLE_IS_OFF),
        "mean, table at equal H, open": Miss(6.43e-5, 1, TABLE_IS_OFF),
    },
)
