"""Stuck frequencies of a lumped two-blade rig with an elastic damper for lists of pairs; tuning to a target."""

import json
from pathlib import Path

import numpy as np
import pytest

from hbm.errors import InputError
from hbm.model import ReducedModel
from static_contact.detachment import StuckAssembly, detach_until
from tests.contact_tables import contact_table

H1 = json.loads((Path(__file__).parents[1] / "reference" / "statics" / "H1-fullstick-sets.json").read_text())
P = H1["parameters"]
Z = np.linspace(-P["L"] / 2, P["L"] / 2, P["n"])


def lumped_rig() -> ReducedModel:
    """u1, th1, u2, th2 of the blades, then w and slope of the damper's stations: Hermite beam elements."""
    area, inertia, h = np.pi * P["d"] ** 2 / 4, np.pi * P["d"] ** 4 / 64, P["L"] / (P["n"] - 1)
    k = P["E"] * inertia / h**3 * np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h**2, -6 * h, 2 * h**2],
                                            [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h**2, -6 * h, 4 * h**2]])
    m = P["rho"] * area * h / 420 * np.array([[156, 22 * h, 54, -13 * h], [22 * h, 4 * h**2, 13 * h, -3 * h**2],
                                              [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h**2, -22 * h, 4 * h**2]])
    r = 4 + 2 * P["n"]
    mass = np.array([P["m1"], P["J1"], P["m2"], P["J2"]])
    own = 2 * np.pi * np.array([P["f1"], P["ft1"], P["f2"], P["ft2"]])
    M, K = np.zeros((r, r)), np.zeros((r, r))
    M[:4, :4], K[:4, :4] = np.diag(mass), np.diag(mass * own**2)
    for j in range(4, r - 2, 2):
        M[j:j + 4, j:j + 4] += m
        K[j:j + 4, j:j + 4] += k
    return ReducedModel.from_matrices(M, K, body=["blades"] * 4 + ["damper"] * (r - 4))


def rows(model, pairs):
    """Bilateral spring between cover (u + z theta) and damper station of each carrying pair."""
    pairs = pairs.select(pairs.carrying)
    B = np.zeros((len(pairs), model.size))
    for i in range(len(pairs)):
        first = 0 if pairs.side[i] == "left" else 2
        B[i, first], B[i, first + 1], B[i, 4 + 2 * pairs.station[i]] = -1, -Z[pairs.station[i]], 1
    return B * np.sqrt(pairs.kn)[:, None]


def pairs_of(active):
    n = P["n"]
    station = np.tile(np.arange(n), 2)
    return contact_table(np.tile(np.eye(3), (2 * n, 1, 1)), side=np.repeat(["left", "right"], n), station=station,
                         kn=np.repeat([P["kL"], P["kR"]], n), weight=np.isin(station, active).astype(float))


def stations(name):
    """Of the sets in the file: 'ends_5_4' keeps 5 at the front and 4 at the back."""
    n = P["n"]
    if name in ("full31", "none"):
        return range(n) if name == "full31" else ()
    counts = [int(c) for c in name.split("_") if c.isdigit()]
    return [*range(counts[0]), *range(n - (counts[1] if len(counts) > 1 else 0), n)]


def out_of_phase(model):
    shape = np.zeros(model.size)
    shape[[0, 2]] = np.array([1, -1]) / np.sqrt(P["m1"] + P["m2"])
    return shape


@pytest.mark.parametrize("case", H1["results"], ids=lambda c: c["set"])
def test_frequencies_of_every_set(case):
    model = lumped_rig()
    found = StuckAssembly(model, rows).modes(pairs_of(stations(case["set"])), out_of_phase(model))
    told = np.array(case["f"])
    elastic = told > 1  # lower ones are rigid motions, 0 to rounding
    assert found.hz[:8][elastic] == pytest.approx(told[elastic], rel=1e-6)
    assert (found.hz[:8] < 1).sum() == case["rigid_modes"]
    if case["oop_index"] is not None and case["set"] != "only_front_5":
        assert found.tracked == case["oop_index"]
        assert found.tracked_hz == pytest.approx(case["oop_f"], rel=1e-6)


def test_target_within_reach():
    target = H1["tuning_targets"]["2300.0"]
    model = lumped_rig()
    found = detach_until(StuckAssembly(model, rows), pairs_of(range(P["n"])), 2300.0, out_of_phase(model))
    assert found.chosen.hz == pytest.approx(target["f"], rel=1e-6)
    assert found.chosen.front + found.chosen.back == P["n"] - target["best_removed"]
    assert found.chosen.hz - 2300.0 == pytest.approx(target["miss_Hz"], abs=1e-2)


def test_target_out_of_reach():
    model = lumped_rig()
    highest = H1["results"][0]["oop_f"]
    with pytest.raises(InputError, match=rf"target 4000 Hz is not reachable: \d+\.\.{highest:.0f} Hz"):
        detach_until(StuckAssembly(model, rows), pairs_of(range(P["n"])), 4000.0, out_of_phase(model))
