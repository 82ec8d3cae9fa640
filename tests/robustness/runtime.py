"""E. Runtime faults: of the disk, the processes, the machine."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from tests.robustness.rows import accepted, chain, corner, refused, row, stages, tipdamp
from tipdamp.doctor import Facts, Module, checks
from tipdamp.engine.store import Store
from tipdamp.hbm.result import ForcedResponse

ROOT = Path(__file__).parents[2]
LONG = (("levels = [5]", "levels = [5, 8, 11]"), ("harmonics = [1]", "harmonics = [3]"))
# A run that no machine finishes between its first curve and the signal
ENDLESS = (("levels = [5]", f"levels = {[5 + 0.01 * k for k in range(400)]}"), LONG[1])
EVERY = "inspect", "reduce", "preload", "tune", "respond"


def environment(**more):
    return {**os.environ, "PYTHONPATH": str(ROOT), **more}


def started(study, *arguments, **options):
    """A run in a process of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "tipdamp", *arguments, study.name, "--quiet"],
        cwd=study.parent,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=environment(),
        **options,
    )


def numbers(study):
    """Everything that a study's curves are."""
    folder = study.parent / "results" / study.stem / "responses"
    return {p.name: ForcedResponse.load(p) for p in sorted(folder.glob("*.npz"))}


def same(one, two):
    assert one and one.keys() == two.keys()
    for name, curve in one.items():
        assert np.array_equal(curve.frequency, two[name].frequency, equal_nan=True), name
        assert np.array_equal(curve.harmonics, two[name].harmonics, equal_nan=True), name


def until(condition, process, limit=60.0):
    """Wait for something that a run does; whether it came while the run went on."""
    end = time.monotonic() + limit
    while time.monotonic() < end and process.poll() is None:
        if condition():
            return True
        time.sleep(0.02)
    return False


@row("70", "disk full", "E")
def disk_full(folder):
    """A file system of 200 kB in a name space of its own, where that is allowed; else the limit of
    a file's size."""
    study = chain(folder)
    stages(study, "preload")
    before = (folder / "results" / "study" / "preload.json").read_bytes()
    script = (
        "mkdir -p full && mount -t tmpfs -o size=200k none full && cp -r results/study/. full && "
        f"dd if=/dev/zero of=full/filler bs=1k 2>/dev/null; {sys.executable} -m tipdamp tune "
        "study.toml --quiet --out full; code=$?; rm full/filler; ls -A full; ls -A full/.stages; "
        "exit $code"
    )
    small = "rm -f results/study/inspect.html; "
    done = subprocess.run(
        ["unshare", "-rm", "bash", "-c", small + script],
        cwd=folder,
        capture_output=True,
        text=True,
        env=environment(),
        timeout=100,
    )
    if "unshare" in done.stderr or "mount:" in done.stderr:
        yield "not tried: this machine allows no file system of one's own"
        return
    lines = [line for line in done.stderr.splitlines() if "warning" not in line.lower()]
    assert done.returncode == 4 and len(lines) == 1 and "No space left on device" in lines[0], done
    assert "full/" in lines[0] and ".tmp-" not in done.stdout and "tune.json" not in done.stdout, (
        done
    )
    assert (folder / "results" / "study" / "preload.json").read_bytes() == before
    yield lines[0].removeprefix("tipdamp: ")


@row("71", "kill -9", "R")
def killed(folder):
    (folder / "a").mkdir()
    (folder / "b").mkdir()
    whole, study = chain(folder / "a", *LONG), chain(folder / "b", *LONG)
    stages(whole, "respond")
    responses = folder / "b" / "results" / "study" / "responses"
    process = started(study, "run", "--jobs", "1")
    until(lambda: len(list(responses.glob("[!.]*.npz"))) >= 2, process)
    process.kill()
    process.communicate()
    recorded = {p.stem for p in (responses.parent / ".stages").glob("Fe_*.json")}
    left = {p.name: p.stat().st_mtime_ns for p in responses.glob("[!.]*.npz") if p.stem in recorded}
    stages(study, "respond")
    same(numbers(whole), numbers(study))
    again = [name for name, at in left.items() if (responses / name).stat().st_mtime_ns != at]
    assert not again and not list(folder.rglob(".tmp-*"))
    yield (
        f"killed with {len(left)} of 6 curves finished: none of them made again, all in every bit "
        "as undisturbed"
    )


@row("72", "Ctrl-C, SIGTERM", "R")
def ended(folder):
    for number, code in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
        place = folder / str(code)
        place.mkdir()
        study = chain(place, *ENDLESS, ("[900, 1400]", "[300, 2400]"))
        process = started(
            study,
            "run",
            "--jobs",
            "1",
            start_new_session=True,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
        )
        came = until(lambda p=place: list(p.glob("results/study/responses/[!.]*.npz")), process)
        process.send_signal(number)
        said = process.communicate(timeout=60)[1]
        assert came, (process, said)
        assert process.returncode == code and said.count("\n") == 1 and "continue" in said, (
            process,
            said,
        )
        yield said.strip().removeprefix("tipdamp: ")


@row("73", "results made from other inputs", "R")
def other_inputs(folder):
    study = chain(folder)
    stages(study, "tune")
    study.write_text(
        study.read_text()
        .replace("stations = [1, 1]", "stations = [2, 1]")
        .replace("= 0.01", "= 0.02")
    )
    assert "up to date" in accepted(study, "reduce").out
    said = accepted(study, "tune").out
    assert "made again: since the last run [tune] stations changed" in said, said
    yield next(line for line in said.splitlines() if "made again" in line)
    np.savez(folder / "other.npz", **dict(np.load(folder / "model.npz")), extra=np.zeros(1))
    shutil.move(folder / "other.npz", folder / "model.npz")
    yield refused(study, "'tune' needs the stage 'reduce', which is out of date", verb="tune")
    said = accepted(study, "reduce").out
    assert "the contents of [model] matrices changed" in said
    yield next(line for line in said.splitlines() if "made again" in line)


@row("75", "results of another version of the program", "R")
def other_version(folder):
    study = chain(folder)
    stages(study, "reduce")
    store = Store(folder / "results" / "study")
    made = store.read_json(".stages/reduce.from")
    store.write_json(".stages/reduce.from", {**made, "the program": "0" * 16})
    record = store.record("reduce")
    store.finish("reduce", "0" * 16, record.outputs, record.seconds)
    said = accepted(study, "reduce").out
    assert "made again: since the last run the program changed" in said, said
    yield next(line for line in said.splitlines() if "made again" in line)


@row("77", "results folder that has results", "R")
def existing(folder):
    study = chain(folder)
    stages(study, "preload")
    assert "up to date" in accepted(study, "preload").out
    yield "up to date: what is there is not made again"
    path = folder / "results" / "study" / "preload.csv"
    path.write_text(path.read_text().replace("0.5,", "0.6,"))
    yield refused(
        study,
        "preload.csv was changed after the stage 'preload' wrote it; .*--force",
        verb="preload",
    )


@row("78", "read-only place, odd paths, long names", "E, S")
def places(folder):
    study = chain(folder)
    said = tipdamp("inspect", study, "--quiet", "--out", "/proc/tipdamp")
    assert said.code == 4 and said.err.startswith("tipdamp: /proc/tipdamp"), said
    yield said.err.strip().removeprefix("tipdamp: ")
    odd = folder / "a b" / "Prüfstand ü 温度" / ("x" * 200)
    odd.mkdir(parents=True)
    study = chain(odd)
    stages(study, "preload")
    yield "spaces, umlauts, 200 letters: the same as elsewhere"
    said = tipdamp("inspect", study, "--quiet", "--out", folder / ("y" * 300))
    assert said.code == 4 and "File name too long" in said.err and said.err.count("\n") == 1, said


@row("80", "an MPI rank dies", "E", slow=True)
def rank_dies(folder):
    if not shutil.which("mpirun"):
        yield "not tried: no mpirun"
        return
    program = (
        "import os, signal, sys\nfrom mpi4py import MPI\ncomm = MPI.COMM_WORLD\ncomm.Barrier()\n"
        "if comm.rank == 1: os.kill(os.getpid(), signal.SIGKILL)\ncomm.Barrier()"
    )
    began = time.monotonic()
    done = subprocess.run(
        ["mpirun", "--oversubscribe", "-n", "2", sys.executable, "-c", program],
        env=environment(OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1"),
        capture_output=True,
        text=True,
        timeout=100,
    )
    assert done.returncode != 0 and time.monotonic() - began < 60
    yield f"mpirun ends the others, exit code {done.returncode}"


@row("81", "other locale, clock, threads", "S")
def locales(folder):
    found = []
    for name, more in (
        ("a", {}),
        ("b", {"LC_ALL": "de_DE.UTF-8", "LANG": "de_DE.UTF-8", "TZ": "Pacific/Kiritimati"}),
        ("c", {"LC_ALL": "C", "PYTHONIOENCODING": "ascii"}),
    ):
        (folder / name).mkdir()
        study = chain(folder / name)
        program = (
            f"from tipdamp.cli import main\nfor v in {EVERY}: assert main([v, 'study.toml', "
            "'--quiet']) == 0"
        )
        process = subprocess.run(
            [sys.executable, "-c", program],
            cwd=folder / name,
            env=environment(TIPDAMP_JOBS="1", **more),
            capture_output=True,
            text=True,
            timeout=200,
        )
        assert process.returncode == 0, process
        found.append(numbers(study))
    for other in found[1:]:
        same(found[0], other)
    yield "German and C locale: the same in every bit"


@row("82", "missing optional package", "E, W")
def missing_package(folder):
    study = chain(folder)
    stages(study, "respond")
    accepted(study, "cycles")
    program = (
        "import importlib.util as u, sys\nfound = u.find_spec\n"
        "u.find_spec = lambda n, *a: None if n.split('.')[0] == sys.argv[1] else found(n, *a)\n"
        "from tipdamp.cli import main\nsys.exit(main(sys.argv[2:]))"
    )
    for package, verb, code in (("matplotlib", "report", 4), ("plotly", "inspect", 0)):
        done = subprocess.run(
            [sys.executable, "-c", program, package, verb, "study.toml", "--quiet", "--force"],
            cwd=folder,
            env=environment(),
            capture_output=True,
            text=True,
            timeout=100,
        )
        assert done.returncode == code and f"{package}" in done.stdout + done.stderr, done
        yield next(line for line in (done.stderr + done.stdout).splitlines() if package in line)


@row("83", "PETSc with complex scalars, foreign numpy, mixed HDF5", "E")
def versions(folder):
    good = {
        name: Module("1.0", f"/usr/lib/python3/dist-packages/{name}/__init__.py")
        for name in (
            "numpy",
            "scipy",
            "numba",
            "petsc4py",
            "slepc4py",
            "dolfinx",
            "gmsh",
            "h5py",
            "pydantic",
            "rich",
            "filelock",
            "threadpoolctl",
            "jinja2",
            "plotly",
            "matplotlib",
        )
    }
    for facts in (
        Facts(good, scalar="complex128"),
        Facts({**good, "numpy": Module("2.1", "/home/x/numpy/__init__.py")}, debian_numpy="1.24.2"),
    ):
        failed = next(
            c
            for c in checks(facts)
            if c.status == "fail" and c.name in ("PETSc's scalars", "numpy's age")
        )
        assert failed.repair
        yield (
            f"tipdamp doctor: {failed.name}: {failed.what}; "
            f"{failed.repair.replace(sys.executable, 'python')}"
        )


@row("x10", "limits of the address space", "E")
def limits(folder):
    study = corner(folder)
    for limit in (100_000, 400_000, 800_000):
        done = subprocess.run(
            [
                "bash",
                "-c",
                f'ulimit -v {limit}; exec "$0" -m tipdamp run corner.toml --quiet',
                sys.executable,
            ],
            cwd=study.parent,
            env=environment(),
            capture_output=True,
            text=True,
            timeout=60,
        )
        assert done.returncode == 4 and "not enough memory: the address space" in done.stderr, done
        assert done.stderr.count("\n") == 1
    yield done.stderr.strip().removeprefix("tipdamp: ")


@row("x11", "a pipe that is closed: tipdamp ... | head -1", "S", slow=True)
def closed_pipe(folder):
    corner(folder)
    line = f"{sys.executable} -m tipdamp inspect corner.toml --quiet | head -c 1"
    done = subprocess.run(
        line, shell=True, cwd=folder, env=environment(), capture_output=True, text=True, timeout=60
    )
    assert "PETSC ERROR" not in done.stderr and "Traceback" not in done.stderr, done
    assert json.loads((folder / "results" / "corner" / "inspect.json").read_text())
    yield "no traceback; the results are there"


@row("x12", "a stage record, a result or a curve that is damaged", "R")
def damaged(folder):
    study = chain(folder)
    stages(study, "respond")
    path = folder / "results" / "study" / "responses" / "Fe_5N_H1.npz"
    whole = path.read_bytes()
    data = bytearray(whole)
    data[len(data) // 2] ^= 4
    path.write_bytes(bytes(data))
    yield refused(
        study, "Fe_5N_H1.npz was changed after the stage 'respond' wrote it", verb="cycles"
    )
    path.write_bytes(whole)
    record = folder / "results" / "study" / ".stages" / "tune.json"
    record.write_text(record.read_text()[:40])
    said = tipdamp("tune", study, "--quiet")
    assert said.code == 0 and "counts as not run" in said.err, said
    yield said.err.strip()[:200].replace(str(folder) + "/", "")


@row("x16", "compiled kernels that are cut off or overwritten", "R", slow=True)
def damaged_kernels(folder):
    program = (
        "import numpy as np; from tipdamp.hbm.balance import kernels\n"
        "print(kernels.by_order(np.arange(6.0).reshape(2, 3) + 2j, np.ones((2, 3), "
        "dtype=complex)).tolist())"
    )

    def run():
        return subprocess.run(
            [sys.executable, "-c", program],
            env=environment(NUMBA_CACHE_DIR=str(folder)),
            capture_output=True,
            text=True,
            check=True,
            timeout=100,
        )

    first = run().stdout
    for kind, damage in (
        ("nbi", lambda content: content[:-9]),
        ("nbc", lambda content: bytes(len(content))),
    ):
        for path in folder.rglob(f"*.{kind}"):
            path.write_bytes(damage(path.read_bytes()))
        said = run()
        assert (
            said.stdout == first and said.stderr.count("\n") == 1 and "compiled anew" in said.stderr
        ), said
        yield said.stderr.strip()
    assert not run().stderr
