"""Tables and warnings: what is said, and what is not."""

import html
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.tipdamp.report.files import artefacts, cut, damage, results_of, write
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.result import NOT_SEARCHED, SEARCH_STOPPED
from tipdamp.report.checks import warnings_of
from tipdamp.report.introduction import introduction
from tipdamp.report.subjects import assumptions, key_figures, measured, peaks, response, tuning
from tipdamp.report.subjects.pairs import covered
from tipdamp.report.summary import summarise
from tipdamp.report.text import NOTHING
from tipdamp.results.response_results import (
    FitResult,
    FittedCurve,
    FittedValue,
    MeasuredDamping,
    PeakStress,
    StressPlace,
    StressResult,
)
from tipdamp.stages import tune
from tipdamp.study.study import load_study


def test_reference_columns_need_reference_values(tmp_path):
    study, store = artefacts(tmp_path)
    assert next(key_figures.key_figures(results_of(study, store))).columns == (
        "",
        "computed",
        "reference",
        "deviation",
    )
    study.path.write_text(study.path.read_text().split("[reference]")[0])
    table = next(key_figures.key_figures(results_of(load_study(study.path), store)))
    assert table.columns == ("", "computed") and all(len(row) == 2 for row in table.rows)


def test_given_stations_are_not_called_tuned(tmp_path):
    given = damage("tune", "target_hz", value=None)
    names = [
        row[0]
        for row in next(
            key_figures.key_figures(results_of(*artefacts(tmp_path, damage=given)))
        ).rows
    ]
    assert "stuck, given stations (Hz)" in names and not any("tuned" in name for name in names)


def test_rounding_of_a_moment_is_nothing(tmp_path):
    values = dict(next(assumptions.assumptions(results_of(*artefacts(tmp_path)))).rows)
    assert values["moment balanced by a constraint in the static solution"].startswith(
        "0 N m about"
    )


def test_friction_of_all_pairs_or_its_range(tmp_path):
    results = results_of(*artefacts(tmp_path))
    mu = results.whole.mu.copy()
    mu[0] = 0.25
    for given, said in ((results.whole.mu, f"{mu[1]:g}"), (mu, f"0.25 to {mu[1]:g}")):
        one = replace(results, whole=results.whole.replace(mu=given))
        assert dict(next(assumptions.assumptions(one)).rows)["friction coefficient mu"] == said


def test_many_load_points_are_a_span():
    """A face of load points: their number and their ends, not a coordinate each, and no minus
    zero."""
    face = np.repeat(np.linspace(-15, 15, 31), 7)
    assert assumptions.load_points(face, None) == "217 load points from -15.0 to 15.0"
    assert (
        assumptions.load_points(np.array([-1e-9] * 9 + [2.0]), None)
        == "10 load points at 0.0 and 2.0"
    )
    assert assumptions.load_points(np.array([1.0, 1.0, 2.0]), [0.2, 0.3, 0.5]) == "1.0, 1.0 and 2.0"


def test_warnings_of_every_stage_are_there(tmp_path):
    results = results_of(*artefacts(tmp_path))
    more = replace(results, said={**results.said, "wear": ["the wear depth exceeds the gap"]})
    assert warnings_of(more) == [*warnings_of(results), "The wear depth exceeds the gap."]


@pytest.mark.parametrize(
    "key, value, state",
    [
        ("complete", False, "incomplete"),
        ("failed_points", 0, "complete"),
        ("failed_points", 3, "3 points failed"),
    ],
)
def test_state_of_a_curve(tmp_path, key, value, state):
    table = next(
        peaks.trust(
            results_of(*artefacts(tmp_path, damage=damage("responses", 1, key, value=value)))
        )
    )
    assert table.rows[1][table.columns.index("curve")] == state


def test_cut_curve_has_no_peak_in_the_table(tmp_path):
    """At least 15 um, and the peak of the other way; the complete curves keep theirs."""
    cut_one = results_of(*artefacts(tmp_path, damage=cut()))
    table, trusted = next(peaks.peaks(cut_one)), next(peaks.trust(cut_one))
    rows, other = (
        [dict(zip(one.columns, row, strict=True)) for row in one.rows] for one in (table, trusted)
    )
    last = rows[-1]
    assert (
        last["peak (Hz)"],
        last["largest (\N{MICRO SIGN}m)"],
        last["smallest (\N{MICRO SIGN}m)"],
    ) == (NOTHING, "at least 15.00", NOTHING)
    assert last["largest per force (\N{MICRO SIGN}m/N)"] == "at least 0.7500"
    assert other[-1]["other way"] == "peak of 20.00 \N{MICRO SIGN}m at 2798.7 Hz"
    assert "has no peak" in table.caption and other[0]["other way"] == "equal"
    assert rows[0]["peak (Hz)"] == "2798.7"


def test_places_of_the_largest_stress(tmp_path):
    """All of the largest level, of the others the first of each body; in MPa and mm, in
    summary.json in SI."""

    def place(body, node):
        return StressPlace(
            body=body,
            node=node,
            position_m=(0.001, -0.02, 0.0),
            mean_Pa=2.5e6,
            alternating_Pa=1.25e7,
            amplitude_m=3e-6,
        )

    places = (place("blades", 4), place("blades", 7), place("damper", 2))
    curves = tuple(
        PeakStress(files=(), Fe_N=Fe, H=3, hz=2800.0, places=places) for Fe in (20.0, 1.0)
    )
    results = results_of(*artefacts(tmp_path))
    assert not list(peaks.stress(results)) and "stress" not in summarise(results)
    results = replace(results, stress=StressResult(curves=curves))
    (table,) = peaks.stress(results)
    assert [(row[1], row[3], row[4]) for row in table.rows] == [
        ("1", "blades", "4"),
        ("1", "damper", "2"),
        ("20", "blades", "4"),
        ("20", "blades", "7"),
        ("20", "damper", "2"),
    ]
    assert table.rows[0][5:] == ("1.00, -20.00, 0.00", "12.50", "2.500", "3.000")
    assert summarise(results)["stress"][0]["places"][1]["alternating_Pa"] == 1.25e7


@pytest.mark.parametrize(
    "change, failed, bound",
    [
        (None, (), False),
        (cut(), (), True),
        (damage("responses", 3, "left_out", value=[[2700.0, 2720.0]]), (), True),
        (damage("responses", 3, "left_out", value=[[1700.0, 1720.0]]), (), False),
        (None, (10,), True),
    ],
)
def test_stress_of_a_curve_that_is_not_whole_is_a_bound(tmp_path, change, failed, bound):
    """Where it stopped, or has holes beside its peak, by points that failed among them: the
    peak may stress the bodies more. The peak too is marked in its table and in the first lines."""
    place = StressPlace(
        body="blades",
        node=4,
        position_m=(0.0, 0.0, 0.0),
        mean_Pa=2.5e6,
        alternating_Pa=3.788e8,
        amplitude_m=3e-6,
        safety=0.638,
    )
    curves = tuple(
        PeakStress(files=(), Fe_N=Fe, H=3, hz=2800.0, places=(place,), least=(place,))
        for Fe in (1.0, 20.0)
    )
    results = results_of(*artefacts(tmp_path, damage=change, failed=failed))
    results = replace(results, stress=StressResult(curves=curves))
    for table in (*peaks.stress(results), *peaks.safety(results)):
        low, high = table.records
        assert (low["alternating (MPa)"], low["safety"]) == ("378.8", "0.638")
        assert high["alternating (MPa)"] == "at least " * bound + "378.8"
        assert high["safety"] == "at most " * bound + "0.638"
        assert ("a bound and no result" in table.caption) == bound
    assert [one["bound"] for one in summarise(results)["stress"]] == [False, bound]
    (table,) = peaks.peaks(results)
    marked = [row["largest (\N{MICRO SIGN}m)"].startswith("at least") for row in table.records]
    assert (marked[0], marked[-1]) == (False, bound)
    assert ("at least" in " ".join(introduction(results))) == bound


def test_sentences_of_a_caption_stand_apart(tmp_path):
    """What the peak does between two levels, and that the third has none."""
    results = results_of(*artefacts(tmp_path, damage=cut()))
    more = [
        replace(one, facts=one.facts.model_copy(update={"Fe_N": 5.0, "file": f"more{one.H}"}))
        for one in results.cases
        if one.Fe == 1
    ]
    figures = response.families(replace(results, cases=(*results.cases, *more)))
    (said,) = (figure.caption for figure in figures if "No peak" in figure.caption)
    assert not re.search(r"[a-zN]\.[A-Z]", said) and " No peak, since" in said


@pytest.mark.parametrize(
    "met, said", [(44.68, "44.62 of 44.62"), (40.0, "40 of 44.62"), (60.0, "60 of 44.62")]
)
def test_no_more_is_covered_than_there_is(met, said):
    """Projections of curved faces overlap by little; faces that are met twice are not hidden."""
    assert covered(SimpleNamespace(area_m2=1e-6 * met, faces_m2=44.62e-6)) == said


def by_area(files):
    """Tuned by area on contact points, all rows of which are in the model."""
    tune, n = files["tune.json"], len(files["kept"])
    sides = {
        s: {"unit": "mm2", "closed": 50.0, "kept": 40.0, "cells": 5, "kept_cells": 4}
        for s in ("left", "right")
    }
    tune.update(
        area={
            "share": 0.8,
            "hz_per_percent": 20.0,
            "sides": sides,
            "history": [
                {"share": 1.0, "hz": 3000.0, "mac": 0.8},
                {"share": 0.8, "hz": 2800.0, "mac": 0.8},
            ],
            "mirrors": [{"normal": [-0.0, 1.0, 0.0], "noise": 0.01}],
        },
        history=[],
        roll_stiffness_Nm_per_rad=0.0,
        redistribution={
            "scale": {"left": 1.5, "right": 1.6},
            "moment_Nm": 0.02,
            "moments_Nm": [0.03, 0.02, -0.04],
        },
    )
    for key in ("stuck_hz", "mac", "closed_pairs", "open_pairs", "stuck_modes_hz"):
        tune[key]["full_line"] = tune[key]["full_area"]
    tune["full_model_check"] = {
        name: tune["full_model_check"]["tuned"] for name in ("full_area", "full_line", "tuned")
    }
    ways = [
        {"way": way, "kn_N_per_m": 1e6, "kt_N_per_m": 9e5}
        for way in ("smooth half-spaces", "given per area")
    ]
    files["preload.json"]["stiffness"] = {
        "left": {
            "model": "given",
            "ways": ways,
            "kn_N_per_m": 1e6,
            "kt_N_per_m": 9e5,
            "kt_along_N_per_m": 9e5,
            "kt_across_N_per_m": 9e5,
            "nodes": 5,
            "load_N": 70.0,
            "length_m": 0.04,
            "kind": None,
            "half_width_m": None,
            "depth_m": None,
            "h_rms_m": None,
            "gamma": None,
            "scale": 1.0,
            "shares": "tributary",
            "E_star_Pa": None,
        }
    }
    files["reduce.json"]["free_hz"] = {}
    files["kept"] = files["kept"].replace(area=np.full(n, 1e-5))


def test_words_fit_areas_and_contact_points(tmp_path):
    """No line, no rows that are moved, no stations, no nodes where the study has none of them; no
    column of dashes."""
    study, store = artefacts(tmp_path, damage=by_area)
    study.path.write_text(
        study.path.read_text().split("[reference]")[0].replace('rows = "edge"', 'rows = "all"')
    )
    study = load_study(study.path)
    pairs = ContactTable.load(store.path("preload.csv"))
    pairs.replace(area=np.full(len(pairs), 1e-5)).save(store.path("preload.csv"))
    write(study, store)
    page = html.unescape(
        re.sub(
            "<script.*?</script>|<style.*?</style>|<[^>]+>",
            " ",
            store.path("report.html").read_text(),
            flags=re.S,
        )
    )
    for word in (
        "whole line",
        "line model",
        "edge line",
        "kept stations",
        "kept row",
        "per node",
        "each node",
        "every node",
        "kn over reference",
        "without:",
        "stations to",
    ):
        assert word not in page, word
    assert (
        "What is detached leaves a moment of 0.0200 N m about the axis of the damper and 0.0500 "
        "N m across it; it is balanced"
    ) in page
    assert "about the plane across (0, 1, 0): preloads of" in page
    for word in ("whole area: 15 contact points", "per contact point", "Preload of the kept area"):
        assert word in page, word
    summary = summarise(results_of(study, store))
    assert not {"free_hz", "tuned_pairs"} & set(summary) and summary["area"]["share"] == 0.8
    assert "line" not in tune.line(store)
    modes = results_of(study, store).tune.stuck_modes_hz.tuned[:3]
    assert f"among modes at {', '.join(f'{hz:.1f}' for hz in modes)}" in tune.line(store)
    assert [row[0] for row in next(key_figures.reduction_check(results_of(study, store))).rows] == [
        "whole area, kept area"
    ]


@pytest.mark.parametrize("count", [0, 1, 2, 30])
def test_sets_within_the_scatter_of_the_target(tmp_path, count):
    """Those that the tuning found, twenty at most; without any the nearest of its steps."""

    def change(files):
        sets = [dict(front=9, back=k, hz=2801.25 + k, mac=0.5) for k in range(count)]
        files["tune.json"] |= {"scatter_hz": 5.0, "equivalent": sets}

    (table,) = tuning.equivalent_sets(results_of(*artefacts(tmp_path, damage=change)))
    assert re.match(f"{count} of 2 sets" if count else "No set .* the nearest of 2", table.caption)
    assert "within 5.00 Hz of the target of 2800 Hz" in table.caption
    assert ("nearest 20 are shown" in table.caption) == (count > 20)
    nearest = ("2 + 2", "2801.0", "+1.0", "0.900")
    rows = [(f"9 + {k}", f"{2801.25 + k:.1f}", f"{1.25 + k:+.1f}", "0.500") for k in range(20)]
    assert table.rows == (tuple(rows[:count]) or (nearest,))


@pytest.mark.parametrize("missing", [("scatter_hz", 0.0), ("history", []), ("target_hz", None)])
def test_no_sets_without_scatter_history_or_target(tmp_path, missing):
    def change(files):
        files["tune.json"] |= {"scatter_hz": 5.0} | dict([missing])

    assert not list(tuning.equivalent_sets(results_of(*artefacts(tmp_path, damage=change))))


@pytest.mark.parametrize(
    "searched, found, said",
    [
        (NOT_SEARCHED, 0, "not searched"),
        ("looked at 12 of 12 values: no further curve found", 0, "0"),
        (f"looked at 0 of 12 values; {SEARCH_STOPPED} 60, more may exist", 0, "0, search stopped"),
        (f"looked at 3 of 12 values; {SEARCH_STOPPED} 60, more may exist", 2, "2, search stopped"),
        ("2 further curves found; random starts led to some of them, more may exist", 2, "2"),
    ],
)
def test_a_search_that_was_stopped_is_told(searched, found, said):
    """As one that found none is not."""
    facts = SimpleNamespace(searched=searched, beside=(None,) * found)
    assert peaks._beside(facts) == said


@pytest.mark.parametrize(
    "points, peak, said",
    [
        (None, False, NOTHING),
        (0, False, "0"),
        (3, False, "3, not the peak"),
        (3, True, "3, the peak too"),
    ],
)
def test_whether_the_peak_is_stable_is_told(points, peak, said):
    assert peaks._unstable(SimpleNamespace(unstable_points=points, unstable=peak)) == said


@pytest.mark.parametrize(
    "apparent, said", [(0.015, "+50.0 %"), (0.005, "-50.0 %"), (None, NOTHING)]
)
def test_half_power_is_told_over_what_was_fitted(tmp_path, apparent, said):
    """Of a fitted ratio of 1 %: friction widens the peak, and half-power takes that for damping."""
    value = FittedValue(name="damping ratio", value=0.01, low=0.009, high=0.011, start=0.02)
    one = FittedCurve(
        measured="a", level_N=1.0, misfit=0.1, half_power=MeasuredDamping(zeta=apparent)
    )
    found = FitResult(values=(value,), curves=(one,), iterations=3)
    _, curves = measured.fitted(replace(results_of(*artefacts(tmp_path)), fit=found))
    assert curves.records[0]["half-power over fit"] == said.replace("-", "\N{MINUS SIGN}")
