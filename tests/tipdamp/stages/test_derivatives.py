"""[respond] derivatives in a study: kept with the curves, drawn in the report."""

from types import SimpleNamespace

import pytest

from tests.tipdamp.rig_study import CHAIN, CHAIN_OF_STAGES
from tests.tipdamp.stages.test_backbone import run
from tipdamp.engine.store import Store
from tipdamp.hbm.modes.derivatives import peak_derivatives
from tipdamp.hbm.result import ForcedResponse
from tipdamp.report.subjects.influence import lacking
from tipdamp.stages.assembly import assembled
from tipdamp.study.study import load_study

ASKED = CHAIN.replace("levels = [5]", "levels = [5, 30]\nderivatives = true")


def test_the_report_draws_what_the_peaks_depend_on(matrices_study):
    pytest.importorskip("matplotlib")
    matrices_study.write_text(ASKED)
    assert run(matrices_study, *CHAIN_OF_STAGES, "inspect", "cycles", "report") == [0] * 7
    folder = matrices_study.parent / "results" / "study"
    curve = ForcedResponse.load(folder / "responses/Fe_30N_H1.npz")
    ((name, by),) = curve.derivatives.items()
    assert name.startswith("patch_1:")
    problem = assembled(load_study(matrices_study), Store(folder), responded=True).curves.problem
    assert by == peak_derivatives(curve, problem, name)
    assert by.total("mu")[1] != 0 and len(by.amplitude_by["mu"]) == len(curve.carrying)
    assert (folder / "figures/derivatives.png").stat().st_size > 10_000
    page = (folder / "report.html").read_text()
    assert "What the peak depends on" in page and "Left out" not in page


def test_levels_without_derivatives_are_named():
    """With the reason: a kink at the peak, or no peak."""
    curves = [("by", True, 2.0), (None, True, 8.0), (None, False, 9.0)]
    cases = [
        SimpleNamespace(
            curve=SimpleNamespace(derivatives=by),
            has_peak=peak,
            Fe=Fe,
            H=1,
            facts=SimpleNamespace(tried=None),
        )
        for by, peak, Fe in curves
    ]
    said = lacking(SimpleNamespace(finest=cases))
    assert "Left out: Fe = 8 N (the curve has a kink" in said
    assert "Fe = 9 N (no peak inside the band)" in said
    assert lacking(SimpleNamespace(finest=cases[:1])) == ""
