"""Stage respond: the law of the study, and what is said of curves that are incomplete."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from tests.hbm.cases import jenkins, load
from tests.tipdamp import corner_study
from tests.tipdamp.backwards import followed_back
from tests.tipdamp.report.files import FULL, artefacts, table
from tests.tipdamp.rig_study import read, text
from tipdamp.cli import main
from tipdamp.engine import curves
from tipdamp.engine.curves import CurveCase
from tipdamp.engine.store import Store
from tipdamp.hbm.balance.open_damping import open_modes
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.balance.receptance import linear_response
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.laws import SHIPPED, Contacts, DryFriction2T, Jenkins1D, UnilateralSpring
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.response import follow_band, forced_response
from tipdamp.hbm.result import ForcedResponse
from tipdamp.results.response_results import CurveResult, Peak, RespondResult
from tipdamp.results.static_results import PreloadResult
from tipdamp.stages import respond, response_doubts
from tipdamp.stages.curve_facts import curve_result, peak_of, peak_shape, with_macs
from tipdamp.statics import model_inputs as terms
from tipdamp.statics.model_inputs import excitation, in_patch, outputs
from tipdamp.study.schema import Respond
from tipdamp.study.study import load_study


def curve_of(path):
    for stage in ("reduce", "preload", "tune", "respond"):
        assert main([stage, str(path), "--quiet"]) in (0, 3)
    given = load_study(path)
    store = Store(given.results)
    found = RespondResult.load(store)
    return given, store, found, ForcedResponse.load(store.path(found.responses[0].file))


@pytest.mark.parametrize("name", ["IsotropicFriction", "DryFriction1T"])
def test_another_law_is_the_library_call(matrices_study, name):
    text("levels = [5]", f'levels = [40]\nboth_ways = false\nlaw = "{name}"')(matrices_study)
    given, store, found, curve = curve_of(matrices_study)
    model = ReducedModel.load(store.path("model.npz"))
    table = ContactTable.load(store.path("kept.csv"))
    with threadpool_limits(limits=1, user_api="blas"):  # as a study does
        direct = forced_response(
            model,
            table.select(table.carrying),
            SHIPPED[name](),
            40 * excitation(given, model),
            given.respond.band,
            harmonics=1,
            damping_ratio=0.01,
            outputs=outputs(given, model),
        )
    assert found.law.name == name and len(curve.slipping_pairs)
    assert direct.frequency == pytest.approx(curve.frequency, rel=1e-9)
    assert np.abs(direct.harmonics - curve.harmonics).max() < 1e-9 * np.abs(curve.harmonics).max()


def test_the_page_on_a_finished_study(matrices_study, monkeypatch):
    """docs/python.md, block by block: the model and table of the results folder give the stored
    curve again, and its peak is an orbit of the problem that the study put together."""
    text("levels = [5]\nharmonics = [1]", "levels = [20]\nharmonics = [3]\nboth_ways = false")(
        matrices_study
    )
    _, _, found, stored = curve_of(matrices_study)
    monkeypatch.chdir(matrices_study.parent)
    page = (Path(__file__).parents[3] / "docs" / "python.md").read_text(encoding="utf-8")
    names = {}
    for block in re.findall(
        r"```python\n(.*?)```", page.partition("## From a finished study")[2], re.DOTALL
    ):
        exec(compile(block, "python.md", "exec"), names)
    again = forced_response(
        names["model"],
        names["kept"],
        DryFriction2T(),
        20 * names["force"],
        (900, 1400),
        **names["given"],
    )
    assert again.peak("patch_1:2") == pytest.approx(stored.peak("patch_1:2"), rel=1e-9)
    assert found.responses[0].peak_m == stored.peak("patch_1:2")[1] and list(names["rows"]) == list(
        stored.output_names
    )
    assert (
        names["verified"].stable and names["verified"].difference < 1e-2 and names["other"].complete
    )


def test_parameters_are_checked_before_solving(matrices_study, capsys):
    text("levels = [5]", 'levels = [5]\nlaw = { name = "CubicSpring", cubic = "much" }')(
        matrices_study
    )
    assert main(["respond", str(matrices_study), "--quiet"]) == 2
    assert "[respond] law" in capsys.readouterr().err


def test_incomplete_curves_are_counted(tmp_path):
    """Three curves, one of them with two failed points, one whose way back ends early."""
    peak = {"peak_hz": 1.0, "peak_m": 1.0, "min_peak_m": 1.0}
    whole = {**peak, "complete": True, "ended": "", "failed_points": 0, "seconds": 1.0}
    curve = {
        **whole,
        "file": "a.npz",
        "Fe_N": 1.0,
        "H": 1,
        "patches": {"p": peak},
        "points": 10,
        "residual_calls": 1,
        "slipping_pairs": (),
        "origin": "preloaded",
        "start": "zero_slider",
    }
    curves = [
        {**curve, "back": whole},
        {**curve, "failed_points": 2, "back": whole},
        {**curve, "back": {**whole, "complete": False}},
    ]
    found = RespondResult(responses=curves, law={"name": "DryFriction2T"}, zeta=(0.01,))
    store = Store(tmp_path)
    found.save(store)
    assert respond.incomplete(found) == (2, 6)
    assert respond.line(store) == (
        "3 curves (6 with those followed back), 30 points, 2 points failed, 2 curves incomplete"
    )


@pytest.mark.parametrize("both", [False, True])
def test_cut_curve_has_no_peak(matrices_study, monkeypatch, capsys, both):
    """Twelve points upwards, and the same or all of them downwards: no peak where the curve
    stopped, and it is said."""

    def stopped(problem, force, band, **options):
        limit = Settings(max_points=12) if both or band[0] < band[1] else Settings()
        return follow_band(problem, force, band, settings=limit, **options)

    monkeypatch.setattr(curves, "follow_band", stopped)
    _, store, found, curve = curve_of(matrices_study)
    case, printed = found.responses[0], capsys.readouterr()
    assert (case.peak_hz, case.peak_m, case.min_peak_m) == (None, None, None)
    assert (case.at_least_hz, case.at_least_m) == max(
        (curve.at_least(n) for n in curve.output_names if n.startswith("patch_1:")),
        key=lambda p: p[1],
    )
    assert case.patches["patch_2"].peak_m is None and case.patches["patch_2"].at_least_m > 0
    missing = 2 if both else 1
    assert respond.line(store).endswith(f"{missing} curves incomplete, {missing} without a peak")
    assert f"{missing} of 2 curves are incomplete, {missing} of them without a peak" in printed.err
    known = (
        f"incomplete: no peak, at least {1e6 * case.at_least_m:.4g} um at {case.at_least_hz:.1f} "
        "Hz; stopped at "
    )
    assert (
        known in printed.out
        and ("followed the other way it has a peak, " in printed.out) is not both
    )
    assert (case.back.peak_m is None) is both and (case.back.at_least_m is None) is not both


def test_stuck_curve_is_the_linear_one(rig_results):
    """At 1 N no pair slips: harmonic balance equals the linear stuck response with the same
    damping."""
    response = rig_results.read_json("respond.json")
    gentle = next(r for r in response["responses"] if r["Fe_N"] == 1)
    assert gentle["slipping_pairs"] == [] and gentle["complete"] and gentle["failed_points"] == 0
    assert response["stuck_difference"][gentle["file"]] < 1e-6


def test_stuck_curve_by_a_second_route(rig_results, rig):
    """Direct solution of the complex dynamic stiffness with hysteretic-free modal damping, at three
    frequencies."""
    study = load_study(rig / "rig.toml")
    model = ReducedModel.load(rig_results.path("model.npz"))
    table = ContactTable.load(rig_results.path("kept.csv"))
    from scipy.linalg import eigh

    from tipdamp.static_contact.tuning.roll_springs import with_springs
    from tipdamp.static_contact.tuning.stuck_assembly import stuck_rows

    model = with_springs(model, table, terms.declared_springs(study, table))
    rows = stuck_rows(model, table)
    K = model.K + rows.T @ rows
    lam, phi = eigh(K, model.M)
    C = model.M @ phi @ np.diag(2 * 0.022 * np.sqrt(lam)) @ phi.T @ model.M
    force, out = terms.excitation(study, model), terms.outputs(study, model)
    hz = np.array([2400.0, 2781.0, 3200.0])
    direct = [
        np.array(list(out.values())) @ np.linalg.solve(K + 1j * w * C - w**2 * model.M, force)
        for w in 2 * np.pi * hz
    ]
    ours = linear_response(model, table.select(table.carrying), force, hz, 0.022, out)
    assert np.abs(ours - direct).max() < 1e-8 * np.abs(direct).max()


def test_friction_damps_and_both_ways_agree(rig_results, rig):
    responses = rig_results.read_json("respond.json")["responses"]
    backwards = followed_back(load_study(rig / "rig.toml"), rig_results, responses)
    for r, (down, peak, _) in zip(responses, backwards, strict=True):
        assert r["complete"] and r["failed_points"] == 0
        assert r["alike_backwards"] and r["back"] is None
        assert down.complete and peak.peak_m == pytest.approx(r["peak_m"], rel=1e-7)
        curve = ForcedResponse.load(rig_results.path(r["file"]))
        shares = curve.share_stick + curve.share_slip + curve.share_open
        assert np.allclose(shares[curve.converged], 1.0, atol=1e-9)
    strong = responses[-1]
    assert strong["Fe_N"] == 20 and len(strong["slipping_pairs"]) > 0


def test_damping_per_mode_and_one_way(variant):
    one = read(variant("respond", ("levels = [1, 20]", "levels = [1]")), "respond.json")[
        "responses"
    ][0]
    ratios = "[" + ", ".join(["0.022"] * 3 + ["0.05"] * 3) + "]"
    folder = variant(
        "respond",
        ("levels = [1, 20]", "levels = [1]\nboth_ways = false"),
        ("damping_ratio = 0.022", f"damping_ratio = {ratios}"),
    )
    two = read(folder, "respond.json")["responses"][0]
    assert two["back"] is None and two["peak_m"] != pytest.approx(one["peak_m"], rel=1e-4)


def two_blades(Fe):
    """Two uncoupled blades; the first one's friction melts its peak away as the level rises, the
    second has none."""
    pairs = Contacts([0.0], [0.3], [1.0], [1.0])
    problem = ContactProblem(
        np.eye(2),
        np.diag([0.02, 0.03]),
        np.diag([1.0, 4.0]),
        np.array([[1.0, 0.0]]),
        Jenkins1D(),
        pairs,
    )
    return problem, follow_band(
        problem,
        Fe * np.array([1.0, 1.0]),
        (0.1, 0.5),
        harmonics=1,
        outputs={"left:1": [1.0, 0.0], "right:2": [0.0, 1.0], "both:1": [1.0, 1.0]},
    )


@pytest.mark.parametrize("hold", ["", 'hold = "y"'])
def test_a_curve_without_any_solved_point(tmp_path, hold):
    """Nothing of it is known; said in the line and in the warnings, which lead with what to hold
    where friction alone holds the damper."""
    problem, curve = two_blades(1.0)
    none = replace(
        curve,
        converged=np.zeros_like(curve.converged),
        complete=False,
        reached_end=False,
        ended="no start",
        harmonics=np.full_like(curve.harmonics, np.nan),
        energy_error=np.full_like(curve.energy_error, np.nan),
    )
    settings = Respond(levels=[1.0], band=[0.1, 0.5], damping_ratio=0.01, patches=["left", "right"])
    found = curve_result(settings, table(), problem, CurveCase(1.0, 1, (0.1, 0.5)), (none, none))
    assert found.peak_m is found.at_least_m is found.energy_error is None and not len(
        peak_shape(none, found)
    )
    store = Store(tmp_path)
    RespondResult(responses=[found], law={"name": "Jenkins1D"}, zeta=(0.01,)).save(store)
    PreloadResult(
        sides={},
        residual=0,
        iterations=1,
        method="newton",
        kn_kt_N_per_m={},
        free_motions=[{"name": "slide along y", "unit": "N", "load": 0}],
    ).save(store)
    study = load_study(corner_study.write(tmp_path, change=[("pull = 10", f"pull = 10\n{hold}")]))
    assert respond.line(store).endswith(
        "2 curves incomplete, 2 without a peak, 2 without a solved point"
    )
    first = (
        ""
        if hold
        else (
            "nothing but friction holds the damper (slide along y): first hold its mean position, "
            "the "
            'vibration stays free: [damper] hold = { motion = "y", mean = true }; '
        )
    )
    said = [
        text
        for text in respond.warnings(study, store)
        if f"no peak, no point solved; {first}no start" in text
    ]
    assert len(said) == 2


def test_pairs_that_lift_off_are_counted():
    """Of ten, two slip and open, one opens alone, and one of these is open at rest already."""
    problem, curve = two_blades(1.0)
    opened = np.zeros((len(curve.frequency), 10))
    slip = np.zeros((len(curve.frequency), 10))
    opened[3:5, [1, 4, 7]], slip[3:9, [1, 4, 9]] = 0.2, 0.3
    curve = replace(curve, share_open=opened, share_slip=slip, share_stick=1 - opened - slip)
    settings = Respond(levels=[1.0], band=[0.1, 0.5], damping_ratio=0.01, patches=["left", "right"])
    kept = table().select(np.arange(10)).replace(preload=np.where(np.arange(10) == 4, -1.0, 1.0))
    found = curve_result(settings, kept, problem, CurveCase(1.0, 1, (0.1, 0.5)), (curve,))
    assert found.lift_off_pairs == ("left 1", "right 1/0") and len(found.slipping_pairs) == 4


def test_a_peak_of_another_mode_is_named(tmp_path):
    """Blade 1 is highest at the low level; slip damps it, so that blade 2 is at the high one."""
    settings = Respond(levels=[1.0], band=[0.1, 0.5], damping_ratio=0.01, patches=["both", "right"])
    found, shapes = [], []
    for Fe in (0.01, 0.02, 0.75):
        problem, curve = two_blades(Fe)
        found.append(
            curve_result(settings, table(), problem, CurveCase(Fe, 1, (0.1, 0.5)), (curve,))
        )
        shapes.append(peak_shape(curve, found[-1]))
    found = with_macs(found, shapes)
    assert found[0].mac is None and found[1].mac == pytest.approx(1.0) and found[2].of_another_mode
    store = Store(tmp_path)
    RespondResult(responses=found, law={"name": "Jenkins1D"}, zeta=(0.01,)).save(store)
    said = [text for text in respond.warnings(None, store) if "another mode" in text]
    assert (
        len(said) == 1
        and said[0].startswith("the peak at Fe = 0.75 N, H = 1, ")
        and "than at 0.02 N, " in said[0]
    )


def test_a_peak_that_is_not_solved_is_named(tmp_path):
    """On the curve itself and on the one from the other end; a solved one is not."""
    problem, force = jenkins(load("A1")["parameters"])
    curve = follow_band(problem, force, (0.1, 0.2), harmonics=1, outputs={"top:1:x": [1.0]})
    open_end = replace(curve, peak_points=np.zeros_like(curve.peak_points))
    solved, unsolved = (
        dict(peak_of(one, in_patch(one.output_names, "top:1"))) for one in (curve, open_end)
    )
    assert solved["unsolved"] == "" and "not solved" in unsolved["unsolved"]
    ways = {"complete": True, "ended": "", "failed_points": 0, "seconds": 1.0}
    assert solved["truncation"] > 0.01  # of one harmonic, told by a sentence of its own
    solved, unsolved = ({**one, "truncation": 1e-4} for one in (solved, unsolved))
    case = {
        **unsolved,
        **ways,
        "file": "a.npz",
        "Fe_N": 2.0,
        "H": 1,
        "patches": {"top:1": unsolved},
        "points": 10,
        "residual_calls": 1,
        "slipping_pairs": (),
        "origin": "preloaded",
        "start": "zero_slider",
        "back": {**solved, **ways},
    }
    store = Store(tmp_path)
    RespondResult(responses=[case], law={"name": "Jenkins1D"}, zeta=(0.01,)).save(store)
    (said,) = respond.warnings(None, store)
    assert "the peak of the curve Fe = 2 N, H = 1, " in said and "the maximum is not solved" in said
    case |= {"unsolved": "", "energy_error": 3e-7, "back": {**solved, **ways, "energy_error": 2e-5}}
    RespondResult(responses=[case], law={"name": "Jenkins1D"}, zeta=(0.01,)).save(store)
    (said,) = respond.warnings(None, store)
    assert (
        "balanced to 2.0e-05 of the input only (worst at Fe = 2 N, H = 1; above 1e-06 on 1 of 2 "
        "curves)" in said
    )


def two_modes(top):
    """(curve of two resonances up to `top` rad/s, its Peak): it is largest at the end from 1.96
    on."""
    one = np.eye(2)
    problem = ContactProblem(
        one,
        0.05 * one,
        np.diag([1.0, 4.0]),
        one[:1],
        Jenkins1D(),
        Contacts([0.0], [0.1], [1.0], [1e3]),
    )
    curve = follow_band(
        problem,
        np.array([0.1, 1.0]),
        np.array([0.5, top]) / (2 * np.pi),
        harmonics=1,
        outputs={"top:1:x": [1.0, 1.0]},
    )
    return curve, peak_of(curve, in_patch(curve.output_names, "top:1"))


def whole_curve(**facts):
    """Facts of a curve that is complete, beside those that a test is about."""
    return CurveResult(
        file="a.npz",
        points=10,
        failed_points=0,
        slipping_pairs=(),
        seconds=1.0,
        residual_calls=1,
        complete=True,
        ended="",
        origin="preloaded",
        start="zero_slider",
        **facts,
    )


@pytest.mark.parametrize("inside", [True, False])
def test_largest_at_an_end_beside_a_local_maximum(inside):
    """The maximum inside the band is told; that there is none is said where there is none."""
    curve, peak = two_modes(1.96)
    assert peak.peak_m is None and peak.at_least_hz == pytest.approx(1.96 / (2 * np.pi))
    a = curve.amplitude()[:, 0]
    top = int(np.argmax(np.where(curve.frequency < 1.5 / (2 * np.pi), a, 0)))
    assert 0 < top < len(a) - 1 and (peak.inside_hz, peak.inside_m) == (
        curve.frequency[top],
        a[top],
    )
    if not inside:
        peak = peak.model_copy(update={"inside_hz": None, "inside_m": None})
    case = whole_curve(**dict(peak), Fe_N=2.0, H=1, patches={"top:1": peak})
    (said,) = response_doubts._without_resonance(case, (0.3183,))
    known = (
        (
            f"has a local maximum inside the band, {1e6 * a[top]:.4g} um at "
            f"{curve.frequency[top]:.1f} Hz, but is largest at the end, "
        )
        if inside
        else "has no peak inside the band: it is largest at"
    )
    assert known in said and said.endswith("; widen [respond] band")


def test_the_error_by_harmonics_is_that_of_the_worst_patch():
    """Of two patches the second misses the tolerance; one alone needs no name."""
    peak = {"peak_hz": 1.0, "peak_m": 1.0, "min_peak_m": 1.0}
    patches = {"tip_a": Peak(**peak, truncation=0.02), "tip_b": Peak(**peak, truncation=0.17)}
    case = whole_curve(**peak, truncation=0.02, Fe_N=20.0, H=3, patches=patches)
    (said,) = response_doubts._truncated([case], 0.05)
    assert "above the tolerance 0.05 at Fe = 20 N (1.7e-01 on tip_b): set" in said
    assert not list(response_doubts._truncated([case], 0.2))
    alone = case.model_copy(update={"patches": {"tip_b": patches["tip_b"]}})
    (said,) = response_doubts._truncated([alone], 0.05)
    assert "at Fe = 20 N (1.7e-01): set" in said


def test_further_solutions_are_warned_of(tmp_path):
    """Once, and not where the curve from the other end is complete and knows of no others."""
    peak = {"peak_hz": 1.0, "peak_m": 1.0, "min_peak_m": 1.0}
    whole = {**peak, "complete": True, "ended": "", "failed_points": 0, "seconds": 1.0}
    curve = {
        **whole,
        "file": "a.npz",
        "Fe_N": 1.0,
        "H": 1,
        "patches": {"p": peak},
        "points": 10,
        "residual_calls": 1,
        "slipping_pairs": (),
        "origin": "preloaded",
        "start": "zero_slider",
        "further": "the branch leaves the band before its fold",
    }
    store = Store(tmp_path)
    for back, told in ((None, True), ({**whole, "complete": False}, True), (whole, False)):
        given = {**curve, "back": back} if back else curve
        RespondResult(responses=[given], law={"name": "DryFriction2T"}, zeta=(0.01,)).save(store)
        sentence = "the curve Fe = 1 N, H = 1: the branch leaves the band before its fold"
        assert (sentence in respond.warnings(None, store)) is told


def test_what_moves_too_far_and_another_mode_than_the_tracked_are_told(tmp_path):
    """Blades of 130 mm that move by 12.8 mm at 428 Hz, tuned to 580 Hz: both are told of the first
    level; within 1 % of the size and between free and stuck neither is."""
    study, store = artefacts(tmp_path, sections=FULL)
    for name in ("reduce", "tune"):
        store.finish(name, "", [f"{name}.json"], 0.0)
    tune = store.read_json("tune.json")
    tune |= {
        "stuck_hz": {"full_area": 600.0, "full_line": 590.0, "tuned": 580.0},
        "stuck_modes_hz": {"full_area": [], "full_line": [], "tuned": [428.3, 580.0]},
        "other_modes": {"in_phase": {"hz": 428.3, "mac": 0.9}},
    }
    store.write_json("tune.json", tune)
    free = {"out_of_phase": 420.0, "in_phase": 421.0}
    store.write_json("reduce.json", store.read_json("reduce.json") | {"free_hz": free})
    whole = RespondResult.load(store).model_copy(update={"size_m": 0.13})

    def told(hz, m):
        curves = tuple(
            one.model_copy(update={"peak_hz": hz, "peak_m": m * one.Fe_N / 20})
            for one in whole.responses
        )
        whole.model_copy(update={"responses": curves}).save(store)
        return [
            text
            for text in respond.warnings(study, store)
            if "tracked mode" in text or "extent of the nodes" in text
        ]

    first, second = told(390.0, 12.8e-3)
    assert "640 um at 390.0 Hz at Fe = 1 N" in first and "nearest is stuck mode 1, 428.3" in first
    assert (
        "12.8 mm at Fe = 20 N" in second
        and "9.8 % of the extent of the nodes of the model, 130 mm" in second
    )
    assert told(500.0, 1e-3) == [] and len(told(620.0, 1e-3)) == 1
    # below the stuck mode, as slip softens it, and no other mode is nearer
    tune["other_modes"]["out_of_phase"] = {"hz": 428.3, "mac": 0.9}
    store.write_json("tune.json", tune)
    assert told(550.0, 1e-3) == [] and len(told(510.0, 1e-3)) == 1


def test_a_curve_that_is_not_one_branch_is_told(tmp_path):
    """Between the frequencies at which it was left and taken up something may be higher."""
    study, store = artefacts(tmp_path, sections=FULL)
    whole = RespondResult.load(store)
    first, *others = whole.responses
    broken = first.model_copy(update={"left_out": ((1541.4, 1554.61),)})
    whole.model_copy(update={"responses": (broken, *others)}).save(store)
    [said] = [text for text in respond.warnings(study, store) if "not one branch" in text]
    assert f"Fe = {first.Fe_N:g} N" in said and "between 1541.4 and 1554.6 Hz" in said


def test_damping_of_pairs_that_are_open_at_rest():
    """A mass on 1 N/m with a stop of 3 N/m: twice the frequency while in contact, so half of the
    damping ratio; and with what the sentence advises it is the other way round."""

    def said(zeta, preload):
        contact = Contacts([3.0], [0.0], [0.0], [preload])
        one = np.eye(1)
        law = UnilateralSpring()
        problem = ContactProblem(one, None, one, one, law, contact, damping_ratio=zeta)
        return respond._open_damping(open_modes(problem))

    assert "mode 1, 0.1592 Hz, has 0.02, without friction" in said(0.01, -1.0)
    assert said(0.01, -1.0).startswith("the damping ratio 0.01 is that of modes")
    assert "damping_ratio = 0.005 would give it 0.01" in said(0.01, -1.0)
    assert "has 0.01, without friction" in said(0.005, -1.0)
    assert said(0.01, 1.0) == ""
