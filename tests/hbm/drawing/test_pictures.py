"""Results draw themselves as the report does, say what they are in a notebook, and become
tables."""

import inspect
import sys
from dataclasses import replace

import numpy as np
import pytest

import tipdamp
from tipdamp import (
    CubicSpring,
    Jenkins1D,
    MeasuredResponse,
    Problem,
    Search,
    StuckAssembly,
    backbone,
    compare,
    contact_cycles,
    curves_beside,
    detach_until,
    energy_balance,
    fit_damping,
    follow_peak,
    peak_derivatives,
    preload,
    synthesis,
    two_blades,
)
from tipdamp.hbm.drawing.branches import branch_lines, error_band
from tipdamp.hbm.drawing.pictures import LINE
from tipdamp.hbm.errors import InputError

pyplot = pytest.importorskip("matplotlib.pyplot")
pyplot.switch_backend("agg")
NONE = np.empty(0)


@pytest.fixture(autouse=True)
def closed_figures():
    yield
    pyplot.close("all")


@pytest.fixture(scope="module")
def duffing():
    return Problem([[1.0]], [[0.02]], [[1.0]]).add(CubicSpring(1.0), 0).force(0, 0.2)


@pytest.fixture(scope="module")
def folded(duffing):
    return duffing.follow_band((0.12, 0.5), outputs={"x": 0}, harmonics=3, stability="all")


@pytest.fixture(scope="module")
def slipping():
    blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    return blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0)


@pytest.fixture(scope="module")
def rubbed(slipping):
    return slipping.follow_band((600, 1000), outputs={"tip": 0}, stability="all")


def test_no_line_where_the_branch_does_not_lead(duffing):
    """A gap, for the line and for the band of the error; a point by itself is a dot."""
    curve = duffing.follow_band((0.12, 0.14), outputs={"x": 0}, harmonics=3)
    jumps = np.zeros(len(curve), dtype=bool)
    jumps[[3, 4]] = True
    a = curve.amplitude()[:, 0]
    line, dot = branch_lines(replace(curve, jumps=jumps), a, NONE, "x", "b")
    assert np.flatnonzero(np.isnan(line.y)).tolist() == [3, 5]
    assert np.asarray(line.y)[[2, 4, 6]] == pytest.approx(a[[2, 3, 4]])
    assert np.asarray(dot.y) == pytest.approx(a[3:4])
    band = error_band(replace(curve, jumps=jumps), a, 1e-3 * a, "b")
    assert np.isnan(np.asarray(band.low)[[3, 5]]).all()
    assert len(list(branch_lines(curve, a, NONE, "x", "b"))) == 1


@pytest.mark.parametrize("kind", ["half_peak_to_peak", "rms"])
def test_dashes_begin_and_end_where_stability_changes(folded, kind):
    """At the folds themselves, not at the next points that were solved: both lines meet there."""
    (whole,), (dashed,) = (lines(folded.plot(kind=kind), style) for style in ("-", "--"))
    drawn = np.isfinite(dashed.get_ydata())
    folds = [one.parameter for one in folded.named_points if one.kind == "fold"]
    assert dashed.get_xdata()[drawn][[0, -1]].tolist() == folds
    both = drawn & np.isfinite(whole.get_ydata())
    assert whole.get_xdata()[both].tolist() == folds
    if kind == "half_peak_to_peak":
        heights = [one.amplitudes[0] for one in folded.named_points if one.kind == "fold"]
        assert whole.get_ydata()[both].tolist() == heights


def test_dashes_run_to_the_next_points_where_no_named_point_is_known(folded):
    curve = replace(folded, named_points=())
    (dashed,) = lines(curve.plot(), "--")
    drawn = np.isfinite(dashed.get_ydata())
    assert drawn.sum() == curve.unstable.sum() + 2


def lines(ax, style):
    return [line for line in ax.lines if line.get_linestyle() == style]


def labels(ax):
    return ax.get_legend_handles_labels()[1]


def test_unstable_parts_are_dashed_between_the_folds(folded):
    ax = folded.plot()
    (whole,), (dashed,) = lines(ax, "-"), lines(ax, "--")
    drawn = np.isfinite(dashed.get_ydata())
    points = np.isin(whole.get_xdata(), folded.parameter)
    folds = sorted(one.parameter for one in folded.named_points if one.kind == "fold")
    inside = dashed.get_xdata()[drawn]
    assert folds[0] - 0.01 < inside.min() and inside.max() < folds[-1] + 0.01
    assert np.isnan(whole.get_ydata()[points][folded.unstable]).all()
    assert ax.get_xlabel() == "frequency (Hz)" and ax.get_ylabel() == "amplitude (m)"
    assert labels(ax) == ["x", "unstable", "estimated error", "fold"]


def test_marks_stand_on_the_curve(rubbed):
    ax = rubbed.plot(unit="um")
    marks = next(line for line in ax.lines if line.get_label() == "onset of slip")
    known = [one for one in rubbed.named_points if one.kind == "onset of slip"]
    assert marks.get_xdata().tolist() == [one.parameter for one in known]
    assert marks.get_ydata() == pytest.approx([1e6 * one.amplitudes[0] for one in known])
    (circle,) = (line for line in ax.lines if line.get_marker() == "o")
    assert [circle.get_xdata()[0], circle.get_ydata()[0]] == pytest.approx(
        [rubbed.peak("tip")[0], 1e6 * rubbed.peak("tip")[1]]
    )


@pytest.mark.parametrize("kind, share", [("half_peak_to_peak", np.sqrt(2)), ("rms", 1.0)])
def test_error_band_is_the_estimate(folded, kind, share):
    ax = folded.plot(kind=kind)
    reach = ax.patches[0].get_xy()[:, 1]
    a = folded.amplitude(kind)[:, 0]
    n = len(reach) // 2
    assert reach[:n] == pytest.approx((a - share * folded.truncation[:, 0])[:n])


def test_band_leaves_out_what_is_no_estimate(folded):
    doubtful = replace(folded, truncation=10 * folded.amplitude())
    assert doubtful.doubtful.all() and not doubtful.plot().patches
    assert not folded.doubtful.all() and folded.plot().patches


def test_curves_on_the_same_axes_have_colours_and_entries_of_their_own(rubbed):
    ax = rubbed.plot(label="first")
    assert rubbed.plot(label="second", ax=ax) is ax
    first, second = lines(ax, "-")
    assert first.get_color() != second.get_color()
    thin = 2 * rubbed.truncation.max() * np.sqrt(2) / rubbed.amplitude().max()
    assert thin < LINE  # of the height: no band is seen, and none named
    assert labels(ax) == ["first", "onset of slip", "second"]
    ax.set_title("mine")
    rubbed.plot(label="third", color="red", ax=ax)
    assert ax.get_title() == "mine" and lines(ax, "-")[2].get_color() == "red"


def test_what_dashes_and_shading_mean_stands_once_in_the_legend(folded):
    ax = folded.plot(label="one")
    assert labels(folded.plot(label="two", ax=ax)) == [
        "one",
        "unstable",
        "estimated error",
        "fold",
        "two",
    ]


def test_a_solution_is_drawn_over_its_period(folded):
    point = folded.at(0.15)
    (line,) = point.plot().lines
    assert line.get_xdata()[-1] == pytest.approx(1 / point.frequency)
    assert np.ptp(line.get_ydata()) / 2 == pytest.approx(point.amplitude().item(), rel=1e-4)


def test_period_of_a_subharmonic_is_its_own():
    quiet = Problem([[1.0]], [[0.05]], [[1.0]]).add(CubicSpring(1.0), 0).force(0, 2.0)
    third = np.zeros(3)
    third[1] = 2.0
    found = quiet.solve_at(6 / (2 * np.pi), outputs={"x": 0}, harmonics=9, periods=3, guess=third)
    (line,) = found.plot().lines
    assert line.get_xdata()[-1] == pytest.approx(3 / found.frequency)


def test_loop_has_the_area_of_the_friction_work(rubbed, slipping):
    top = int(rubbed.amplitude()[:, 0].argmax())
    cycles = contact_cycles(rubbed, slipping.contact_problem, top)
    (line,) = cycles.plot().lines
    work = np.trapezoid if hasattr(np, "trapezoid") else np.trapz
    assert work(line.get_ydata(), line.get_xdata()) == pytest.approx(cycles.energy.friction.sum())


def test_loops_on_the_same_axes_are_told_apart_by_their_labels(rubbed, slipping):
    axes = None
    for label in ("3 N", "5 N"):
        axes = contact_cycles(rubbed, slipping.contact_problem, 0).plot(ax=axes, label=label)
    assert labels(axes) == ["3 N", "5 N"]
    assert len({line.get_color() for line in axes.lines}) == len(axes.lines)


def test_a_band_behind_the_line_has_no_entry_in_the_legend(folded):
    """A thousandth of the height is less than the line is wide."""
    thin = replace(folded, truncation=1e-3 * folded.truncation / folded.truncation.max())
    small = replace(thin, truncation=thin.truncation * folded.amplitude()[:, :1].max())
    assert "estimated error" not in labels(small.plot())


def test_integration_lies_on_the_balance(rubbed, slipping):
    found = compare(rubbed, slipping.contact_problem, 700.0)
    balance, integration = found.plot().lines
    off = np.abs(balance.get_ydata() - integration.get_ydata()).max()
    assert off < 0.01 * np.abs(balance.get_ydata()).max()


def test_curves_found_beside_are_thin():
    M, C = np.diag([1, 0.05]), np.array([[0.01, -0.005], [-0.005, 0.005]])
    driven = Problem(M, C, [[1.015, -0.015], [-0.015, 0.015]]).add(CubicSpring(0.2 / 3), (0, 1))
    driven = driven.force(0, 0.0311)
    curve = driven.follow_band((0.0955, 0.2546), outputs={"x": 0}, harmonics=1, samples=16)
    ax = curves_beside(curve, driven.contact_problem, Search(frequencies=3, starts=4)).plot()
    first, detached = lines(ax, "-")
    assert detached.get_linewidth() < first.get_linewidth()
    assert detached.get_color() == first.get_color()


def test_backbone_meets_the_peaks_of_the_response(slipping, rubbed):
    found = backbone(slipping.contact_problem, 1, (1e-5, 1e-4), outputs={"tip": [1.0]})
    ax = rubbed.plot(unit="um")
    found.plot(unit="um", ax=ax)
    line = ax.lines[-1]
    hz, height = rubbed.peak("tip")
    x, y = line.get_xdata(), line.get_ydata()
    order = np.argsort(y)
    assert np.interp(1e6 * height, y[order], x[order]) == pytest.approx(hz, rel=0.01)
    with pytest.raises(InputError, match="output 'y'"):
        found.plot("y")


def test_statics_draw_their_maps():
    model, pairs = two_blades(stations=5)
    found = preload(model, pairs, 60.0 * model.loads["pull"])
    ax = found.pairs.plot("right")
    heights = np.concatenate([line.get_ydata() for line in ax.lines if line.get_marker() == "o"])
    assert heights.sum() == pytest.approx(found.force[pairs.side == "right"].sum())
    mode = sum(model.displacement_row("blade1", node, [0, 1, 0]) for node in range(1, 6))
    mode = mode / np.sqrt(mode @ model.M @ mode)
    ax = detach_until(StuckAssembly(model), pairs, 1270.0, mode).plot()
    assert "sets tried" in labels(ax) and "chosen" in labels(ax)


def test_a_map_runs_along_the_rows():
    """Two square sides at a right angle, whose rows both lie along y."""
    _, pairs = two_blades(stations=9)
    n = len(pairs) // 2
    square = np.stack(np.meshgrid([0.0, 1.0, 2.0], [0.0, 1.0, 2.0], indexing="ij"), -1)
    row, along = square.reshape(-1, 2)[:n].T
    flat, upright = np.c_[row, along, 0 * row], np.c_[0 * row, along, row]
    turned = pairs.replace(
        side=np.repeat(["a", "b"], n),
        row=np.tile(row.astype(int), 2),
        position=1e-3 * np.r_[flat, upright],
    )
    for side in turned.sides:
        ax = turned.plot(side)
        assert ax.get_xlabel() == "y (mm)"


def test_sides_on_the_same_axes_are_told_apart():
    _, pairs = two_blades(stations=3)
    three = pairs.replace(side=np.array(["a", "a", "b", "b", "c", "c"]))
    ax = three.plot("a")
    for side in "bc":
        three.plot(side, ax=ax)
    marks = [line for line in ax.lines if line.get_marker() not in ("", "None", None)]
    looks = {(line.get_color(), line.get_marker()) for line in marks}
    assert len(looks) == len(three.sides) == 3


def test_points_of_a_curve(folded):
    assert len(folded) == len(list(folded)) == len(folded.frequency)
    assert folded[-1].frequency == folded.frequency[-1]
    assert np.array_equal(folded[3].harmonics, folded.harmonics[3])
    with pytest.raises(IndexError):
        folded[len(folded)]


def test_a_point_of_a_curve_is_what_is_solved_there(rubbed, slipping):
    point = rubbed.at(760.0)
    found = slipping.solve_at(point.frequency, outputs={"tip": 0}, guess=point.unknowns)
    assert found.amplitude() == pytest.approx(point.amplitude(), rel=1e-8)
    assert found.share_slip == pytest.approx(point.share_slip, abs=1e-8)


def test_points_where_a_curve_passes_a_value(folded):
    with pytest.raises(InputError, match="passes it 3 times.*say which = 0 to 2"):
        folded.at(0.25)
    heights = [folded.at(0.25, which=k).amplitude().item() for k in range(3)]
    assert heights[0] > heights[1] > heights[2]
    with pytest.raises(InputError, match="its points lie from 0.12 to 0.5"):
        folded.at(0.7)
    with pytest.raises(InputError, match="which = 3: the curve passes 0.25 3 times"):
        folded.at(0.25, which=3)
    with pytest.raises(InputError, match="either value in Hz or omega in rad/s"):
        folded.at()
    for bad in ("a", np.nan):
        with pytest.raises(InputError, match="value = .*: must be one positive number"):
            folded.at(bad)
    with pytest.raises(InputError, match="which = 0.5: must be a whole number"):
        folded.at(0.25, which=0.5)


def test_frame_has_a_row_for_each_point(folded, rubbed):
    pytest.importorskip("pandas")
    frame = rubbed.to_pandas()
    assert list(frame) == [
        *("frequency", "tip", "dissipated", "converged", "stable", "relative_truncation")
    ]
    assert frame["tip"].to_numpy() == pytest.approx(rubbed.amplitude()[:, 0])
    assert (~folded.to_pandas()["stable"].astype(bool)).sum() == folded.unstable.sum()


def test_dataset_has_names_and_units(rubbed):
    pytest.importorskip("xarray")
    data = rubbed.to_xarray()
    assert data.harmonics.sel(output="tip", harmonic=1).values == pytest.approx(
        rubbed.harmonics[:, 0, 1]
    )
    assert data.dissipated.attrs["units"] == "J" and data.frequency.attrs["units"] == "Hz"
    shares = data.share_stick + data.share_slip + data.share_open
    assert shares.values == pytest.approx(np.ones((len(rubbed), 1)))


SHARES = {"share_stick", "share_slip", "share_open"}


def test_what_has_no_contacts_is_not_said_to_stick_or_slip(folded, rubbed):
    """A Duffing oscillator, of whose curve a point failed; of a contact all shares stay, also of a
    curve without a solved point, of which nothing is known."""
    pytest.importorskip("xarray")
    failed = np.zeros(len(folded), dtype=bool)
    failed[0] = True
    lost = {name: np.where(failed[:, None], np.nan, vars(folded)[name]) for name in SHARES}
    for curve in (folded, replace(folded, converged=~failed, **lost)):
        assert not SHARES & set(curve.to_xarray()) and "pairs" not in repr(curve)
    assert not SHARES & set(folded[1].to_xarray())
    nothing = replace(rubbed, **{name: np.nan * vars(rubbed)[name] for name in SHARES})
    for curve in (rubbed, nothing, rubbed[0]):
        assert set(curve.to_xarray()) >= SHARES
    assert "of 1 pairs" in repr(rubbed) and "of 1 pairs" in repr(nothing)


def test_notebooks_show_a_table(folded, duffing):
    _, pairs = two_blades()
    shown = [one._repr_html_() for one in (folded, folded[0], pairs)]
    assert all(text.startswith("<table>") and text.endswith("</table>") for text in shown)
    assert "fold" in shown[0] and "side &#x27;left&#x27;" in shown[2]
    point = folded.at(0.12)
    assert f"0.12 Hz, x {point.amplitude().item():.4g} m" in repr(point)
    found = compare(folded, duffing, 0.12)
    assert repr(found) == f"<Comparison at 0.12 Hz, H = 3: {found.said}>"


@pytest.fixture(scope="module")
def mode(slipping):
    return backbone(slipping, 1, (1e-7, 1e-3), outputs={"tip": 0}, harmonics=3)


@pytest.fixture(scope="module")
def made(mode, slipping):
    return synthesis(mode, slipping, [5.0])


@pytest.fixture(scope="module")
def fit(slipping, rubbed):
    every = slice(None, None, 8)
    tip = rubbed.amplitude("harmonic")[every, 0]
    measured = MeasuredResponse(rubbed.frequency[every], tip, [1.0], level=5.0)
    guess = replace(slipping.contact_problem, damping_ratio=0.012)
    return fit_damping(guess, [1.0], [measured])


def test_a_fit_draws_what_was_measured_and_what_it_computes(fit):
    ax = fit.plot(unit="um")
    measured, line = ax.lines
    assert measured.get_marker() == "o" and line.get_label() == "fit at level 5"
    assert measured.get_ydata() == pytest.approx(1e6 * fit.measured[0].response)
    assert line.get_ydata() == pytest.approx(measured.get_ydata(), rel=1e-4)
    pytest.importorskip("pandas")
    (row,) = fit.to_pandas().itertuples()
    assert row.unknown == "damping ratio" and row.values == pytest.approx(0.01, rel=1e-4)


def test_a_synthesis_stands_among_curves(made, rubbed):
    ax = made.plot(unit="um", ax=rubbed.plot(unit="um"))
    line = ax.lines[-1]
    assert line.get_label() == "synthesis"
    assert line.get_ydata().max() == pytest.approx(1e6 * made.peak("tip")[1])
    with pytest.raises(InputError, match="output 'y' is not in this synthesis"):
        made.plot("y")
    pytest.importorskip("pandas")
    frame = made.to_pandas()
    assert list(frame) == ["frequency", "tip"] and frame["tip"].max() == made.peak("tip")[1]


def test_an_energy_balance_has_a_bar_for_each_taker(rubbed, slipping):
    energy = energy_balance(rubbed, slipping, int(rubbed.amplitude()[:, 0].argmax()))
    ax = energy.plot()
    ends = {
        name.get_text(): bar.get_path().vertices[:, 0].max()
        for name, bar in zip(ax.get_yticklabels(), ax.patches, strict=True)
    }
    assert list(ends) == ["contact 0", "damping", "input"]
    assert ends["input"] == pytest.approx(ends["damping"] + ends["contact 0"], rel=1e-6)
    assert "1 contacts" in energy._repr_html_()


def test_a_preload_draws_its_map():
    model, pairs = two_blades()
    found = preload(model, pairs, model.loads["pull"])
    assert len(found.plot("right").lines) == len(found.pairs.plot("right").lines) > 0
    n = len(pairs) // 2
    assert f"{n} of {n} pairs closed" in found._repr_html_()


def test_notebooks_show_results_in_words(fit, made, mode, rubbed, slipping):
    given = dict(outputs={"tip": [1.0]}, band=(600, 1000), harmonics=1)
    peaks = follow_peak(slipping, [5.0], "level", (1.0, 2.0), **given)
    by = peak_derivatives(rubbed, slipping, "tip")
    compared = compare(rubbed, slipping, 760.0)
    shown = {
        "0.01 (": fit,
        f"{made.peak('tip')[1]:.4g} m": made,
        mode.ended: mode,
        f"{peaks.height.max():.4g} m at level 2": peaks,
        f"{by.total('mu')[1] / by.amplitude:+.3g} % in amplitude": by,
        compared.said: compared,
    }
    for words, one in shown.items():
        assert words in one._repr_html_(), words


@pytest.fixture(scope="module")
def results(folded, duffing, rubbed, slipping, made, mode, fit):
    """One of each public result that draws itself, by its class."""
    model, pairs = two_blades(stations=3)
    shape = sum(model.displacement_row("blade1", node, [0, 1, 0]) for node in (1, 2, 3))
    shape = shape / np.sqrt(shape @ model.M @ shape)
    given = dict(outputs={"tip": [1.0]}, band=(600, 1000), harmonics=1)
    found = [
        *(folded, folded[3], made, mode, fit, pairs),
        follow_peak(slipping, [5.0], "level", (1.0, 2.0), **given),
        peak_derivatives(rubbed, slipping, "tip"),
        compare(rubbed, slipping, 760.0),
        contact_cycles(rubbed, slipping, 3),
        energy_balance(rubbed, slipping, 3),
        curves_beside(rubbed, slipping, Search(frequencies=1, starts=1)),
        detach_until(StuckAssembly(model), pairs, 1270.0, shape),
        preload(model, pairs, model.loads["pull"]),
    ]
    return {type(one): one for one in found}


def test_whatever_draws_itself_is_a_table_and_shows_itself_in_a_notebook(results):
    pytest.importorskip("pandas")
    faces = [getattr(tipdamp, name) for name in tipdamp.__all__]
    draw = {one for one in faces if inspect.isclass(one) and hasattr(one, "plot")}
    assert draw == set(results)
    for one in results.values():
        assert len(one.to_pandas()) > 0 and "<table>" in one._repr_html_(), type(one)
    of_arrays = {"ForcedResponse", "PeriodicSolution", "Backbone", "Followed", "Synthesis"}
    found = {one.__name__ for one in draw if hasattr(one, "to_xarray")}
    assert found == {*of_arrays, "ContactCycles"}


def test_tables_hold_what_their_results_do(results, rubbed):
    pytest.importorskip("pandas")
    rows = {kind.__name__: one.to_pandas() for kind, one in results.items()}
    one = {kind.__name__: one for kind, one in results.items()}
    assert rows["PeriodicSolution"]["rms"].tolist() == one["PeriodicSolution"].amplitude("rms")
    assert rows["ContactTable"]["preload"].tolist() == one["ContactTable"].preload.tolist()
    assert rows["ContactTable"]["x"].tolist() == one["ContactTable"].position[:, 0].tolist()
    cycles = one["ContactCycles"]
    last = rows["ContactCycles"].iloc[-1]
    assert (last["time"], last["force_t1"]) == (cycles.time[-1], cycles.force[-1, -1, 0])
    energy = rows["EnergyBalance"].set_index("of")["energy"]
    assert energy["contact 0"] == one["EnergyBalance"].friction[0]
    first = rows["CurvesBeside"].loc[0]
    assert len(first) == len(rubbed) and first["tip"].max() == rubbed.peak("tip")[1]
    compared = rows["Comparison"]
    largest = compared[compared["order"] == 1].iloc[0]
    assert largest["balance"] == abs(one["Comparison"].harmonics[0, 1])
    assert largest["integration"] == pytest.approx(largest["balance"], rel=0.01)
    assert rows["Detachment"]["hz"].tolist() == [s.hz for s in one["Detachment"].history]


def test_branches_are_arrays_with_names(results):
    pytest.importorskip("xarray")
    mode, peaks = (results[kind].to_xarray() for kind in (tipdamp.Backbone, tipdamp.Followed))
    assert mode["harmonics"].dims == ("place", "output", "harmonic")
    assert mode["shape"].dims == ("place", "dof") and mode["frequency"].attrs == {"units": "Hz"}
    assert peaks["share_slip"].dims == ("place", "contact")
    assert peaks["height"].values.tolist() == results[tipdamp.Followed].height.tolist()
    assert peaks["output"].values.tolist() == ["tip"]


def test_solutions_loops_and_syntheses_are_arrays_with_names(results):
    pytest.importorskip("xarray")
    of = {kind.__name__: one for kind, one in results.items()}
    solution = of["PeriodicSolution"].to_xarray()
    assert (
        solution["harmonics"].sel(output="x", harmonic=3) == of["PeriodicSolution"].harmonics[0, 3]
    )
    assert solution.attrs["frequency_Hz"] == of["PeriodicSolution"].frequency
    loops = of["ContactCycles"].to_xarray()
    force = loops["force"].sel(component="t1", contact=0)
    assert np.abs(force.diff("time")).max() > 0 and force.attrs == {"units": "N"}
    assert (loops["time"] == of["ContactCycles"].time).all()
    made = of["Synthesis"].to_xarray()
    at = int(np.argmax(made["amplitude"].sel(output="tip").values))
    assert made["frequency"].values[at] == of["Synthesis"].peak("tip")[0]


def test_models_and_problems_show_themselves(slipping):
    model, _ = two_blades()
    assert "body &#x27;damper&#x27;" in model._repr_html_() and "pull" in model._repr_html_()
    assert "Jenkins1D" in slipping._repr_html_() and "5 N" in slipping._repr_html_()


@pytest.mark.parametrize(
    "missing, call",
    [("matplotlib.pyplot", "plot"), ("pandas", "to_pandas"), ("xarray", "to_xarray")],
)
def test_missing_libraries_are_told_with_the_remedy(folded, monkeypatch, missing, call):
    monkeypatch.setitem(sys.modules, missing, None)
    with pytest.raises(InputError, match=f"not installed: pip install {missing.split('.')[0]}"):
        getattr(folded, call)()


@pytest.mark.parametrize(
    "draw, said",
    [
        (lambda curve: curve.plot("y"), "output 'y'"),
        (lambda curve: curve.plot(unit="inch"), "unit = 'inch'"),
        (lambda curve: curve[0].plot("y"), "output 'y'"),
    ],
)
def test_what_cannot_be_drawn_is_told(folded, draw, said):
    with pytest.raises(InputError, match=said):
        draw(folded)
