"""The page: whole, harmless, with a section for everything that was computed."""

import io
import re
import subprocess
import sys
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from tests.tipdamp.report.files import (
    FULL,
    HOSTILE,
    HOSTILE_NAMES,
    artefacts,
    curve,
    cut,
    damage,
    results_of,
    table,
    write,
)
from tipdamp.hbm.drawing import figure
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.result import ForcedResponse
from tipdamp.report.contents import contents
from tipdamp.report.drawing import matplotlib, plotly
from tipdamp.report.drawing.table import Table
from tipdamp.report.introduction import introduction
from tipdamp.report.subjects import friction, kept, modes, peaks, preload, response
from tipdamp.report.summary import summarise

ROOT = Path(__file__).parents[3]


class Reader(HTMLParser):
    """Tags with their attributes, and the text of the page without styles and scripts."""

    def __init__(self, content):
        super().__init__()
        self.tags, self.text, self.scripts, self.open = [], "", [], []
        self.feed(content)

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        if tag not in ("meta", "link", "img", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag, f"</{tag}> closes nothing"

    def handle_data(self, data):
        if self.open and self.open[-1] == "script":
            self.scripts.append(data)
        elif not self.open or self.open[-1] != "style":
            self.text += data


def html_of(store):
    return Reader(store.path("report.html").read_text(encoding="utf-8"))


def test_page_loads_nothing_from_elsewhere(plain_report):
    content = plain_report.path("report.html").read_text(encoding="utf-8")
    read = html_of(plain_report)
    assert read.open == []
    for tag, attributes in read.tags:
        assert (
            tag not in ("link", "iframe", "object", "embed", "base") and "src" not in attributes
        ), (tag, attributes)
        assert attributes.get("href", "#").startswith("#")
    assert (
        "@import" not in content.split("</style>")[0] and "url(" not in content.split("</style>")[0]
    )
    library, *ours = sorted(read.scripts, key=len, reverse=True)
    assert len(library) > 1e6 and sum("Plotly.newPlot" in s for s in ours) == read.text.count(
        "Figure "
    )
    assert not any("http" in script for script in ours)
    assert len(content) < 6e6


def test_every_section_and_picture_is_there(plain_report):
    read = html_of(plain_report)
    ids = {a["id"] for tag, a in read.tags if tag == "section"}
    assert ids == {
        "figures",
        "linear",
        "preload",
        "tuning",
        "response",
        "trust",
        "pairs",
        "assumptions",
        "reduction",
        "made",
    }
    assert "left 0\N{EN DASH}1; right 4" in read.text  # the slipping pairs by name
    assert "+0.06 %" in read.text  # 1591 of 1590 Hz
    names = {p.stem for p in plain_report.path("figures").glob("*.png")}
    assert names == {
        "linear_without_damper",
        "preload",
        "preload_kept",
        "tuning",
        "family_H1",
        "family_H3",
        "levels",
        "peaks",
        "contact_states",
    }


def test_tables_of_the_pictures(plain_report):
    """Every picture has its numbers beside it; the response is that of the oscillator of the
    made-up results."""
    import csv

    folder = plain_report.path("figures")
    assert {p.stem for p in folder.glob("*.csv")} == {p.stem for p in folder.glob("*.png")}
    with (folder / "family_H1.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    mine = [
        (float(r["x"]), float(r["y"]))
        for r in rows
        if (r["panel"], r["drawn as"], r["name"]) == ("per newton", "curve", "Fe = 1 N")
    ]
    hz, um = np.array(mine).T
    assert len(hz) == 41
    np.testing.assert_allclose(
        um, np.abs(0.044 / (1 - (hz / 2800) ** 2 + 0.044j * hz / 2800)), rtol=1e-8
    )


def test_two_processes_draw_the_same_pictures(plain_report, tmp_path):
    """Byte for byte, with the tables beside them."""
    study, store = artefacts(tmp_path)
    write(study, store, jobs=2)
    alone, shared = (
        {path.name: path.read_bytes() for path in one.path("figures").iterdir()}
        for one in (plain_report, store)
    )
    assert len(alone) > 10 and shared == alone


def test_pictures_are_not_empty(plain_report):
    from matplotlib.image import imread

    for path in plain_report.path("figures").glob("*.png"):
        image = imread(path)[..., :3]
        inked = (image < 0.95).any(axis=2).mean()
        assert min(image.shape[:2]) > 300 and 0.01 < inked < 0.9, path.name


def test_hostile_names_are_text(hostile_report):
    """Title, sides and patches: escaped in paragraphs, tables, captions and figures."""
    content = hostile_report.path("report.html").read_text(encoding="utf-8")
    read = html_of(hostile_report)
    assert "<script>alert" not in content and "<img" not in content and "<b><" not in content
    assert not any(script.startswith("alert") for script in read.scripts)
    for text in (HOSTILE, f"N on side '{HOSTILE_NAMES['left']}'", f"{HOSTILE_NAMES['left']} 0"):
        assert text in read.text


def test_backends_escape_names():
    one = figure.Curve(np.arange(3), np.arange(3), HOSTILE)
    drawn = figure.Figure(
        "x",
        HOSTILE,
        "",
        (
            figure.Panel(
                HOSTILE,
                HOSTILE,
                HOSTILE,
                (
                    one,
                    figure.Line("y", 1.0, HOSTILE),
                    figure.Marks(np.ones(1), np.ones(1), labels=(HOSTILE,)),
                ),
            ),
        ),
    )
    content = plotly.draw(drawn)
    assert "<script>alert" not in content and "%{y}" not in content
    # every text, as plotly must read it
    assert content.replace("\\u0026", "&").count("&lt;script&gt;alert") == 8
    picture = io.BytesIO()
    matplotlib.draw(drawn, picture)  # "$a_$" alone would stop its reader of formulas
    assert picture.getvalue().startswith(b"\x89PNG")


def test_lines_stand_on_the_page_wherever_they_are_named():
    """Before the first curve of a panel, after it, and in a panel of lines alone."""
    line, curve = figure.Line("y", 1.0), figure.Curve(np.arange(3), np.arange(3), "a")
    panels = [
        figure.Panel("", "x", "y", items) for items in ((line, curve), (curve, line), (line,))
    ]
    content = plotly.draw(figure.Figure("x", "title", "", tuple(panels), columns=3))
    assert content.count('"type":"line"') == 3
    domains = re.findall(r'"xaxis[23]?":.*?"domain":\[([\d.]+),([\d.]+)\]', content)
    ends = np.array(domains, dtype=float)
    assert ends[0, 0] == 0.0 and ends[-1, 1] == 1.0 and (ends[1:, 0] > ends[:-1, 1]).all()
    assert np.allclose(np.diff(ends, axis=1), np.diff(ends[0]))  # as wide as each other


@pytest.mark.parametrize(
    "names, wide, columns",
    [([], 7, 1), (["a"] * 3, 7, 3), (["a" * 19] * 9, 8, 4), (["a" * 300] * 2, 7, 1)],
)
def test_the_legend_of_a_picture_has_the_columns_that_fit(names, wide, columns):
    """No more than it has names, and than their lengths leave room for."""
    assert matplotlib._legend_columns(names, wide) == columns


def test_a_name_without_points_in_the_first_panel_stands_in_the_legend():
    """The page draws no entry for a trace of no points; its entry serves the other panels."""
    none, some = np.empty(0), np.ones(1)
    for item in (figure.Marks, figure.Curve):
        panels = [figure.Panel("", "x", "y", (item(x, x, "a"),)) for x in (none, some)]
        content = plotly.draw(figure.Figure("x", "title", "", tuple(panels)))
        shown = re.findall(r'"showlegend":(true|false),"x":(\[null\]|\{)', content)
        assert shown == [("true", "[null]"), ("false", "{")]


@pytest.mark.parametrize("names", [(), ("a", "b"), ("longer than the picture is wide " * 9, "b")])
def test_panels_of_a_picture_leave_room_for_their_labels(monkeypatch, names):
    """Nothing is cut off at an edge or drawn over another panel, as far as names allow; each panel
    keeps half of its share."""
    drawn = []
    base = matplotlib._matplotlib()[1]
    monkeypatch.setattr(base, "savefig", lambda self, *_, **__: drawn.append(self))
    items = (figure.Curve(np.arange(3), 1e5 * np.arange(3), "a"),)
    tiles = figure.Tiles(np.arange(2), np.arange(2), np.eye(2), "N", 1.0)
    panel = figure.Panel("title", "x (Hz)", "y (N)", items, y_names=names)
    panels = [replace(panel, items=(*items, tiles)), panel, panel, panel, panel]
    matplotlib.draw(figure.Figure("x", "title", "", tuple(panels), columns=2), None)
    [out] = drawn
    renderer = out.canvas.get_renderer()
    groups: dict = {}
    for axes in out.axes:
        seen = axes.get_tightbbox(renderer, for_layout_only=True)
        groups.setdefault(axes.get_subplotspec().get_topmost_subplotspec().num1, []).append(seen)
        place = axes.get_subplotspec().get_topmost_subplotspec().get_position(out)
        assert place.width > 0.5 * 0.9 / 2 and place.height > 0.5 * 0.7 / 3
    if not any(len(name) > 5 for name in names):
        boxes = [type(seen[0]).union(seen) for seen in groups.values()]
        assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[:i])
        ends = np.array([box.extents for box in boxes])
        title = out._suptitle.get_window_extent(renderer)
        legend = out.legends[0].get_window_extent(renderer)
        assert ends[:, 0].min() >= 0 and ends[:, 2].max() <= out.bbox.x1
        assert ends[:, 1].min() >= legend.y1 and ends[:, 3].max() <= title.y0


def test_failed_points_are_gaps_with_a_mark(hostile_report, tmp_path):
    study, store = artefacts(tmp_path, failed=(19, 20))
    items = next(response.levels(results_of(study, store))).panels[0].items
    band = next(i for i in items if isinstance(i, figure.Band))
    assert [len(x) // 2 for x, _ in figure.outlines(band)] == [19, 20]  # 41 points without two
    assert np.nanmin(band.low / band.high) == pytest.approx(0.9)  # the nodes of blade 1 alone
    line = next(i for i in items if isinstance(i, figure.Curve))
    assert np.flatnonzero(np.isnan(line.y)).tolist() == [19, 20]
    marks = next(i for i in items if isinstance(i, figure.Marks))
    assert (
        marks.name == "failed point"
        and np.allclose(marks.x, line.x[19:21])
        and np.isfinite(marks.y).all()
    )
    early = marks_of_early_stop(tmp_path / "early")
    assert early.name == "curve stops" and early.x.tolist() == [3300.0]
    read = html_of(hostile_report)
    assert (
        "incomplete, 2 points failed" in read.text
        and "is incomplete, 2 points failed: " in read.text
    )
    assert any("failed point" in script for script in read.scripts[1:])


def test_failed_points_stand_where_slip_ends(tmp_path):
    """In the picture of the contact states: at the height to which contacts slip or are open."""
    study, store = artefacts(tmp_path, failed=(19, 20))
    panels = next(friction.states(results_of(study, store))).panels
    marked = [p for p in panels if any(isinstance(i, figure.Marks) for i in p.items)]
    assert marked
    for panel in marked:
        marks = next(i for i in panel.items if isinstance(i, figure.Marks))
        slip = next(i for i in panel.items if i.name == "slip")
        solved = np.isfinite(slip.high)
        heights = np.interp(marks.x, slip.x[solved], slip.high[solved])
        assert marks.y == pytest.approx(heights) and (slip.high > slip.low)[solved].any()


def test_ends_of_the_preload_map_are_told_by_the_middle(tmp_path):
    """Sums of the stations by hand; a middle that carries nothing gives no ratio."""
    results = results_of(*artefacts(tmp_path))
    whole, told = results.whole, next(preload.at_rest(results)).caption
    for side in whole.sides:
        mine = whole.side == side
        stations = sorted(
            set(whole.station[mine]),
            key=lambda s: results.along(whole)[mine & (whole.station == s)].mean(),
        )
        sums = [whole.preload[mine & (whole.station == s)].clip(0).sum() for s in stations]
        third = max(len(sums) // 3, 1)
        ratio = min(sums[0], sums[-1]) / min(sums[third:-third])
        assert f"{ratio:.1f} times the middle on side '{side}'" in told
    bare = replace(results, whole=whole.replace(preload=np.zeros(len(whole))))
    assert "times the middle" not in next(preload.at_rest(bare)).caption


def marks_of_early_stop(folder):
    """The curve of 20 N at H = 3 says that it is incomplete, and no point failed."""
    folder.mkdir()
    study, store = artefacts(folder, damage=damage("responses", 3, "complete", value=False))
    items = next(response.levels(results_of(study, store))).panels[0].items
    return next(i for i in items if isinstance(i, figure.Marks))


@pytest.mark.parametrize(
    "sections, gone",
    [
        ("", {"tuning", "response", "reduction"}),
        # without [respond] there is no shape to tune by
        ("[tune]\ntarget_hz = 2800\n", {"tuning", "response", "reduction"}),
    ],
)
def test_sections_without_data_are_left_out(tmp_path, sections, gone):
    study, store = artefacts(tmp_path, sections=sections)
    results = results_of(study, store)
    shown = contents(results)
    assert not gone & {section.name for section in shown} and len(shown) == 9 - len(gone)
    assert all(not name.startswith("respon") for name in summarise(results))


def test_table_and_map_of_further_load_cases(tmp_path):
    light = table(preload=2.0)
    light = light.replace(preload=np.where(light.station == 2, -0.5, light.preload))
    case = {
        "file": "loads/light.csv",
        "residual": 0.0,
        "balance_error": 0.0,
        "sides": {
            "left": {"sum_N": 8.0, "max_N": 2.0, "detached": 1},
            "right": {"sum_N": 16.0, "max_N": 2.0, "detached": 2},
        },
    }
    study, store = artefacts(
        tmp_path,
        sections=FULL + "[loads.light]\npull = 20\n",
        damage=lambda files: files["preload.json"].update(cases={"light": case}),
    )
    store.path("loads").mkdir()
    light.save(store.path("loads/light.csv"))
    blocks = next(s.blocks for s in contents(results_of(study, store)) if s.name == "preload")
    rows = next(b for b in blocks if isinstance(b, Table)).rows
    assert rows == (
        ("the pull", "100", "70.00", "9.000", "0", "70.00", "9.000", "0"),
        ("light: another pull", "20", "8.000", "2.000", "1", "16.00", "2.000", "2"),
    )
    pictures = {b.name: b for b in blocks if not isinstance(b, Table)}
    map_of_case = pictures["preload_light"]
    marks = [i for panel in map_of_case.panels for i in panel.items if isinstance(i, figure.Marks)]
    assert sum(len(m.x) for m in marks) == len(light) and {
        float(y) for m in marks for y in m.y
    } == {2.0, -0.5}
    assert all(m.filled == (m.y > 0).all() for m in marks)
    assert pictures["preload_on_damper"].cases == ["the pull", "light"]


def test_cut_curve_in_the_figures(tmp_path):
    """No circle at a peak that is none, no place in the trend; the captions and the first page say
    what is known."""
    results = results_of(*artefacts(tmp_path, damage=cut()))
    said = (
        "No peak, since the curve stops or has a gap at its highest point: 20 N, H = 3 (at least "
        "0.7500 µm/N at 2700"
    )
    family, other = list(response.families(results))[:2]
    circles = [i for i in family.panels[0].items if isinstance(i, figure.Marks) and not i.name]
    assert len(circles) == 1 and said in family.caption and "No peak" not in other.caption
    trend = next(response.trend(results))
    places = {i.name: i.x.tolist() for i in trend.panels[0].items if isinstance(i, figure.Marks)}
    assert places == {"H = 1": [1.0, 20.0], "H = 3": [1.0]} and said in trend.caption
    words = introduction(results)
    assert (
        "At 20 N the curve has no peak: at least 0.7500 µm/N at 2700.0 Hz, stopped at 2700 Hz: "
        "the mean" in words[-1]
    )


def test_peaks_of_two_modes_are_no_trend(tmp_path):
    """The largest peak of 20 N at H = 3 is that of another mode: no line joins the two, and no
    sentence makes a trend of them."""
    results = results_of(*artefacts(tmp_path, damage=damage("responses", 3, "mac", value=0.1)))
    trend = next(response.trend(results))
    lines = [len(i.x) for i in trend.panels[0].items if isinstance(i, figure.Curve)]
    assert sorted(lines) == [1, 1, 2]
    family, other = list(response.families(results))[:2]
    assert "At 20 N the largest peak is that of another mode, at" in family.caption
    moves = "peak (moves|stays)"
    assert not re.search(moves, family.caption) and re.search(moves, other.caption)


def test_a_curve_that_never_began(tmp_path):
    """The first point fails: one point, no peak, and nothing that looks like a number; why stands
    there."""

    def change(files):
        files["responses"][3].update(
            peak_hz=None,
            peak_m=None,
            min_peak_m=None,
            complete=False,
            ended="no solution found at 2300 Hz, where the band starts; run the other way",
        )

    study, store = artefacts(tmp_path, damage=change)
    one = curve(20.0, 3)
    dead = {
        name: getattr(one, name)[:1] * np.nan
        for name in ("harmonics", "share_stick", "share_slip", "share_open")
    }
    replace(
        one,
        frequency=one.frequency[:1],
        parameter=one.frequency[:1],
        converged=np.array([False]),
        iterations=one.iterations[:1],
        dissipated=one.dissipated[:1],
        complete=False,
        **dead,
    ).save(store.path("responses/Fe_20N_H3.npz"))
    write(study, store)
    found = store.read_json("summary.json")
    assert len(found["warnings"]) == 1 and found["responses"][3]["peak_m"] is None
    results = results_of(study, store)
    why = "no solution found at 2300 Hz, where the band starts"
    assert (
        introduction(results)[-1]
        == f"At 20 N the curve has no solved point: {why}; see the warnings."
    )
    rows = [row for row in next(peaks.trust(results)).rows if "no solved point" in row[2]]
    assert [row[:3] for row in rows] == [("3", "20", f"no solved point: {why}")]
    said = f"No point of the curve 20 N, H = 3 is solved: {why}."
    assert all(said in next(part(results)).caption for part in (response.families, response.levels))
    assert [panel.title for panel in next(response.levels(results)).panels] == [
        "Fe = 20 N: no point solved",
        "Fe = 1 N",
    ]
    assert len(next(friction.states(results)).panels) == 1
    assert "at least \N{EN DASH}" not in store.path("report.html").read_text()


@pytest.mark.parametrize("missing", ["plotly", "matplotlib", "jinja2"])
def test_missing_library_is_named(tmp_path, monkeypatch, missing):
    study, store = artefacts(tmp_path)
    if missing != "matplotlib":
        monkeypatch.setattr(matplotlib, "draw", lambda _, path: path.write_bytes(b""))
    for name in [n for n in sys.modules if n.split(".")[0] == missing]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, missing, None)
    with pytest.raises(InputError, match=rf"{missing}.*extra 'study'"):
        write(study, store)
    assert store.path("summary.json").is_file() and not store.path("report.html").exists()


def test_drawing_libraries_wait_until_they_are_needed():
    code = (
        "import sys, tipdamp.report.write\nprint([m for m in ('plotly', 'matplotlib', 'jinja2', "
        "'dolfinx', 'gmsh') if m in sys.modules])"
    )
    child = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert child.stdout.strip() == "[]", child.stdout + child.stderr


def test_wide_gaps_do_not_flatten_the_preload(tmp_path):
    """A pair open by a hundred times the largest load: crosses at the end of an axis that the
    closed pairs set."""

    def opened(pairs):
        load = pairs.preload.copy()
        for side in pairs.sides:
            load[np.flatnonzero(pairs.carrying & (pairs.side == side))[0]] = -100 * load.max()
        return pairs.replace(preload=load)

    results = results_of(*artefacts(tmp_path))
    results = replace(results, whole=opened(results.whole), kept=opened(results.kept))
    for part in (preload.at_rest, kept.figure):
        shown = next(part(results))
        for panel in shown.panels:
            marks = [item for item in panel.items if isinstance(item, figure.Marks)]
            [cut_off] = [m for m in marks if m.name == "open, below the axis"]
            assert len(cut_off.x) == 1 and panel.y_range[0] > -0.4 * panel.y_range[1]
            assert all((np.asarray(m.y) >= panel.y_range[0]).all() for m in marks)
    drawn = plotly.draw(shown)
    assert (
        '"minexponent":4' in drawn and '"separators":"."' in drawn
    )  # 15000 Hz, not 1.5 times a power of ten
    assert '"exponentformat":"power"' in drawn and '"xanchor":"left"' in drawn


def test_figures_draw_what_their_legend_names(tmp_path, recwarn):
    """All stations kept, a band without resonance, a blade that the other one leaves alone: no name
    without a mark inside the panel, and matplotlib has nothing to say."""

    def change(files):
        files["kept"] = files["kept"].replace(weight=np.ones(len(files["kept"])))
        files["reduce.json"]["free_hz"] = {"out_of_phase": 3901.0, "in_phase": 3996.0}
        files["reduce.json"]["free_response"]["m_per_N"]["patch_2"] *= 0

    study, store = artefacts(tmp_path, damage=change)
    results = results_of(study, store)
    linear = next(modes.free_response(results))
    of_kept = next(kept.figure(results))
    for panel in of_kept.panels:
        for item in panel.items:
            if not isinstance(item, figure.Line) and item.name:
                low, high = panel.y_range
                assert (
                    len(item.x)
                    and ((np.asarray(item.y) >= low) & (np.asarray(item.y) <= high)).all()
                ), item.name
    assert [c.name for c in linear.panels[0].items if isinstance(c, figure.Curve)] == [
        "blade 1 (patch_1)"
    ]
    low, high = linear.panels[0].y_range
    assert (
        low > 1e-7
        and "Not shown: blade 2 (patch_2), which the excitation does not reach" in linear.caption
    )
    matplotlib.draw(linear, tmp_path / "linear.png")
    assert not [str(w.message) for w in recwarn]


def test_the_pairs_of_the_peak_are_not_those_of_the_curve(tmp_path):
    """Two of six slip at the peak, the others at its feet alone; one opens there at last."""
    study, store = artefacts(tmp_path)
    path = store.path("responses/Fe_20N_H3.npz")
    one = ForcedResponse.load(path)
    share = one.share_slip.copy()
    top = int(one.amplitude()[:, 0].argmax())
    share[top, 2:] = 0.0
    opens = 0 * share
    opens[0, 5] = 0.3
    replace(one, share_slip=share, share_open=opens).save(path)
    said = introduction(results_of(study, store))[-1]
    assert "where 2 of 6 pairs slip or open at the peak; anywhere on the curve 3 do" in said


def test_axis_titles_keep_off_each_other():
    """One title for neighbours that say the same, and two lines where a panel is not high
    enough."""
    x = np.linspace(0, 1, 3)
    labels = ["force (N)", "force (N)", "work (J)", "a long title of an axis (J per mm and hour)"]
    panels = [figure.Panel("", "x", label, [figure.Curve(x, x, "", "#000000")]) for label in labels]
    drawn = plotly.draw(figure.Figure("f", "t", "", panels, columns=4, row_height=200))
    assert drawn.count("force (N)") == drawn.count("work (J)") == 1
    assert re.search(r"a long title of an axis(<|\\u003c)br(>|\\u003e)\(J per", drawn)
    below = plotly.draw(figure.Figure("f", "t", "", panels[:2], columns=1, row_height=200))
    assert below.count("force (N)") == 2


def test_a_stuck_frequency_far_away_does_not_squeeze_the_peaks(tmp_path):
    def far(files):
        files["tune.json"]["stuck_hz"] = dict.fromkeys(files["tune.json"]["stuck_hz"], 7507.0)

    def stuck(trend):
        return [i.value for i in trend.panels[1].items if isinstance(i, figure.Line)]

    for name in ("near", "far"):
        (tmp_path / name).mkdir()
    near = next(response.trend(results_of(*artefacts(tmp_path / "near"))))
    assert stuck(near) == [2801.0] and "beyond the axis" not in near.caption
    away = next(response.trend(results_of(*artefacts(tmp_path / "far", damage=far))))
    assert stuck(away) == [] and "7507.0 Hz, far beyond the axis" in away.caption


def test_a_peak_that_stays_does_not_move():
    cases = [SimpleNamespace(facts=SimpleNamespace(peak_hz=hz)) for hz in (275.21, 275.22, 276.3)]
    assert response._moves(*cases[:2]) == "stays at 275.2 Hz and goes"
    assert response._moves(*cases[1:]) == "moves from 275.2 to 276.3 Hz and"
