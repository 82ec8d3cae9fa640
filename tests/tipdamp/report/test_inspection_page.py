"""inspect.html: what a user needs to see wrong normals or a wrong pairing before anything is
computed."""

import json
import re

import numpy as np
import pytest

from tests.tipdamp import corner_study
from tests.tipdamp.curved_pairs import curved_pairs
from tests.tipdamp.report.files import HOSTILE, HOSTILE_NAMES, artefacts
from tipdamp.bodies.pair import matched
from tipdamp.bodies.read import read_meshes
from tipdamp.bodies.table_checks import surface_angles
from tipdamp.checks import pairs as pair_checks
from tipdamp.cli import main
from tipdamp.hbm.contact import ContactTable
from tipdamp.report.drawing.scene import Points
from tipdamp.report.inspection_page import Inspected, inspection_page
from tipdamp.report.subjects.bodies import without_partner
from tipdamp.results.static_results import InspectResult
from tipdamp.study.study import load_study

HALF = 1 / np.sqrt(2)  # the pull along x + z on faces x and z


def inspected(path, capsys, code=0):
    assert main(["inspect", str(path), "--quiet"]) == code
    out, error = capsys.readouterr()
    page = path.parent / "results" / "corner" / "inspect.html"
    return page.read_text(encoding="utf-8"), out + error, page


def content(path):
    return json.loads((path.parent / "results" / "corner" / "inspect.json").read_text())


def test_page_of_a_sound_study(tmp_path, capsys):
    path = corner_study.write(tmp_path)
    page, out, file = inspected(path, capsys)
    assert f"to look at: {file}" in out and len(page) < 6e6
    found = content(path)["pair_checks"]
    assert found["one"]["mean_normal"] == pytest.approx([1, 0, 0]) and found["two"][
        "mean_normal"
    ] == pytest.approx([0, 0, 1])
    for side in found.values():
        assert (side["pairs"], side["stations"], side["rows"]) == (9, 3, 3)
        assert side["force_per_pull"] == pytest.approx(HALF) and side["trouble"] is None
        assert (
            side["off_surface_deg"] < 1e-5 and abs(np.array(side["apart_along_n_m"])).max() < 1e-12
        )
    text = page.split("<main>")[1]
    assert "(+1.000, +0.000, +0.000)" in text and "0.7071" in text
    # the user's own numbers: the blade's 3 x 3 nodes at x = A
    for node in corner_study.on(corner_study.damper(), 0, corner_study.A):
        assert f"damper node {node}" in text


def test_nodes_without_a_partner_are_shown(tmp_path, capsys):
    """The damper 2 um too low: the pairing stops, and the page shows every node with its
    distance."""
    path = corner_study.write(tmp_path, damper_mesh=corner_study.damper(at=(0, 0, -2e-6)))
    page, error, file = inspected(path, capsys, code=2)
    assert (
        f"(look at {file})" in error
        and "Stopped" in page
        and "without a partner within 1e-06 m" in page
    )
    study = load_study(path)
    lonely = list(without_partner(study, read_meshes(study)))
    assert len(lonely) == 4 and all(isinstance(p, Points) and len(p.position) == 9 for p in lonely)
    x = 1e3 * corner_study.A  # mm, as all that is drawn
    assert all(p.position[:, 0] == pytest.approx(x) for p in lonely if "side 'one'" in p.name)
    text = [t for p in lonely if "side 'one': damper" in p.name for t in p.hover]
    nodes = {int(re.search(r"damper node (\d+)", t)[1]) for t in text}
    assert nodes == set(corner_study.on(corner_study.damper(), 0, corner_study.A).tolist())
    assert all(re.search(r"nearest blade node \d+, 2\.00 µm away", t) for t in text)
    assert r"2.00 \u00b5m away" in page


@pytest.fixture
def own_table(tmp_path, capsys):
    """A study with a table of pairs of its own; returns (study path, table)."""
    path = corner_study.write(tmp_path)
    for verb in ("reduce", "preload"):
        assert main([verb, str(path), "--quiet"]) == 0
    capsys.readouterr()
    table = ContactTable.load(tmp_path / "results" / "corner" / "preload.csv")
    text = path.read_text()
    for line in (
        "mu = 0.3\n",
        "kn = 1e6\n",
        "kt = 1e6\n",
        'blade = "touch_one"\n',
        'damper = "face_x"\n',
        'blade = "touch_two"\n',
        'damper = "face_z"\n',
    ):
        text = text.replace(line, "")
    path.write_text(text.replace("[contact]\n", '[contact]\npairs = "own.csv"\n'))
    return path, table


def test_a_flipped_normal_is_named(own_table, capsys):
    path, table = own_table
    frame = table.frame.copy()
    worst = np.flatnonzero(table.side == "one")[4]
    frame[worst] *= [[1], [-1], [-1]]  # t2 and n turned over: still right-handed
    table.replace(frame=frame).save(path.parent / "own.csv")
    page, error, file = inspected(path, capsys, code=2)
    assert "points against that of its neighbour" in error and f"(look at {file})" in error
    # the pairs, to look at
    assert "Stopped" in page and "180.0° off" in page.replace("\\u00b0", "°")


def test_hostile_names_are_text(tmp_path):
    study, _ = artefacts(tmp_path, title=HOSTILE, names=HOSTILE_NAMES)
    pairs = curved_pairs()
    pairs = pairs.replace(side=np.where(pairs.side == "arc", HOSTILE, "line"))
    places = {"blades": pairs.position, "damper": pairs.position}
    checks = pair_checks.side_checks(pairs, places, np.array([0.5, 0, 1.0]))
    found = InspectResult(bodies={}, warnings=[HOSTILE], pair_checks=checks)
    page = inspection_page(study, found, Inspected(pairs=pairs, places=places, trouble=HOSTILE))
    assert "<script>alert" not in page and "&lt;script&gt;alert" in page.split("<main>")[1]


@pytest.mark.parametrize("mu", [2.0, 3.0])
def test_friction_above_any_dry_metals(tmp_path, capsys, mu):
    """Taken, with a warning on the page and in the result file."""
    path = corner_study.write(tmp_path, change=[("mu = 0.3", f"mu = {mu}")])
    page, *_ = inspected(path, capsys)
    said = [w for w in content(path)["warnings"] if "[contact] mu = 3 is above 2" in w]
    assert len(said) == (mu > 2) and ("mu = 3 is above 2" in page) == (mu > 2)


def test_a_side_that_the_pull_opens_is_named(own_table, capsys):
    """All normals of both sides the wrong way round: the pull would lift the damper off."""
    path, table = own_table
    table.replace(frame=table.frame * np.array([1, -1, -1])[None, :, None]).save(
        path.parent / "own.csv"
    )
    page, error, _ = inspected(path, capsys, code=2)
    assert "n must point out of the damper into the blade" in error
    assert "would have to pull the damper" in page


def test_angles_count_both_surfaces(tmp_path):
    study = load_study(corner_study.write(tmp_path))
    meshes = read_meshes(study)
    pairs = matched(study, meshes).pairs
    turn = np.radians(25)
    lean = np.array([[np.cos(turn), 0, -np.sin(turn)], [0, 1, 0], [np.sin(turn), 0, np.cos(turn)]])
    leaning = pairs.replace(frame=pairs.frame @ lean.T)
    angles = surface_angles(leaning, meshes)
    inner = (pairs.side == "one") & (pairs.row == 1) & (pairs.station == 1)  # one face normal there
    assert angles[inner] == pytest.approx(25, abs=1e-6)
    assert "25 degrees off" in pair_checks.warnings(leaning, angles)[0]


def test_page_of_a_study_of_matrices(tmp_path, capsys):
    path = corner_study.write(tmp_path)
    for verb in ("reduce", "preload"):
        assert main([verb, str(path), "--quiet"]) == 0
    folder = tmp_path / "results" / "corner"
    own = tmp_path / "m"
    own.mkdir()
    (own / "model.npz").write_bytes((folder / "model.npz").read_bytes())
    (own / "pairs.csv").write_bytes((folder / "preload.csv").read_bytes())
    (own / "corner.toml").write_text(
        '[model]\nmatrices = "model.npz"\npull = 10\npull_direction = [1, 0, 1]\n'
        '[contact]\npairs = "pairs.csv"\n'
    )
    page, *_ = inspected(own / "corner.toml", capsys)
    assert "The study starts from matrices: there is no mesh" in page and 'id="meshes"' not in page
    assert 'id="figure-contact_pairs"' in page
    assert main(["run", str(own / "corner.toml"), "--quiet"]) == 0
    report = (own / "results" / "corner" / "report.html").read_text()
    assert "there is no mesh" in report and 'id="modes"' not in report
    for name in ("preload_on_damper", "contact_pairs"):
        assert f'id="figure-{name}"' in report
    assert not (own / "results" / "corner" / "surface.npz").exists()


def test_without_plotly_inspect_still_answers(tmp_path, capsys, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "plotly", None)
    path = corner_study.write(tmp_path)
    assert main(["inspect", str(path), "--quiet"]) == 0
    assert "inspect.html is left out: plotly is not installed" in content(path)["warnings"]
    assert not (tmp_path / "results" / "corner" / "inspect.html").exists()
