"""What is said of machines and versions in pyproject.toml, constraints/, ./dev and the documents
agrees."""

import ast
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import tipdamp

ROOT = Path(__file__).resolve().parents[1]
CONSTRAINTS = sorted((ROOT / "constraints").glob("*.txt"))
PACKAGES = ("hbm", "modal", "static_contact", "tipdamp")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
each_machine = pytest.mark.parametrize("path", CONSTRAINTS, ids=lambda path: path.stem)


def _numbers(version):
    return [int(part) for part in re.findall(r"\d+", version)]


def _pins(path):
    lines = [line.partition("#")[0].strip() for line in path.read_text().splitlines()]
    pins = [line.split("==") for line in lines if line]
    assert len({name.lower() for name, _ in pins}) == len(pins)
    return {name.lower(): version for name, version in pins}


def _lower_bounds():
    project = PROJECT["project"]
    extras = project["optional-dependencies"].values()
    for requirement in (
        *project["dependencies"],
        *(r for extra in extras for r in extra),
        *PROJECT["build-system"]["requires"],
    ):
        name, _, bound = requirement.partition(">=")
        yield name.lower(), bound


@each_machine
def test_each_machine_pins_every_dependency_within_its_bound(path):
    pins = _pins(path)
    for name, bound in _lower_bounds():
        assert name in pins, name
        assert _numbers(pins[name]) >= _numbers(bound), name


def test_coverage_leaves_out_every_kernel_and_no_other_function():
    """Numba compiles kernels: no tracer sees their lines, which would count as lines that no test
    runs."""
    patterns = PROJECT["tool"]["coverage"]["report"]["exclude_also"]
    left_out = {True: 0, False: 0}
    for path in (p for name in PACKAGES for p in (ROOT / name).rglob("*.py")):
        lines = path.read_text(encoding="utf-8").splitlines()
        for node in ast.walk(ast.parse("\n".join(lines))):
            if isinstance(node, ast.FunctionDef):
                heads = [lines[at.lineno - 1] for at in (*node.decorator_list, node)]
                kernel = any("njit" in ast.unparse(one) for one in node.decorator_list)
                assert kernel is any(re.search(p, head) for p in patterns for head in heads), (
                    node.name
                )
                left_out[kernel] += 1
    assert left_out[True] > 100 and left_out[False] > 1000


def test_machines_pin_the_same_packages():
    first, *others = map(_pins, CONSTRAINTS)
    assert others and all(set(pins) == set(first) for pins in others)


def test_the_bare_machines_of_dev_are_those_with_constraints():
    releases = re.search(r"declare -A releases=\((.*)\)", (ROOT / "dev").read_text())[1]
    found = dict(re.findall(r"\[(\w+)\]=(\d+)", releases))
    assert {f"debian{number}" for number in found.values()} == {path.stem for path in CONSTRAINTS}
    workflow = (ROOT / ".github" / "workflows" / "ci.yml").read_text()
    assert f"debian: [{', '.join(sorted(found.values()))}]" in workflow
    assert f"release: [{', '.join(sorted(found))}]" in workflow
    assert (
        f"On Debian {' or '.join(sorted(found.values()))}, as root"
        in (ROOT / "README.md").read_text()
    )


def test_the_pythons_of_the_metadata_are_tried():
    told = [
        line.rpartition(" ")[2]
        for line in PROJECT["project"]["classifiers"]
        if " Python :: 3." in line
    ]
    workflow = (ROOT / ".github" / "workflows" / "ci.yml").read_text()
    assert re.findall(r'python: "([\d.]+)"', workflow) == told
    lowest = re.search(r'with: "(numpy==[^"]+)"', workflow)[1].split()
    assert "pyNastran" in lowest  # else no test reads an OUTPUT2
    for requirement in PROJECT["project"]["dependencies"]:
        name, _, bound = requirement.partition(">=")
        assert f"{name}=={bound}.0" in lowest


def _file_of(module):
    """The source of a module of this repository, None of another."""
    path = ROOT / module.replace(".", "/")
    return next((p for p in (path.with_suffix(".py"), path / "__init__.py") if p.is_file()), None)


def _imported(path):
    """Modules that are imported when a file is, by statements at its top."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in tree.body:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module
            names = [f"{node.module}.{alias.name}" for alias in node.names]
            yield from filter(_file_of, names)


def test_the_job_of_matrices_installs_what_its_tests_import():
    """Whatever collection of tests/hbm reaches, also through other files of this repository."""
    workflow = (ROOT / ".github" / "workflows" / "ci.yml").read_text()
    asked = re.search(r"pip install \. (.*) \$\{\{ matrix.with", workflow)[1].split()
    needed = [bound.partition(">=")[0] for bound in PROJECT["project"]["dependencies"]]
    there = {*asked, *needed, *sys.stdlib_module_names}
    left, seen, foreign = [*(ROOT / "tests" / "hbm").rglob("*.py")], set(), {}
    while left:
        path = left.pop()
        seen.add(path)
        for module in _imported(path):
            source = _file_of(module)
            if source is None and not (ROOT / module.replace(".", "/")).is_dir():
                foreign.setdefault(module.split(".")[0], path)
            elif source and source not in seen:
                left.append(source)
    assert len(seen) > 150 and {"numpy", "pytest"} <= foreign.keys()
    assert {name: at for name, at in foreign.items() if name not in there} == {}


def test_a_release_is_told_alike():
    version = tipdamp.__version__
    heading = re.search(r"^## (\S+) - (\S+)$", (ROOT / "CHANGELOG.md").read_text(), re.M)
    citation = (ROOT / "CITATION.cff").read_text()
    assert heading[1] == version and f"\nversion: {version}\n" in citation
    assert f"\ndate-released: {heading[2]}\n" in citation


@pytest.fixture
def small_project(tmp_path):
    """What a release changes, in a repository of its own."""
    for name in ("dev", "CITATION.cff", "CHANGELOG.md", "tipdamp/__init__.py"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    changes = tmp_path / "CHANGELOG.md"
    entry = "## Unreleased\n\n- Something that is released by this test alone.\n"
    changes.write_text(changes.read_text().replace("## Unreleased\n", entry, 1))

    def git(*words):
        done = subprocess.run(["git", *words], cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done.stdout

    git("init", "-q")
    git("config", "user.name", "t")
    git("config", "user.email", "t@t")
    git("add", "-A")
    git("commit", "-qm", "before")
    return tmp_path, git


def tagged(folder, version):
    return subprocess.run([folder / "dev", "tag", version], capture_output=True, text=True)


def test_a_release_is_a_commit_and_a_tag(small_project):
    folder, git = small_project
    changes = (folder / "CHANGELOG.md").read_text()
    done = tagged(folder, "7.8.9")
    assert done.returncode == 0, done.stderr
    assert git("log", "-1", "--format=%s").strip() == "Version 7.8.9"
    assert git("rev-parse", "v7.8.9^{commit}") == git("rev-parse", "HEAD")
    today = git("log", "-1", "--format=%cs").strip()
    citation = (folder / "CITATION.cff").read_text()
    assert f"\nversion: 7.8.9\ndate-released: {today}\n" in citation
    assert '\n__version__ = "7.8.9"\n' in (folder / "tipdamp" / "__init__.py").read_text()
    heading = f"## Unreleased\n\n## 7.8.9 - {today}\n"
    assert (folder / "CHANGELOG.md").read_text() == changes.replace("## Unreleased\n", heading)
    again = tagged(folder, "7.8.9")
    assert again.returncode and "v7.8.9 is there" in again.stderr


def test_no_release_of_what_nobody_can_get(small_project):
    folder, git = small_project
    assert "such as 0.3.0" in tagged(folder, "7.8").stderr
    (folder / "CHANGELOG.md").write_text("# Changelog\n\n## Unreleased\n\n## 0.2.0 - 2026-01-01\n")
    assert "not committed" in tagged(folder, "7.8.9").stderr
    git("commit", "-qam", "nothing new")
    assert "nothing below Unreleased" in tagged(folder, "7.8.9").stderr
    assert git("tag") == ""


@pytest.mark.parametrize(
    "refused, why",
    [
        ("debootstrap", "has no way to make a bare trixie"),
        ("mount", "allows no mount of /proc"),
        ("id", "needs root"),
    ],
)
def test_a_machine_that_allows_no_bare_debian_says_why(tmp_path, refused, why):
    """Exit code 4, and nothing is left behind."""
    programs = {
        "id": "echo 0",
        "df": "echo Avail; echo 9000000",
        "mount": "true",
        "debootstrap": f'mkdir -p "$4/proc"; echo "$4" >{tmp_path}/made',
    }
    for name, text in (
        programs | {refused: {"id": "echo 1000"}.get(refused, f"{programs[refused]}; exit 32")}
    ).items():
        (tmp_path / name).write_text(f"#!/bin/bash\n{text}\n")
        (tmp_path / name).chmod(0o755)
    shutil.copy(ROOT / "dev", tmp_path)
    done = subprocess.run(
        [tmp_path / "dev", "fresh", "trixie"],
        capture_output=True,
        text=True,
        env=os.environ | {"PATH": f"{tmp_path}:{os.environ['PATH']}"},
    )
    assert done.returncode == 4 and why in done.stderr.splitlines()[-1]
    assert refused == "id" or not Path((tmp_path / "made").read_text().strip()).exists()


def test_fresh_knows_its_releases():
    done = subprocess.run([ROOT / "dev", "fresh", "sid"], capture_output=True, text=True)
    assert done.returncode == 1 and "bookworm" in done.stderr and "trixie" in done.stderr
