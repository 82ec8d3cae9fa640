"""What a user waits for, in two checkouts: CPU time of the verbs of the rig of the demo, run
alternately.

    python -m tests.benchmarks.waits OLD_ROOT [--repeats 3]

One curve of 12 N with five harmonics, and the stress at its peak. Each checkout works with its own
sources, in a folder of its own, on the same meshes; what a verb needs is made first. CPU time is
that of the command and of all that it starts, on one thread; the least of the repeats counts."""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.benchmarks.record import ROOT, one_thread, record

NEEDED = ("inspect", "reduce", "preload", "tune", "respond", "cycles", "stress", "report")
ROWS = {
    "inspect": ("inspect", "--force"),
    "tune": ("tune", "--force"),
    "stress at one peak": ("stress", "--force"),
    "report": ("report", "--force"),
    "nothing to do: reduce": ("reduce",),
    "nothing to do: report": ("report",),
}


def prepare(root: Path, folder: Path) -> Path:
    """The study in a folder."""
    rig = [sys.executable, "-m", "tipdamp.meshes.two_blade_rig", "--rig", "twin"]
    subprocess.run(
        [*rig, "--out", str(folder / "meshes")], cwd=root, env=of(root), check=True, text=True
    )
    text = (ROOT / "docs/studies/two_blade_rig/twin.toml").read_text(encoding="utf-8")
    for line in text.splitlines():
        if line.startswith("levels ="):
            text = text.replace(line, "levels = [12]\nstress = true")
        if line.startswith("harmonics ="):
            text = text.replace(line, "harmonics = [5]")
    study = folder / "study.toml"
    study.write_text(text, encoding="utf-8")
    for verb in NEEDED:
        seconds(root, study, verb)
    return study


def of(root: Path) -> dict[str, str]:
    """The environment in which a checkout finds its own sources."""
    return os.environ | {"PYTHONPATH": str(root)}


def seconds(root: Path, study: Path, *command: str) -> float:
    """CPU s of a verb."""
    verb, *more = command
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [sys.executable, "-m", "tipdamp", verb, str(study), "--quiet", *more],
        cwd=root,
        env=of(root),
        check=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main():
    one_thread()
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("old", type=Path, help="root of the other checkout")
    parser.add_argument("--repeats", type=int, default=3)
    arguments = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        roots = {"before": arguments.old.resolve(), "after": ROOT}
        for name in roots:
            (Path(folder) / name).mkdir()
        studies = {name: prepare(root, Path(folder) / name) for name, root in roots.items()}
        for row, command in ROWS.items():
            found = [
                {name: seconds(root, studies[name], *command) for name, root in roots.items()}
                for _ in range(arguments.repeats)
            ]
            least = {name: min(one[name] for one in found) for name in roots}
            rows.append({"row": row, **least, "ratio": least["after"] / least["before"]})
            print(rows[-1], flush=True)
    record("waits", {"repeats": arguments.repeats, "rows": rows})


if __name__ == "__main__":
    main()
