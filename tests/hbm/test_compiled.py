"""Compiled kernels on disk: whatever happens to their files, the next run compiles anew and gives
the same numbers."""

import importlib
import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tipdamp.hbm import compiled

ROOT = Path(__file__).parents[2]
SOURCE = '''from tipdamp.hbm.compiled import njit


@njit(cache=True)
def product(a, b):
    """One that calls another, as kernels do."""
    return a * shifted(b)


@njit(cache=True)
def shifted(b):
    return b + 1
'''
ADD = """
import numpy as np
from tipdamp.hbm.balance import kernels
rates, push = np.arange(6.0).reshape(2, 3) * (1 + 2j), np.ones((2, 3), dtype=complex)
print(kernels.by_order(rates, push).tolist())
"""


@pytest.fixture
def kernels(tmp_path, monkeypatch):
    """load() -> (module of two kernels as a new process finds it), its files in
    tmp_path/__pycache__; without Python's own code there, which is told from another of the same
    second and size by nothing."""
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    source = tmp_path / "kernels.py"
    source.write_text(SOURCE)

    def load():
        compiled._told.clear()
        spec = importlib.util.spec_from_file_location("kernels", source)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module

    assert load().product(2.0, 3.0) == 8.0
    return load


def test_compilation_is_told_before_it_once(kernels, caplog, tmp_path):
    """Of whichever kernel comes first, and of none that is stored."""
    assert kernels().product(2.0, 3.0) == 8.0
    assert not caplog.text
    again = kernels()
    assert again.product(2, 3) == 8 and again.shifted(1j) == 1 + 1j
    assert caplog.text.count("compiling the kernels of the laws") == 1
    for path in files(tmp_path):
        path.unlink()
    caplog.clear()
    assert kernels().shifted(2.0) == 3.0
    assert "compiling the kernels of the laws" in caplog.text


def files(folder, kind="nb[ic]"):
    return sorted(Path(folder).rglob(f"*.{kind}"))


def hits(kernel):
    return sum(kernel.stats.cache_hits.values())


def run(program, **environment):
    return subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
        env=os.environ | {key: str(value) for key, value in environment.items()},
    )


def test_kept_kernels_are_loaded(kernels, tmp_path):
    assert len(files(tmp_path)) == 4
    again = kernels()
    assert again.product(2.0, 3.0) == 8.0 and hits(again.product) == 1
    # another signature beside the first
    assert again.product(2, 3) == 8 and hits(again.product) == 1
    both = kernels()
    assert both.product(2, 3) == both.product(2.0, 3.0) == 8 and hits(both.product) == 2


def test_every_cut_and_every_changed_byte_is_found(kernels, tmp_path):
    """Of index and code; numba alone takes a code of which one byte is another."""
    for path in files(tmp_path):
        whole = path.read_bytes()
        assert compiled._read(path)
        for cut in {*range(0, len(whole), 97), *range(64), len(whole) - 1}:
            path.write_bytes(whole[:cut])
            assert compiled._read(path) is None
        for at in range(0, len(whole), 97):
            path.write_bytes(whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :])
            assert compiled._read(path) is None
        path.write_bytes(whole)


DAMAGES = {
    "emptied": lambda content: b"",
    "half": lambda content: content[: len(content) // 2],
    "cut by one": lambda content: content[:-1],
    "zeros": lambda content: bytes(len(content)),
    "random": lambda content: np.random.default_rng(0).bytes(len(content)),
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["nbi", "nbc"])
def test_damaged_kernels_are_compiled_anew(kernels, tmp_path, kind, caplog):
    for name, damage in DAMAGES.items():
        for path in files(tmp_path, kind):
            path.write_bytes(damage(path.read_bytes()))
        caplog.clear()
        again = kernels()
        assert again.product(2.0, 3.0) == 8.0 and not hits(again.product), name
        assert caplog.text.count("compiled anew") == 1
        assert hits_of_next_run(kernels) == 1


def hits_of_next_run(kernels):
    after = kernels()
    after.product(2.0, 3.0)
    return hits(after.product)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["nbi", "nbc"])
def test_what_is_no_file_in_their_place(kernels, tmp_path, kind, caplog):
    """A folder stays and hinders keeping, which is told; a pipe, which would never end, is
    replaced."""
    for path in files(tmp_path, kind):
        path.unlink()
        os.mkfifo(path)
    assert kernels().product(2.0, 3.0) == 8.0 and "cannot" not in caplog.text
    assert hits_of_next_run(kernels) == 1
    for path in files(tmp_path, kind):
        path.unlink()
        path.mkdir()
    assert kernels().product(2.0, 3.0) == 8.0
    assert "cannot be kept" in caplog.text and str(tmp_path) in caplog.text
    assert not [path for path in tmp_path.rglob("*.tmp.*")]


def test_unreadable_files(kernels, tmp_path, monkeypatch, caplog):
    def refused(path, *mode):
        if str(path).endswith(".nbi") and mode == ("rb",):
            raise PermissionError(13, "Permission denied", str(path))
        return open(path, *mode)

    monkeypatch.setattr(compiled, "open", refused, raising=False)
    again = kernels()
    assert again.product(2.0, 3.0) == 8.0 and not hits(again.product)
    assert "cannot be read" in caplog.text


def test_a_full_disk(kernels, tmp_path, monkeypatch, caplog):
    for path in files(tmp_path):
        path.unlink()

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(compiled, "_checksum", full)
    assert kernels().product(2.0, 3.0) == 8.0
    assert "cannot be kept" in caplog.text and "No space left" in caplog.text
    assert not list((tmp_path / "__pycache__").glob("*.tmp.*"))


def test_no_folder_that_can_be_written_to(kernels, monkeypatch, caplog):
    """A read-only program and no home: numba alone ends on import."""
    from numba.core import caching

    def read_only(_):
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr(caching._CacheLocator, "ensure_cache_path", read_only)
    again = kernels()
    assert again.product(2.0, 3.0) == 8.0 and "cannot be kept" in caplog.text


def test_code_of_another_key_or_source_does_not_count(kernels, tmp_path):
    """Two processes may take one name for two signatures; one that ends between index and code
    leaves the old code."""
    module = kernels()
    module.product(2, 3)
    one, two = files(tmp_path, "nbc")[:2]
    assert one.stem.startswith("kernels.product") and two.stem.startswith("kernels.product")
    two.write_bytes(one.read_bytes())
    again = kernels()
    assert again.product(2.0, 3.0) == 8.0 and again.product(2, 3) == 8 and hits(again.product) == 1
    old = {path: path.read_bytes() for path in files(tmp_path, "nbc")}
    source = tmp_path / "kernels.py"
    source.write_text(SOURCE.replace("b + 1", "b + 2"))
    assert kernels().product(2.0, 3.0) == 10.0
    for path, content in old.items():
        path.write_bytes(content)
    assert kernels().product(2.0, 3.0) == 10.0


def test_a_change_in_the_file_of_a_called_kernel_counts(tmp_path, monkeypatch):
    """numba knows a kernel by its own file alone, and goes on with old code of the other."""
    monkeypatch.syspath_prepend(tmp_path)
    called, caller = tmp_path / "called_kernels.py", tmp_path / "calling_kernels.py"
    called.write_text(SOURCE)
    caller.write_text(
        "from called_kernels import shifted\nfrom tipdamp.hbm.compiled import njit\n\n\n"
        "@njit(cache=True)\ndef twice(a):\n    return 2 * shifted(a)\n"
    )

    def load():
        for name in ("called_kernels", "calling_kernels"):
            sys.modules.pop(name, None)
        return importlib.import_module("calling_kernels").twice

    assert load()(3.0) == 8.0
    again = load()
    assert again(3.0) == 8.0 and hits(again) == 1
    called.write_text(SOURCE.replace("b + 1", "b + 12"))
    assert load()(3.0) == 30.0


@pytest.mark.slow
def test_damage_beside_the_solver(tmp_path):
    """From Python with hbm alone, two processes at once."""
    first = run(ADD, NUMBA_CACHE_DIR=tmp_path).stdout
    for path in files(tmp_path):
        path.write_bytes(path.read_bytes()[:-20])
    both = [
        subprocess.Popen(
            [sys.executable, "-c", ADD],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=ROOT,
            env=os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)},
        )
        for _ in range(2)
    ]
    for process in both:
        said, errors = process.communicate()
        assert said == first and errors.count("compiled anew") <= 1 and "Traceback" not in errors
    last = run(ADD, NUMBA_CACHE_DIR=tmp_path)
    assert last.stdout == first and not last.stderr


def test_no_kernel_of_ours_is_kept_by_numba_itself():
    for package in ("hbm", "modal", "static_contact", "tipdamp"):
        for path in (ROOT / package).rglob("*.py"):
            if path.name != "compiled.py":
                text = path.read_text(encoding="utf-8")
                assert "numba.njit(cache" not in text and "from numba import" not in text, path
