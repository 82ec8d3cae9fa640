"""Stage cycles: peaks beside time integration, and slides that leave the contact."""

import pytest

from tests.tipdamp.rig_study import CHAIN, without_report
from tipdamp import compare
from tipdamp.engine.store import Store
from tipdamp.hbm.result import ForcedResponse
from tipdamp.report.results import load_results
from tipdamp.report.subjects import peaks
from tipdamp.report.text import NOTHING, number
from tipdamp.results.response_results import PeakCycle
from tipdamp.stages.assembly import assembled
from tipdamp.stages.cycles import _otherwise_damped
from tipdamp.stages.report import said
from tipdamp.study.study import load_study

pytestmark = pytest.mark.slow


def test_peaks_beside_time_integration(matrices_study):
    """As from Python, of the largest H alone; curves are not made again for it."""
    text = CHAIN.replace("levels = [5]\nharmonics = [1]", "levels = [30]\nharmonics = [1, 3]")
    assert text != CHAIN
    matrices_study.write_text(text)
    assert not any(without_report(matrices_study))
    store = Store(matrices_study.parent / "results" / "study")
    made = store.path("responses/Fe_30N_H3.npz").stat().st_mtime_ns
    matrices_study.write_text(text.replace("levels", "compare = true\nlevels"))
    assert not any(without_report(matrices_study))
    assert store.path("responses/Fe_30N_H3.npz").stat().st_mtime_ns == made
    few, many = store.read_json("cycles.json")["curves"]
    assert few["integration"] is None
    study = load_study(matrices_study)
    curve = ForcedResponse.load(store.path("responses/Fe_30N_H3.npz"))
    own = compare(curve, assembled(study, store, responded=True).curves.problem, many["hz"])
    assert many["integration"]["difference"] == pytest.approx(own.difference, rel=1e-6)
    assert many["integration"]["agrees"] and many["integration"]["stable"]
    assert 0 < own.difference < 0.05
    (table,) = peaks.trust(load_results(study, store, said(study, store)))
    shown = [row[table.columns.index("integration")] for row in table.rows]
    assert shown[0] == NOTHING
    assert shown[1] == f"{number(own.difference, 1, 100)} %"


def test_a_slide_farther_than_the_contact_is_said(matrices_study):
    """The pairs of the chain lie 20 mm apart; a force a thousand times the pull moves them more."""
    matrices_study.write_text(CHAIN.replace("levels = [5]", "levels = [5, 20000]"))
    assert not any(without_report(matrices_study))
    (said,) = Store(matrices_study.parent / "results" / "study").read_json("cycles.json")[
        "warnings"
    ]
    assert "Fe = 20000 N" in said and "slide by up to" in said and "distance of its pairs" in said


def test_a_structure_that_is_damped_otherwise_is_said():
    """From half as much again on, the peak at which it is most."""
    one = PeakCycle(
        file="a.npz",
        Fe_N=5.0,
        H=1,
        hz=1000.0,
        input_J=1.0,
        damping_J=1.0,
        friction_J={},
        error=0.0,
        damping_ratio=0.014,
    )
    assert not list(_otherwise_damped([one], 0.01)) and not list(_otherwise_damped([], 0.01))
    more = one.model_copy(update={"Fe_N": 20.0, "damping_ratio": 0.07})
    (said,) = _otherwise_damped([one, more], 0.01)
    assert said.startswith("the damping ratio 0.01 is that of modes")  # words on the page
    assert "at the peak of Fe = 20 N" in said and "damped by 0.07, friction left out" in said
