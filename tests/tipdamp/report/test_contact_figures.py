"""Friction work over the contact sides in colour, names beside the states of the pairs, what was
chosen in tuning."""

from dataclasses import replace

import numpy as np
import pytest

from tests.tipdamp.report.files import artefacts, damage, results_of
from tipdamp.checks.pairs import pair_names
from tipdamp.hbm.drawing.figure import Line, Marks, Tiles, edges
from tipdamp.report.drawing import matplotlib, plotly, table
from tipdamp.report.subjects import friction, tuning, wear
from tipdamp.report.subjects import kept as kept_figures
from tipdamp.report.subjects.axial import across, of_side, with_room
from tipdamp.results.response_results import CyclesResult, PeakCycle
from tipdamp.results.static_results import SideStiffness


@pytest.fixture
def drawn(tmp_path):
    """(results, kept pairs, figures by name): of pair k friction takes k microjoule."""
    results = results_of(*artefacts(tmp_path))
    kept = results.kept.select(results.kept.carrying)
    names = pair_names(kept, slice(None))
    one = PeakCycle(
        file="a.npz",
        Fe_N=20.0,
        H=3,
        hz=2800.0,
        input_J=1e-3,
        damping_J=9e-4,
        error=1e-9,
        damping_ratio=0.01,
        friction_J={name: 1e-6 * k for k, name in enumerate(names)},
    )
    share = np.full((len(results.cases[0].curve.frequency), len(kept)), 0.2)
    cases = tuple(
        replace(
            case,
            curve=replace(
                case.curve, share_stick=1 - share, share_slip=share, share_open=0 * share
            ),
        )
        for case in results.cases
    )
    results = replace(results, cases=cases, cycles=CyclesResult(curves=(one,), pairs=tuple(names)))
    return results, kept, {figure.name: figure for figure in friction.friction_work(results)}


def test_energies_of_a_period_are_in_microjoule(drawn):
    results, kept, _ = drawn
    (table,) = friction.energies(results)
    total = sum(range(len(kept)))
    assert table.records == [
        {
            "H": "3",
            "Fe (N)": "20",
            "at (Hz)": "2800.0",
            "input (µJ)": "1000",
            "damping (µJ)": "900.0",
            "ratio": "1.00 %",
            "friction (µJ)": f"{total:.2f}",
            "friction share": f"{total / 10:.1f} %",
            "error": "1\N{MULTIPLICATION SIGN}10⁻⁹",
        }
    ]


def test_levels_stand_by_their_name_and_colour(drawn):
    """Work of a station is that of its pairs; each level has a colour of its own."""
    results, kept, _ = drawn
    (one,) = results.cycles.curves
    Fe_N = next(case.Fe for case in results.cases if case.H == one.H and case.Fe != one.Fe_N)
    twice = one.model_copy(
        update={"Fe_N": Fe_N, "friction_J": {n: 2 * J for n, J in one.friction_J.items()}}
    )
    cycles = CyclesResult(curves=(one, twice), pairs=results.cycles.pairs)
    figure = next(friction.friction_work(replace(results, cycles=cycles)))
    for panel, side in zip(figure.panels, kept.sides, strict=True):
        marks = [item for item in panel.items if isinstance(item, Marks)]  # a station alone shows
        low, high = sorted(marks, key=lambda item: np.nansum(item.y))
        assert (low.name, high.name) == (f"Fe = {one.Fe_N:g} N", f"Fe = {Fe_N:g} N")
        assert len({low.color, high.color}) == 2 and all(c.color[0] == "#" for c in (low, high))
        mine = np.flatnonzero(kept.side == side)
        assert np.nansum(low.y) == pytest.approx(mine.sum())
        assert np.nansum(high.y) == pytest.approx(2 * mine.sum())


def test_every_pair_has_its_tile(drawn, tmp_path):
    results, kept, figures = drawn
    panels = figures["friction_map"].panels
    assert [panel.title[:6] for panel in panels] == ["side '"] * 2 and all(
        panel.whole_y for panel in panels
    )
    found = {}
    for panel, side in zip(panels, kept.sides, strict=True):
        (tiles,) = panel.items
        assert isinstance(tiles, Tiles) and tiles.top == len(kept) - 1
        found |= {
            (side, x, y): tiles.values[j, i]
            for j, y in enumerate(tiles.y)
            for i, x in enumerate(tiles.x)
            if np.isfinite(tiles.values[j, i])
        }
    along = results.along(kept)
    assert found == {
        (kept.side[k], along[k], kept.row[k]): pytest.approx(k) for k in range(len(kept))
    }
    table.write(figures["friction_map"], tmp_path / "map.csv")
    assert (tmp_path / "map.csv").read_text().count("side 'left', cylinder\",tiles,") == (
        kept.side == "left"
    ).sum()


def test_wear_index_of_every_level(drawn, tmp_path):
    """Over length and hour it is the power of friction of each station; per area where the contacts
    know theirs; nothing where nothing slips."""
    results, kept, _ = drawn
    (figure,) = wear.figure(results)
    assert [panel.y_label for panel in figure.panels] == ["friction work (J per mm and hour)"] * 2
    for panel, side in zip(figure.panels, kept.sides, strict=True):
        line, marks = panel.items
        every = np.unique(results.along(results.whole.select(results.whole.side == side)))
        length = np.gradient(every)  # half way to the neighbours: half of it at the ends
        length[[0, -1]] /= 2
        joule = 3600 * 2800.0 * 1e-6 * np.flatnonzero(kept.side == side).sum()
        assert (marks.name, marks.y @ np.interp(marks.x, every, length)) == (
            "Fe = 20 N",
            pytest.approx(joule),
        )
        gaps = np.diff(np.unique(kept.station[kept.side == side])) > 1
        assert np.isnan(line.y).sum() == gaps.sum()  # no line over detached stations
    matplotlib.draw(figure, tmp_path / "wear.png")
    areas = replace(results, kept=results.kept.replace(area=np.full(len(results.kept), 2e-6)))
    (figure,) = wear.figure(areas)
    assert figure.panels[0].y_label == "friction work (J per mm² and hour)"
    least = [
        one.model_copy(update={"friction_J": dict.fromkeys(one.friction_J, 0.0)})
        for one in results.cycles.curves
    ]
    stuck = results.cycles.model_copy(update={"curves": tuple(least)})
    assert list(wear.figure(replace(results, cycles=stuck))) == []


def test_points_of_unlike_meshes_stand_for_themselves(drawn, tmp_path):
    """A sum over an interval of the axis follows the mesh: 2 and 3 points in turn. Those of the
    other side, which lie on lines across the axis, are drawn and measured alike."""
    results, _, _ = drawn
    mesh = np.random.default_rng(1).uniform(-4e-4, 4e-4, len(results.kept))
    area = np.linspace(1e-6, 3e-6, len(mesh))

    def with_points(table):
        moved = table.position + mesh[:, None] * np.array(results.axis)
        right = (table.side == "right")[:, None]
        return table.replace(area=area, position=np.where(right, moved, table.position))

    kept = with_points(results.kept.replace(weight=np.ones(len(mesh))))
    names = pair_names(kept, slice(None))
    (one,) = results.cycles.curves
    one = one.model_copy(update={"friction_J": {n: 1e-6 * k for k, n in enumerate(names)}})
    scattered = replace(
        results,
        kept=kept,
        whole=with_points(results.whole),
        cycles=CyclesResult(curves=(one,), pairs=tuple(names)),
    )
    mine = kept.side == "right"
    work = np.arange(len(kept), dtype=float)[mine] / (1e6 * kept.area[mine])  # uJ/mm2
    x = scattered.along(kept)[mine]
    lines, over_length = friction.friction_work(scattered), wear.figure(scattered)
    left, right = next(lines).panels
    assert {panel.y_label for panel in (left, right)} == {"friction work (µJ/mm² per period)"}
    _, marks = right.items
    assert marks.x == pytest.approx(x) and marks.y == pytest.approx(work)
    others, classes = (panel.items for panel in next(lines).panels)
    assert all(isinstance(one, Marks) for one in (*others, *classes))
    assert sorted(np.concatenate([one.x for one in classes])) == pytest.approx(np.sort(x))
    strongest = classes[-1].x
    assert x[work >= 0.8 * work.max()] == pytest.approx(strongest)
    (other,), (marks,) = (panel.items for panel in next(over_length).panels)
    assert len(other.x) == (~mine).sum()
    order = np.argsort(x)
    assert marks.x == pytest.approx(x[order])
    assert marks.y == pytest.approx(3600 * 2800.0 * 1e-6 * work[order])
    (figure,) = kept_figures.figure(scattered)
    drawn_before = [panel.items[1] for panel in figure.panels]
    assert drawn_before[0].name == "whole patch, sum over the rows"
    whole = scattered.whole.select(scattered.whole.side == "right")
    closed = whole.preload > 0
    assert drawn_before[1].name == "whole patch"
    assert drawn_before[1].y == pytest.approx(whole.preload[closed])
    matplotlib.draw(figure, tmp_path / "kept.png")


def test_wear_of_lines_whose_width_is_known(drawn):
    """The power of a station over its length times the width: stated of the flat side, of the round
    one twice the half-width that its stiffness was found with."""
    results, kept, _ = drawn
    assert results.study.sides["right"].width == 1.6e-3
    strip = {"left": SideStiffness.model_construct(half_width_m=5e-5)}
    preload = results.preload.model_copy(update={"stiffness": strip})
    (figure,) = wear.figure(replace(results, preload=preload))
    assert [one.y_label for one in figure.panels] == ["friction work (J per mm² and hour)"] * 2
    (per_length,) = wear.figure(results)
    for panel, line, mm in zip(figure.panels, per_length.panels, (0.1, 1.6), strict=True):
        assert panel.items[1].y * mm == pytest.approx(line.items[1].y, rel=1e-12)


def test_names_beside_the_states(drawn, tmp_path):
    _, _, figures = drawn
    (panel,) = figures["state_map"].panels
    assert panel.y_names[:2] == ("left 0", "left 1") and len(panel.y_names) == len(
        set(panel.y_names)
    )
    html = plotly.draw(figures["state_map"])
    assert all(f'"{name}"' in html for name in panel.y_names)
    for name in ("state_map", "friction_map"):
        matplotlib.draw(figures[name], tmp_path / f"{name}.png")
        assert (tmp_path / f"{name}.png").stat().st_size > 5000
    assert '"heatmap"' in plotly.draw(figures["friction_map"])


def test_borders_of_the_tiles():
    assert edges(np.array([0.0, 1.0, 3.0])).tolist() == [-0.5, 0.5, 2.0, 4.0]
    assert edges(np.array([2.0])).tolist() == [1.5, 2.5]


def test_a_graded_station_is_part_of_a_station(tmp_path):
    """The mark of what was chosen stands at the kept area, and its words in the legend."""
    results = results_of(
        *artefacts(tmp_path, damage=damage("tune", "graded", value={"station": 1, "part": 0.25}))
    )
    figure = next(f for f in tuning.histories(results) if f.name == "tuning")
    (chosen,) = [item for item in figure.panels[0].items if item.name.startswith("chosen")]
    kept = results.tune.tuned_pairs
    assert (
        list(chosen.x) == [kept.front + kept.back - 0.75]
        and "of station 1 a part of 0.25" in chosen.name
    )
    assert (
        any(item.name == "target 2800 Hz" for item in figure.panels[0].items)
        and figure.panels[0].whole_x
    )


@pytest.mark.parametrize("scatter", [0.0, 5.0])
def test_a_target_has_the_band_of_its_scatter(tmp_path, scatter):
    """The target as a line over all that was tried, and dotted lines at both edges of what it is
    known to."""
    results = results_of(*artefacts(tmp_path, damage=damage("tune", "scatter_hz", value=scatter)))
    figure = next(f for f in tuning.histories(results) if f.name == "tuning")
    items = figure.panels[0].items
    edges_hz = [(one.axis, one.value, one.dash) for one in items if isinstance(one, Line)]
    both = [("y", 2795.0, "dot"), ("y", 2805.0, "dot")]
    assert edges_hz == (both if scatter else [])
    (target,) = [one for one in items if getattr(one, "name", "") == "target 2800 Hz"]
    counts = [s.front + s.back for s in results.tune.history]
    assert list(target.x) == [min(counts), max(counts)] and list(target.y) == [2800.0] * 2


@pytest.mark.parametrize("target", [2800.0, 3500.0, 1000.0])
def test_what_was_tuned_and_its_target_lie_within_the_axes(tmp_path, target):
    results = results_of(*artefacts(tmp_path, damage=damage("tune", "target_hz", value=target)))
    panel = next(f for f in tuning.histories(results) if f.name == "tuning").panels[0]
    low, high = panel.y_range
    every = [*(s.hz for s in results.tune.history), target]
    assert low < min(every) and max(every) < high
    assert high - low < 1.5 * np.ptp(every)


def test_worth_of_stations_where_they_are(tmp_path):
    """Kept ones filled, detached ones hollow; mm and Hz."""

    def worth(files):
        files["tune.json"]["station_worth"] = [
            {"station": k, "kept": k != 2, "hz": 10.0 + k, "position_m": 0.01 * k} for k in range(5)
        ]

    results = results_of(*artefacts(tmp_path, damage=worth))
    _, figure = tuning.histories(results)
    kept, detached = figure.panels[0].items
    assert (list(kept.x), list(kept.y)) == (pytest.approx([0, 10, 30, 40]), [10, 11, 13, 14])
    assert (list(detached.x), list(detached.y)) == (pytest.approx([20]), [12])
    assert kept.filled and not detached.filled and detached.name.startswith("detached: gained")
    assert figure.panels[0].y_range[0] == 0 and 14 < figure.panels[0].y_range[1] < 18


def tuned_by_area(files):
    """Half of one pair is kept, one is not, one was open at rest."""
    sides = {"left": ("mm2", 50.0, 35.0), "right": ("mm", 40.0, 40.0)}
    files["tune.json"]["area"] = {
        "share": 0.7,
        "hz_per_percent": -2.5,
        "sides": {
            name: {"unit": unit, "closed": closed, "kept": kept, "cells": 5, "kept_cells": 4}
            for name, (unit, closed, kept) in sides.items()
        },
        "history": [
            {"share": 1.0, "hz": 3000.0, "mac": 0.8},
            {"share": 0.7, "hz": 2801.0, "mac": 0.9},
        ],
    }
    files["tune.json"]["history"] = []
    weight = np.ones(15)
    weight[:3] = 0.5, 0.0, 0.0
    files["kept"] = files["kept"].replace(weight=weight)


def test_kept_area_is_mapped_point_by_point(tmp_path):
    """Each point once, by what became of it; of the right side all is kept."""
    results = results_of(*artefacts(tmp_path, damage=tuned_by_area))
    preload = results.whole.preload.copy()
    preload[2] = -1.0
    history, figure = tuning.histories(
        replace(results, whole=results.whole.replace(preload=preload))
    )
    left, right = (
        {marks.name: (sorted(marks.x), marks.filled) for marks in panel.items}
        for panel in figure.panels
    )
    assert left == {
        "kept": ([30.0, 40.0], True),
        "kept in part": ([0.0], True),
        "detached": ([10.0], False),
        "open at rest": ([20.0], True),
    }
    assert right == {"kept": (sorted([0.0, 10.0, 20.0, 30.0, 40.0] * 2), True)}
    assert "35 of 50 mm² on side 'left' and 40 of 40 mm on side 'right'" in figure.caption
    hz, mac = history.panels
    for panel, values in ((hz, [3000.0, 2801.0]), (mac, [0.8, 0.9])):
        line, marks = panel.items[:2]
        assert list(line.x) == list(marks.x) == pytest.approx([100.0, 70.0])  # percent
        assert list(line.y) == list(marks.y) == values
    (kept,) = [item for item in hz.items if item.name.startswith("kept: 70 %, 2801.0 Hz")]
    assert (list(kept.x), list(kept.y)) == (pytest.approx([70.0]), [2801.0])
    assert "a percent of the area is worth 2.5 Hz" in history.caption


def test_rounding_makes_no_heights_across_a_side(tmp_path):
    """Points of one row, whose coordinates differ in their last digits: one height, with room."""
    results = results_of(*artefacts(tmp_path))
    pairs = of_side(results.kept, "right")
    noise = 1e-17 * np.arange(len(pairs))[:, None] * pairs.frame[:, 1]
    heights = across(results, pairs.replace(position=noise))
    assert np.ptp(heights) == 0 and np.ptp(with_room(heights)) > 0.1
