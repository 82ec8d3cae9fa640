"""A verb that finds nothing to do says again what it said, from its receipt; whatever differs, it
looks for itself."""

import json
import shutil
import subprocess
import sys

import pytest

import tipdamp
from tipdamp import cli
from tipdamp.proposal.first_study import write_first_study
from tipdamp.stages import receipts

VERBS = ("inspect", "reduce", "preload", "tune")


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A study whose first stages are done, and a copy of its folder."""
    study = write_first_study(tmp_path_factory.mktemp("finished") / "study")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(study.parent)
        for verb in VERBS:
            assert cli.main([verb, study.name, "--quiet"]) == 0
    return study, shutil.copytree(study.parent, study.parent.with_name("copy"))


@pytest.fixture
def study(finished, monkeypatch):
    """The study in its folder, which is put back afterwards."""
    path, copy = finished
    monkeypatch.chdir(path.parent)
    yield path
    monkeypatch.undo()
    shutil.rmtree(path.parent)
    shutil.copytree(copy, path.parent)


@pytest.fixture
def looked(monkeypatch):
    """The verbs that did not go by a receipt."""
    found, opened = [], cli._opened
    monkeypatch.setattr(
        cli, "_opened", lambda given, *more: found.append(given.verb) or opened(given, *more)
    )
    return found


@pytest.mark.parametrize("verb", VERBS)
def test_says_again_what_a_look_says(study, looked, capsys, verb):
    assert cli.main([verb, study.name]) == 0
    by_receipt = capsys.readouterr()
    assert looked == [] and by_receipt.out.startswith(f"{verb:8s} up to date")
    (study.parent / f"results/study/.stages/{verb}.receipt").unlink()
    assert cli.main([verb, study.name]) == 0
    assert looked == [verb]
    # the machine is measured anew for an estimate, all else is the same
    by_look = capsys.readouterr()
    one, other = (
        [text for text in said.out.splitlines() if "estimate" not in text]
        for said in (by_receipt, by_look)
    )
    assert one == other and by_look.err == by_receipt.err


def test_loads_no_library(study):
    program = (
        "import sys; from tipdamp.cli import main; code = main(sys.argv[1:]); "
        "print(sorted({'numpy', 'scipy', 'pydantic', 'numba'} & set(sys.modules))); sys.exit(code)"
    )
    child = subprocess.run(
        [sys.executable, "-c", program, "tune", study.name], capture_output=True, text=True
    )
    assert child.returncode == 0, child.stderr
    assert "up to date" in child.stdout and child.stdout.splitlines()[-1] == "[]"


def append(name, text="\n"):
    def change(folder):
        with (folder / name).open("a") as file:
            file.write(text)

    return change


def with_receipt(**changes):
    """The receipt of `tune` with other contents, its own check left as it is."""

    def change(folder):
        path = folder / "results/study/.stages/tune.receipt"
        content = json.loads(path.read_text())
        said, complaint, code, needs = content["receipt"]
        values = {"said": said, "complaint": complaint, "code": code, "needs": needs} | changes
        path.write_text(json.dumps(content | {"receipt": list(values.values())}))

    return change


CHANGES = {
    "the study": append("study.toml", "# more\n"),
    "the matrices": lambda folder: shutil.copy(folder / "pairs.csv", folder / "model.npz"),
    "the pairs": append("pairs.csv"),
    "no pairs": lambda folder: (folder / "pairs.csv").unlink(),
    "an output altered": append("results/study/tune.json", " "),
    "an output of a stage before altered": append("results/study/preload.csv", " "),
    "an output gone": lambda folder: (folder / "results/study/kept.csv").unlink(),
    "an output elsewhere": lambda folder: (
        (folder / "results/study/kept.csv").rename(folder / "kept.csv"),
        (folder / "results/study/kept.csv").symlink_to(folder / "kept.csv"),
    ),
    "a record altered": append("results/study/.stages/reduce.json", " "),
    "a record gone": lambda folder: (folder / "results/study/.stages/reduce.json").unlink(),
    "an interrupted stage": append("results/study/.stages/respond.running"),
    "what a killed run left": append("results/study/.tmp-1-kept.csv"),
    "a receipt cut": lambda folder: (folder / "results/study/.stages/tune.receipt").write_text("{"),
    "a receipt that says other things": with_receipt(said=["all is well"]),
    "a receipt of another exit code": with_receipt(code=3),
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_looks_where_anything_has_changed(study, looked, change):
    change(study.parent)
    cli.main(["tune", study.name, "--quiet"])
    assert looked == ["tune"]


def test_looks_with_another_program(study, looked, monkeypatch):
    monkeypatch.setattr(receipts, "_program", lambda: "of another version")
    cli.main(["tune", study.name, "--quiet"])
    assert looked == ["tune"]


def test_every_source_is_in_its_hash(tmp_path, monkeypatch):
    found = set()
    for name in ("__init__.py", "hbm/law.py", "report/page.css"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        monkeypatch.setattr(tipdamp, "__file__", str(tmp_path / "__init__.py"))
        for text in ("a = 1\n", "a = 2\n"):
            path.write_text(text)
            found.add(receipts._program())
    assert len(found) == 6


@pytest.mark.parametrize("more", [["--force"], ["--out", "elsewhere"], ["--allow-outside"]])
def test_looks_when_asked_otherwise(study, looked, more):
    cli.main(["tune", study.name, "--quiet", *more])
    assert looked == ["tune"]


def test_looks_while_another_run_has_the_folder(study, looked):
    from tipdamp.engine.store import Store

    with Store(study.parent / "results/study").lock():
        assert cli.main(["tune", study.name]) == 4
    assert looked == ["tune"]


def test_looks_where_memory_has_become_short(study, looked, monkeypatch):
    path = study.parent / "results/study/.stages/inspect.receipt"
    needs = json.loads(path.read_text())["receipt"][3]
    monkeypatch.setattr(receipts, "available_bytes", lambda: needs / 2)
    cli.main(["inspect", study.name, "--quiet"])
    assert needs > 0 and looked == ["inspect"]


def test_none_is_left_of_a_study_that_was_edited_meanwhile(study, looked, monkeypatch):
    opened = cli._opened

    def edited_after(*arguments):
        found = opened(*arguments)
        append("study.toml", "# edited while the verb ran\n")(study.parent)
        return found

    append("study.toml", "# more\n")(study.parent)
    monkeypatch.setattr(cli, "_opened", edited_after)
    assert cli.main(["reduce", study.name, "--quiet"]) == 0
    monkeypatch.setattr(cli, "_opened", opened)
    assert cli.main(["reduce", study.name, "--quiet"]) == 0
    assert looked == ["reduce", "reduce"]


@pytest.mark.slow
def test_the_whole_run(study, looked, capsys):
    code, again = (cli.main(["run", study.name, "--quiet", "--jobs", "1"]) for _ in range(2))
    assert code == again and looked == ["run"]
    assert "report   up to date" in capsys.readouterr().out


def test_incomplete_curves_are_told_again(study, monkeypatch, capsys):
    """On stderr, with the exit code."""
    monkeypatch.setattr(receipts, "find", lambda _: receipts.Receipt(["said"], "2 of 6", 3, 0.0))
    assert cli.main(["run", study.name]) == 3
    assert capsys.readouterr() == ("said\n", "tipdamp: 2 of 6\n")
