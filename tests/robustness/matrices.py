"""B. Matrices and reduced models."""

import numpy as np

from tests.robustness.rows import (
    accepted,
    arrays,
    cells,
    chain,
    corner,
    entry,
    refused,
    row,
    warned,
)


@row("25", "M or K unsymmetric", "E")
def unsymmetric(folder):
    def change(A):
        A = A.copy()
        A[0, 1] += 1e-8 * np.abs(A).max()
        return A

    for name in "MK":
        yield refused(
            arrays(chain(folder), **{name: change}),
            f"{name} is not symmetric: .*0, 1.*1.0e-08 of the largest entry",
        )


@row("26", "M indefinite, or with a zero row", "E")
def indefinite_mass(folder):
    yield refused(
        arrays(chain(folder), M=entry(4, 4, -0.02)), "M has -0.02 on its diagonal at dof 4"
    )
    yield refused(
        arrays(chain(folder), M=entry(0, 1, 0.5)),
        "M is not positive definite: a motion mostly of dof",
    )

    def empty(M):
        M = M.copy()
        M[5] = M[:, 5] = 0.0
        return M

    yield refused(arrays(chain(folder), M=empty), "M has a row of zeros at dof 5")


@row("27", "NaN in K", "E")
def not_finite(folder):
    yield refused(arrays(chain(folder), K=entry(3, 5, np.nan)), r"K\[3, 5\] is nan")


@row("28", "K singular: damper free", "S, E")
def free_body(folder):
    found = accepted(corner(folder))
    assert "6 rigid modes" in found.out and "0 rigid modes" in found.out
    yield "a damper without support: 6 rigid modes, exact to rounding"

    def floating(K):
        K = K.copy()
        K[:18, :18] -= np.diag(K[:18, :18].sum(axis=1))  # no blade is held any more
        return K

    yield refused(
        arrays(chain(folder), K=floating),
        r"motions of the blades meet no stiffness.*only the damper may be",
    )


@row("30", "negative stiffness", "E")
def negative_stiffness(folder):
    yield refused(cells(chain(folder), "kn", "-1"), r"pair 1: kn = -1")
    yield refused(cells(chain(folder), "kt", "-1"), r"pair 1: kt = -1")
    yield refused(
        corner(folder, ("kn = 1e6", "kn = 0")), r"\[contact.one\] kn = 0: must be above 0"
    )
    yield refused(
        arrays(chain(folder), K=entry(0, 0, -1e9)), "K is indefinite: a motion mostly of dof 0"
    )


@row("31", "dimensions of M, C, K, loads, dof table disagree", "E")
def dimensions(folder):
    yield refused(
        arrays(chain(folder), M=lambda M: M[:-1, :-1]), r"M is \(26, 26\), K is \(27, 27\)"
    )
    yield refused(arrays(chain(folder), C=np.eye(3)), r"C is \(3, 3\)")
    yield refused(arrays(chain(folder), node=lambda n: n[:-2]), "node has 25 rows")
    yield refused(
        arrays(chain(folder), **{"load/pull": np.ones(5)}),
        r"load 'pull' must hold 27 finite numbers",
    )


@row("32", "dof table refers to a clamped dof", "E")
def clamped(folder):
    study = chain(folder)
    yield refused(
        arrays(study, groups='{"blades/excitation": [2, 99]}'),
        "node 99 of body 'blades' has no dof",
    )
    yield refused(cells(chain(folder), "blade_node", "77"), "node 77")


@row("33", "C negative; zeta < 0, >= 1, >= 0.2", "E, W")
def damping(folder):
    yield refused(arrays(chain(folder), C=-np.eye(27)), "C feeds energy in")
    yield refused(
        chain(folder, ("= 0.01", "= -0.01")), r"damping_ratio = -0.01: must be at least 0"
    )
    yield refused(
        chain(folder, ("= 0.01", "= 1.0")),
        r"damping_ratio = 1.0: must be at least 0 and at most 0.9999",
    )
    yield warned(chain(folder, ("= 0.01", "= 0.3")), "damping_ratio = 0.3: is it in percent")


@row("35", "more modes than dofs, 0, negative", "E, S")
def modes(folder):
    yield refused(
        corner(folder, ("modes = 5", "modes = -1")), r"modes = -1: must lie between 0 and 2000"
    )
    assert (
        "99 masters + 0 modes"
        in accepted(
            corner(folder, ("modes = 5", "modes = 0"), ("modes = 3", "modes = 0")), "reduce"
        ).out
    )
    yield "0 modes: Guyan reduction"
    yield refused(
        corner(folder, ("modes = 5", "modes = 500")), "500 modes.*at most|500", verb="reduce"
    )
