"""`tipdamp compare` of studies from matrices: one page, the scaling of friction, errors at the
door."""

import csv
import shutil
from pathlib import Path

import numpy as np
import pytest

from tests.tipdamp.rig_study import CHAIN, without_report, write_chain
from tipdamp.cli import main
from tipdamp.comparison.read import read, source
from tipdamp.hbm.contact import ContactTable
from tipdamp.report.subjects.axial import of_side
from tipdamp.report.subjects.wear import wear_index
from tipdamp.stages.run import results_folder
from tipdamp.study.study import load_study

pytestmark = pytest.mark.slow
LEVELS = (5.0, 20.0, 40.0)


def study(folder, name, **changes):
    """A study of its own in the folder of the chain."""
    text = CHAIN.replace("levels = [5]", f"levels = {list(LEVELS)}")
    for old, new in changes.items():
        assert f"\n{old} = " in text
        lines = (f"{old} = {new}" if s.startswith(f"{old} = ") else s for s in text.splitlines())
        text = "\n".join(lines)
    (folder / f"{name}.toml").write_text(text)
    return str(folder / f"{name}.toml")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Folder with two studies that were run: the second with twice the pull and twice the force."""
    folder = tmp_path_factory.mktemp("compared")
    write_chain(folder)
    for path in (
        study(folder, "light"),
        study(folder, "heavy", pull=120, levels=[2 * Fe for Fe in LEVELS]),
    ):
        assert set(without_report(path)) <= {0, 3}
    return folder


SWEEP = """
[sweep]
cases = "scatter.csv"
[sweep.over]
model.pull = [60, 120]
"""


def rows(folder):
    with (folder / "comparison.csv").open() as file:
        return list(csv.DictReader(file))


def test_response_follows_fc_over_fe_alone(run, tmp_path, capsys):
    """Coulomb friction, no gaps: pull and force in one ratio give the same motion per newton. What
    figure 3 of the paper is drawn over."""
    paths = [str(run / f"{name}.toml") for name in ("light", "heavy")]
    assert main(["compare", *paths, "--out", str(tmp_path)]) == 0
    assert "comparison.html" in capsys.readouterr().out
    found = rows(tmp_path)
    light, heavy = ([r for r in found if r["study"] == s] for s in ("light", "heavy"))
    assert len(light) == len(heavy) >= 2 * len(LEVELS)  # blades
    slips = 0
    for a, b in zip(light, heavy, strict=True):
        assert (a["phase"], a["blade"]) == (b["phase"], b["blade"])
        assert float(a["ratio"]) == float(b["ratio"])
        assert float(a["m_per_N"]) == pytest.approx(float(b["m_per_N"]), rel=1e-6)
        assert float(a["hz"]) == pytest.approx(float(b["hz"]), rel=1e-6)
        slips += float(a["slipping"]) > 0
    assert slips


def test_page_shows_every_study_and_is_whole(run, tmp_path):
    paths = [str(run / f"{name}.toml") for name in ("light", "heavy")]
    assert main(["compare", *paths, "--out", str(tmp_path)]) == 0
    page = (tmp_path / "comparison.html").read_text(encoding="utf-8")
    for section in ("Optimisation curves", "The studies", "Preload", "Every case"):
        assert section in page
    assert "light.toml, heavy.toml" in page
    assert 'content="default-src ' in page  # nothing is fetched
    names = {path.stem for path in (tmp_path / "figures").glob("*.png")}
    assert names == {
        "optimisation",
        "frequencies",
        "preloads",
        "wear",
        "responses_light",
        "responses_heavy",
    }


def test_what_is_drawn_is_not_drawn_again(run, tmp_path, capsys, monkeypatch):
    """Until a result, the studies or a file of the page change; that another page stood there is
    said, and its figures do not stay."""
    both = [str(run / f"{name}.toml") for name in ("light", "heavy")]
    place = ["--out", str(tmp_path / "page")]
    page, figures = tmp_path / "page" / "comparison.html", tmp_path / "page" / "figures"
    assert main(["compare", *both, *place]) == 0
    assert capsys.readouterr().out == f"compare: {page}\n"
    with monkeypatch.context() as patch:
        patch.setattr("tipdamp.comparison.read.load_results", None)  # nothing is read
        assert main(["compare", *both, *place]) == 0
    assert capsys.readouterr().out == f"compare: {page} is up to date\n"
    (figures / "mine.png").write_text("of somebody else")
    assert main(["compare", both[0], *place]) == 0
    assert "comparison.html of before is replaced\n" in capsys.readouterr().out
    assert not (figures / "responses_heavy.png").exists() and (figures / "mine.png").exists()
    (figures / "wear.png").unlink()
    assert main(["compare", both[0], *place]) == 0
    assert (figures / "wear.png").exists()


def test_one_study_alone_has_a_folder_of_its_name(run, tmp_path):
    shutil.copytree(run, tmp_path / "copy")
    light, heavy = (str(tmp_path / "copy" / f"{name}.toml") for name in ("light", "heavy"))
    assert main(["compare", light, heavy]) == main(["compare", light]) == 0
    there = {"comparison": {"light", "heavy"}, "comparison_light": {"light"}}
    for name, studies in there.items():
        assert {r["study"] for r in rows(tmp_path / "copy" / "results" / name)} == studies


def test_a_section_names_the_others(run, tmp_path, capsys):
    """The page is that of both studies, in the folder that is stated; each is taken once."""
    shutil.copytree(run, tmp_path / "copy")
    heavy, light = (tmp_path / "copy" / f"{name}.toml" for name in ("heavy", "light"))
    text = light.read_text()
    light.write_text(text + "\n[compare]\nstudies = ['heavy.toml']\nout = 'page'\n")
    assert main(["compare", str(light)]) == 0
    assert main(["compare", str(light), str(heavy)]) == 0
    assert {r["study"] for r in rows(tmp_path / "copy" / "page")} == {"light", "heavy"}
    light.write_text(text + "\n[compare]\nstudies = ['none.toml']\n")
    capsys.readouterr()
    assert "none.toml" in refused(capsys, str(light))


def test_studies_that_were_not_run_are_run_first(tmp_path, capsys):
    """With progress, as a user calls it: each stage in its line, below the name of the study."""
    write_chain(tmp_path)
    paths = [study(tmp_path, "light", levels=[5]), study(tmp_path, "heavy", pull=120, levels=[10])]
    page = tmp_path / "page"
    assert main(["compare", *paths, "--run", "--jobs", "1", "--out", str(page)]) == 0
    said = capsys.readouterr().out
    assert said.index("light.toml") < said.index("respond") < said.index("heavy.toml")
    assert {r["study"] for r in rows(page)} == {"light", "heavy"}


def test_sweep_of_a_study_gives_its_pulls_and_its_scatter(tmp_path, capsys):
    """Two pulls, which draw one curve over Fc/Fe, and zeta about that of the study: a linear peak
    is as 1/zeta; `--run` makes what is missing."""
    write_chain(tmp_path)
    path = Path(study(tmp_path, "swept", levels=[1.0, 2.0]))
    path.write_text(path.read_text() + SWEEP)
    (tmp_path / "scatter.csv").write_text("respond.damping_ratio\n0.01\n0.009\n0.0125\n")
    assert "no sweep has run here yet" in refused(capsys, str(path))
    assert main(["compare", str(path), "--run", "--quiet", "--out", str(tmp_path / "page")]) == 0
    assert main(["compare", str(path), "--out", str(tmp_path / "page")]) == 0  # nothing is missing
    found = rows(tmp_path / "page")
    assert {r["study"] for r in found} == {"swept"}
    assert {r["pull"] for r in found} == {"60.0", "120.0"}
    at_60 = {"ratio": "60.0", "scatter": "", "blade": "1"}
    same = [r for r in found if at_60.items() <= r.items()]
    assert [r["Fe"] for r in same] == ["1.0", "2.0"]
    assert float(same[0]["m_per_N"]) == pytest.approx(float(same[1]["m_per_N"]), rel=1e-6)
    assert {r["scatter"] for r in found} == {
        "",
        "respond.damping_ratio = 0.009",
        "respond.damping_ratio = 0.0125",
    }
    stuck = [r for r in found if (r["pull"], r["Fe"], r["blade"]) == ("60.0", "1.0", "1")]
    height = {r["scatter"][-5:]: float(r["m_per_N"]) for r in stuck}
    assert height["0.009"] == pytest.approx(height[""] * 0.01 / 0.009, rel=0.02)
    assert height[".0125"] == pytest.approx(height[""] * 0.01 / 0.0125, rel=0.02)
    page = (tmp_path / "page" / "comparison.html").read_text(encoding="utf-8")
    assert "scatter" in page and "Compared: swept" in page and "swept, Fc = 120 N" in page
    assert "µm/N, where friction takes nothing." in page  # nothing slips


def test_a_sweep_without_the_study_itself_is_refused_before_it_runs(tmp_path, capsys):
    """With the values that a case lacks; those of the pairs and defaults are the study's own."""
    write_chain(tmp_path)
    path = Path(study(tmp_path, "swept", levels=[1.0]))
    path.write_text(path.read_text() + "\n[sweep]\ncases = 'scatter.csv'\n")

    def told(text):
        (tmp_path / "scatter.csv").write_text(text)
        return refused(capsys, str(path), "--run")

    assert "own values, about which the others scatter; add one with respond.damping_ratio = " in (
        said := told("respond.damping_ratio,model.pull\n0.009,60\n")
    )
    assert "model.pull" not in said
    assert not (tmp_path / "results").exists()
    mu = float(np.unique(ContactTable.load(tmp_path / "pairs.csv").mu).item())
    assert f"add one with contact.mu = {mu}\n" in told(f"contact.mu\n{mu + 0.1}\n")
    zeta = 0.01
    assert f"contact.mu = {mu} and respond.damping_ratio = {zeta}" in told(
        f"contact.mu,respond.damping_ratio\n{mu},0.02\n{mu + 0.1},{zeta}\n"
    )
    assert "contact.mu" not in told(f"contact.mu,respond.damping_ratio\n{mu},0.02\n")
    (tmp_path / "scatter.csv").write_text(f"contact.mu\n{mu}\n")
    assert "no sweep has run here yet" in refused(capsys, str(path))


def test_wear_index_is_the_friction_of_the_period(run):
    """Over the hour and the length of the damper, it is the work of friction that the stage
    `cycles` integrates over the period at the same peak."""
    loaded = load_study(run / "light.toml")
    comparison = read([source(loaded, results_folder(loaded, None))])
    one = comparison.studies["light"]
    along = np.unique(one.along(of_side(one.whole, "left")))
    length = np.gradient(along)  # mm from station to station, of those at the ends half
    length[[0, -1]] /= 2
    for period in one.cycles.curves[-2:]:
        (peak,) = [p for p in comparison.peaks if (p.Fe, p.blade) == (period.Fe_N, 1)]
        assert peak.hz == pytest.approx(period.hz, rel=1e-9)
        index = [wear_index(one, peak.friction_W, side) for side in ("left", "right")]
        hour = sum(work @ np.interp(x, along, length) for x, work in index)
        assert hour == pytest.approx(3600 * period.hz * sum(period.friction_J.values()), rel=1e-6)
        assert hour > 0


def refused(capsys, *arguments):
    assert main(["compare", *arguments]) == 2
    out = capsys.readouterr()
    assert out.out == "" and out.err.count("\n") == 1
    return out.err


def test_doors(run, tmp_path, capsys):
    shutil.copytree(run, tmp_path / "copy")
    folder, light = tmp_path / "copy", str(tmp_path / "copy" / "light.toml")
    new = study(folder, "new")
    assert f"its forced response is not there yet; run: tipdamp run {new}" in refused(
        capsys, light, new
    )
    assert "both are named light" in refused(capsys, light, light)
    along = study(folder, "along", direction="[0, 0, 1]")
    assert "[respond] direction = (0.0, 0.0, 1.0)" in refused(capsys, light, along)
    static = Path(study(folder, "static"))
    static.write_text(static.read_text().split("[respond]")[0])
    assert "section [respond] is missing" in refused(capsys, light, str(static))
    assert "none.toml" in refused(capsys, light, str(folder / "none.toml"))
    study(folder, "light", damping_ratio=0.02)
    assert "out of date" in (said := refused(capsys, light)) and f"tipdamp run {light}" in said
