"""`import tipdamp` loads nothing, each of its names is there, and type checkers see them."""

import ast
import json
import os
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import tipdamp
import tipdamp.hbm.laws

ROOT = Path(__file__).parents[1]
SCRIPT = """
from tipdamp import Problem, CubicSpring, follow_band

duffing = Problem([[1.0]], [[0.1]], [[1.0]]).add(CubicSpring(1.0), 0).force(0, 0.2)
curve = duffing.follow_band((0.1, 0.3), outputs={"x": 0}, harmonics=5)
reveal_type(curve)
duffing.follow_band((0.1, 0.3), outputs={"x": 0}, harmonic=5)
duffing.add(CubicSpring(1.0))
curve.peek("x")
from tipdamp import ForcedRespons
from tipdamp.hbm.laws import SHIPPED, DryFriction2T, Nonsense
DryFriction2T(friction=0.5)
reveal_type(SHIPPED["CubicSpring"]())
"""
WRONG = {
    7: 'Unexpected keyword argument "harmonic"',
    8: 'Missing positional argument "where"',
    9: '"ForcedResponse" has no attribute "peek"',
    10: 'Module "tipdamp" has no attribute "ForcedRespons"',
    11: 'Module "tipdamp.hbm.laws" has no attribute "Nonsense"',
    12: 'Unexpected keyword argument "friction"',
}


@pytest.mark.parametrize("name", tipdamp.__all__)
def test_public_names_are_there(name):
    assert vars(sys.modules[getattr(tipdamp, name).__module__])[name] is getattr(tipdamp, name)


@pytest.mark.parametrize("name", tipdamp.hbm.laws.__all__)
def test_names_of_laws_are_there(name):
    assert name in dir(tipdamp.hbm.laws)
    found = getattr(tipdamp.hbm.laws, name)
    assert name == "SHIPPED" or found.__name__ == name


@pytest.mark.parametrize("face", [tipdamp, tipdamp.hbm.laws], ids=lambda face: face.__name__)
def test_checkers_read_the_same_names_from_the_same_places(face):
    """Those that an import gives its own name again: others they take for no part of the face."""
    tree = ast.parse(Path(face.__file__).read_text(encoding="utf-8"))
    (choice,) = (node for node in tree.body if isinstance(node, ast.If))
    seen = [
        (alias, node.module)
        for node in choice.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    ]
    assert all(alias.asname == alias.name for alias, _ in seen)
    assert sorted(alias.name for alias, _ in seen) == [n for n in face.__all__ if n != "SHIPPED"]
    for alias, module in seen:
        assert vars(import_module(module))[alias.name] is getattr(face, alias.name)


def test_unknown_names_are_refused():
    with pytest.raises(AttributeError, match="module 'tipdamp' has no attribute 'forced_respons'"):
        tipdamp.forced_respons  # noqa: B018


def test_nothing_heavy_is_loaded():
    heavy = "print([name for name in ('numpy', 'scipy', 'numba') if name in sys.modules])"
    program = f"import sys, tipdamp.hbm.laws; {heavy}"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout == "[]\n", done.stderr


@pytest.mark.slow
def test_a_checker_sees_wrong_use_in_a_script(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    asked = [
        sys.executable,
        "-m",
        "mypy",
        "--strict",
        "--no-error-summary",
        "--config-file",
        str(ROOT / "pyproject.toml"),
        str(script),
    ]
    told = subprocess.run(asked, cwd=ROOT, capture_output=True, text=True).stdout
    lines = {
        line: [text for text in told.splitlines() if f"script.py:{line}: error" in text]
        for line in range(1, SCRIPT.count("\n") + 1)
    }
    assert 'Revealed type is "tipdamp.hbm.result.ForcedResponse"' in told
    assert 'Revealed type is "tipdamp.hbm.laws.base.ContactLaw"' in told
    assert {line for line, found in lines.items() if found} == set(WRONG), told
    assert all(text in lines[line][0] for line, text in WRONG.items()), told


@pytest.mark.slow
def test_pyright_sees_them_too(tmp_path):
    pytest.importorskip("basedpyright")
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    told = subprocess.run(
        [
            sys.executable,
            "-m",
            "basedpyright",
            "--outputjson",
            "--pythonpath",
            sys.executable,
            str(script),
        ],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    ).stdout
    found = json.loads(told)["generalDiagnostics"]
    errors = {one["range"]["start"]["line"] + 1 for one in found if one["severity"] == "error"}
    assert any('"ForcedResponse"' in one["message"] for one in found), told
    assert errors == set(WRONG), told
