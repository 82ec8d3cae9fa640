"""The results folder with damaged and hostile stage records, and the folder of the compiled
kernels."""

import json
import os
import random
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.tipdamp import corner_study
from tipdamp.cli import main
from tipdamp.engine.store import Store, fingerprint
from tipdamp.hbm.errors import InputError

ROOT = Path(__file__).parents[3]


@pytest.fixture
def store(tmp_path):
    """A stage `one` that left two files."""
    store = Store(tmp_path / "results" / "study")
    for name in ("inspect.json", "loads/b.json"):
        store.write_json(name, {"name": name})
    store.finish("inspect", "key", ["inspect.json", "loads/b.json"], 1.5)
    return store


def hostile(store, outputs, checked=True):
    """A record of the stage with these outputs, as somebody else may have written it."""
    record = {"key": "0", "outputs": outputs, "seconds": 1}
    if checked:
        record["check"] = fingerprint("0", outputs, 1.0)
    store.path(".stages").mkdir(parents=True, exist_ok=True)
    store.path(".stages/inspect.json").write_text(json.dumps(record))


@pytest.mark.parametrize("checked", [True, False])
@pytest.mark.parametrize("route", ["relative", "absolute", "linked folder", "own file"])
def test_a_foreign_record_deletes_nothing(matrices_study, tmp_path, route, checked, capsys):
    victim = tmp_path / "victim.txt"
    store = Store(tmp_path / "results" / "study")
    store.folder.mkdir(parents=True)
    if route == "own file":  # inside the folder, but of other content than the record states
        victim = store.folder / "victim.txt"
    if route == "linked folder":
        (store.folder / "out").symlink_to(tmp_path)
    victim.write_text("precious")
    name = {
        "relative": "../../victim.txt",
        "absolute": str(victim),
        "linked folder": "out/victim.txt",
    }.get(route, victim.name)
    hostile(store, {name: "x" if route == "own file" else fingerprint(victim)}, checked)
    assert main(["inspect", str(matrices_study), "--force", "--quiet"]) == 0
    assert victim.read_text() == "precious"


def test_links_out_of_the_folder_are_refused(matrices_study, tmp_path, capsys):
    victim = tmp_path / "victim.txt"
    victim.write_text("precious")
    store = Store(tmp_path / "results" / "study")
    store.folder.mkdir(parents=True)
    store.path(f".tmp-{os.getpid()}-inspect.json").symlink_to(victim)
    assert main(["inspect", str(matrices_study), "--quiet"]) == 0
    for name in ("inspect.json", ".stages"):
        path = store.path(name)
        path.rename(tmp_path / f"moved {name}")
        path.symlink_to(tmp_path / f"moved {name}" if name == ".stages" else victim)
        capsys.readouterr()
        assert main(["inspect", str(matrices_study), "--quiet", "--force"]) == 2
        assert "leads out of it" in capsys.readouterr().err
        path.unlink()
    assert victim.read_text() == "precious"


def beside_its_input(study):
    """Results in the folder of the study, inputs of other names than results; the store."""
    for name in ("model.npz", "pairs.csv"):
        (study.parent / name).rename(study.parent / f"my_{name}")
    study.write_text(
        'results = "."\n'
        + study.read_text()
        .replace('"model.npz"', '"my_model.npz"')
        .replace('"pairs.csv"', '"my_pairs.csv"')
    )
    return Store(study.parent)


@pytest.mark.parametrize(
    "name",
    [
        "study.toml",
        "my_model.npz",
        "my_pairs.csv",
        "notes.txt",
        "own/inspect.html",
        "linked/a.csv",
        "./inspect.json",
    ],
)
def test_a_forged_record_deletes_no_file_of_others(matrices_study, name, capsys):
    """Neither inputs nor other files, whatever the record states; nor through a link inside the
    folder."""
    store = beside_its_input(matrices_study)
    (store.folder / "own").mkdir()
    for file in ("notes.txt", "own/inspect.html", "own/a.csv"):
        store.path(file).write_text("precious")
    store.path("linked").symlink_to(store.folder / "own")
    assert main(["inspect", str(matrices_study), "--quiet"]) == 0
    hostile(store, {name: fingerprint(store.path(name))})
    assert main(["inspect", str(matrices_study), "--quiet", "--force"]) == 0
    assert store.path(name).is_file() and "own/inspect.html" not in store.outputs("inspect")


def test_linked_results_are_not_removed(store):
    """A declared name whose folder is a link is not what the stage wrote."""
    store.path("loads").rename(store.path("mine"))
    store.path("loads").symlink_to(store.path("mine"))
    store.finish(
        "inspect",
        "key",
        ["inspect.json"],
        1.0,
        {"loads/b.json": fingerprint(store.path("mine/b.json"))},
    )
    assert store.path("mine/b.json").is_file()


@pytest.mark.parametrize(
    "old, new, file, key",
    [
        ("", "", "model.npz", r"\[model\] matrices"),
        ('"model.npz"', '"m.npz"', "pairs.csv", r"\[contact\] pairs"),
        ('"model.npz"', '"export/m.npz"', "export/m.npz", r"\[model\] matrices"),
        ('"model.npz"', '"linked.npz"', "linked.npz", r"\[model\] matrices"),
    ],
)
def test_results_that_would_overwrite_an_input(matrices_study, old, new, file, key, capsys):
    folder = matrices_study.parent
    if file == "linked.npz":
        (folder / file).symlink_to(folder / "model.npz")
    elif new:
        (folder / new.strip('"')).parent.mkdir(exist_ok=True)
        (folder / "model.npz").rename(folder / new.strip('"'))
    matrices_study.write_text('results = "."\n' + matrices_study.read_text().replace(old, new))
    before = {p: fingerprint(p) for p in folder.rglob("*") if p.is_file()}
    for verb in ("inspect", "run", "export"):
        assert main([verb, str(matrices_study)]) == 2
        said = capsys.readouterr().err
        assert (
            re.search(rf"study.toml: {key}, \S*{file}, would be overwritten .*--out", said)
            and said.count("\n") == 1
        )
    assert {p: fingerprint(p) for p in folder.rglob("*") if p.is_file()} == before


@pytest.mark.parametrize("planted", ["folder", "filled folder", "link out", "link to itself"])
@pytest.mark.parametrize("name", ["inspect.json", "inspect.running"])
def test_a_record_that_is_no_file_counts_as_absent(matrices_study, tmp_path, name, planted, caplog):
    store = Store(tmp_path / "results" / "study")
    assert main(["inspect", str(matrices_study), "--quiet"]) == 0
    victim, record = tmp_path / "victim.json", store.folder / ".stages" / name
    store.path(".stages/inspect.json").rename(victim)
    if "folder" in planted:
        record.mkdir()
        if planted == "filled folder":
            (record / "a.txt").write_text("precious")
    else:
        record.symlink_to(victim if planted == "link out" else record)
    content = victim.read_bytes()
    assert main(["inspect", str(matrices_study), "--quiet"]) == 0
    assert victim.read_bytes() == content and store.record("inspect") is not None
    assert caplog.text.count("counts as not run") == (name == "inspect.json")
    assert [p.read_text() for p in store.folder.rglob("a.txt")] == ["precious"] * (
        planted == "filled folder"
    )


def test_files_no_longer_written_are_removed(store):
    with store.running("inspect") as before:
        pass
    store.finish("inspect", "key", ["inspect.json"], 1.0, before)
    assert store.path("inspect.json").is_file() and not store.path("loads/b.json").exists()


@pytest.mark.parametrize("name", ["/etc/passwd", "../a", "a/../../b"])
def test_names_outside_are_refused(store, name):
    with pytest.raises(InputError, match="leads out of it"):
        store.path(name)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\xff\xfe",
        b"5",
        b"[]",
        b'{"outputs": {}}',
        b"[" * 100000,
        b'{"key": "0", "outputs": 5, "seconds": 1}',
        b'{"key": "0", "outputs": {"a\\u0000b": "x"}, "seconds": 1}',
    ],
)
def test_a_damaged_record_counts_as_absent(store, content, caplog):
    store.path(".stages/inspect.json").write_bytes(content)
    assert store.record("inspect") is None and not store.is_current("inspect", "key")
    assert store.record("inspect") is None and caplog.text.count("is damaged") == 1


def test_flipped_bytes_of_records(matrices_study, tmp_path, capsys):
    """One seeded flip after the other: each is noticed and the stage runs again, or the record says
    the same."""
    assert main(["inspect", str(matrices_study), "--quiet"]) == 0
    store = Store(tmp_path / "results" / "study")
    path = tmp_path / "results" / "study" / ".stages" / "inspect.json"
    intact, record = path.read_bytes(), store.record("inspect")
    chosen = random.Random(7)
    for _ in range(300):
        damaged = bytearray(intact)
        damaged[chosen.randrange(len(damaged))] ^= 1 << chosen.randrange(8)
        path.write_bytes(damaged)
        assert store.record("inspect") in (None, record)
    path.write_bytes(damaged)
    capsys.readouterr()
    assert main(["inspect", str(matrices_study), "--quiet"]) == 0
    assert "up to date" not in capsys.readouterr().out and store.record("inspect").key == record.key


def test_a_user_without_a_home(tmp_path):
    """Compiled forms of the finite elements go elsewhere, and are gone with the process."""
    study, elsewhere = corner_study.write(tmp_path), tmp_path / "elsewhere"
    elsewhere.mkdir()
    variables = {k: v for k, v in os.environ.items() if not k.startswith("XDG_")}
    variables |= {"PYTHONPATH": str(ROOT), "HOME": os.devnull, "TMPDIR": str(elsewhere)}
    said = subprocess.run(
        [sys.executable, "-m", "tipdamp", "inspect", study, "--quiet", "--out", tmp_path / "out"],
        capture_output=True,
        text=True,
        env=variables,
    )
    assert said.returncode == 0, said.stderr
    assert not list(elsewhere.glob("tipdamp-*"))


@pytest.mark.parametrize("planted", ["open to all", "a link", "none", "unusable home"])
def test_kernels_are_cached_in_a_private_folder(tmp_path, planted):
    """With a read-only program; compiled kernels are pickles, which run what they say when they are
    read."""
    home, elsewhere = tmp_path / "cache", tmp_path / "elsewhere"
    elsewhere.mkdir()
    home.mkdir()
    if planted == "open to all":
        (home / "tipdamp").mkdir()
        (home / "tipdamp").chmod(0o777)
    elif planted == "a link":
        (home / "tipdamp").symlink_to(elsewhere)
    elif planted == "unusable home":
        home.rmdir()
        home.write_text("a file")
    program = (
        "import os, stat; real = os.access\nos.access = lambda path, mode: not "
        "str(path).endswith('hbm') and real(path, mode)\nfrom tipdamp.engine.kernel_cache import "
        "choose_caches; choose_caches()\nplace = os.environ['NUMBA_CACHE_DIR']; "
        "print(place, oct(stat.S_IMODE(os.lstat(place).st_mode)))"
    )
    said = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        check=True,
        env={"PYTHONPATH": str(ROOT), "XDG_CACHE_HOME": str(home), "TMPDIR": str(elsewhere)},
    )
    place, mode = said.stdout.split()
    assert mode == "0o700" and (place == str(home / "tipdamp")) == (planted == "none")
    assert (home if planted == "none" else elsewhere) in Path(place).parents
    assert Path(place).exists() == (planted == "none")  # a temporary one is gone with the process
