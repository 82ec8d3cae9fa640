"""The fenced code of the documents: Python runs, and study files and their parts are valid."""

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from tipdamp import ReducedModel
from tipdamp.hbm.example import two_blades
from tipdamp.hbm.matrices_out import write_model
from tipdamp.study.documentation import json_schema
from tipdamp.study.study import load_study

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.m*d*"))]
RUN_BY = {  # the test that runs the Python of each page
    "README.md": "test_fences.py",
    "docs/coming_from.md": "hbm/io/test_nlvib.py",
    "docs/first_hour.md": "test_fences.py",
    "docs/gallery/six_examples.md": "hbm/test_gallery.py",
    "docs/own_model.md": "test_fences.py",
    "docs/python.md": "hbm/test_theory.py",
    "docs/site/package.markdown": "test_fences.py",
    "docs/sweeps.md": "tipdamp/sweep/test_outcome.py",
    "docs/theory/contact_stiffness.md": "hbm/test_theory.py",
    "docs/theory/harmonic_balance.md": "hbm/test_theory.py",
    "docs/theory/time_integration.md": "hbm/test_theory.py",
}


def fences(page, language):
    text = (ROOT / page).read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.DOTALL | re.MULTILINE)


def studies(page):
    """The study files of a page, again with each alternative that stands in a comment."""
    for block in fences(page, "toml"):
        yield block
        for line, key in re.findall(r"^# ((\w+) = .*)$", block, re.MULTILINE):
            yield re.sub(rf"^{key} = .*$", line, block, count=1, flags=re.MULTILINE)


STUDIES = [
    pytest.param(block, id=f"{page.relative_to(ROOT).as_posix()}-{k}")
    for page in PAGES
    for k, block in enumerate(studies(page))
]


def run(block, page, **names):
    exec(compile(block, page, "exec"), names)
    return names


def test_the_python_of_every_page_is_run():
    there = {page.relative_to(ROOT).as_posix() for page in PAGES if fences(page, "python")}
    assert there == set(RUN_BY)
    for page, test in RUN_BY.items():
        assert Path(page).stem in (ROOT / "tests" / test).read_text(encoding="utf-8"), page


@pytest.mark.parametrize("page", ["README.md", "docs/site/package.markdown"])
def test_the_first_curve(page, tmp_path, monkeypatch):
    pytest.importorskip("matplotlib.pyplot").switch_backend("agg")
    monkeypatch.chdir(tmp_path)
    (block,) = fences(page, "python")
    curve = run(block, page)["curve"]
    assert curve.complete and "fold" in {at.kind for at in curve.named_points}


def test_the_first_hour_from_matrices(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine").mkdir()
    model, _ = two_blades()
    write_model(model, tmp_path, "mtx")
    run(fences("docs/first_hour.md", "python")[0], "first_hour.md")
    again = ReducedModel.load("mine/model.npz")
    assert np.array_equal(again.K, model.K) and again.body.tolist() == model.body.tolist()


def test_a_model_of_ones_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (block,) = fences("docs/own_model.md", "python")
    nodes = np.array([12, 13, 40])
    given = {"M": np.eye(3), "K": np.diag([1.0, 2.0, 3.0]), "body": ["blades"] * 3, "node": nodes}
    given |= {"direction": ["x"] * 3, "position": np.zeros((3, 3)), "f": np.ones(3)}
    run(block, "own_model.md", **given)
    again = ReducedModel.load("model.npz")
    assert again.loads["pull"].tolist() == [1, 1, 1]
    assert again.groups["blades/patch_1"].tolist() == [12, 13]


def test_the_study_of_the_readme(tmp_path):
    (block,) = fences("README.md", "toml")
    (tmp_path / "study.toml").write_text(block, encoding="utf-8")
    study = load_study(tmp_path / "study.toml")
    assert study.damper.pull == 113 and sorted(study.sides) == ["left", "right"]


def parts(schema):
    """The schema of a part of a study: nothing is required."""
    if isinstance(schema, dict):
        return {key: parts(value) for key, value in schema.items() if key != "required"}
    return [parts(one) for one in schema] if isinstance(schema, list) else schema


@pytest.mark.parametrize("block", STUDIES)
def test_sections_of_a_study(block):
    jsonschema = pytest.importorskip("jsonschema")
    content = tomllib.loads(block)
    found = jsonschema.Draft202012Validator(parts(json_schema())).iter_errors(content)
    assert content and [error.message for error in found] == []
