"""The fenced code of the documents: Python runs, and study files and their parts are valid."""

import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

from tipdamp import ReducedModel
from tipdamp.cli import _parser
from tipdamp.proposal.first_study import write_first_study
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
    write_first_study(tmp_path / "mine")
    model = ReducedModel.load("mine/model.npz")
    (tmp_path / "mine" / "model.npz").unlink()
    run(fences("docs/first_hour.md", "python")[0], "first_hour.md")
    again = ReducedModel.load("mine/model.npz")
    assert np.array_equal(again.K, model.K) and again.body.tolist() == model.body.tolist()


SMALLER = {  # what makes the way from meshes short: coarse cells, one level, a narrow band
    "--edge 0.008": "--edge 0.016 --contact-edge 0.004 --axial 15 --across 1",
    "levels": "levels = [0.31]",
    "band": "band = [1500, 1700]",
    "harmonics": "harmonics = 1",
}


def way(name):
    """[(language, block)] of one of the three ways of the first hour."""
    text = (ROOT / "docs" / "first_hour.md").read_text(encoding="utf-8")
    (part,) = re.findall(rf"^## From {name}\n(.*?)(?=^## |\Z)", text, re.DOTALL | re.MULTILINE)
    return re.findall(r"^```(\w+)\n(.*?)^```", part, re.DOTALL | re.MULTILINE)


def shell(block, folder):
    """Run the lines of a fence with this Python."""
    for line in block.splitlines():
        command = line.partition("#")[0].replace("--edge 0.008", SMALLER["--edge 0.008"]).strip()
        words = shlex.split(re.sub("^tipdamp ", "python -m tipdamp ", command))
        assert words[:2] == ["python", "-m"]
        done = subprocess.run(
            [sys.executable, *words[1:]],
            cwd=folder,
            env=os.environ | {"PYTHONPATH": str(ROOT), "TIPDAMP_JOBS": "1"},
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, (line, done.stderr[-2000:])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["meshes", "matrices", "equations"])
def test_the_first_hour(name, tmp_path, monkeypatch):
    """All that a way says, in its order; a study is filled in by the part of it that stands there,
    and left with less to compute."""
    pytest.importorskip("matplotlib.pyplot").switch_backend("agg")
    if name == "meshes":
        pytest.importorskip("dolfinx")
    monkeypatch.chdir(tmp_path)
    blocks = way(name)
    assert sum(block.count("\n") for language, block in blocks if language == "sh") <= 3
    for language, block in blocks:
        if language == "sh":
            shell(block, tmp_path)
        elif language == "python":
            run(block, "first_hour.md")
        else:
            study = tmp_path / "tet_rig.toml"
            given = dict(re.findall(r"^(\w+) = (.*)$", block, re.MULTILINE))
            filled = study.read_text(encoding="utf-8")
            for key, value in given.items():
                filled, count = re.subn(rf'^{key} = "\?"', f"{key} = {value}", filled, flags=re.M)
                assert count == 1, key
            for key in ("levels", "band", "harmonics"):
                filled = re.sub(rf"^{key} = .*", SMALLER[key], filled, flags=re.MULTILINE)
            study.write_text(filled, encoding="utf-8")
    reports = [path for path in tmp_path.rglob("report.html")]
    assert len(reports) == (name != "equations")


def spoken():
    """(page, words) of each command of tipdamp in fences and code of the documents."""
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        inside = re.findall(r"^```sh\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
        lines = [line for block in inside for line in block.splitlines()]
        lines += re.findall(r"`(tipdamp [a-z][^`\n]*)`", text)
        lines += re.findall(r"^    (tipdamp [a-z].*)$", text, re.MULTILINE)
        for line in lines:
            for command in re.split("&&", line.partition("#")[0]):
                if command.strip().startswith("tipdamp "):
                    words = re.split(r" {2,}|\\$", command.strip())[0].split()[1:]
                    if words[0].endswith(":"):  # what the program says
                        continue
                    yield page.relative_to(ROOT).as_posix(), words


def test_commands_of_the_documents_exist():
    """Verbs and options; what a command needs besides need not stand where it is named."""
    verbs = _parser()._subparsers._group_actions[0].choices
    said = list(spoken())
    assert len(said) > 40
    for page, words in said:
        assert words[0] in verbs, (page, words)
        known = verbs[words[0]]._option_string_actions
        options = [word.partition("=")[0] for word in words[1:] if word.startswith("-")]
        assert [one for one in options if one not in known] == [], (page, words)


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
