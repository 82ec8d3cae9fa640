"""The report from small made-up artefacts, no finite elements: what it says, and what it does with bad luck.

Two sides of five stations, two rows on the right; the curves are those of one damped mass (2800 Hz, zeta 0.022).
"""

import io
import json
import subprocess
import sys
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from hbm.contact import ContactTable
from hbm.errors import InputError
from hbm.response import ForcedResponse
from tipdamp.report import draw_matplotlib, figure, page, response_figures, static_figures, text
from tipdamp.report.results import load_results
from tipdamp.report.summary import summarise
from tipdamp.store import Store
from tipdamp.study import load_study

ROOT = Path(__file__).parents[2]
# at least these, and so deep                                               [what a run promises to leave]
PROMISED = {"free_hz": {"out_of_phase", "in_phase"}, "stuck_hz": {"full_area", "full_line", "tuned"},
            "tuned_pairs": {"front", "back"}, "reduction": {"dofs", "masters", "modes"}, "seconds": set(),
            "versions": {"tipdamp", "python", "numpy", "scipy", "numba"}, "warnings": set()}
SIDE_FIGURES = {"sum_N", "min_N", "max_N", "detached", "equilibrium_N", "balance_error"}
RESPONSE_FIGURES = {"Fe_N", "H", "peak_hz", "peak_m", "min_peak_m", "points", "failed_points", "slipping_pairs",
                    "seconds", "back"}
STUDY = """
title = {title}
[model]
matrices = "rig.npz"
pull = 100
[contact]
pairs = "pairs.csv"
[contact.left]
shape = "cylinder"
[contact.right]
shape = "flat"
width = 1.6e-3
rows = "edge"
{rest}
[reference]
out_of_phase_hz = 1590
tuned_hz = 2800
front = 2
back = 2
"""
FULL = """
[tune]
target_hz = 2800
[respond]
levels = [1, 20]
harmonics = [1, 3]
band = [2300, 3300]
damping_ratio = 0.022
"""
HOSTILE = "<script>alert('x')</script> & $a_$ %{y}"


def table(weight=None, preload=10.0):
    side = np.array(["left"] * 5 + ["right"] * 10)
    station, row = np.r_[np.arange(5), np.repeat(np.arange(5), 2)], np.r_[np.zeros(5), np.tile([0, 1], 5)]
    n = len(side)
    return ContactTable(
        side, station, row, ["blades"] * n, np.arange(n), ["damper"] * n, np.arange(n),
        np.column_stack([np.zeros(n), 0.01 * station, np.zeros(n)]), np.tile(np.eye(3), (n, 1, 1)), np.zeros(n),
        np.full(n, 1e6), np.full(n, 9e5), np.full(n, 0.6), np.full(n, preload),
        np.ones(n) if weight is None else weight)


def curve(Fe, H, failed=()):
    hz = np.linspace(2300, 3300, 41)
    x = 1e-6 * Fe * 0.044 / (1 - (hz / 2800)**2 + 0.044j * hz / 2800)
    harmonics = np.zeros((len(hz), 4, H + 1), dtype=complex)
    harmonics[:, :, 1] = x[:, None] * [1.0, 0.9, 0.5, 0.4]
    good = ~np.isin(np.arange(len(hz)), failed)
    harmonics[~good] = np.nan
    share = np.where(good, 0.2, np.nan)[:, None] * np.ones(6) * (Fe > 1)
    names = np.array(["patch_1:1", "patch_1:2", "patch_2:3", "patch_2:4"])
    return ForcedResponse(frequency=hz, output_names=names, harmonics=harmonics, parameter_name="frequency",
                          parameter=hz, share_stick=1 - share, share_slip=share, share_open=0 * share,
                          dissipated=share, converged=good, iterations=np.ones(len(hz), int),
                          ended="reached the end of the band", complete=bool(good.all()), H=H, origin="preloaded",
                          start="zero_slider", seconds=0.5, residual_calls=100)


def side_figures():
    return {s: {"sum_N": 70.0, "min_N": 1.0, "max_N": 9.0, "detached": 0, "equilibrium_N": 70.0, "balance_error": 1e-15}
            for s in ("left", "right")}


def artefacts(folder, title="A rig", sections=FULL, failed=(), damage=None):
    """(study, store) with the files that the stages leave; `damage` changes {file: content} before it is written."""
    study_file = folder / "rig.toml"
    study_file.write_text(STUDY.format(title=json.dumps(title), rest=sections), encoding="utf-8")
    study = load_study(study_file)
    store = Store(study.results)
    hz = np.linspace(1400, 1900, 50)
    kept = table(np.r_[1, 1, 0, 1, 1, [1, 0] * 2, 0, 0, [1, 0] * 2])
    files = {
        "inspect.json": {"bodies": {"blades": {"dofs": 90}, "damper": {"dofs": 30}}, "pairs": {"left": 5, "right": 10}},
        "reduce.json": {"reduction": {"dofs": 120, "masters": 60, "modes": {"blades": 4, "damper": 2}},
                        "rows": {"left": 1, "right": 2},
                        "free_hz": {"out_of_phase": 1591.0, "in_phase": 1664.0},
                        "free_response": {"hz": hz, "m_per_N": {"patch_1": 1e-6 + 0 * hz, "patch_2": 2e-6 + 0 * hz}}},
        "preload.json": {"kn_kt_N_per_m": {"left": [1e6, 9e5], "right": [1e6, 9e5]},
                         "sides": side_figures(), "residual": 1e-15},
        "tune.json": {"target_hz": 2800.0, "tuned_pairs": {"front": 2, "back": 2},
                      "history": [{"front": 3, "back": 2, "hz": 2900.0, "likeness": 0.8},
                                  {"front": 2, "back": 2, "hz": 2801.0, "likeness": 0.9}],
                      "stuck_hz": {"full_area": 3000.0, "full_line": 2900.0, "tuned": 2801.0},
                      "likeness": {"full_area": 0.7, "full_line": 0.8, "tuned": 0.9},
                      "full_model_check": {"tuned": {"reduced_hz": [2801.0], "full_hz": [2800.9],
                                                     "largest_error": 4e-5}},
                      "preload_kept": side_figures(), "carried": {"scale": {"left": 1.5, "right": 1.6}, "moment_Nm": 0},
                      "roll_stiffness_Nm_per_rad": 1.7},
        "kept": kept, "responses": []}
    for H in (1, 3):
        for Fe in (1.0, 20.0):
            one = curve(Fe, H, failed if Fe > 1 else ())
            name = f"responses/Fe_{Fe:g}N_H{H}.npz"
            with store.writing(name) as path:
                one.save(path)
            (hz_top, top), bottom = one.peak("patch_1:1"), one.peak("patch_1:2")[1]
            files["responses"].append({
                "file": name, "Fe_N": Fe, "H": H, "peak_hz": hz_top, "peak_m": top, "min_peak_m": bottom, "points": 41,
                "failed_points": len(failed) if Fe > 1 else 0, "complete": one.complete, "ended": one.ended,
                "slipping_pairs": ["left 0", "left 1", "right 4"] if Fe > 1 else [], "seconds": 0.5,
                "origin": "preloaded", "start": "zero_slider", "peak_inside_band": True,
                "back": {"peak_hz": hz_top, "peak_m": top, "complete": True, "ended": "", "failed_points": 0,
                         "seconds": 0.5}})
    if damage:
        damage(files)
    for name, pairs in (("preload.csv", table()), ("kept.csv", files["kept"])):
        with store.writing(name) as path:
            pairs.save(path)
    for name in ("inspect", "reduce", "preload", "tune"):
        store.write_json(f"{name}.json", files[f"{name}.json"])
        store.finish(name, "key", [f"{name}.json"], 1.25)
    store.write_json("respond.json", {"responses": files["responses"], "stuck_difference":
                                      {f["file"]: 1e-15 for f in files["responses"] if not f["slipping_pairs"]}})
    first = curve(1.0, 1)
    np.savez(store.path("stuck.npz"), frequency=first.frequency, response=first.harmonics[:, :, 1],
             output_names=first.output_names)
    return study, store


def written(folder, **options):
    study, store = artefacts(folder, **options)
    page.write_report(study, store, lambda *_: None)
    return store


@pytest.fixture(scope="module")
def plain_report(tmp_path_factory):
    return written(tmp_path_factory.mktemp("plain"))


@pytest.fixture(scope="module")
def hostile_report(tmp_path_factory):
    """Failed points and a title that means harm, together."""
    return written(tmp_path_factory.mktemp("hostile"), title=HOSTILE, failed=(19, 20))


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


# ---- summary.json ----------------------------------------------------------------------------------------------


def test_summary_holds_what_is_promised(plain_report):
    summary = json.loads(plain_report.path("summary.json").read_text())
    for key, inside in PROMISED.items():
        assert key in summary and inside <= set(summary[key])
    for key in ("preload", "preload_kept"):
        assert all(SIDE_FIGURES == set(side) for side in summary[key].values()) and len(summary[key]) == 2
    assert all(set(r) >= RESPONSE_FIGURES for r in summary["responses"]) and len(summary["responses"]) == 4
    last = summary["responses"][-1]
    assert (last["Fe_N"], last["H"], last["slipping_pairs"]) == (20.0, 3, 3)
    assert last["peak_m"] == pytest.approx(20e-6, rel=1e-3)      # 1e-6 m/N at resonance, by construction
    assert set(summary["seconds"]) == {"inspect", "reduce", "preload", "tune", "report"}
    assert summary["warnings"] == []


def damage(stage, *path, value):
    def change(files):
        target = files[stage] if stage == "responses" else files[f"{stage}.json"]
        for key in path[:-1]:
            target = target[key]
        target[path[-1]] = value
    return change


def open_pair(files):
    preload = files["kept"].preload.copy()
    preload[0] = -0.5
    files["kept"] = files["kept"].replace(preload=preload)


@pytest.mark.parametrize("change, words", [
    (damage("inspect", "bodies", "damper", "not_read", value=["tetra"]), "not read: tetra"),
    (damage("reduce", "free_hz", "out_of_phase", value=1640.0), "+3.1 % from the reference 1590 Hz"),
    (damage("preload", "residual", value=1e-3), "residual of 1.0e-03"),
    (damage("preload", "sides", "left", "sum_N", value=70.01), "side 'left' is 70.01 N, not the 70.00 N"),
    (damage("preload", "sides", "left", "balance_error", value=1e-4), "not in equilibrium: 1.0e-04"),
    (damage("tune", "full_model_check", "tuned", "largest_error", value=2e-3), "off by 0.2 %"),
    (damage("tune", "carried", "moment_Nm", value=-0.064), "moment of \N{MINUS SIGN}0.0640 N m"),
    (damage("tune", "carried", value={"held": {"roll about y": 0.05}}), "along 'roll about y'"),
    (damage("tune", "tuned_pairs", "front", value=3), "keeps 3 + 2 stations, the reference is 2 + 2"),
    (damage("tune", "history", 0, "hz", value=2700.0), "not monotone: with 3 + 2"),
    (damage("tune", "likeness", "full_area", value=0.3), "by 0.30 only"),
    (damage("tune", "target_hz", value=2700.0), "misses the target of 2700 Hz by +3.7 %"),
    (open_pair, "1 of 8 kept pairs are open at rest: left 0"),
    (damage("responses", 1, "complete", value=False), "Fe = 20 N, H = 1 is incomplete, 0 failed points: reached"),
    (damage("responses", 1, "back", "failed_points", value=2), "from the other end is incomplete, 2 failed"),
    (damage("responses", 1, "peak_inside_band", value=False), "at the edge of the band"),
    (damage("responses", 3, "back", "peak_m", value=1.9e-5), "two ways through the band disagree"),
    (damage("responses", 0, "peak_hz", value=2760.0), "from the stuck frequency: another mode is near"),
    (lambda files: [files["responses"][k].update(slipping_pairs=["left 0"]) for k in (0, 2)], "lowest level, 1 N"),
])
def test_warnings_appear_when_they_should(tmp_path, change, words):
    study, store = artefacts(tmp_path, damage=change)
    found = summarise(load_results(study, store))["warnings"]
    assert any(words in sentence for sentence in found), found


def keep_all(files):
    files["kept"] = files["kept"].replace(weight=np.ones(len(files["kept"])))


def test_figures_draw_what_their_legend_names(tmp_path, recwarn):
    """All stations kept, in a band without resonance: no name without a mark inside the panel, and matplotlib finds
    room for the axes."""
    def change(files):
        keep_all(files)
        files["reduce.json"]["free_hz"] = {"out_of_phase": 3901.0, "in_phase": 3996.0}

    study, store = artefacts(tmp_path, damage=change)
    results = load_results(study, store)
    linear, kept = static_figures.linear(results), static_figures.kept(results)
    for panel in kept.panels:
        for item in panel.items:
            if getattr(item, "name", ""):
                low, high = panel.y_range
                assert len(item.x) and ((np.asarray(item.y) >= low) & (np.asarray(item.y) <= high)).all(), item.name
    draw_matplotlib.draw(linear, tmp_path / "linear.png")
    assert not [w for w in recwarn if "constrained_layout" in str(w.message)]


def test_curve_without_slip_must_be_the_linear_one(tmp_path):
    study, store = artefacts(tmp_path)
    content = store.read_json("respond.json")
    content["stuck_difference"] = {"responses/Fe_1N_H1.npz": 3e-5}
    store.write_json("respond.json", content)
    assert [w for w in summarise(load_results(study, store))["warnings"] if "differs from the linear" in w]


# ---- the page --------------------------------------------------------------------------------------------------


def test_page_loads_nothing_from_elsewhere(plain_report):
    content = plain_report.path("report.html").read_text(encoding="utf-8")
    read = html_of(plain_report)
    assert read.open == []
    for tag, attributes in read.tags:
        assert tag not in ("link", "iframe", "object", "embed", "base") and "src" not in attributes, (tag, attributes)
        assert attributes.get("href", "#").startswith("#")
    assert "@import" not in content.split("</style>")[0] and "url(" not in content.split("</style>")[0]
    library, *ours = sorted(read.scripts, key=len, reverse=True)
    assert len(library) > 1e6 and sum("Plotly.newPlot" in s for s in ours) == read.text.count("Figure ")
    assert not any("http" in script for script in ours)
    assert len(content) < 6e6


def test_every_section_and_picture_is_there(plain_report):
    read = html_of(plain_report)
    ids = {a["id"] for tag, a in read.tags if tag == "section"}
    assert ids == {"figures", "linear", "preload", "tuning", "response", "pairs", "assumptions", "reduction", "made"}
    assert "left 0\N{EN DASH}1; right 4" in read.text          # the slipping pairs by name
    assert "+0.06 %" in read.text                               # 1591 of 1590 Hz
    names = {p.stem for p in plain_report.path("figures").glob("*.png")}
    assert names == {"linear_without_damper", "preload", "preload_kept", "tuning", "family_H1", "family_H3", "levels",
                     "peaks", "contact_states"}


def test_pictures_are_not_empty(plain_report):
    from matplotlib.image import imread

    for path in plain_report.path("figures").glob("*.png"):
        image = imread(path)[..., :3]
        inked = (image < 0.95).any(axis=2).mean()
        assert min(image.shape[:2]) > 300 and 0.01 < inked < 0.9, path.name


def test_hostile_title_is_text(hostile_report):
    read = html_of(hostile_report)
    assert "<script>alert" not in hostile_report.path("report.html").read_text(encoding="utf-8")
    assert not any(script.startswith("alert") for script in read.scripts)
    assert HOSTILE in read.text


def test_backends_escape_names():
    from tipdamp.report import draw_matplotlib, draw_plotly

    one = figure.Curve(np.arange(3), np.arange(3), HOSTILE)
    drawn = figure.Figure("x", HOSTILE, "", (figure.Panel(HOSTILE, HOSTILE, HOSTILE, (
        one, figure.Line("y", 1.0, HOSTILE), figure.Marks(np.ones(1), np.ones(1), labels=(HOSTILE,)))),))
    content = draw_plotly.draw(drawn)
    assert "<script>alert" not in content and "%{y}" not in content
    assert content.replace("\\u0026", "&").count("&lt;script&gt;alert") == 8    # every text, as plotly must read it
    picture = io.BytesIO()
    draw_matplotlib.draw(drawn, picture)       # "$a_$" alone would stop its reader of formulas
    assert picture.getvalue().startswith(b"\x89PNG")


def test_failed_points_are_gaps_with_a_mark(hostile_report, tmp_path):
    study, store = artefacts(tmp_path, failed=(19, 20))
    items = response_figures.levels(load_results(study, store)).panels[0].items
    band = next(i for i in items if isinstance(i, figure.Band))
    assert [len(x) // 2 for x, _ in figure.outlines(band)] == [19, 20]     # 41 points without two
    assert np.nanmin(band.low / band.high) == pytest.approx(0.9)           # the nodes of blade 1 alone
    line = next(i for i in items if isinstance(i, figure.Curve))
    assert np.flatnonzero(np.isnan(line.y)).tolist() == [19, 20]
    marks = next(i for i in items if isinstance(i, figure.Marks))
    assert marks.name == "failed point" and np.allclose(marks.x, line.x[19:21]) and np.isfinite(marks.y).all()
    early = marks_of_early_stop(tmp_path / "early")
    assert early.name == "curve stops" and early.x.tolist() == [3300.0]
    read = html_of(hostile_report)
    assert "2, incomplete" in read.text and "incomplete, 2 failed points" in read.text
    assert any("failed point" in script for script in read.scripts[1:])


def marks_of_early_stop(folder):
    """The curve of 20 N at H = 3 says that it is incomplete, and no point failed."""
    folder.mkdir()
    study, store = artefacts(folder, damage=damage("responses", 3, "complete", value=False))
    items = response_figures.levels(load_results(study, store)).panels[0].items
    return next(i for i in items if isinstance(i, figure.Marks))


@pytest.mark.parametrize("sections, gone", [("", {"tuning", "response", "reduction"}),
                                            # without [respond] there is no shape to tune by
                                            ("[tune]\ntarget_hz = 2800\n", {"tuning", "response", "reduction"})])
def test_sections_without_data_are_left_out(tmp_path, sections, gone):
    study, store = artefacts(tmp_path, sections=sections)
    results = load_results(study, store)
    shown = page.sections_of(results)
    assert not gone & {name for name, _, _ in shown} and len(shown) == 9 - len(gone)
    assert all(not name.startswith("respon") for name in summarise(results))


def test_further_load_cases_have_a_table_and_a_map_each(tmp_path):
    light = table(preload=2.0)
    light = light.replace(preload=np.where(light.station == 2, -0.5, light.preload))
    case = {"file": "loads/light.csv", "residual": 0.0, "balance_error": 0.0,
            "sides": {"left": {"sum_N": 8.0, "max_N": 2.0, "detached": 1},
                      "right": {"sum_N": 16.0, "max_N": 2.0, "detached": 2}}}
    study, store = artefacts(tmp_path, sections=FULL + "[loads.light]\npull = 20\n",
                             damage=lambda files: files["preload.json"].update(cases={"light": case}))
    store.path("loads").mkdir()
    light.save(store.path("loads/light.csv"))
    blocks = dict((name, shown) for name, _, shown in page.sections_of(load_results(study, store)))["preload"]
    rows = next(b for b in blocks if hasattr(b, "rows") and hasattr(b, "columns") and not hasattr(b, "panels")).rows
    assert rows == (("the pull", "100", "70.00", "9.000", "0", "70.00", "9.000", "0"),
                    ("light: another pull", "20", "8.000", "2.000", "1", "16.00", "2.000", "2"))
    map_of_case = next(b for b in blocks if getattr(b, "name", "") == "preload_light")
    marks = [i for panel in map_of_case.panels for i in panel.items if isinstance(i, figure.Marks)]
    assert sum(len(m.x) for m in marks) == len(light) and {float(y) for m in marks for y in m.y} == {2.0, -0.5}
    assert all(m.filled == (m.y > 0).all() for m in marks)
    scene = next(b for b in blocks if getattr(b, "name", "") == "preload_on_damper")
    assert scene.cases == ["the pull", "light"]
    page.write_report(study, store, lambda *_: None)
    assert store.path("figures/preload_light.png").is_file()


def test_a_curve_that_never_began(tmp_path):
    """The first point fails: one point, no peak."""
    def change(files):
        files["responses"][1].update(peak_hz=None, peak_m=None, min_peak_m=None, complete=False, peak_inside_band=False)

    study, store = artefacts(tmp_path, damage=change)
    one = curve(20.0, 1)
    dead = {name: getattr(one, name)[:1] * np.nan for name in ("harmonics", "share_stick", "share_slip", "share_open")}
    replace(one, frequency=one.frequency[:1], converged=np.array([False]), iterations=one.iterations[:1],
            dissipated=one.dissipated[:1], complete=False, **dead).save(store.path("responses/Fe_20N_H1.npz"))
    page.write_report(study, store, lambda *_: None)
    found = store.read_json("summary.json")
    assert len(found["warnings"]) == 1 and found["responses"][1]["peak_m"] is None


@pytest.mark.parametrize("missing", ["plotly", "matplotlib"])
def test_missing_library_is_named(tmp_path, monkeypatch, missing):
    study, store = artefacts(tmp_path)
    monkeypatch.setattr(page.draw_matplotlib, "draw", page.draw_matplotlib.draw if missing == "matplotlib" else
                        lambda _, path: path.write_bytes(b""))
    for name in [n for n in sys.modules if n.split(".")[0] == missing]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, missing, None)
    with pytest.raises(InputError, match=rf"{missing}.*extra 'report'"):
        page.write_report(study, store, lambda *_: None)
    assert store.path("summary.json").is_file() and not store.path("report.html").exists()


def test_drawing_libraries_wait_until_they_are_needed():
    code = ("import sys, tipdamp.report.page\n"
            "print([m for m in ('plotly', 'matplotlib', 'dolfinx', 'gmsh') if m in sys.modules])")
    child = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert child.stdout.strip() == "[]", child.stdout + child.stderr


# ---- numbers and names -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("value, written", [(0.75226, "0.7523"), (79.903, "79.90"), (43896, "43896"), (0, "0"),
                                            (-0.0639, "\N{MINUS SIGN}0.06390"), (None, "\N{EN DASH}"),
                                            (2.5e-12, "2.500\N{MULTIPLICATION SIGN}10⁻¹²")])
def test_numbers(value, written):
    assert text.number(value) == written


def test_percent_of_nearly_nothing():
    assert text.percent(-1e-6) == "0.00 %" and text.percent(-0.0123) == "\N{MINUS SIGN}1.23 %"


def test_names_of_pairs():
    names = ["the left 3", "the left 1", "the left 2", "right 0", "the left 9", "right 0"]
    assert text.names_of_pairs(names) == "the left 1\N{EN DASH}3, 9; right 0"


def test_colors_of_levels_go_from_dark_to_light():
    grey = [sum(w * int(c[k:k + 2], 16) for w, k in ((0.299, 1), (0.587, 3), (0.114, 5)))
            for c in figure.level_colors(5)]
    assert grey == sorted(grey) and min(np.diff(grey)) > 20      # of 255: apart in grey print
