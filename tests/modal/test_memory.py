"""Predicted memory against what the reductions of tests/benchmarks/growth.py took."""

import tracemalloc

import numpy as np

from tests.modal.blocks import block
from tipdamp.modal.craig_bampton import craig_bampton
from tipdamp.modal.elasticity import Material, elastic_body
from tipdamp.modal.memory import predicted_bytes

# GiB by dofs
MEASURED = {10080: 0.270, 27720: 0.521, 56700: 1.103, 107712: 2.254, 206640: 4.958, 298356: 7.771}


def test_forecast_of_the_measured_reductions():
    """From 28 000 dofs on to 15 %; below, the libraries themselves are most of it. 300 000 dofs
    stay under 8 GiB."""
    assert max(MEASURED) > 295000 and MEASURED[max(MEASURED)] < 8
    for dofs, GiB in list(MEASURED.items())[1:]:
        assert abs(predicted_bytes(dofs / 3) / 2**30 / GiB - 1) < 0.15, dofs


def test_forecast_of_many_masters():
    """Arrays of numpy at the height of a reduction of 3969 dofs, traced: what 250 masters need
    beyond 62, and up to half as much again, since the forecast counts all dofs as rows and a
    quarter of them are masters or clamped."""
    mesh = block("hexahedron", (26, 6, 6))
    body = elastic_body(mesh, Material(E=207e9, nu=0.3, density=7850.0), "block", clamp="clamp")

    def height(masters):
        tracemalloc.start()
        craig_bampton(body, np.setdiff1d(body.node, mesh.group("clamp"))[:masters], 5)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return peak

    needed = height(250) - height(62)
    predicted = predicted_bytes(len(mesh.node), 250) - predicted_bytes(len(mesh.node), 62)
    assert 1 < predicted / needed < 1.5, (predicted, needed)
