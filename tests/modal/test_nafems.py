"""Coarse rungs of the NAFEMS ladders of tests/validation/nafems.py."""

import numpy as np
import pytest

pytest.importorskip("dolfinx")
from tests.validation.nafems import FV32_HZ, IN_THE_PLANE, exact_hard_plate, fv32, fv52  # noqa: E402


def test_fv32_tapered_membrane():
    """Within 0.1 % of the published values and of the limit of the ladder (64 x 32 cells, changing
    by 0.003 %)."""
    hz = fv32(8)
    assert hz == pytest.approx(FV32_HZ, rel=1e-3)
    assert hz == pytest.approx([44.617, 130.011, 162.689, 245.987, 379.718, 391.405], rel=1e-3)
    # from above
    assert (
        hz >= np.array([44.617, 130.011, 162.689, 245.987, 379.718, 391.405]) * (1 - 2e-5)
    ).all()


@pytest.mark.slow
def test_fv52_plate_with_an_exact_solution():
    exact = exact_hard_plate(6)
    errors = [fv52(n, layers, "hard")[:6] / exact - 1 for n, layers in ((4, 1), (8, 1), (16, 2))]
    assert (errors[2] < 1e-3).all() and (errors[2] > -1e-8).all()
    assert (errors[0] > 2 * errors[1] - 1e-6).all() and (errors[1] > 3 * errors[2] - 1e-6).all()
    # shear in the plane, constant over the thickness
    assert errors[2][[3, 4]] == pytest.approx([0, 0], abs=1e-5)


def test_fv52_mode_in_the_plane():
    """On its lower edges, as published, within 0.1 %: the mode that a line support does hold."""
    assert np.abs(fv52(8, 1, "lower edges") / IN_THE_PLANE - 1).min() < 1e-3
