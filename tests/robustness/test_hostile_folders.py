"""Folders of a stranger: nothing in them is run, nothing outside is touched, and pages show names
as text."""

import json
import os
import pickle
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from tests.robustness.hostile import Planted
from tests.robustness.rows import chain, corner, stages, tipdamp
from tests.tipdamp import corner_study
from tipdamp.engine.store import Store, fingerprint

NAME = r"$\frac{$ \x^ %s {0} </td>" + (
    "</script><script>document.title='ran'</script><img src=http://127.0.0.1:9/x "
    "onerror=\"document.title='ran'\">"
)


def record(store, name, outputs):
    """A stage record as the program would write it."""
    store.write_json(
        f".stages/{name}.json",
        {"key": "0", "outputs": outputs, "seconds": 1.0, "check": fingerprint("0", outputs, 1.0)},
    )


def absolute_record(store, outside):
    record(store, "inspect", {str(outside / "victim.txt"): "x"})


def climbing_record(store, outside):
    record(store, "respond", {"../../../outside/victim.txt": fingerprint(outside / "victim.txt")})


def linked_folder(store, outside):
    (store.folder / "responses").symlink_to(outside)
    record(store, "Fe_9N_H1", {"responses/victim.txt": fingerprint(outside / "victim.txt")})


def linked_result(store, outside):
    (store.folder / "inspect.json").symlink_to(outside / "victim.txt")


def linked_records(store, outside):
    (store.folder / ".stages").symlink_to(outside)


def linked_lock(store, outside):
    (store.folder / ".stages").mkdir()
    (store.folder / ".stages" / ".holder").symlink_to(outside / "victim.txt")


def linked_journal(store, outside):
    (store.folder / ".stages").mkdir()
    (store.folder / ".stages" / "Fe_5N_H1.0.00000.npz").symlink_to(outside / "victim.txt")


def linked_temporary(store, outside):
    for name in ("inspect.json", "inspect.html"):
        (store.folder / f".tmp-{os.getpid()}-{name}").symlink_to(outside / "victim.txt")


def pickled_model(store, outside):
    array = np.array([Planted(outside / "ran")], dtype=object)
    np.savez(store.folder / "model.npz", K=array, M=array)
    record(store, "reduce", {"model.npz": fingerprint(store.folder / "model.npz")})


def pickled_curve(store, outside):
    (store.folder / "responses").mkdir()
    (store.folder / "responses" / "Fe_5N_H1.npz").write_bytes(
        pickle.dumps(Planted(outside / "ran"))
    )
    record(
        store,
        "Fe_5N_H1",
        {"responses/Fe_5N_H1.npz": fingerprint(store.folder / "responses" / "Fe_5N_H1.npz")},
    )


def deep_json(store, outside):
    record(store, "inspect", {})
    (store.folder / ".stages" / "inspect.json").write_text("[" * 200_000)


def huge_counts(store, outside):
    (store.folder / "inspect.json").write_text(
        json.dumps({"bodies": {}, "pairs": {"left": 10**400}})
    )


def script_in_results(store, outside):
    (store.folder / "conftest.py").write_text(f"open({str(outside / 'ran')!r}, 'w')")
    (store.folder / "numpy.py").write_text(f"open({str(outside / 'ran')!r}, 'w')")


FOLDERS = [
    absolute_record,
    climbing_record,
    linked_folder,
    linked_result,
    linked_records,
    linked_lock,
    linked_journal,
    linked_temporary,
    pickled_model,
    pickled_curve,
    deep_json,
    huge_counts,
    script_in_results,
]


@pytest.mark.parametrize("plant", FOLDERS, ids=lambda f: f.__name__)
def test_results_of_a_stranger(tmp_path, plant):
    """Refused, or run without touching anything outside."""
    outside, home = tmp_path / "outside", tmp_path / "home"
    outside.mkdir()
    home.mkdir()
    (outside / "victim.txt").write_text("precious")
    study, store = chain(home), Store(home / "results" / "study")
    store.folder.mkdir(parents=True)
    plant(store, outside)
    for force in ((), ("--force",)):
        for verb in ("inspect", "reduce", "preload", "tune", "respond"):
            said = tipdamp(verb, study, "--quiet", *force)
            assert said.code in (0, 2, 4) and "Traceback" not in said.err, said
            if said.code:
                break
    assert [p.name for p in outside.iterdir()] == ["victim.txt"]
    assert (outside / "victim.txt").read_text() == "precious"


def program_in_the_folder(folder):
    """A study beside modules that have the names of libraries: the command is given in that
    folder."""
    study = chain(folder)
    for name in ("numpy", "tipdamp", "sitecustomize", "matplotlib"):
        (folder / f"{name}.py").write_text(f"open({str(folder / 'ran')!r}, 'w')\n")
    return study


def test_modules_beside_the_study_are_not_imported(tmp_path):
    study = program_in_the_folder(tmp_path)
    command = shutil.which("tipdamp")
    if command is None:
        pytest.skip("the command is not installed")
    done = subprocess.run(
        [command, "inspect", study.name, "--quiet"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
        timeout=100,
    )
    assert done.returncode == 0 and not (tmp_path / "ran").exists(), done


def named(folder):
    """A study whose title, groups, side and output are called NAME."""
    mesh, blades = corner_study.damper(), corner_study.blades()
    mesh.groups[NAME], blades.groups[NAME] = mesh.groups["face_x"], blades.groups["touch_one"]
    side, text = NAME.replace("\\", "\\\\").replace('"', '\\"'), f"'''{NAME}'''"
    return corner(
        folder,
        ("[material]", f"title = {text}\n[material]"),
        ("[contact.one]", f'[contact."a{side}"]'),
        ('damper = "face_x"', f"damper = {text}"),
        ('blade = "touch_one"', f"blade = {text}"),
        ('patches = ["touch_one"', f"patches = [{text}"),
        ("[respond]", '[tune]\nstations = "all"\n[respond]'),
        ("levels = [1]", "levels = [1]\nharmonics = [1]\nboth_ways = false"),
        damper_mesh=mesh,
        blade_mesh=blades,
    )


@pytest.mark.slow
def test_hostile_names_in_a_browser(tmp_path):
    """Rendered: no script of a name runs, nothing is fetched, and no script of the page fails."""
    chromium = shutil.which("chromium")
    if chromium is None:
        pytest.skip("chromium is not installed")
    stages(study := named(tmp_path), "respond")
    assert all(tipdamp(verb, study, "--quiet").code == 0 for verb in ("cycles", "report"))
    for page in ("inspect.html", "report.html"):
        path = tmp_path / "results" / "corner" / page
        done = subprocess.run(
            [
                chromium,
                "--headless=new",
                "--no-sandbox",
                "--use-gl=angle",
                "--use-angle=swiftshader",
                "--enable-unsafe-swiftshader",
                f"--user-data-dir={tmp_path / 'profile'}",
                "--enable-logging=stderr",
                "--virtual-time-budget=8000",
                "--dump-dom",
                f"file://{path}",
            ],
            capture_output=True,
            text=True,
            timeout=120,
        )
        title = re.search("<title>(.*?)</title>", done.stdout, re.DOTALL)[1]
        assert title.startswith(r"$\frac{$ \x^ %s {0} &lt;/td&gt;&lt;/script&gt;")
        assert "<img src=http" not in done.stdout
        console = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
        assert not [
            line
            for line in console
            if re.search("Uncaught|Refused|violates|ERR_|Failed to load", line)
        ]
        assert "js-plotly-plot" in done.stdout and "main-svg" in done.stdout
