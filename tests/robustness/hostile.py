"""F. Hostile input."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np

from tests.robustness.rows import accepted, arrays, chain, corner, refused, row, tipdamp
from tests.tipdamp import corner_study
from tipdamp.hbm.contact import ContactTable

ROOT = Path(__file__).parents[2]


class Planted:
    """A pickle that leaves a file when it is loaded."""

    def __init__(self, mark):
        self.mark = mark

    def __reduce__(self):
        return (Path(self.mark).touch, ())


@row("84", "npz with a pickled object", "E")
def pickled(folder):
    for name in ("K", "body", "groups"):
        study = arrays(chain(folder), **{name: np.array([Planted(folder / "ran")], dtype=object)})
        yield refused(study, "pickle|object")
    assert not (folder / "ran").exists()


@row("86", "YAML with python tags", "E")
def tagged(folder):
    study = folder / "study.yaml"
    study.write_text(f"a: !!python/object/apply:os.system ['touch {folder}/ran']\n")
    yield refused(study, "mesh files of type .* are not read")
    (folder / "study.yaml").rename(folder / "study.toml")
    yield refused(folder / "study.toml", "not a valid TOML file")
    assert not (folder / "ran").exists()


@row("88", "paths out of the folder, links", "R, E")
def outside(folder):
    (folder / "theirs").mkdir()
    (folder / "mine.inp").write_text("precious")
    study = corner(
        folder / "theirs", ('"blades.inp"', '"../../../../../../../../../etc/passwd.inp"')
    )
    yield refused(study, "no such file")
    study = corner(folder / "theirs", ('"blades.inp"', '"../blades.inp"'))
    shutil.move(folder / "theirs" / "blades.inp", folder / "blades.inp")
    said = accepted(study)
    assert (
        f"[blades] mesh is read from outside the study's folder: {folder / 'blades.inp'}"
        in said.err
    )
    yield "read and named: " + said.err.strip().replace(str(folder) + "/", "")
    for place in ("../../elsewhere", "/tmp/elsewhere", "link/results"):
        study = chain(folder / "theirs")
        study.write_text(f'results = "{place}"\n' + study.read_text())
        if not (folder / "theirs" / "link").is_symlink():
            (folder / "theirs" / "link").symlink_to(folder)
        yield refused(study, "its results lead out of its own folder.*--allow-outside")
    assert (folder / "mine.inp").read_text() == "precious" and not (folder / "results").exists()


@row("90", "expressions in the place of values", "E")
def expressions(folder):
    code = f"__import__('os').system('touch {folder}/ran')"
    yield refused(chain(folder, ("pull = 60", f'pull = "{code}"')), "pull = .*: must be a number")
    yield refused(
        chain(folder, ("levels = [5]", f'levels = ["{code}"]')), "levels = .*: must be a number"
    )
    yield refused(chain(folder, add=f'[loads.a]\npull = "{{{{ {code} }}}}"\n'), "must be a number")
    assert not (folder / "ran").exists()


@row("92", "formulas in CSV cells", "E, S")
def formulas(folder):
    study = corner(folder, ("[contact.one]", '[contact."=cmd|x"]'))
    yield refused(
        study, r"side '=cmd\|x': must be a printable name that does not begin with = \+ - @"
    )
    study = chain(folder)
    path = folder / "pairs.csv"
    path.write_text(path.read_text().replace("left", "=1+1"))
    study.write_text(study.read_text().replace("[contact.left]", '[contact."=1+1"]'))
    yield refused(study, r"side '=1\+1': must be a printable name")
    with np.testing.assert_raises(ValueError):
        ContactTable.load(path).save(folder / "out.csv")


@row("93", "newlines and escapes in names", "S")
def escapes(folder):
    study = chain(
        folder, ("direction = ", 'patches = ["a\\u001b[31m\\nroot: done", "b"]\ndirection = ')
    )
    said = [tipdamp(verb, study, "--quiet") for verb in ("inspect", "reduce")]
    text = "".join(one.out + one.err for one in said)
    assert said[-1].code == 2 and "\x1b" not in text and "\nroot" not in text, text
    yield said[-1].line[:300]
    yield refused(chain(folder, add='"a\\u001b[2J" = 1\n'), r"unknown key 'a\\x1b\[2J'")


@row("95", ".petscrc in the current folder", "S", slow=True)
def petscrc(folder):
    study = corner(folder)
    (folder / ".petscrc").write_text("-on_error_attach_debugger\n-log_view\n-ksp_type gmres\n")
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PETSC_OPTIONS": "-log_view"}
    for verb in ("inspect", "reduce", "preload"):
        done = subprocess.run(
            [sys.executable, "-m", "tipdamp", verb, study.name, "--quiet"],
            cwd=folder,
            text=True,
            capture_output=True,
            env=environment,
            timeout=100,
        )
        assert done.returncode == 0 and "PETSc Performance" not in done.stdout + done.stderr, done
    yield "neither it nor PETSC_OPTIONS is read"


@row("96", ".geo script as mesh", "E")
def script(folder):
    study = corner(folder, ('"blades.inp"', '"blades.geo"'))
    (folder / "blades.geo").write_text(f'SystemCall "touch {folder}/ran";\n')
    yield refused(study, r"mesh files of type '.geo' are not read; .*valid: .msh")
    assert not (folder / "ran").exists()


@row("x8", "pipe or device in the place of a file", "E")
def pipes(folder):
    study = chain(folder)
    (folder / "pairs.csv").unlink()
    os.mkfifo(folder / "pairs.csv")
    yield refused(study, r"\[contact\] pairs = .*pairs.csv: is not a file")
    study = chain(folder := folder / "b") if (folder / "b").mkdir() is None else study
    (folder / "model.npz").unlink()
    (folder / "model.npz").symlink_to("/dev/zero")
    yield refused(study, r"\[model\] matrices = .*model.npz: is not a file")


@row("x9", "names in a page", "S")
def names_in_a_page(folder):
    name = "</script><img src=x onerror=alert(1)>"
    mesh = corner_study.damper()
    mesh.groups[name] = mesh.groups["face_x"]
    study = corner(
        folder,
        ("[material]", f"title = '{name}'\n[material]"),
        ('"load"', f"'{name}'"),
        damper_mesh=mesh,
    )
    for verb in ("inspect", "reduce", "preload", "report"):
        accepted(study, verb)
    for page in ("inspect.html", "report.html"):
        text = (folder / "results" / "corner" / page).read_text(encoding="utf-8")
        assert "<img src=x" not in text and "script-src &#39;sha256-" in text
    yield "escaped, and the page's policy lets no other script run"
