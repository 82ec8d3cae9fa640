"""Measured curves beside the computed ones of their level, per newton, and what is told of them."""

from dataclasses import replace

import numpy as np
import pytest

from tests.tipdamp.report.files import artefacts, results_of
from tipdamp.hbm.drawing.figure import Band, Curve, Marks
from tipdamp.report.results import MeasuredBand
from tipdamp.report.subjects import measured
from tipdamp.report.text import NOTHING
from tipdamp.results.response_results import (
    Agreement,
    AgreementResult,
    FitResult,
    FittedCurve,
    MeasuredDamping,
    MeasuredFacts,
    MeasuredResult,
)
from tipdamp.study.schema import Measured

MINUS = "\N{MINUS SIGN}"
HZ = np.array([2250.0, 2700.0, 2800.0, 2900.0])
READ = {"response": None, "amplitude": "fundamental"}  # of a measured section
MEAN = 1e-6 * np.array([0.1, 0.5, 1.2, 0.5])


def resonance(hz):
    """µm/N, the damped mass of every curve in `files`, whatever its level."""
    s = hz / 2800
    return np.abs(0.044 / (1 - s**2 + 0.044j * s))


def beside(case, name, share=0.75, zeta=0.033):
    return Agreement(
        measured=name,
        computed=case.facts.file,
        Fe_N=case.Fe,
        H=case.H,
        share_inside=share,
        peak=-0.125,
        frequency=0.001,
        half_power=MeasuredDamping(zeta=zeta),
    )


@pytest.fixture
def results(tmp_path):
    """`low` measured at 1 N and `high` at 20 N, beside the computed curves of their levels."""
    found = results_of(*artefacts(tmp_path))
    levels = {"low": 1.0, "high": 20.0}
    facts = {
        name: MeasuredFacts(
            file=f"{name}.csv",
            files=("a.csv",),
            level_N=level,
            repeats=3,
            points=4,
            band_hz=(2250.0, 2900.0),
            with_phase=True,
            peak_hz=2799.96,
            peak_m_per_N=1.2e-6,
            peak_hz_deviation=0.31,
            peak_m_per_N_deviation=4e-8,
            half_power=MeasuredDamping(zeta=0.0241, deviation=0.0012),
            circle_fit=MeasuredDamping(refused="no phase"),
        )
        for name, level in levels.items()
    }
    vars(found.study)["measured"] = {name: Measured.model_construct(**READ) for name in levels}
    curves = tuple(
        beside(case, name)
        for name, level in levels.items()
        for case in found.cases
        if case.Fe == level
    )
    return replace(
        found,
        measured=MeasuredResult(curves=facts),
        agreement=AgreementResult(curves=curves, zeta=0.022),
        bands={name: MeasuredBand(HZ, MEAN, 0.9 * MEAN, 1.25 * MEAN) for name in levels},
    )


def test_computed_curves_stand_per_newton_beside_the_measured_ones(results):
    """1 µm/N at resonance at 20 N as at 1 N, one curve for each H; points and band in µm/N; all
    within the axes."""
    (figure,) = measured.figure(results)
    assert [panel.title for panel in figure.panels] == ["low: 1 N", "high: 20 N"]
    for panel in figure.panels:
        band, marks, *curves = panel.items
        assert isinstance(band, Band) and isinstance(marks, Marks)
        assert panel.y_label == "amplitude per force (µm/N)"
        assert list(marks.y) == pytest.approx([0.1, 0.5, 1.2, 0.5])
        assert list(band.low) == pytest.approx([0.09, 0.45, 1.08, 0.45])
        assert list(band.high) == pytest.approx([0.125, 0.625, 1.5, 0.625])
        assert [one.name for one in curves] == ["computed, H = 1", "computed, H = 3"]
        assert len({one.color for one in curves}) == 2
        for one in curves:
            assert isinstance(one, Curve) and np.isfinite(one.y).all()
            assert one.y.max() == pytest.approx(1.0, rel=1e-3)
            assert one.y == pytest.approx(resonance(one.x), rel=0.01)
        assert panel.x_range == (2250.0, 3300.0)
        assert panel.y_range[0] == 0 and 1.5 < panel.y_range[1] < 1.7
    tall = {name: replace(one, high=0.01 * one.high) for name, one in results.bands.items()}
    (figure,) = measured.figure(replace(results, bands=tall))
    assert all(1.0 < panel.y_range[1] < 1.1 for panel in figure.panels)  # of the computed ones


def test_the_fitted_curve_is_that_of_its_measured_one(results):
    one = FittedCurve(
        measured="high",
        level_N=20.0,
        misfit=0.1,
        half_power=MeasuredDamping(),
        hz=(2700.0, 2800.0),
        m_per_N=(4e-7, 1.1e-6),
    )
    fit = FitResult(values=(), curves=(one,), iterations=3)
    (figure,) = measured.figure(replace(results, fit=fit, agreement=None))
    low, high = ([item for item in p.items if isinstance(item, Curve)] for p in figure.panels)
    assert low == [] and "Wide: with what was fitted" in figure.caption
    assert [(c.name, list(c.x), list(c.y)) for c in high] == [
        ("fitted", [2700.0, 2800.0], pytest.approx([0.4, 1.1]))
    ]


def test_what_is_told_of_measured_curves(results):
    """Deviations where there are any, dashes where a method was refused; damping over what was
    put in."""
    first, second = measured.tables(results)
    assert first.records[1] == {
        "curve": "high",
        "Fe (N)": "20",
        "repeats": "3",
        "points": "4",
        "peak (Hz)": "2800.0 ± 0.3",
        "peak (µm/N)": "1.200 ± 0.040",
        "half-power": "0.02410 ± 0.0012",
        "circle fit": NOTHING,
    }
    assert second.records[-1] == {
        "measured": "high",
        "Fe (N)": "20",
        "H": "3",
        "inside": "75 %",
        "peak": f"{MINUS}12.50 %",
        "frequency": "+0.10 %",
        "half-power": "0.03300",
        "bias": "+50.0 %",
    }
    assert "0.022 was put into the computation" in second.caption
    unknown = tuple(beside(case, "low", share=None, zeta=None) for case in results.cases[:1])
    agreement = results.agreement.model_copy(update={"curves": unknown})
    _, second = measured.tables(replace(results, agreement=agreement))
    assert [second.records[0][k] for k in ("inside", "half-power", "bias")] == [NOTHING] * 3


def test_nothing_is_told_where_nothing_was_measured(results):
    assert [*measured.tables(replace(results, measured=None))] == []
    assert [*measured.figure(replace(results, measured=None))] == []
    for agreement in (None, AgreementResult(curves=(), zeta=0.022)):
        assert len([*measured.tables(replace(results, agreement=agreement))]) == 1
