"""Tables and warnings: what is said, and what is not."""

from dataclasses import replace

import pytest

from tests.tipdamp.report.files import artefacts, cut, damage, results_of
from tipdamp.report.checks import warnings_of
from tipdamp.report.summary import summarise
from tipdamp.report.tables import assumptions, key_figures, peaks, stress
from tipdamp.report.text import NOTHING
from tipdamp.stages.response_results import PeakStress, StressPlace, StressResult
from tipdamp.study.study import load_study


def test_reference_columns_need_reference_values(tmp_path):
    study, store = artefacts(tmp_path)
    assert next(key_figures.tables(results_of(study, store))).columns == ("", "computed", "reference", "deviation")
    study.path.write_text(study.path.read_text().split("[reference]")[0])
    table = next(key_figures.tables(results_of(load_study(study.path), store)))
    assert table.columns == ("", "computed") and all(len(row) == 2 for row in table.rows)


def test_given_stations_are_not_called_tuned(tmp_path):
    given = damage("tune", "target_hz", value=None)
    names = [row[0] for row in next(key_figures.tables(results_of(*artefacts(tmp_path, damage=given)))).rows]
    assert "stuck, given stations (Hz)" in names and not any("tuned" in name for name in names)


def test_rounding_of_a_moment_is_nothing(tmp_path):
    values = dict(next(assumptions.tables(results_of(*artefacts(tmp_path)))).rows)
    assert values["moment balanced by a constraint in the static solution"].startswith("0 N m about")


def test_warnings_of_every_stage_are_there(tmp_path):
    results = results_of(*artefacts(tmp_path))
    more = replace(results, said={**results.said, "wear": ["the wear depth exceeds the gap"]})
    assert warnings_of(more) == [*warnings_of(results), "The wear depth exceeds the gap."]


@pytest.mark.parametrize("key, value, state", [("complete", False, "incomplete"), ("failed_points", 0, "complete"),
                                               ("failed_points", 3, "3 points failed")])
def test_state_of_a_curve(tmp_path, key, value, state):
    table = next(peaks.tables(results_of(*artefacts(tmp_path, damage=damage("responses", 1, key, value=value)))))
    assert table.rows[1][table.columns.index("curve")] == state


def test_cut_curve_has_no_peak_in_the_table(tmp_path):
    """At least 15 um, and the peak of the other way; the complete curves keep theirs."""
    table = next(peaks.tables(results_of(*artefacts(tmp_path, damage=cut()))))
    rows = [dict(zip(table.columns, row, strict=True)) for row in table.rows]
    last = rows[-1]
    assert (last["peak (Hz)"], last["largest (\N{MICRO SIGN}m)"], last["smallest (\N{MICRO SIGN}m)"]) == (
        NOTHING, "at least 15.00", NOTHING)
    assert last["largest per force (\N{MICRO SIGN}m/N)"] == "at least 0.7500"
    assert last["other way"] == "peak of 20.00 \N{MICRO SIGN}m at 2798.7 Hz" and "has no peak" in table.caption
    assert rows[0]["other way"] == "equal" and rows[0]["peak (Hz)"] == "2798.7"


def test_places_of_the_largest_stress(tmp_path):
    """All of the largest level, of the others the first of each body; in MPa and mm, in summary.json in SI."""
    def place(body, node):
        return StressPlace(body=body, node=node, position_m=(0.001, -0.02, 0.0), mean_Pa=2.5e6, alternating_Pa=1.25e7,
                           amplitude_m=3e-6)
    places = (place("blades", 4), place("blades", 7), place("damper", 2))
    curves = tuple(PeakStress(files=(), Fe_N=Fe, H=3, hz=2800.0, places=places) for Fe in (20.0, 1.0))
    results = results_of(*artefacts(tmp_path))
    assert not list(stress.tables(results)) and "stress" not in summarise(results)
    results = replace(results, stress=StressResult(curves=curves))
    (table,) = stress.tables(results)
    assert [(row[1], row[3], row[4]) for row in table.rows] == [
        ("1", "blades", "4"), ("1", "damper", "2"), ("20", "blades", "4"), ("20", "blades", "7"), ("20", "damper", "2")]
    assert table.rows[0][5:] == ("1.00, -20.00, 0.00", "12.50", "2.500", "3.000")
    assert summarise(results)["stress"][0]["places"][1]["alternating_Pa"] == 1.25e7
