"""Peaks by phase and blade: against the closed form of two coupled blades."""

from dataclasses import replace

import numpy as np
import pytest

from tests.tipdamp.report.files import artefacts, curve, results_of
from tipdamp.comparison.peaks import ComparedPeak, has_gap, peaks_of, windows

IN, OUT, ZETA = 1660.0, 2800.0, 0.01  # Hz of both modes of two equal blades
BAND = "band = [2300, 3300]", "band = [1200, 3300]"


def modal(hz, natural):
    """Response of one mode of unit modal constant, 1 at rest."""
    s = hz / natural
    return 1 / (1 - s**2 + 2j * ZETA * s)


def two_blades(Fe, hz):
    """(n, 2) m: force on blade 1; the blades together, and against each other."""
    together, against = modal(hz, IN), modal(hz, OUT)
    return 1e-7 * Fe * np.stack([together + against, together - against], axis=1)


def results(tmp_path, fine=4001, change=lambda curve: curve):
    """Of a study in whose store the curves are those of the two blades."""
    study, store = artefacts(tmp_path)
    tune = store.read_json("tune.json")
    tune["other_modes"] = {"in_phase": {"hz": IN, "mac": 0.9}}
    store.write_json("tune.json", tune)
    found = results_of(study, store)
    vars(study)["respond"] = study.respond.model_copy(update={"band": (1200.0, 3300.0)})
    hz = np.linspace(1200, 3300, fine)
    cases = []
    for case in found.cases:
        x = two_blades(case.Fe, hz)
        harmonics = np.zeros((len(hz), 4, case.H + 1), dtype=complex)
        harmonics[:, :, 1] = x[:, [0, 0, 1, 1]] * [1.0, 0.9, 1.0, 0.8]
        share = np.zeros((len(hz), 6))
        whole = replace(
            curve(case.Fe, case.H),
            frequency=hz,
            parameter=hz,
            harmonics=harmonics,
            share_stick=1 + share,
            share_slip=share,
            share_open=share,
            dissipated=share,
            converged=np.ones(len(hz), bool),
            iterations=np.ones(len(hz), int),
            jumps=np.zeros(len(hz), bool),
            complete=True,
        )
        cases.append(replace(case, curve=change(whole)))
    return replace(found, cases=tuple(cases))


def failed(*between):
    """The points between two frequencies fail."""

    def change(whole):
        bad = (whole.frequency > between[0]) & (whole.frequency < between[1])
        harmonics = whole.harmonics.copy()
        harmonics[bad] = np.nan
        return replace(whole, harmonics=harmonics, converged=~bad, complete=False)

    return change


def test_both_phases_on_both_blades(tmp_path):
    """The maximum near each mode, by the closed form on a fine grid; the phases are those of the
    modes."""
    hz = np.linspace(1200, 3300, 400_001)
    fine = np.abs(two_blades(1.0, hz))
    peaks = peaks_of(results(tmp_path))
    assert len(peaks) == 2 * 2 * 2  # phases, blades, levels
    for peak in peaks:
        near = np.abs(hz - (IN if peak.phase == "in_phase" else OUT)) < 100
        top = fine[near, peak.blade - 1].max()
        place = hz[near][fine[near, peak.blade - 1].argmax()]
        assert peak.m_per_N == pytest.approx(top, rel=1e-5)
        assert peak.hz == pytest.approx(place, abs=0.02)
        assert peak.at_least is None and peak.complete and not peak.merged


def test_gap_takes_the_peak_of_its_phase_alone(tmp_path):
    """Points fail about the out-of-phase mode: what is known of it is a bound below the true
    maximum; the in-phase peak stands."""
    hz = np.linspace(1200, 3300, 400_001)
    peaks = peaks_of(results(tmp_path, change=failed(2700, 2850)))
    for peak in peaks:
        if peak.phase == "in_phase":
            assert peak.m_per_N is not None
            continue
        true = np.abs(two_blades(1.0, hz))[:, peak.blade - 1].max()
        assert peak.m_per_N is None and 0 < peak.at_least < true and not peak.merged


def test_curve_that_stops_has_a_gap_to_the_end(tmp_path):
    def stop(whole):
        n = int((whole.frequency < 2500).sum())
        cut = {
            name: getattr(whole, name)[:n]
            for name in (
                "frequency parameter harmonics share_stick share_slip share_open dissipated "
                "converged iterations jumps"
            ).split()
        }
        return replace(whole, **cut, complete=False, reached_end=False, ended="stopped at 2500 Hz")

    peaks = peaks_of(results(tmp_path, change=stop))
    assert [p.m_per_N is None for p in peaks] == [p.phase == "out_of_phase" for p in peaks]
    assert {p.why for p in peaks} == {"stopped at 2500 Hz"}


def test_level_without_a_maximum_of_its_own_leaves_the_others(tmp_path):
    """At 20 N the blades move against each other alone: the peak in phase has merged there, and at
    1 N it stands."""
    whole = results(tmp_path)
    hz = whole.cases[0].curve.frequency
    cases = []
    for case in whole.cases:
        against = 1e-7 * case.Fe * modal(hz, OUT)
        harmonics = np.zeros_like(case.curve.harmonics)
        harmonics[:, :, 1] = against[:, None] * [1.0, 0.9, -1.0, -0.8]
        curve = replace(case.curve, harmonics=harmonics) if case.Fe == 20 else case.curve
        cases.append(replace(case, curve=curve))
    peaks = peaks_of(replace(whole, cases=tuple(cases)))
    assert {(p.phase, p.Fe) for p in peaks if p.merged} == {("in_phase", 20.0)}
    assert {(p.phase, p.Fe) for p in peaks if p.m_per_N} == {
        ("in_phase", 1.0),
        ("out_of_phase", 1.0),
        ("out_of_phase", 20.0),
    }


def test_other_way_stands_in_where_it_covers_the_phase(tmp_path):
    """Points fail on the way up and not on the way down: the peak is that of the latter."""
    whole, broken = results(tmp_path), results(tmp_path, change=failed(2700, 2850))

    def down(curve):
        turned = ("frequency", "parameter", "harmonics")
        return replace(curve, **{name: getattr(curve, name)[::-1] for name in turned})

    both = tuple(
        replace(case, back=down(other.curve))
        for case, other in zip(broken.cases, whole.cases, strict=True)
    )
    for peak, true in zip(peaks_of(replace(broken, cases=both)), peaks_of(whole), strict=True):
        assert peak.complete and peak.m_per_N == pytest.approx(true.m_per_N, rel=1e-9)


def test_curve_that_stops_on_the_way_down(tmp_path):
    up = results(tmp_path).cases[0].curve
    n = len(up.frequency) // 2
    names = "frequency parameter harmonics converged iterations jumps".split()
    cut = {name: getattr(up, name)[::-1][:n] for name in names}
    shares = {k: getattr(up, k)[:n] for k in "share_stick share_slip share_open dissipated".split()}
    down = replace(up, **cut, **shares, complete=False, reached_end=False)
    assert not has_gap(down, (2700, 2900), (3300, 1200)) and has_gap(
        down, (1500, 1700), (3300, 1200)
    )


def test_windows_are_those_of_the_band(tmp_path):
    """A band about the out-of-phase mode says nothing of the other one."""
    whole = results(tmp_path)
    assert set(windows(whole)) == {"in_phase", "out_of_phase"}
    narrow = whole.study.respond.model_copy(update={"band": (2300.0, 3300.0)})
    vars(whole.study)["respond"] = narrow
    low, high = windows(whole)["out_of_phase"]
    assert set(windows(whole)) == {"out_of_phase"}
    assert low == 2300 and high == pytest.approx(1.15 * 2801)


def test_branch_that_was_left_is_a_gap(tmp_path):
    whole = results(tmp_path).cases[0].curve
    left = replace(whole, restarts=np.array([[2600.0, 2590.0]]))
    assert not has_gap(whole, (2500, 2700), (1200, 3300))
    assert has_gap(left, (2500, 2700), (1200, 3300))
    assert not has_gap(left, (1200, 2000), (1200, 3300))


def test_reasons_without_advice():
    def peak(ended, complete=False):
        return ComparedPeak(
            study="a",
            scatter="",
            phase="in_phase",
            blade=1,
            pull=10.0,
            Fe=1.0,
            H=3,
            hz=None,
            m_per_N=None,
            error=None,
            tolerance=1e-3,
            stable=None,
            at_least=1e-7,
            slipping=None,
            friction_W=(),
            mac=None,
            complete=complete,
            ended=ended,
        )

    rolls = peak(
        "stopped at 28 Hz: not balanced; x; the damper rolls (y): no periodic state exists there"
    )
    assert rolls.motion == "the damper rolls"
    assert rolls.why == "stopped at 28 Hz: the damper rolls, no periodic motion there"
    holes = peak("reached the end of the band; 4 points failed near 31 Hz: run it back, or else")
    assert holes.motion == ""
    assert holes.why == "reached the end of the band; 4 points failed near 31 Hz"
