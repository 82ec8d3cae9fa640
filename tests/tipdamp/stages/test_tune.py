"""Stage tune: options of [tune], of the kept rows and of their preload."""

import json
import re

import numpy as np
import pytest
from scipy.linalg import eigh

from tests.tipdamp import corner_study
from tests.tipdamp.rig_study import read
from tipdamp.cli import main
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.model import ReducedModel
from tipdamp.static_contact.tuning.redistribution import carried
from tipdamp.static_contact.tuning.roll_springs import spring_rows
from tipdamp.static_contact.tuning.stuck_assembly import stuck_rows
from tipdamp.statics import model_inputs as inputs
from tipdamp.study.study import load_study

EACH_SIDE = 113 / (2 * np.sin(np.pi / 4))  # N, frictionless balance between faces at 45 degrees


def test_resolved_preload_still_balances_the_pull(variant):
    folder = variant("tune", ("[tune]", '[tune]\npreload = "resolved"'))
    found = read(folder, "tune.json")
    for figures in found["preload_kept"].values():
        assert (
            figures["sum_N"] == pytest.approx(EACH_SIDE, rel=1e-6)
            and figures["balance_error"] < 1e-9
        )
    # the roll that the edge line cannot balance: half the flat's width times the side force
    assert abs(found["redistribution"]["reactions"]["roll about y"]) == pytest.approx(
        EACH_SIDE * 0.8e-3, rel=1e-3
    )


def test_rows_kept_and_roll_stiffness(variant):
    hz, roll = {}, {}
    for name, changes in {
        "edge": [],
        "no roll": [('rows = "edge"', 'rows = "edge"\nroll_stiffness = 0')],
        "given roll": [('rows = "edge"', 'rows = "edge"\nroll_stiffness = 4.0')],
        "all": [('rows = "edge"', 'rows = "all"')],
    }.items():
        found = read(variant("tune", *changes), "tune.json")
        hz[name], roll[name] = found["stuck_hz"]["tuned"], found["roll_stiffness_Nm_per_rad"]
    # from_flat: kn w^2 / 12 at each of 9 stations
    assert roll == pytest.approx(
        {"edge": 9 * 1.03e6 * 1.6e-3**2 / 12, "no roll": 0.0, "given roll": 4.0, "all": 0.0}
    )
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
    # the damper mostly rolls: the mode keeps its shape and nearly its frequency [Zucca 2016,
    # section 5]
    assert found["mac"]["tuned"] > 0.7 and found["stuck_hz"]["tuned"] < 0.7 * other


def test_the_mode_that_reaches_a_target_is_named(variant, capsys):
    """The in-phase mode followed lies far below the out-of-phase one's target, and softer contact
    would lower it."""
    wanted = read(variant("tune"), "tune.json")["stuck_hz"]["tuned"]
    target = [
        ("[tune]", '[tune]\nfollow = "in_phase"'),
        ("stations = [5, 4]", f"target_hz = {wanted:.0f}"),
    ]
    with pytest.raises(AssertionError):
        variant("tune", *target)
    said = capsys.readouterr().err
    assert "is not reachable" in said and "[tune] follow = 'out_of_phase' reaches it" in said
    assert "softer" not in said


def test_tuning_to_a_target(variant, capsys):
    """The set nearest the target of those that leave no large moment: one that is nearer is refused
    where it is given (the nearest of all has its middle at a quarter of the damper's length)."""
    found = read(variant("tune", ("stations = [5, 4]", "target_hz = 2500")), "tune.json")
    nearer = sorted(found["history"], key=lambda s: abs(s["hz"] - 2500))
    left_out = nearer[
        : [(s["front"], s["back"]) for s in nearer].index(tuple(found["tuned_pairs"].values()))
    ]
    ends = [{(s["front"], s["back"]) for s in sets} for sets in (left_out, found["passed_over"])]
    assert left_out and ends[0] == ends[1]
    assert f"{len(left_out)} sets of stations nearer to the target" in " ".join(found["warnings"])
    for one in {(s["front"], s["back"]) for s in (*left_out[:1], *left_out[-1:])}:
        with pytest.raises(AssertionError):
            variant("tune", ("stations = [5, 4]", f"stations = {list(one)}"))
        assert "leaves a moment" in capsys.readouterr().err
    best = min(abs(s["hz"] - 2500) for s in nearer[len(left_out) :])
    kept = found["tuned_pairs"]
    chosen = next(
        s for s in found["history"] if (s["front"], s["back"]) == (kept["front"], kept["back"])
    )
    assert abs(chosen["hz"] - 2500) < best + 1e-4 and len(found["history"]) == 436
    assert found["stuck_hz"]["tuned"] == pytest.approx(chosen["hz"], abs=1e-5)
    assert [s["kept"] for s in found["station_worth"]] == [
        i in found["kept_stations"] for i in range(31)
    ]


MEASURED = """[measured.low]
files = ["a.csv", "b.csv"]
columns = ["frequency_hz", "amplitude"]
quantity = "receptance"
unit = "um/N"
level = 1
[tune]"""


def test_tuning_to_a_measured_peak(variant, tmp_path):
    """The mean peak of the repeats is the target, two standard deviations are its scatter."""
    hz = np.linspace(2505, 2705, 401)
    for name, peak in (("a", 2602.0), ("b", 2608.0)):
        np.savetxt(
            tmp_path / f"{name}.csv",
            np.column_stack([hz, 1 / np.abs(peak**2 - hz**2 + 0.04j * peak * hz)]),
            delimiter=",",
        )
    variant("preload", ("[tune]", MEASURED), ("stations = [5, 4]", 'target_from = "low"'))
    for stage in ("measured", "tune"):
        assert main([stage, str(tmp_path / "rig.toml"), "--quiet"]) == 0
    found = read(tmp_path / "results" / "rig", "tune.json")
    # of the amplitude
    assert found["target_hz"] == pytest.approx(2605 * np.sqrt(1 - 2 * 0.02**2), abs=0.05)
    assert found["scatter_hz"] == pytest.approx(2 * 6 / np.sqrt(2), abs=0.5)
    assert abs(found["stuck_hz"]["tuned"] - 2605) < found["scatter_hz"]
    # 10 + 1 would leave a moment
    assert [(s["front"], s["back"]) for s in found["equivalent"]] == [(3, 3)]


@pytest.mark.parametrize("order", ["from_middle", "least_loaded"])
def test_graded_station(variant, order):
    """The target is met, the graded pairs carry that part of their load, and the whole pull is
    carried. At 2500 Hz the part of a third station at one end alone leaves 5.8 % of the pull times
    the length, which is refused."""
    folder = variant(
        "tune", ("stations = [5, 4]", f'target_hz = 2620\ngraded = true\norder = "{order}"')
    )
    found = read(folder, "tune.json")
    whole, kept = (ContactTable.load(folder / f"{n}.csv") for n in ("preload", "kept"))
    assert found["stuck_hz"]["tuned"] == pytest.approx(2620, abs=0.01)
    last, part = found["graded"]["station"], found["graded"]["part"]
    on = kept.carrying & (kept.side == "left")
    factor = kept.preload[on] / whole.preload[on]
    assert factor[kept.station[on] == last] == pytest.approx(
        part * factor[kept.station[on] != last].mean(), rel=1e-9
    )
    assert kept.preload[on].sum() == pytest.approx(EACH_SIDE, rel=1e-6)


def crowned(folder):
    """pairs.csv with a crown on the left side."""
    pairs = ContactTable.load(folder / "pairs.csv")
    crown = np.interp(pairs.position[:, 1], *np.transpose(CROWN))
    pairs.replace(gap=np.where(pairs.side == "left", crown, 0.0)).save(folder / "pairs.csv")


CROWN = [[0, 0], [0.0175, 30e-6], [0.035, 40e-6], [0.0525, 30e-6], [0.07, 0]]


def test_pairs_open_at_rest_do_not_stick(variant, tmp_path):
    """A crown opens 11 pairs of the left side: area and line fall, and both as without these
    pairs."""
    flat = read(variant("tune"), "tune.json")["stuck_hz"]
    crowned(tmp_path)
    folder = variant("tune", ("stations = [5, 4]", "stations = [12, 9]"))
    found, whole = read(folder, "tune.json"), ContactTable.load(folder / "preload.csv")
    opened = whole.preload <= 0
    assert opened.sum() == 11 and (whole.side[opened] == "left").all()
    assert found["open_pairs"]["full_area"] == found["open_pairs"]["full_line"] == 11
    kept = ContactTable.load(folder / "kept.csv")
    assert found["open_pairs"]["tuned"] == (kept.carrying & opened).sum() > 0
    assert (kept.preload[kept.carrying & opened] < 0).all()  # they may close as the damper moves
    for name in ("full_area", "full_line"):
        assert found["stuck_hz"][name] < flat[name] - 10
    whole.replace(weight=np.where(opened, 0.0, 1.0)).save(tmp_path / "pairs.csv")
    without = read(variant("tune", ("stations = [5, 4]", "stations = [12, 9]")), "tune.json")
    assert without["stuck_hz"] == pytest.approx(found["stuck_hz"], rel=1e-9)


def test_linear_response_leaves_open_pairs_out(variant, tmp_path):
    """stuck.npz against the superposition of the modes of the closed pairs with their roll springs,
    written out; damped by what gives the modes with all pairs closed the ratio asked for."""
    variant("preload")
    crowned(tmp_path)
    folder = variant(
        "respond",
        ("stations = [5, 4]", "stations = [16, 15]"),
        ("levels = [1, 20]", "levels = [1]"),
        ("band = [2300, 3300]", "band = [3300, 3700]"),
    )
    study = load_study(tmp_path / "rig.toml")
    model = ReducedModel.load(folder / "model.npz")
    kept = ContactTable.load(folder / "kept.csv")
    closed = kept.carrying & (kept.preload > 0)
    assert closed.sum() < kept.carrying.sum()
    with np.load(folder / "stuck.npz") as linear:
        hz, found, names = (linear[k] for k in ("frequency", "response", "output_names"))

    def modes(stuck, rolling):
        rows = np.vstack(
            [
                stuck_rows(model, kept.select(stuck)),
                spring_rows(model, kept, inputs.declared_springs(study, kept, rolling)),
            ]
        )
        return eigh(model.K + rows.T @ rows, model.M)

    def superposed(stuck):
        all_closed, shapes = modes(kept.carrying, stuck)
        lam, phi = modes(stuck, stuck)
        damping = (2 * 0.022 * np.sqrt(all_closed)) @ (shapes.T @ model.M @ phi) ** 2
        w = 2 * np.pi * hz[:, None]
        shape = np.array([inputs.outputs(study, model)[name] for name in names]) @ phi
        return (phi.T @ inputs.excitation(study, model) / (lam - w**2 + 1j * damping * w)) @ shape.T

    assert np.abs(found - superposed(closed)).max() < 1e-8 * np.abs(found).max()
    assert np.abs(found - superposed(kept.carrying)).max() > 0.1 * np.abs(found).max()


def test_row_that_stands_for_a_flat_goes_with_its_station(variant, tmp_path):
    """Row 0 open, row 1 closed: row 0 stands for the station and sticks. Both open: it goes."""
    variant("tune")
    whole = ContactTable.load(tmp_path / "results" / "rig" / "preload.csv")
    low, high = ((whole.side == "right") & (whole.station == 3) & (whole.row == r) for r in (0, 1))
    one = whole.preload.copy()
    one[low] = -0.3
    line = whole.replace(weight=(whole.row == 0).astype(float))
    assert carried(whole.replace(preload=one), line)[low] == pytest.approx(one[high])
    one[high] = -0.1
    assert carried(whole.replace(preload=one), line)[low] == pytest.approx(-0.3)


def test_a_table_of_kept_pairs_overrides_the_target(variant, tmp_path):
    """Edited by hand: a pair with half its area, one with more preload, its rows turned round; it
    stays as it is."""
    folder = variant("tune", ("stations = [5, 4]", "target_hz = 2500"))
    kept = ContactTable.load(folder / "kept.csv")
    weight, preload = kept.weight.copy(), kept.preload.copy()
    place = np.flatnonzero(kept.carrying)[2]
    weight[place], preload[place] = 0.5, 9.0
    own = (
        kept.replace(weight=weight, preload=preload)
        .select(slice(None, None, -1))
        .save(tmp_path / "mine.csv")
    )
    text = own.read_text()
    found = read(
        variant("tune", ("stations = [5, 4]", 'target_hz = 2500\nkept = "mine.csv"')), "tune.json"
    )
    after = ContactTable.load(folder / "kept.csv")
    assert (after.weight == weight).all() and (after.preload == preload).all()
    assert found["table"] == "mine.csv" and own.read_text() == text
    assert 0 < read(folder, "tune.json")["stuck_hz"]["tuned"] < 2600
    # another preload than the table's where the study says so
    scaled = variant("tune", ("stations = [5, 4]", 'kept = "mine.csv"\npreload = "scaled"'))
    assert read(scaled, "tune.json")["preload_kept"]["left"]["sum_N"] == pytest.approx(
        EACH_SIDE, rel=1e-6
    )


@pytest.mark.parametrize(
    "change, said",
    [
        (lambda kept: kept.select([0, 1, 0]), "row 3: side 'left', .* is there twice"),
        (
            lambda kept: kept.replace(blade_node=kept.blade_node + 1),
            "row 1: .* the study has no such pair",
        ),
    ],
)
def test_a_table_of_other_pairs_is_refused(variant, tmp_path, capsys, change, said):
    folder = variant("tune")
    change(ContactTable.load(folder / "kept.csv")).save(tmp_path / "mine.csv")
    with pytest.raises(AssertionError):
        variant("tune", ("stations = [5, 4]", 'kept = "mine.csv"'))
    assert re.search(f"mine.csv, {said}", capsys.readouterr().err)


@pytest.mark.parametrize(
    "factor, said",
    [
        ([1e-3], "kn too small by a factor of 1000"),
        ([1e3, 1.0], "times the median of its side"),
    ],
)
def test_another_unit_in_a_table_of_kept_pairs_is_told(variant, tmp_path, capsys, factor, said):
    kept = ContactTable.load(variant("tune") / "kept.csv")
    share = np.r_[factor, np.ones(len(kept))][: len(kept)] if len(factor) > 1 else factor[0]
    kept.replace(kn=share * kept.kn, kt=share * kept.kt).save(tmp_path / "mine.csv")
    capsys.readouterr()
    variant("tune", ("stations = [5, 4]", 'kept = "mine.csv"'))
    assert said in capsys.readouterr().out


def test_conserved_total(variant):
    """The stations that stay carry the stiffness of the whole side: more than their share, the
    stuck mode higher."""
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
    assert ContactTable.load(folder / "preload.csv").preload[upper].tolist() == [0.0] * int(
        upper.sum()
    )
    assert all(1 < scale < 4 for scale in found["redistribution"]["scale"].values())
    assert abs(found["redistribution"]["moment_Nm"]) < 0.1


def moment_of(table, on):
    """(3,) N m of the forces on the damper about x, y, z."""
    force = -np.maximum(table.preload[on], 0)[:, None] * table.normal[on]
    return np.cross(table.position[on], force).sum(axis=0)


@pytest.mark.parametrize(
    "keys, off",
    [
        ('by = "area"', 0.1),
        ('by = "area"\norder = "from_middle"', 0.1),
        ('by = "cell"\ncell_size = 0.006\ngraded = true', 0.1),
        ('by = "cell"\ncell_size = 0.004', 115),
    ],
)
def test_tuning_by_area(variant, keys, off):
    """The target is met, as nearly as whole cells at both ends let it (2 + 2 stations give 2390 Hz,
    3 + 3
    2607 Hz); the same share of the line of the cylinder and of the flat stays and carries the whole
    pull, each contact its own part of the map."""
    folder = variant("tune", ("stations = [5, 4]", f"{keys}\ntarget_hz = 2500"))
    found = read(folder, "tune.json")
    whole, kept = (ContactTable.load(folder / f"{n}.csv") for n in ("preload", "kept"))
    area, moment = found["area"], np.zeros(3)
    assert (kept.preload[~kept.carrying] == 0).all() and not kept.carrying.all()
    assert abs(found["stuck_hz"]["tuned"] - 2500) <= off and 0.1 < area["share"] < 0.9
    assert {name: side["unit"] for name, side in area["sides"].items()} == {
        "left": "mm",
        "right": "mm2",
    }
    for name, side in area["sides"].items():
        on = kept.carrying & (kept.side == name)
        assert kept.preload[on].sum() == pytest.approx(EACH_SIDE, rel=1e-6)
        assert side["kept"] / side["closed"] == pytest.approx(
            area["share"], abs=0.1 if off > 1 else 1e-6
        )
        moment += moment_of(whole, whole.side == name) - moment_of(kept, on)
        if name == "left":  # one row: nothing is moved from other rows to it
            factor = kept.preload[on] / whole.preload[on] / kept.weight[on]
            assert np.ptp(factor) < 1e-9 * factor.mean()
    assert found["redistribution"]["moment_Nm"] == pytest.approx(moment[1], abs=1e-9)
    assert found["redistribution"]["moments_Nm"] == pytest.approx(moment, abs=1e-9)
    hz = [step["hz"] for step in area["history"]]
    assert hz[0] == pytest.approx(found["stuck_hz"]["full_line"], abs=1e-3) and hz[0] > hz[-1]


def test_a_given_share_of_the_area(variant):
    """All of it is the whole line; half of it lies between that and nothing."""
    hz = {
        share: read(
            variant("tune", ("stations = [5, 4]", f'by = "area"\nkept_share = {share}')),
            "tune.json",
        )["stuck_hz"]
        for share in (1, 0.5)
    }
    assert (
        hz[1]["tuned"] == pytest.approx(hz[1]["full_line"], rel=1e-9)
        and hz[0.5]["tuned"] < hz[1]["tuned"] - 50
    )


def test_a_moment_of_the_choice_is_refused(variant, capsys):
    """Nearly all of the kept contact at one end: by the lever rule 9 + 1 of 31 stations of equal
    loads have their middle at (9 * 4 + 30) / 10 = 6.6 instead of 15 stations, 28 % of the
    length."""
    with pytest.raises(AssertionError):
        variant("tune", ("stations = [5, 4]", "stations = [9, 1]"))
    said = capsys.readouterr().err
    assert re.search(
        r"leaves a moment of .*: 2\d\.\d% of the load at rest times the length of the contact", said
    )
    assert "stations = [n, n]" in said and 'preload = "resolved"' in said


def test_scaled_beside_resolved(variant, tmp_path):
    """5 + 4 of 31 stations of equal loads: their middle is (5 * 2 + 4 * 28.5) / 9 = 13.8 instead of
    15, 4 % of the length; beside it the same pairs solved again, as preload = "resolved" has them.
    5 + 5 leave the roll of the edge line alone, 0.8 % of it."""
    folder = variant("report")
    done = read(folder, "tune.json")["redistribution"]
    assert 0.01 < done["moment_share"] < 0.05
    size = 113 * 0.07
    assert done["moment_share"] == pytest.approx(
        np.linalg.norm(done["moments_Nm"]) / size, rel=1e-6
    )
    assert "solved again" in (folder / "report.html").read_text()
    even = read(variant("tune", ("stations = [5, 4]", "stations = [5, 5]")), "tune.json")[
        "redistribution"
    ]
    assert even["moment_share"] < 0.01 and even["resolved"] is None
    again = read(variant("tune", ("[tune]", '[tune]\npreload = "resolved"')), "tune.json")
    for side, found in done["resolved"]["sides"].items():
        expected = again["preload_kept"][side]
        assert found == pytest.approx({key: expected[key] for key in found}, rel=1e-9)
    assert done["resolved"]["reactions"] == pytest.approx(again["redistribution"]["reactions"])


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes, damper", [((), {}), ((("2e11", "5e9"), ("1.5e11", "4e9")), {"along": 9})]
)
def test_a_symmetric_damper_is_tuned_symmetrically(tmp_path, changes, damper):
    """Damper, pull and preload are symmetric about y = 0 and about x = 0, the blades' tetrahedra
    are not: what is kept leaves no moment, and no more on one end than on the other."""
    pytest.importorskip("dolfinx")
    pytest.importorskip("gmsh")
    from tests.tipdamp import symmetric_wedge

    study = symmetric_wedge.write(tmp_path, *changes, **damper)
    for verb in ("reduce", "preload", "tune"):
        assert main([verb, str(study), "--quiet"]) == 0
    found = read(tmp_path / "results" / "wedge", "tune.json")
    assert found["redistribution"]["moment_share"] < 1e-3
    assert [m["noise"] < 0.01 for m in found["area"]["mirrors"]] == [True, True]
    kept = ContactTable.load(tmp_path / "results" / "wedge" / "kept.csv")
    for side in kept.sides:
        mine = kept.select(kept.side == side)
        order = np.lexsort((mine.row, mine.station))
        mirrored = np.lexsort((mine.row, -mine.station))
        assert mine.weight[order] == pytest.approx(mine.weight[mirrored])


def test_modes_around_a_tracked_one_of_20_kHz(tmp_path):
    """Shown, and checked on the full model: the limits of 10 and 5 kHz hold below it alone."""
    study = corner_study.write(
        tmp_path, change=[("[respond]", '[tune]\nstations = "all"\n[respond]')]
    )
    for verb in ("inspect", "reduce", "preload", "tune"):
        assert main([verb, str(study), "--quiet"]) == 0
    found = json.loads((tmp_path / "results" / "corner" / "tune.json").read_text())
    tracked = found["stuck_hz"]["tuned"]
    assert tracked > 20e3
    assert min(abs(hz - tracked) for hz in found["stuck_modes_hz"]["tuned"]) == 0
    check = found["full_model_check"]["tuned"]
    assert len(check["full_hz"]) == len(check["reduced_hz"]) > 0
    assert min(abs(hz - tracked) for hz in check["reduced_hz"]) == 0
