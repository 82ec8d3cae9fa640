"""The stage `report`: summary.json, figures/*.png and one HTML page that holds all it needs."""

import html
import time
from pathlib import Path

import tipdamp
from tipdamp.report import (
    draw_matplotlib,
    draw_plotly,
    draw_scene,
    modes,
    response_figures,
    space_figures,
    static_figures,
    tables,
)
from tipdamp.report.figure import Figure
from tipdamp.report.results import Results, load_results
from tipdamp.report.scene import Scene
from tipdamp.report.summary import summarise
from tipdamp.report.text import hertz, listing, micro, number

# plots follow the width of a printed page, and go back
PRINT = """
const plots = () => document.querySelectorAll(".plotly-graph-div");
addEventListener("beforeprint", () => plots().forEach(plot => {
  plot.dataset.height = plot.layout.height;
  Plotly.relayout(plot, {width: 680, height: Math.round(0.8 * plot.layout.height)});
}));
addEventListener("afterprint", () => plots().forEach(plot =>
  Plotly.relayout(plot, {autosize: true, width: null, height: Number(plot.dataset.height)})));
"""


def write_report(study, store, tick) -> list[str]:
    """Write summary.json, figures/*.png and report.html into the results folder; the names of the figures.

    Without plotly or matplotlib summary.json is written all the same, then InputError says what to install.
    """
    began = time.perf_counter()
    results = load_results(study, store)
    summary = summarise(results)
    store.write_json("summary.json", summary)
    sections = sections_of(results)
    figures = [block for _, _, blocks in sections for block in blocks if isinstance(block, Figure)]
    for i, figure in enumerate(figures):
        tick(i / (len(figures) + 1), f"figures/{figure.name}.png")
        with store.writing(f"figures/{figure.name}.png") as path:
            draw_matplotlib.draw(figure, path)
    tick(len(figures) / (len(figures) + 1), "report.html")
    with store.writing("report.html") as path:
        path.write_text(page(results, sections, summary["warnings"]), encoding="utf-8")
    summary["seconds"]["report"] = round(time.perf_counter() - began, 3)
    store.write_json("summary.json", summary)
    return [f"figures/{figure.name}.png" for figure in figures]


def sections_of(results: Results) -> list[tuple]:
    """(id, title, blocks) of what there is to show; a block is a Figure, a Scene, ModeShapes or a Table."""
    found = [("figures", "Key figures", [tables.key_figures(results)])]
    if results["reduce"]["free_response"]:
        found.append(("linear", "Without damper", [static_figures.linear(results)]))
    if "preload" in results:
        found.append(("preload", "Preload", [static_figures.preload(results),
                                             space_figures.preload_on_damper(results), *_load_cases(results)]))
    if "tune" in results:
        tuning = [static_figures.tuning(results)] if results["tune"]["target_hz"] else []
        found.append(("tuning", "Kept stations", [*tuning, static_figures.kept(results)]))
    if shapes := space_figures.modes_of(results):
        found.append(("modes", "Mode shapes", [shapes]))
    if results.cases:
        r = response_figures
        trend = [r.trend(results)] if len({case.Fe for case in results.cases if case.has_peak}) > 1 else []
        found.append(("response", "Forced response",
                      [tables.peaks(results), *(r.family(results, H) for H in reversed(results.orders)),
                       r.levels(results), *trend, r.shares(results)]))
    if results.whole is not None:
        found.append(("pairs", "Contact pairs", [space_figures.pairs_of(results)]))
    found.append(("assumptions", "Assumptions", [tables.assumptions(results)]))
    if "tune" in results and results["tune"]["full_model_check"]:
        found.append(("reduction", "Reduced and full model", [tables.reduction(results)]))
    found.append(("made", "How it was made", [*([tables.bodies(results)] if "inspect" in results else []),
                                              tables.stages(results), tables.software()]))
    return found


def _load_cases(results):
    """Table and map of the further load cases."""
    if results.loads:
        yield tables.load_cases(results)
        for case in results.loads:
            yield static_figures.load_case(results, case)


def page(results: Results, sections, warnings) -> str:
    """The report."""
    lead = "".join(f'<p class="lead">{html.escape(text)}</p>' for text in introduction(results))
    return shell(results.study, lead + warnings_box(warnings), sections, """<footer>Beside this page: summary.json (all
figures in one file), figures/ (PNG), preload.csv and kept.csv (the contact pairs), responses/ (the curves); where there
are meshes also free_modes.vtu, stuck_modes.vtu and preload.vtu for ParaView.</footer>""")


def shell(study, above: str, sections, below: str = "") -> str:
    """A whole page around the sections, which are numbered through; every text from outside goes through html.escape.

    above, below - HTML before the list of sections and after them.
    """
    title = html.escape(study.title)
    body, counts = [], {"Figure": 0, "Table": 0}
    for name, heading, blocks in sections:
        body.append(f'<section id="{name}"><h2>{heading}</h2>')
        for block in blocks:
            kind = "Table" if isinstance(block, tables.Table) else "Figure"
            counts[kind] += 1
            body.append((_figure if kind == "Figure" else _table)(block, counts[kind]))
        body.append("</section>")
    links = "".join(f'<a href="#{name}">{heading}</a>' for name, heading, _ in sections)
    style = Path(__file__).with_name("style.css").read_text(encoding="utf-8")
    return f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title><style>
{style}</style>
<script>{draw_plotly.plotly_script()}</script><script>{modes.script()}</script></head>
<body><main>
<h1>{title}</h1>
<p class="sub">{html.escape(study.path.name)} · tipdamp {html.escape(tipdamp.__version__)}</p>
{above}
<nav>{links}</nav>
<noscript><p>The figures of this page need JavaScript; those of a report that are not in three dimensions are also in
the folder figures/.</p></noscript>
{"".join(body)}
{below}
</main><script>{PRINT}</script></body></html>
"""


def introduction(results: Results) -> list[str]:
    """What was computed, in a few sentences with the figures."""
    r, free = results["reduce"]["reduction"], results["reduce"]["free_hz"]
    first = (f"Two blades with a friction damper pressed between them: a model of {r['dofs']} dofs, reduced to "
             f"{r['masters']} contact and response dofs and {sum(r['modes'].values())} modes.")
    if free:
        first += (f" Without damper the blades vibrate out of phase at {hertz(free['out_of_phase'])} Hz and in phase "
                  f"at {hertz(free['in_phase'])} Hz.")
    if "preload" in results:
        forces = [f"{number(s['sum_N'])} N on side '{n}'" for n, s in results["preload"]["sides"].items()]
        what = f"The pull of {results.study.driver.pull:g} N"
        if results.study.preload.case:
            what = f"The load case '{results.study.preload.case}'"
        first += f" {what} presses the damper with {listing(forces)}."
    if "tune" in results:
        stuck, kept, target = (results["tune"][k] for k in ("stuck_hz", "tuned_pairs", "target_hz"))
        how = f"detaching stations from the middle (target {target:g} Hz) leaves" if target else "the study keeps"
        first += (f" With all pairs stuck the tracked mode lies at {hertz(stuck['full_area'])} Hz; {how} "
                  f"{kept['front']} + {kept['back']} stations, which bring it to {hertz(stuck['tuned'])} Hz.")
    return [first, *_response_sentence(results)]


def _response_sentence(results):
    cases = [c for c in results.cases if c.H == results.orders[-1] and c.has_peak]
    if not cases:
        return
    a, b = cases[0], cases[-1]
    text = (f"Under {a.Fe:g} N the peak of blade 1 is {micro(a.facts['peak_m'] / a.Fe)} µm/N at "
            f"{hertz(a.facts['peak_hz'])} Hz (H = {a.H})")
    if len(cases) > 1:
        n = len(b.facts["slipping_pairs"])
        text += (f", under {b.Fe:g} N {micro(b.facts['peak_m'] / b.Fe)} µm/N at {hertz(b.facts['peak_hz'])} Hz, where "
                 f"{n} of {b.curve.share_slip.shape[1]} pairs slip")
    yield text + "."


def warnings_box(sentences) -> str:
    if not sentences:
        return '<div class="fine">No warnings: every check of this run is met.</div>'
    items = "".join(f"<li>{html.escape(text)}</li>" for text in sentences)
    return f'<div class="warnings"><strong>Warnings</strong><ul>{items}</ul></div>'


def _figure(figure, count) -> str:
    drawn = _DRAW[type(figure)](figure)
    return (f'<figure><div class="plot">{drawn}</div><figcaption><b>Figure {count}. '
            f"{html.escape(figure.title)}.</b> {html.escape(figure.caption)}</figcaption></figure>")


def _table(table, count) -> str:
    def row(cells, tag):
        left = (' class="left"' if i in table.left else "" for i in range(len(cells)))
        return "<tr>" + "".join(f"<{tag}{c}>{html.escape(str(text))}</{tag}>" for text, c
                                in zip(cells, left, strict=True)) + "</tr>"

    head, body = row(table.columns, "th"), "".join(row(cells, "td") for cells in table.rows)
    wide = " wide" if len(table.columns) > 5 else ""
    return (f'<div class="scroll{wide}"><table><caption><b>Table {count}.</b> {html.escape(table.caption)}</caption>'
            f"<thead>{head}</thead><tbody>{body}</tbody></table></div>")


_DRAW = {Figure: draw_plotly.draw, Scene: draw_scene.draw, modes.ModeShapes: modes.draw}
