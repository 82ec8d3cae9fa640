"""Stage tune: options of [tune], of the kept rows and of their preload."""

import numpy as np
import pytest

from hbm.contact import ContactTable
from tests.tipdamp.rig_study import read

EACH_SIDE = 113 / (2 * np.sin(np.pi / 4))  # N, frictionless balance between faces at 45 degrees


def test_resolved_preload_still_balances_the_pull(variant):
    folder = variant("tune", ("[tune]", '[tune]\npreload = "resolved"'))
    found = read(folder, "tune.json")
    for figures in found["preload_kept"].values():
        assert figures["sum_N"] == pytest.approx(EACH_SIDE, rel=1e-6) and figures["balance_error"] < 1e-9
    # the roll that the edge line cannot balance: half the flat's width times the side force
    assert abs(found["redistribution"]["reactions"]["roll about y"]) == pytest.approx(EACH_SIDE * 0.8e-3, rel=1e-3)


def test_rows_kept_and_roll_stiffness(variant):
    hz, roll = {}, {}
    for name, changes in {"edge": [], "no roll": [('rows = "edge"', 'rows = "edge"\nroll_stiffness = 0')],
                          "given roll": [('rows = "edge"', 'rows = "edge"\nroll_stiffness = 4.0')],
                          "all": [('rows = "edge"', 'rows = "all"')]}.items():
        found = read(variant("tune", *changes), "tune.json")
        hz[name], roll[name] = found["stuck_hz"]["tuned"], found["roll_stiffness_Nm_per_rad"]
    # from_flat: kn w^2 / 12 at each of 9 stations
    assert roll == pytest.approx({"edge": 9 * 1.03e6 * 1.6e-3**2 / 12, "no roll": 0.0, "given roll": 4.0, "all": 0.0})
    assert hz["no roll"] < hz["edge"] < hz["given roll"] < hz["all"]


def test_rows_keep_their_part_of_the_map(variant):
    folder = variant("tune", ('rows = "edge"', 'rows = "all"'))
    whole, kept = (ContactTable.load(folder / f"{n}.csv") for n in ("preload", "kept"))
    on = kept.carrying & (kept.side == "right")
    factor = kept.preload[on] / whole.preload[on]
    assert np.ptp(factor) < 1e-9 * factor.mean()
    assert read(folder, "tune.json")["redistribution"]["moment_Nm"] == pytest.approx(0, abs=2e-2)


def test_the_in_phase_mode_can_be_followed(variant):
    other = read(variant("tune"), "tune.json")["stuck_hz"]["tuned"]
    found = read(variant("tune", ("[tune]", '[tune]\nfollow = "in_phase"')), "tune.json")
    # the damper mostly rolls: the mode keeps its shape and nearly its frequency [Zucca 2016, section 5]
    assert found["mac"]["tuned"] > 0.7 and found["stuck_hz"]["tuned"] < 0.7 * other


def test_tuning_to_a_target(variant):
    found = read(variant("tune", ("stations = [5, 4]", "target_hz = 2500")), "tune.json")
    best = min(found["history"], key=lambda s: abs(s["hz"] - 2500))
    assert found["tuned_pairs"] == {"front": best["front"], "back": best["back"]} and len(found["history"]) == 30


def test_conserved_total(variant):
    """The stations that stay carry the stiffness of the whole side: more than their share, the stuck mode higher."""
    kept = read(variant("tune"), "tune.json")["stuck_hz"]
    folder = variant("tune", ("[tune]", '[tune]\nstiffness = "conserved"'))
    table, full = (ContactTable.load(folder / f"{name}.csv") for name in ("kept", "preload"))
    for side in table.sides:
        mine = table.carrying & (table.side == side)
        assert table.kn[mine].sum() == pytest.approx(full.kn[full.side == side].sum())
        assert table.kt[mine].sum() == pytest.approx(full.kt[full.side == side].sum())
    whole = read(folder, "tune.json")["stuck_hz"]
    assert whole["tuned"] > kept["tuned"] and whole["full_line"] > kept["full_line"]
    assert whole["full_area"] == pytest.approx(kept["full_area"], rel=1e-12)


def test_detached_rows_of_an_own_table_carry_nothing(variant, tmp_path):
    """The upper row at weight 0: neither scale nor moment sees it."""
    variant("inspect")
    pairs = ContactTable.load(tmp_path / "pairs.csv")
    upper = (pairs.row == 1) & (pairs.station > 0) & (pairs.station < 30)
    pairs.replace(weight=np.where(upper, 0.0, 1.0)).save(tmp_path / "pairs.csv")
    folder = variant("tune", ('rows = "edge"', 'rows = "all"'))
    found = read(folder, "tune.json")
    assert ContactTable.load(folder / "preload.csv").preload[upper].tolist() == [0.0] * int(upper.sum())
    assert all(1 < scale < 4 for scale in found["redistribution"]["scale"].values())
    assert abs(found["redistribution"]["moment_Nm"]) < 0.1
