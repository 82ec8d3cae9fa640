"""Stage respond: the law of the study, and what is said of curves that are incomplete."""

import numpy as np
import pytest

from hbm.contact import ContactTable
from hbm.laws import SHIPPED
from hbm.model import ReducedModel
from hbm.response import forced_response
from hbm.result import ForcedResponse
from tests.tipdamp.test_bad_respond import study, text  # noqa: F401
from tipdamp.cli import main
from tipdamp.stages import respond
from tipdamp.stages.model_inputs import excitation, outputs
from tipdamp.stages.results import RespondResult
from tipdamp.store import Store
from tipdamp.study.study import load_study


def curve_of(path):
    for stage in ("reduce", "preload", "tune", "respond"):
        assert main([stage, str(path), "--quiet"]) in (0, 1)
    given = load_study(path)
    store = Store(given.results)
    found = RespondResult.load(store)
    return given, store, found, ForcedResponse.load(store.path(found.responses[0].file))


@pytest.mark.parametrize("name", ["IsotropicFriction", "DryFriction1T"])
def test_another_law_is_the_library_call(study, name):  # noqa: F811
    text("levels = [5]", f'levels = [40]\nboth_ways = false\nlaw = "{name}"')(study)
    given, store, found, curve = curve_of(study)
    model, table = ReducedModel.load(store.path("model.npz")), ContactTable.load(store.path("kept.csv"))
    direct = forced_response(model, table.select(table.carrying), SHIPPED[name](), 40 * excitation(given, model),
                             given.respond.band, harmonics=1, damping_ratio=0.01, outputs=outputs(given, model))
    assert found.law.name == name and len(curve.slipping_pairs)
    assert direct.frequency == pytest.approx(curve.frequency, rel=1e-9)
    assert np.abs(direct.harmonics - curve.harmonics).max() < 1e-9 * np.abs(curve.harmonics).max()


def test_parameters_are_checked_before_solving(study, capsys):  # noqa: F811
    text("levels = [5]", 'levels = [5]\nlaw = { name = "CubicSpring", cubic = "much" }')(study)
    assert main(["respond", str(study), "--quiet"]) == 2
    assert "[respond] law" in capsys.readouterr().err


def test_incomplete_curves_are_counted(tmp_path):
    """Three curves, one of them with two failed points, one whose way back ends early."""
    peak = {"peak_hz": 1.0, "peak_m": 1.0, "min_peak_m": 1.0}
    whole = {**peak, "complete": True, "ended": "", "failed_points": 0, "seconds": 1.0}
    curve = {**whole, "file": "a.npz", "Fe_N": 1.0, "H": 1, "patches": {"p": peak}, "points": 10, "residual_calls": 1,
             "slipping_pairs": (), "origin": "preloaded", "start": "zero_slider", "peak_inside_band": True}
    curves = [{**curve, "back": whole}, {**curve, "failed_points": 2, "back": whole},
              {**curve, "back": {**whole, "complete": False}}]
    found = RespondResult(responses=curves, law={"name": "DryFriction2T"}, zeta=(0.01,))
    store = Store(tmp_path)
    found.save(store)
    assert respond.incomplete(found) == (2, 6)
    assert respond.line(store) == ("3 curves (6 with those followed back), 30 points, 2 points failed, 2 curves "
                                   "incomplete")
